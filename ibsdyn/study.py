"""Many variants of one model: what each of them comes to, on one core or on a cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tqdm import tqdm

from ibsdyn.errors import ModelError, StudyError, UnknownNameError, known_keywords
from ibsdyn.fingerprint import fingerprint
from ibsdyn.parameters import checked_model, nearest_address
from ibsdyn.quantities import Quantity
from ibsdyn.requirement import Requirement
from ibsdyn.sampling import Samples
from ibsdyn.sensitivity import checked_quantities
from ibsdyn.study_execution import Task, packed, run_chunks
from ibsdyn.study_file import StudyFile, VariantResult
from ibsdyn.study_results import FailedVariant, StudyResults

if TYPE_CHECKING:
    from ibsdyn.model import Model


@dataclass(frozen=True, eq=False, init=False)
class Study:
    """Variants of a model and what is asked of each.

    Parameters
    ----------
    model : the nominal model; it is not changed.
    samples : from ``ibs.monte_carlo``, ``latin_hypercube``, ``full_factorial``, ``one_at_a_time`` or ``variants``.
    quantities : as ``ibs.ModeFrequency(1)``; the values of each variant that are kept.
    requirements : held against every variant; those of the model if None.
    name : of the study, for figures and files.

    Raises
    ------
    UnknownNameError : a sample of a parameter that the model does not have.
    ModelError : no samples, neither a quantity nor a requirement, or a name twice.
    """

    model: Model
    samples: Samples
    quantities: tuple[Quantity, ...]
    requirements: tuple[Requirement, ...]
    name: str

    @known_keywords
    def __init__(
        self,
        model: Model,
        samples: Samples,
        quantities: Quantity | Sequence[Quantity] = (),
        requirements: Requirement | Sequence[Requirement] | None = None,
        name: str | None = None,
    ) -> None:
        if not isinstance(samples, Samples) or not len(samples):
            raise ModelError(f"Study: samples must come from ibs.monte_carlo, full_factorial ..., got {samples!r}.")
        known = checked_model(model, "Study").parameters()
        for address in samples.addresses:
            if address not in known:
                raise UnknownNameError(
                    f"Study: the model has no parameter {address!r}. {nearest_address(address, known)}"
                )
        limits = _requirements(model, requirements)
        listed = [] if isinstance(quantities, (list, tuple)) and not quantities else checked_quantities(quantities)
        for requirement in limits:
            if not any(requirement.quantity is own or requirement.quantity == own for own in listed):
                listed.append(requirement.quantity)
        if not listed:
            raise ModelError(
                "Study: it has neither a quantity nor a requirement; give quantities=[ibs.ModeFrequency(1)]."
            )
        for names, what in (([q.name for q in listed], "quantities"), ([r.name for r in limits], "requirements")):
            twice = [name for name in names if names.count(name) > 1]
            if twice:
                raise ModelError(f"Study: two {what} are called {twice[0]!r}; give one another name=.")
        fields = {
            "model": model.copy(),
            "samples": samples,
            "quantities": tuple(listed),
            "requirements": limits,
            "name": name if name is not None else f"{model.name}, {samples.kind}",
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor

    def __repr__(self) -> str:
        """Name the study, its size and what it asks."""
        return f"Study({self.name!r}, {len(self.samples)} variants, {len(self.quantities)} quantities)"

    @known_keywords
    def run(
        self,
        executor: Executor | None = None,
        workers: int | None = None,
        results: str | PathLike[str] | None = None,
        progress: bool = True,
    ) -> StudyResults:
        """Calculate all variants.

        Parameters
        ----------
        executor : any ``concurrent.futures.Executor``: a pool of yours, ``client.get_executor()`` of Dask, mpi4py's
            ``MPIPoolExecutor()``. None starts processes on this machine's cores; no ``if __name__ == "__main__"`` is
            needed.
        workers : number of those processes; the number of cores if None; 1 calculates in this process.
        results : a file that takes every finished chunk at once. Where it holds results of this study already, only
            the others are calculated: an interrupted study goes on.
        progress : show a bar on a terminal.

        Returns
        -------
        StudyResults, the same numbers whatever the executor and the number of workers.

        Raises
        ------
        StudyError : the results file belongs to another study; a worker process died.
        ModelError, AnalysisError : the nominal model itself has no answer.

        Notes
        -----
        A variant that fails does not end the study; ``failed`` of the results tells its parameters and why.
        """
        if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
            raise ModelError(f"Study.run: workers must be a whole number from 1, got {workers!r}.")
        if executor is not None and not isinstance(executor, Executor):
            raise ModelError(f"Study.run: executor must be a concurrent.futures.Executor, got {executor!r}.")
        system = self.model.linearize()
        nominal = np.array([quantity.evaluate(system) for quantity in self.quantities])
        kept = None if results is None else self._file(results)
        finished = dict(kept.finished) if kept is not None else {}
        missing = np.array([v for v in range(len(self.samples)) if v not in finished], dtype=int)
        content = packed(Task(self.model, self.samples.addresses, self.quantities))
        with tqdm(
            total=len(self.samples),
            initial=len(finished),
            desc=self.name,
            disable=None if progress else True,
            leave=False,
        ) as bar:
            for chunk in self._chunks(content, missing, executor, workers):
                if kept is not None:
                    kept.add(chunk)
                finished |= {result.variant: result for result in chunk}
                bar.update(len(chunk))
        return self._gathered(nominal, [finished[v] for v in range(len(self.samples))])

    def _file(self, results: str | PathLike[str]) -> StudyFile:
        try:
            return StudyFile(Path(results), self.fingerprint(), self.name, len(self.quantities))
        except TypeError:
            raise StudyError(f"Study.run: results must be the path of a file, got {results!r}.") from None
        except OSError as error:
            raise StudyError(f"Study.run: {results} cannot be used: {error.strerror or error}.") from error

    def fingerprint(self) -> str:
        """Return a hash of the model, the samples and the quantities: what the results depend on."""
        return fingerprint(self.model, self.samples.addresses, self.samples.values, self.quantities)

    def evaluate(self, variant: int) -> VariantResult:
        """Calculate one variant, counted from 0, in this process; to see what is behind a failure."""
        return Task(self.model, self.samples.addresses, self.quantities).evaluate(
            variant, self.samples.values[variant].tolist()
        )

    def _chunks(
        self, content: bytes, missing: np.ndarray, executor: Executor | None, workers: int | None
    ) -> Iterator[list[VariantResult]]:
        if len(missing):
            yield from run_chunks(content, missing, self.samples.values[missing], executor, workers)

    def _gathered(self, nominal: np.ndarray, finished: Sequence[VariantResult]) -> StudyResults:
        values = np.array([[np.nan if v is None else v for v in result.values] for result in finished])
        failed = tuple(
            FailedVariant(result.variant, self.samples.parameters(result.variant), dict(result.failures))
            for result in finished
            if result.failures
        )
        values.setflags(write=False)
        return StudyResults(
            study=self,
            quantities=tuple(quantity.name for quantity in self.quantities),
            units=tuple(quantity.unit for quantity in self.quantities),
            nominal=nominal,
            values=values,
            failed=failed,
        )


def _requirements(model: Model, requirements: Requirement | Sequence[Requirement] | None) -> tuple[Requirement, ...]:
    given = model.requirements.values() if requirements is None else requirements
    listed = [given] if isinstance(given, Requirement) else list(given)
    checked = tuple(each for each in listed if isinstance(each, Requirement))
    if len(checked) < len(listed):
        raise ModelError(f"Study: requirements must be ibs.Requirement, got {listed!r}.")
    return checked

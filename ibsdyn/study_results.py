"""What the variants of a study came to: percentiles, odds to meet requirements, what drives the scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import TYPE_CHECKING

import numpy as np
import scipy.stats

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, UnknownNameError, known_keywords, nearest

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.model import Model
    from ibsdyn.requirement import Requirement
    from ibsdyn.study import Study


@dataclass(frozen=True)
class FailedVariant:
    """A variant that could not be calculated, or not all of it.

    Attributes
    ----------
    variant : its number, from 0.
    parameters : its values by address.
    reasons : why, by quantity; under "" if the variant has no linear system at all.
    """

    variant: int
    parameters: Mapping[str, float]
    reasons: Mapping[str, str]

    def __str__(self) -> str:
        """Return one line: number, parameters, reason."""
        values = ", ".join(f"{address}={value:.6g}" for address, value in self.parameters.items())
        reasons = "; ".join(f"{name}: {words}" if name else words for name, words in self.reasons.items())
        return f"variant {self.variant} ({values}): {reasons}"


@dataclass(frozen=True)
class Odds:
    """How many variants meet a requirement.

    Attributes
    ----------
    requirement : its name.
    met, calculated : how many of how many; variants that failed are not among them.
    share : met over calculated: the estimated probability; nan where none was calculated.
    lower, upper : confidence interval of that probability.
    confidence : of the interval.
    """

    requirement: str
    met: int
    calculated: int
    share: float
    lower: float
    upper: float
    confidence: float

    def __str__(self) -> str:
        """Return one line: share and interval."""
        if not self.calculated:
            return f"{self.requirement}: no variant was calculated"
        return (
            f"{self.requirement}: met by {100 * self.share:.4g} % ({self.met} of {self.calculated}), "
            f"{100 * self.confidence:g} % confidence {100 * self.lower:.4g} to {100 * self.upper:.4g} %"
        )


@dataclass(frozen=True, eq=False)
class StudyResults:
    """Quantities of all variants.

    Attributes
    ----------
    study : what was asked.
    quantities, units : names and units of the quantities.
    nominal : (n_q,) values of the model itself.
    values : (n_variants, n_q); nan where a variant failed.
    failed : those variants, with their parameters and the reason.
    """

    study: Study
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    nominal: Array
    values: Array
    failed: tuple[FailedVariant, ...]

    def __repr__(self) -> str:
        """Name the study and its size."""
        return f"StudyResults({self.study.name!r}, {len(self.values)} variants, {len(self.failed)} failed)"

    def __getitem__(self, quantity: str) -> Array:
        """Return the (n_variants,) values of a quantity; UnknownNameError if it was not asked for."""
        own: Array = self.values[:, self.column(quantity)]
        return own

    def column(self, quantity: str | int) -> int:
        """Return the place of a quantity, by name or number (from 0); UnknownNameError if it was not asked for."""
        if isinstance(quantity, int) and -len(self.quantities) <= quantity < len(self.quantities):
            return range(len(self.quantities))[quantity]
        if quantity not in self.quantities:
            raise UnknownNameError(f"the study has no quantity {quantity!r}. {nearest(str(quantity), self.quantities)}")
        return self.quantities.index(str(quantity))

    def parameters(self, variant: int) -> dict[str, float]:
        """Return the parameters of one variant, counted from 0, by address; AnalysisError if there is none."""
        count = len(self.values)
        if isinstance(variant, bool) or not isinstance(variant, Integral) or not -count <= variant < count:
            raise AnalysisError(f"the study has variants 0 to {count - 1}, got {variant!r}.")
        return self.study.samples.parameters(int(variant))

    def model(self, variant: int) -> Model:
        """Return one variant, counted from 0, as a model."""
        return self.study.model.with_parameters(self.parameters(variant))

    def percentiles(self, quantity: str | int, percent: Sequence[float] = (5.0, 50.0, 95.0)) -> Array:
        """Return percentiles of a quantity over the variants that were calculated.

        Raises
        ------
        UnknownNameError : a quantity that was not asked for.
        AnalysisError : no variant of it was calculated, or percentages beside 0 to 100.
        """
        shares = np.asarray(percent)
        if shares.dtype.kind not in "iuf" or not ((shares >= 0) & (shares <= 100)).all():
            raise AnalysisError(f"percent must be numbers from 0 to 100, got {percent!r}.")
        return np.asarray(np.percentile(self._calculated(quantity), percent))

    @known_keywords
    def odds(self, confidence: float = 0.95) -> tuple[Odds, ...]:
        """Return for every requirement how probable it is that a machine meets it.

        Parameters
        ----------
        confidence : of the interval.

        Raises
        ------
        AnalysisError : variants that are no random ones, whose shares are no probabilities.

        Notes
        -----
        The exact interval of C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404-413: never too narrow. Those of
        a Latin hypercube are wider than need be.
        """
        if not self.study.samples.random:
            raise AnalysisError(
                f"the variants are of the kind {self.study.samples.kind!r}; odds need random ones, from "
                "ibs.monte_carlo or ibs.latin_hypercube."
            )
        if not isinstance(confidence, Real) or not 0.0 < confidence < 1.0:
            raise AnalysisError(f"confidence must lie between 0 and 1, got {confidence!r}.")
        found = []
        for requirement in self.study.requirements:
            values = self.values[:, self._column_of(requirement)]
            values = values[np.isfinite(values)]
            met = int(np.sum(values <= requirement.limit if requirement.sense == "<=" else values >= requirement.limit))
            low, high = 0.0, 1.0  # all that is known without any
            if len(values):
                interval = scipy.stats.binomtest(met, len(values)).proportion_ci(confidence, method="exact")
                low, high = float(interval.low), float(interval.high)
            found.append(
                Odds(
                    requirement=requirement.name,
                    met=met,
                    calculated=len(values),
                    share=met / len(values) if len(values) else float("nan"),
                    lower=low,
                    upper=high,
                    confidence=confidence,
                )
            )
        return tuple(found)

    def rank_correlations(self, quantity: str | int = 0) -> dict[str, float]:
        """Return Spearman's rank correlation of each parameter with a quantity, the strongest first.

        What drives the scatter, also where the quantity is no linear function of the parameter. Parameters that do not
        vary are left out.

        Raises
        ------
        UnknownNameError : a quantity that was not asked for.
        AnalysisError : fewer than three variants were calculated.
        """
        column = self.column(quantity)
        calculated = np.isfinite(self.values[:, column])
        if calculated.sum() < 3:
            raise AnalysisError(f"{int(calculated.sum())} variants were calculated; a correlation needs three.")
        samples = self.study.samples
        found = {}
        values = self.values[calculated, column]
        for address, own in zip(samples.addresses, samples.values[calculated].T, strict=True):
            if np.ptp(own) > 0 and np.ptp(values) > 0:
                found[address] = float(scipy.stats.spearmanr(own, values).statistic)
        return dict(sorted(found.items(), key=lambda item: -abs(item[1])))

    def __str__(self) -> str:
        """Return a table: nominal value and scatter of each quantity, odds, failures."""
        samples = self.study.samples
        lines = [f"{self.study.name}: {len(self.values)} variants of {len(samples.addresses)} parameters"]
        spread = ("mean", "deviation (1σ)") if samples.random else ("lowest", "highest")
        titles = (f"{spread[0]:>12}", f"{spread[1]:>14}", *(f"{percent:>11}" for percent in ("5 %", "50 %", "95 %")))
        lines.append(f"  {'quantity':36} {'nominal':>11} {' '.join(titles)}")
        for column, (name, unit) in enumerate(zip(self.quantities, self.units, strict=True)):
            label = name if unit == "-" else f"{name} [{unit}]"
            own = self.values[:, column]
            own = own[np.isfinite(own)]
            if not len(own):
                lines.append(f"  {label:36} {self.nominal[column]:11.5g}  no variant was calculated")
                continue
            pair = (own.mean(), own.std(ddof=1) if len(own) > 1 else 0.0) if samples.random else (own.min(), own.max())
            shown = f"{pair[0]:12.5g} {pair[1]:14.5g}"
            percentiles = " ".join(f"{value:11.5g}" for value in np.percentile(own, (5, 50, 95)))
            lines.append(f"  {label:36} {self.nominal[column]:11.5g} {shown} {percentiles}")
        if samples.random and self.study.requirements:
            lines += [f"  {odds}" for odds in self.odds()]
        if self.failed:
            lines.append(f"  {len(self.failed)} variants failed; the first: {self.failed[0]}")
        return "\n".join(lines)

    def plot(self, quantity: str | int | None = None, axes: np.ndarray | Axes | None = None) -> np.ndarray:
        """Draw histograms of random variants, or each quantity over each parameter of a sweep.

        Parameters
        ----------
        quantity : name or number (from 0) of one; all of them if None.
        axes : Axes to draw on, as many as there are panels; a new figure if None.

        Returns
        -------
        Array of matplotlib Axes: (n_q,) of histograms, (n_q, n_parameters) of sweeps.

        Raises
        ------
        UnknownNameError : a quantity that was not asked for.
        """
        from ibsdyn.plotting.study import plot_study

        columns = list(range(len(self.quantities))) if quantity is None else [self.column(quantity)]
        return plot_study(self, columns, axes)

    def limits(self, quantity: str | int) -> tuple[Requirement, ...]:
        """Return the requirements on a quantity."""
        column = self.column(quantity)
        return tuple(each for each in self.study.requirements if self._column_of(each) == column)

    def _column_of(self, requirement: Requirement) -> int:
        own = self.study.quantities
        return next(i for i, q in enumerate(own) if q is requirement.quantity or q == requirement.quantity)

    def _calculated(self, quantity: str | int) -> Array:
        column = self.column(quantity)
        own = self.values[:, column]
        calculated: Array = own[np.isfinite(own)]
        if not len(calculated):
            raise AnalysisError(f"{self.quantities[column]}: no variant of it was calculated; see failed.")
        return calculated

"""Model against test, linear against nonlinear: two frequency responses on the same lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError, UnknownNameError, known_keywords, nearest
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification.confidence import checked_confidence
from ibsdyn.identification.frf_estimate import FrfEstimate
from ibsdyn.resonances import Resonance, distinct, find_resonances, fitted, same
from ibsdyn.validation import in_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

# Resonances of model and test further apart than this share of their frequency are not taken for the same.
SAME = 0.1
# Frequencies that agree to this share are the same line: a period of whole samples rounds them.
LINE = 1e-9


class ModeSet(Protocol):
    """What MAC needs of modes: ``Modes`` of a model or ``ModalEstimate`` of a test."""

    @property
    def frequencies(self) -> Array:
        """(n_modes,) [Hz]."""

    @property
    def shapes(self) -> NDArray[np.complex128] | Array:
        """(n, n_modes)."""


@dataclass(frozen=True)
class MatchedResonance:
    """A resonance in the response that shows it best.

    Attributes
    ----------
    model, test : as each shows it; None where one of them does not.
    output, input : names of the response.
    """

    model: Resonance | None
    test: Resonance | None
    output: str
    input: str

    @property
    def frequency_error(self) -> float:
        """Frequency of the model over that of the test, less 1; NaN without a match."""
        return self.model.frequency / self.test.frequency - 1 if self.model and self.test else np.nan

    @property
    def damping_error(self) -> float:
        """Damping ratio of the model over that of the test, less 1; NaN without a match."""
        return self.model.damping_ratio / self.test.damping_ratio - 1 if self.model and self.test else np.nan


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a model and a test have in common, array order [output, input, frequency].

    Attributes
    ----------
    model, test : the responses compared, same names, same lines.
    confidence : of the region; None where the test has none.
    inside : (n_out, n_in, n_freq) whether the region holds the model; None without region.
    frac : (n_out, n_in) frequency response assurance criterion, 1 where they have the same shape.
    deviation : (n_out, n_in) largest |model - test| over the test's largest magnitude.
    resonances : each in the response that shows it best, in the order of frequency.
    mac : (n_model, n_test) modal assurance criterion of the modes given; None without.
    """

    model: FrequencyResponse
    test: FrequencyResponse
    confidence: float | None
    inside: NDArray[np.bool_] | None
    frac: Array
    deviation: Array
    resonances: tuple[MatchedResonance, ...]
    mac: Array | None

    @property
    def share_inside(self) -> Array:
        """(n_out, n_in) share of lines at which the region holds the model.

        Raises
        ------
        AnalysisError : the test has no region.
        """
        if self.inside is None:
            raise AnalysisError("the test is a response without region; estimate it by estimate_frf to have one.")
        share: Array = self.inside.mean(axis=2)
        return share

    @property
    def total_share_inside(self) -> float:
        """Share of lines of all responses together; AnalysisError if the test has no region."""
        return float(self.share_inside.mean())

    def __str__(self) -> str:
        """Return tables: responses first, then resonances."""
        lines = []
        if self.confidence is not None:
            lines.append(
                f"{100 * self.total_share_inside:.1f} % of {self.model.response.size} values inside the "
                f"{100 * self.confidence:g} % region of the test"
            )
        wide = max(len(f"{o} / {i}") for o in self.model.outputs for i in self.model.inputs)
        inside_title = f"{'inside [%]':>10}  " if self.inside is not None else ""
        lines.append(f"{'response':{wide}}  {inside_title}{'FRAC':>6}  largest deviation [% of peak]")
        for o, output in enumerate(self.model.outputs):
            for i, input_ in enumerate(self.model.inputs):
                inside = f"{100 * self.share_inside[o, i]:10.1f}  " if self.inside is not None else ""
                lines.append(
                    f"{f'{output} / {input_}':{wide}}  {inside}{self.frac[o, i]:6.4f}  {100 * self.deviation[o, i]:.3g}"
                )
        if self.resonances:
            lines += ["", "resonance [Hz]     model      test  error [%]    zeta model      test  [%]  seen in"]
        for resonance in self.resonances:
            model, test = resonance.model, resonance.test
            error = f"{100 * resonance.frequency_error:+9.2f}" if model and test else f"{'-':>9}"
            lines.append(
                f"               {_cell(model, 'frequency')} {_cell(test, 'frequency')}  "
                f"{error}     {_cell(model, 'zeta')} {_cell(test, 'zeta')}       {resonance.output} / {resonance.input}"
            )
        if self.mac is not None:
            lines += ["", "MAC (model modes down, test modes across)"]
            lines += ["  ".join(f"{value:5.2f}" for value in row) for row in self.mac]
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    def plot(self, axes: Sequence[Axes] | np.ndarray | None = None) -> np.ndarray:
        """Draw model (dashed black), test (red) and its region over frequency, magnitude, phase and coherence.

        Parameters
        ----------
        axes : what an earlier call returned; a new figure if None.

        Returns
        -------
        (3 n_out, n_in) array of matplotlib Axes: magnitude, phase, multiple coherence; (2 n_out, n_in) where the test
        has no coherence.
        """
        from ibsdyn.plotting.comparison import plot_comparison

        return plot_comparison(self, axes)

    def select(
        self,
        outputs: str | int | Sequence[str | int] | None = None,
        inputs: str | int | Sequence[str | int] | None = None,
    ) -> Comparison:
        """Return the comparison of some outputs and inputs by name or number (from 0), in the order asked.

        Raises
        ------
        UnknownNameError : a name or number that is not among them.
        """
        chosen = compare(self.model.select(outputs, inputs), self.test.select(outputs, inputs), self.confidence or 0.99)
        return replace(chosen, mac=self.mac)


@known_keywords
def compare(
    model: FrequencyResponse,
    test: FrequencyResponse,
    confidence: float = 0.99,
    names: Mapping[str, str] | None = None,
    modes: tuple[ModeSet, ModeSet] | None = None,
) -> Comparison:
    """Compare a model's response with an estimated one, or any two responses.

    Parameters
    ----------
    model : the model's response at the test's frequencies.
    test : an FrfEstimate, of measured records or of a nonlinear simulation; a plain FrequencyResponse has no region.
    confidence : of the test's region.
    names : the model's name for a channel of the test, where they differ: {"test name": "model name"}.
    modes : of model and test, shapes over the same sensors, for MAC.

    Returns
    -------
    Comparison; ``print`` gives tables and ``plot`` the figure.

    Raises
    ------
    AnalysisError : other frequencies or units; shapes over different sensors.
    UnknownNameError : channels that the other does not have.

    Notes
    -----
    The smaller of both says which responses are compared. FRAC is |sum A conj(B)|^2 / (sum |A|^2 sum |B|^2) over
    frequency, MAC the same over sensors. Frequencies and damping ratios of both come from the same local fit of one
    mode, or from the half-power points where there are too few lines.
    """
    level = checked_confidence(confidence)
    for what, given in (("model", model), ("test", test)):
        if not isinstance(given, FrequencyResponse):
            raise AnalysisError(f"compare: {what} must be an ibs.FrequencyResponse or an estimate, got {given!r}.")
    theirs = dict(names or {})
    for name in theirs:
        known = (*test.outputs, *test.inputs)
        if name not in known:
            raise UnknownNameError(f"names= renames {name!r}, which the test does not have. {nearest(name, known)}")
    renamed = replace(
        test,
        outputs=tuple(theirs.get(name, name) for name in test.outputs),
        inputs=tuple(theirs.get(name, name) for name in test.inputs),
    )
    outputs = _common(model.outputs, renamed.outputs, "outputs")
    inputs = _common(model.inputs, renamed.inputs, "inputs")
    ours, other = model.select(outputs, inputs), renamed.select(outputs, inputs)
    _check_units(ours, other)
    if len(ours.frequencies) != len(other.frequencies) or not np.allclose(
        ours.frequencies, other.frequencies, rtol=LINE, atol=0
    ):
        raise AnalysisError(
            f"the model has {len(ours.frequencies)} frequencies from {ours.frequencies[0]:.6g} to "
            f"{ours.frequencies[-1]:.6g} Hz, the test {len(other.frequencies)} from {other.frequencies[0]:.6g} to "
            f"{other.frequencies[-1]:.6g} Hz. Evaluate the model at the test's: "
            "system.frf(inputs, outputs, estimate.frequencies)."
        )
    inside = variance = None
    if isinstance(other, FrfEstimate) and np.all(other.degrees_of_freedom > 0):
        inside = np.abs(ours.response - other.response) <= other.radius(level)
        variance = other.variance
    largest = other.magnitude.max(axis=2)
    deviation = np.abs(ours.response - other.response).max(axis=2) / np.where(largest > 0, largest, 1.0)
    return Comparison(
        ours,
        other,
        level if inside is not None else None,
        inside,
        _assurance(ours.response, other.response),
        deviation,
        _matched(ours, other, variance),
        None if modes is None else _mac(*modes),
    )


def _cell(resonance: Resonance | None, what: str) -> str:
    if resonance is None:
        return f"{'-':>9}"
    return f"{resonance.frequency:#9.4g}" if what == "frequency" else f"{100 * resonance.damping_ratio:#9.3g}"


def _common(ours: tuple[str, ...], theirs: tuple[str, ...], what: str) -> list[str]:
    fewer, more = (ours, theirs) if len(ours) < len(theirs) else (theirs, ours)
    missing = [name for name in fewer if name not in more]
    if missing:
        whose, other = ("model's", "test") if fewer is ours else ("test's", "model")
        raise UnknownNameError(
            f"the {other} has none of the {whose} {what} called {in_words([repr(name) for name in missing])}. "
            f"{nearest(missing[0], more)} Select what both have, or say which is which: "
            'names={"test name": "model name"}.'
        )
    return list(fewer)


def _check_units(ours: FrequencyResponse, theirs: FrequencyResponse) -> None:
    for what in ("output", "input"):
        pairs = zip(
            getattr(ours, f"{what}s"), getattr(ours, f"{what}_units"), getattr(theirs, f"{what}_units"), strict=True
        )
        for name, unit, other in pairs:
            if _plain(unit) != _plain(other):
                raise AnalysisError(
                    f"{what} {name!r} is in {unit} in the model and in {other} in the test; convert it."
                )


def _plain(unit: str) -> str:
    """Spell m/s², m/s^2 and m/s2, N·m, N*m and Nm alike."""
    for given, plain in (("²", "2"), ("^", ""), ("·", ""), ("*", ""), (" ", "")):
        unit = unit.replace(given, plain)
    return unit


def _assurance(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> Array:
    """Return the squared correlation of two responses over their last axis; 1 where both are nothing."""
    product = np.abs(np.sum(a * b.conj(), axis=-1)) ** 2
    size = np.sum(np.abs(a) ** 2, axis=-1) * np.sum(np.abs(b) ** 2, axis=-1)
    both_zero = (np.abs(a).max(axis=-1) == 0) & (np.abs(b).max(axis=-1) == 0)
    assurance: Array = np.divide(product, size, out=np.where(both_zero, 1.0, 0.0), where=size > 0)
    return assurance


def _mac(model: ModeSet, test: ModeSet) -> Array:
    if model.shapes.shape[0] != test.shapes.shape[0]:
        raise AnalysisError(
            f"the model's mode shapes have {model.shapes.shape[0]} rows, the test's {test.shapes.shape[0]}; MAC needs "
            "both over the same sensors, as estimate_modes of both responses gives them."
        )
    a, b = np.asarray(model.shapes, dtype=complex), np.asarray(test.shapes, dtype=complex)
    return _assurance(a.T[:, None, :], b.T[None, :, :])


def _matched(model: FrequencyResponse, test: FrequencyResponse, variance: Array | None) -> tuple[MatchedResonance, ...]:
    """Pair the resonances of both, the nearest first, each in the response of both in which it stands out most."""
    ours, theirs = find_resonances(model), find_resonances(test, variance)
    one_each, other_each = distinct(ours), distinct(theirs)
    mine_of = {a: next(k for k, r in enumerate(one_each) if same(a, r)) for a in ours}
    yours_of = {b: next(k for k, r in enumerate(other_each) if same(b, r)) for b in theirs}
    candidates = []
    for a in ours:
        for b in theirs:
            if (a.output, a.input) == (b.output, b.input) and abs(a.frequency - b.frequency) < SAME * b.frequency:
                mine, yours = mine_of[a], yours_of[b]
                candidates.append((abs(one_each[mine].frequency - other_each[yours].frequency), a, b, mine, yours))
    pairs: list[tuple[Resonance | None, Resonance | None]] = []
    mine_taken: set[int] = set()
    yours_taken: set[int] = set()
    for _, a, b, mine, yours in sorted(candidates, key=lambda c: (c[0], -c[1].prominence)):
        if mine not in mine_taken and yours not in yours_taken:
            pairs.append((a, b))
            mine_taken.add(mine)
            yours_taken.add(yours)
    pairs += [(a, None) for k, a in enumerate(one_each) if k not in mine_taken]
    pairs += [(None, b) for k, b in enumerate(other_each) if k not in yours_taken]
    found = []
    for one, other in pairs:
        seen = one or other
        assert seen is not None  # every pair has one of both
        found.append(
            (
                seen.frequency,
                MatchedResonance(
                    None if one is None else fitted(model, one),
                    None if other is None else fitted(test, other, variance),
                    model.outputs[seen.output],
                    model.inputs[seen.input],
                ),
            )
        )
    return tuple(resonance for _, resonance in sorted(found, key=lambda entry: entry[0]))

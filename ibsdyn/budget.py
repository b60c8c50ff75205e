"""Vibration and error budget: from what shakes a machine to how much an output moves, and what makes it move.

Powers are apportioned exactly. A response is a sum of terms, y = sum_j y_j, so its mean square is the sum over j of the
mean of y_j y: each term's own power and half of what it shares with every other. A term that counteracts the rest has
a negative share; the shares add up to 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import STIFFNESS_NAMES, Array
from ibsdyn.components import FlexibleBody
from ibsdyn.disturbances import AnyDisturbance, Tone, checked_disturbances
from ibsdyn.errors import AnalysisError, UnknownNameError, known_keywords, nearest
from ibsdyn.harmonic import carried_response, harmonic_response, modal_response
from ibsdyn.linear_system import LinearSystem, checked_system
from ibsdyn.modes import in_hertz
from ibsdyn.psd import require_band_overlap
from ibsdyn.reduction_trust import warn_of_frequencies_beyond
from ibsdyn.resonance_grid import LEAST_RATIO, ResonanceGrid, checked_band, poles, resonance_grid
from ibsdyn.signals import Input, Output, checked_outputs
from ibsdyn.validation import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Complex = NDArray[np.complexfloating]

CHUNK_BYTES = 64e6
# A tone alone is drawn this far around it.
TONE_MARGIN = 2.0
# An undamped mode with less than this share of the power takes no part in it.
UNDAMPED_SHARE = 1e-6
# Shares below this are not printed.
SHOWN = 5e-4
CARRIED = "carried by the base"
RIGID = "rigid-body motion"
KINDS = ("source", "mode", "component", "part")


@dataclass(frozen=True, eq=False)
class VibrationBudget:
    """Power spectral densities of outputs under disturbances, their RMS (one sigma), and what they come from.

    Attributes
    ----------
    outputs, units : name and unit of each output.
    sources : names of the disturbances, which add in power.
    band : (lower, upper) [Hz] over which power is counted.
    frequencies : (n_freq,) [Hz], crowded where resonances are, so that sums over them are right.
    source_psd : (n_out, n_source, n_freq) one-sided PSD that each source makes [unit²/Hz]; 0 for tones.
    source_cumulative : (n_out, n_source, n_freq) mean square from the band's lower end up to each frequency [unit²].
    source_power : (n_out, n_source) mean square over the band [unit²].
    """

    outputs: tuple[str, ...]
    units: tuple[str, ...]
    sources: tuple[str, ...]
    band: tuple[float, float]
    frequencies: Array
    source_psd: Array
    source_cumulative: Array
    source_power: Array
    _mode_power: Mapping[str, Array]
    _part_power: Mapping[str, Array]

    @property
    def psd(self) -> Array:
        """(n_out, n_freq) one-sided PSD of the outputs under all sources [unit²/Hz]."""
        return np.asarray(self.source_psd.sum(axis=1))

    @property
    def cumulative_power(self) -> Array:
        """(n_out, n_freq) mean square from the band's lower end up to each frequency [unit²]."""
        return np.asarray(self.source_cumulative.sum(axis=1))

    @property
    def power(self) -> Array:
        """(n_out,) mean square over the band [unit²]."""
        return np.asarray(self.source_power.sum(axis=1))

    @property
    def rms(self) -> Array:
        """(n_out,) root mean square over the band, one sigma [unit]."""
        return np.sqrt(self.power)

    @known_keywords
    def shares(self, by: str = "source", output: str | int = 0, source: str | None = None) -> dict[str, float]:
        """Return what part of an output's power comes from what, the largest first; they add up to 1.

        Parameters
        ----------
        by : "source", "mode", "component" or "part". Components are connections and flexible bodies, parts the
            directions of connections ("mount.kxx"); beside them stand what the base carries along and rigid-body
            motions.
        output : name or number (from 0).
        source : count the power of this source only.

        Raises
        ------
        AnalysisError : an unknown kind of share.
        UnknownNameError : an output or a source that is not in the budget.

        Notes
        -----
        By part: the static unit load at the output strains every spring; the work of these forces on the springs'
        actual deformations is the output's motion relative to the base, spring by spring (unit-load theorem, exact at
        every frequency). So a share says how much of the motion comes about because that spring deforms.
        """
        if by not in KINDS:
            raise AnalysisError(f"shares by {by!r} are not known. {nearest(str(by), KINDS)}")
        row = self._output(output)
        if source is not None and source not in self.sources:
            raise UnknownNameError(f"the budget has no source {source!r}. {nearest(str(source), self.sources)}")
        columns = slice(None) if source is None else [self.sources.index(source)]
        if by == "source":
            powers = dict(zip(self.sources, self.source_power[row], strict=True))
            powers = powers if source is None else {source: powers[source]}
        else:
            powers = {}
            for name, power in (self._mode_power if by == "mode" else self._part_power).items():
                # A component's name has no dot, the direction of a connection follows after one.
                label = name.split(".")[0] if by == "component" else name
                powers[label] = powers.get(label, 0.0) + float(power[row, columns].sum())
        total = float(self.source_power[row, columns].sum())
        shares = {name: float(power) / total if total else 0.0 for name, power in powers.items()}
        return dict(sorted(shares.items(), key=lambda item: -abs(item[1])))

    def __str__(self) -> str:
        """Return a table: RMS of each output and its largest contributions."""
        lines = [f"vibration budget, {self.band[0]:g} to {self.band[1]:g} Hz, RMS = one sigma"]
        for row, (name, unit) in enumerate(zip(self.outputs, self.units, strict=True)):
            lines.append(f"{name}: {self.rms[row]:.4g} {unit} RMS")
            for by in KINDS:
                leading = [
                    f"{key} {100 * share:.3g} %" for key, share in self.shares(by, row).items() if abs(share) >= SHOWN
                ]
                shown = ", ".join(leading[:4]) + (", ..." if len(leading) > 4 else "")
                lines.append(f"  by {by}: {shown or '-'}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)

    @known_keywords
    def plot(self, limit: float | Mapping[str, float] | None = None, axes: np.ndarray | None = None) -> np.ndarray:
        """Draw the PSD above and the cumulative RMS below, total and by source, a column for each output.

        Parameters
        ----------
        limit : allowed RMS (one sigma) in the output's unit, drawn as a line; {output: limit} where there are several.
        axes : what an earlier call returned, to draw over it; a new figure if None.

        Returns
        -------
        (2, n_out) array of matplotlib Axes.

        Raises
        ------
        ModelError : a limit that is not a number above 0.
        """
        from ibsdyn.plotting.budget import plot_budget

        if isinstance(limit, Mapping):
            given = {self._output(name): value for name, value in limit.items()}
        else:
            given = {} if limit is None else dict.fromkeys(range(len(self.outputs)), limit)
        limits = {
            row: number(value, f"{self.outputs[row]}: limit", self.units[row], above=0.0)
            for row, value in given.items()
        }
        return plot_budget(self, limits, axes)

    @known_keywords
    def plot_shares(self, by: str = "part", output: str | int = 0, most: int = 10, axes: Axes | None = None) -> Axes:
        """Draw the largest shares of an output's power as bars.

        Parameters
        ----------
        by : as in ``shares``.
        output : name or number (from 0).
        most : how many bars.
        axes : where to draw; a new figure if None.

        Returns
        -------
        The matplotlib Axes drawn on.
        """
        from ibsdyn.plotting.budget import plot_shares

        row = self._output(output)
        title = f"{self.outputs[row]}: {self.rms[row]:.3g} {self.units[row]} RMS (1σ), share of the power by {by}"
        return plot_shares(self.shares(by, row), title, most, axes)

    def _output(self, output: str | int) -> int:
        if isinstance(output, int) and -len(self.outputs) <= output < len(self.outputs):
            return range(len(self.outputs))[output]
        if output not in self.outputs:
            raise UnknownNameError(f"the budget has no output {output!r}. {nearest(str(output), self.outputs)}")
        return self.outputs.index(str(output))


@known_keywords
def vibration_budget(
    system: LinearSystem,
    outputs: Output | Sequence[Output],
    disturbances: AnyDisturbance | Sequence[AnyDisturbance],
    band: Sequence[float] | None = None,
    hysteretic: bool = False,
) -> VibrationBudget:
    """Return how much outputs move under disturbances, and where that comes from.

    Parameters
    ----------
    system : from ``model.linearize()``.
    outputs : Sensor or CombinedSensor, one or several.
    disturbances : Disturbance, CorrelatedDisturbance, Tone; one or several. They are independent of each other and
        add in power.
    band : (lower, upper) over which power is counted [Hz]; all that the disturbances reach if None.
    hysteretic : as in ``LinearSystem.frf``.

    Returns
    -------
    VibrationBudget.

    Raises
    ------
    ModelError : an output or an input that the model does not have.
    AnalysisError : a band without power, or an undamped mode in it, under which the RMS is infinite.

    Notes
    -----
    S_y = G S G^H with one-sided spectra; integrals by Gauss-Legendre rules in intervals graded towards every pole,
    right at any damping.
    """
    checked_system(system, "vibration_budget")
    sensors, causes = checked_outputs(outputs), checked_disturbances(disturbances)
    grid, limits = power_grid(system, causes, band, hysteretic)
    warn_of_frequencies_beyond(system._assembly, grid.frequencies)
    accumulated = _accumulate(system, sensors, causes, grid, limits, hysteretic)
    source_psd, source_cumulative, modal, carried = accumulated
    source_power = np.array(
        [
            [
                source_cumulative[o, d, -1] if isinstance(cause, Tone) else grid.integral(source_psd[o, d])
                for d, cause in enumerate(causes)
            ]
            for o in range(len(sensors))
        ]
    )
    seen = system.sensors(sensors)[0] @ system._modal[1]
    modes = _mode_powers(system, seen, modal, carried)
    _refuse_undamped(system, modes, source_power, grid, hysteretic)
    return VibrationBudget(
        outputs=tuple(sensor.name for sensor in sensors),
        units=tuple(sensor.unit for sensor in sensors),
        sources=tuple(cause.name for cause in causes),
        band=limits,
        frequencies=grid.frequencies,
        source_psd=source_psd,
        source_cumulative=source_cumulative,
        source_power=source_power,
        _mode_power=modes,
        _part_power=_part_powers(system, seen, modal, carried),
    )


def response_power(
    system: LinearSystem, output: Output, disturbances: Sequence[AnyDisturbance], band: Sequence[float] | None = None
) -> float:
    """Return the mean square of one output, without what it comes from: studies ask for it thousands of times."""
    grid, limits = power_grid(system, disturbances, band)
    if len(_undamped(system, grid, hysteretic=False)):
        return float(vibration_budget(system, output, disturbances, band).power[0])
    warn_of_frequencies_beyond(system._assembly, grid.frequencies)
    total = 0.0
    for cause in disturbances:
        if isinstance(cause, Tone):
            if limits[0] <= cause.frequency <= limits[1]:
                response = harmonic_response(system, cause.input, output, [cause.frequency], False).response
                total += float(np.abs(response[0, 0, 0]) ** 2) * cause.amplitude**2 / 2
            continue
        step = max(1, int(CHUNK_BYTES / (16 * len(system.coordinates))))
        for start in range(0, len(grid.frequencies), step):
            hertz, weights = grid.frequencies[start : start + step], grid.weights[start : start + step]
            (row,) = harmonic_response(system, cause.inputs, output, hertz, False).response
            spectra = cause.cross_spectra(hertz) * weights
            total += float(np.einsum("if,ikf,kf->", row, spectra, row.conj(), optimize=True).real)
    return max(total, 0.0)


def power_grid(
    system: LinearSystem, causes: Sequence[AnyDisturbance], band: Sequence[float] | None, hysteretic: bool = False
) -> tuple[ResonanceGrid, tuple[float, float]]:
    """Return the grid on which the power of disturbances is integrated, and the band [Hz] that it covers."""
    psds = [psd for cause in causes if not isinstance(cause, Tone) for psd in cause.psds]
    tones = [cause.frequency for cause in causes if isinstance(cause, Tone)]
    if band is None:
        reach = [f for psd in psds for f in psd.band]
        reach += [f * factor for f in tones for factor in (1 / TONE_MARGIN, TONE_MARGIN)]
        limits = (min(reach), max(reach))
    else:
        limits = checked_band(band)
        if psds and not any(limits[0] <= f <= limits[1] for f in tones):
            require_band_overlap(psds, limits)
    kinks = [f for psd in psds for f in psd.smooth_pieces()] + tones
    kinks += [f for cause in causes for f in _correlation_kinks(cause)]
    return resonance_grid(poles(system, hysteretic), limits, np.unique(kinks)), limits


def _correlation_kinks(cause: AnyDisturbance) -> Sequence[float]:
    varying = getattr(cause, "frequencies", None)
    return [] if varying is None else [float(f) for f in varying]


def _accumulate(
    system: LinearSystem,
    sensors: Sequence[Output],
    causes: Sequence[AnyDisturbance],
    grid: ResonanceGrid,
    limits: tuple[float, float],
    hysteretic: bool,
) -> tuple[Array, Array, Array, Array]:
    """Return PSDs and cumulative powers by source, and the powers with which modes and the base's motion agree.

    Returns
    -------
    source_psd, source_cumulative (n_out, n_source, n_freq); modal (n_out, n_source, n_modes) integral of the cross
    spectrum between each modal coordinate and the output; carried (n_out, n_source) the same of what the base carries.
    """
    n_out, n_freq, n_modes = len(sensors), len(grid.frequencies), len(system.coordinates)
    source_psd = np.zeros((n_out, len(causes), n_freq))
    source_cumulative = np.zeros_like(source_psd)
    modal, carried = np.zeros((n_out, len(causes), n_modes)), np.zeros((n_out, len(causes)))
    for d, cause in enumerate(causes):
        if isinstance(cause, Tone):
            if not limits[0] <= cause.frequency <= limits[1]:
                continue
            hertz, spectra = np.array([cause.frequency]), np.full((1, 1, 1), cause.amplitude**2 / 2, dtype=complex)
            power, modal[:, d], carried[:, d] = _cross_powers(
                system, (cause.input,), sensors, hertz, spectra, np.ones(1), hysteretic
            )
            source_cumulative[:, d] = np.where(grid.frequencies >= cause.frequency, power, 0.0)
            continue
        step = max(1, int(CHUNK_BYTES / (16 * n_modes * len(cause.inputs))))
        for start in range(0, n_freq, step):
            part = slice(start, start + step)
            hertz = grid.frequencies[part]
            source_psd[:, d, part], by_mode, by_base = _cross_powers(
                system, cause.inputs, sensors, hertz, cause.cross_spectra(hertz), grid.weights[part], hysteretic
            )
            modal[:, d] += by_mode
            carried[:, d] += by_base
        source_cumulative[:, d] = grid.cumulative(source_psd[:, d])
    return source_psd, source_cumulative, modal, carried


def _cross_powers(
    system: LinearSystem,
    inputs: Sequence[Input],
    sensors: Sequence[Output],
    hertz: Array,
    spectra: Complex,
    weights: Array,
    hysteretic: bool,
) -> tuple[Array, Array, Array]:
    """Return PSDs (n_out, n_freq) and the weighted sums over frequency by mode (n_out, n_modes) and by base (n_out,).

    The sum by mode is that of Re(derivative of q_r times the conjugate of y) for unit observation of mode r.
    """
    q = modal_response(system, inputs, hertz, hysteretic)
    base = carried_response(system, inputs, sensors, hertz)
    seen = system.sensors(sensors)[0] @ system._modal[1]
    derivative = np.array([(2j * np.pi * hertz) ** sensor.order for sensor in sensors])
    response = np.einsum("or,rif,of->oif", seen, q, derivative, optimize=True) + base
    others = np.einsum("ikf,okf->oif", spectra, response.conj(), optimize=True)
    psd = np.einsum("oif,oif->of", response, others).real
    # The spectrum is Hermitian and no more than rounding makes it negative where responses of many inputs cancel.
    psd = np.maximum(psd, 0.0)
    weighted = others * weights
    by_mode = np.einsum("rif,oif->or", q, weighted * derivative[:, None], optimize=True).real
    by_base = np.einsum("oif,oif->o", base, weighted).real
    return psd, by_mode, by_base


def _mode_powers(system: LinearSystem, seen: Array, modal: Array, carried: Array) -> dict[str, Array]:
    omega, _, rigid = system._modal
    powers = {_mode_label(system, r): seen[:, None, r] * modal[:, :, r] for r in range(len(omega)) if not rigid[r]}
    if rigid.any():
        # Modes at 0 Hz are a basis of rigid motions among many; their shares mean something only together.
        powers[RIGID] = np.einsum("or,odr->od", seen[:, rigid], modal[:, :, rigid])
    return powers | {CARRIED: carried}


def _mode_label(system: LinearSystem, mode: int) -> str:
    return f"mode {mode + 1} ({in_hertz(system._modal[0][mode] / (2 * np.pi))} Hz)"


def _part_powers(system: LinearSystem, seen: Array, modal: Array, carried: Array) -> dict[str, Array]:
    omega, shapes, rigid = system._modal
    elastic = ~rigid
    flexibility = seen[:, elastic] / omega[elastic] ** 2  # modal coordinates of the static unit load at each output
    powers: dict[str, Array] = {}
    labels = _row_labels(system)
    for part in system._parts:
        strain = part.rows[:, : len(omega)] @ shapes[:, elastic]
        virtual = flexibility @ strain.T
        actual = modal[:, :, elastic] @ strain.T
        for label, row in zip(labels[part.name], range(len(part.rows)), strict=True):
            own = virtual[:, None, row] * actual[:, :, row]
            powers[label] = powers.get(label, 0.0) + own
    if rigid.any():
        powers[RIGID] = np.einsum("or,odr->od", seen[:, rigid], modal[:, :, rigid])
    return powers | {CARRIED: carried}


def _row_labels(system: LinearSystem) -> dict[str, list[str]]:
    """Return what each row of each elastic part is: a direction of a connection, or a flexible body as a whole."""
    labels = {}
    for joint in system._assembly.joints:
        stiffness = joint.connection.stiffness
        if len(stiffness) == 1:
            names: Sequence[str] = (joint.name,)
        else:
            names = [f"{joint.name}.{name}" for name in STIFFNESS_NAMES]
        labels[joint.name] = [name for name, k in zip(names, stiffness, strict=True) if 0 < k < np.inf]
    for part in system._parts:
        if isinstance(system._assembly.items.get(part.name), FlexibleBody):
            labels[part.name] = [part.name] * len(part.rows)
    return labels


def _undamped(system: LinearSystem, grid: ResonanceGrid, hysteretic: bool) -> Array:
    """Return the frequencies of undamped poles within a grid [Hz]."""
    found = poles(system, hysteretic)
    undamped = found[(np.abs(found.imag) < LEAST_RATIO * found.real) & (found.real > 0)].real
    inside: Array = undamped[(undamped >= grid.edges[0]) & (undamped <= grid.edges[-1])]
    return inside


def _refuse_undamped(
    system: LinearSystem, modes: Mapping[str, Array], source_power: Array, grid: ResonanceGrid, hysteretic: bool
) -> None:
    """Refuse an undamped mode that takes part: the integral over its resonance is infinite, the grid's sum is not."""
    for frequency in _undamped(system, grid, hysteretic):
        # Undamped poles of systems that have damping elsewhere still lie at the frequency of an undamped mode.
        label = _mode_label(system, int(np.argmin(np.abs(system._modal[0] / (2 * np.pi) - frequency))))
        power = modes.get(label, np.zeros(1))
        if (np.abs(power) > UNDAMPED_SHARE * source_power).any():
            raise AnalysisError(
                f"{label} has no damping and the disturbances drive it: the RMS is infinite. Give the connections that "
                "it strains a damping ratio zeta."
            )

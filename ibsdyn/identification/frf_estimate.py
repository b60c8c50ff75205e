"""An estimated frequency response with its statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError
from ibsdyn.frequency_response import FrequencyResponse, places
from ibsdyn.identification.confidence import checked_confidence, circle_quantile, marginal_quantile

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class DetectionLines:
    """What the outputs hold at harmonics that were not excited, where a linear system would be silent.

    Attributes
    ----------
    frequencies : (n_lines,) [Hz].
    harmonics : (n_lines,) multiples of the base frequency.
    amplitude : (n_out, n_lines) root mean square over the runs of the output's amplitude, less what the inputs
        themselves hold there, in the output's unit.
    noise : (n_out, n_lines) of it the standard deviation that period-to-period scatter explains; NaN with one period.
    outputs, output_units : names and units.
    """

    frequencies: Array
    harmonics: NDArray[np.int64]
    amplitude: Array
    noise: Array
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]

    @property
    def odd(self) -> NDArray[np.bool_]:
        """(n_lines,) which of them show odd distortions (x^3); the others show even ones (x^2)."""
        odd: NDArray[np.bool_] = self.harmonics % 2 == 1
        return odd


@dataclass(frozen=True, eq=False, repr=False)
class FrfEstimate(FrequencyResponse):
    """A frequency response estimated from records, array order [output, input, frequency], e^{+i omega t}.

    Attributes
    ----------
    frequencies, response, outputs, inputs, output_units, input_units : as of any FrequencyResponse.
    method : how it was estimated, in words.
    coherence : (n_out, n_freq) multiple coherence, the share of an output's power that the inputs explain.
    partial_coherence : (n_out, n_in, n_freq) coherence of output and input once the other inputs are taken out of both.
    residual_covariance : (n_out, n_out, n_freq) covariance of what the inputs do not explain of the outputs, per
        average, unbiased.
    input_gain : (n_in, n_in, n_freq) inverse of the inputs' summed power; Cov(G_ij, G_kl) is
        ``residual_covariance[i, k] * input_gain[l, j]``.
    degrees_of_freedom : (n_freq,) complex ones of ``residual_covariance``: about averages less inputs.
    n_averages : independent averages.
    resolution : width within which lines are averaged (half height of the spectral window), the distance of the lines
        for periodic excitation [Hz].
    noise_level : (n_out, n_in, n_freq) standard deviation that noise adds to the response; periodic excitation only.
    distortion_level : (n_out, n_in, n_freq) the same of nonlinear distortions; periodic excitation and more runs than
        inputs only.
    detection_lines : what the outputs hold at lines that were not excited; periodic excitation only.
    """

    method: str
    coherence: Array
    partial_coherence: Array
    residual_covariance: ComplexArray
    input_gain: ComplexArray
    degrees_of_freedom: Array
    n_averages: float
    resolution: float
    noise_level: Array | None = None
    distortion_level: Array | None = None
    detection_lines: DetectionLines | None = None

    def __repr__(self) -> str:
        """Name the size, the band and the method."""
        return (
            f"FrfEstimate({len(self.outputs)} outputs x {len(self.inputs)} inputs x {len(self.frequencies)} "
            f"frequencies, {self.frequencies[0]:.4g} to {self.frequencies[-1]:.4g} Hz, {self.method}, "
            f"{self.n_averages:.4g} averages, resolution {self.resolution:.3g} Hz)"
        )

    @property
    def variance(self) -> Array:
        """(n_out, n_in, n_freq) complex variance E|dG|^2 of each response; real and imaginary part have half each."""
        residual = np.einsum("iif->if", self.residual_covariance).real
        gain = np.einsum("jjf->jf", self.input_gain).real
        variance: Array = residual[:, None] * gain[None]
        return variance

    def covariance(
        self, output: str | int, input_: str | int, other_output: str | int, other_input: str | int
    ) -> ComplexArray:
        """Return E[dG conj(dG')] of two responses, (n_freq,).

        Parameters
        ----------
        output, input_ : names or numbers of the first response G.
        other_output, other_input : of the second response G'.

        Raises
        ------
        UnknownNameError : a name or number that is not among them.
        """
        (i,), (k,) = places(output, self.outputs, "output"), places(other_output, self.outputs, "output")
        (j,), (m,) = places(input_, self.inputs, "input"), places(other_input, self.inputs, "input")
        covariance: ComplexArray = self.residual_covariance[i, k] * self.input_gain[m, j]
        return covariance

    def radius(self, confidence: float = 0.99) -> Array:
        """Return the radius of the circle in the complex plane that holds the true response.

        Parameters
        ----------
        confidence : probability that it does, of each response at each frequency on its own.

        Returns
        -------
        (n_out, n_in, n_freq) in the unit of each response.

        Raises
        ------
        AnalysisError : a level outside 0 to 1; no degree of freedom left to estimate a variance with.

        Notes
        -----
        r^2 = F_{2, 2 nu}(confidence) times the variance: the variance is itself estimated from a few averages.
        """
        level = checked_confidence(confidence)
        nu = self._known_degrees_of_freedom()
        return np.sqrt(circle_quantile(level, nu) * self.variance)

    def magnitude_bounds(self, confidence: float = 0.99, circle: bool = True) -> tuple[Array, Array]:
        """Return the lowest and highest magnitude of the region.

        Parameters
        ----------
        confidence : probability of the region.
        circle : the shadow of the circle, for magnitude and phase together (what ``plot`` draws); False gives the
            bounds of the magnitude alone, 15 % narrower with many averages.

        Returns
        -------
        lower, upper, (n_out, n_in, n_freq) each; not below 0.

        Raises
        ------
        AnalysisError : as of ``radius``.
        """
        half = self.radius(confidence) if circle else self._marginal(confidence)
        magnitude = self.magnitude
        return np.maximum(magnitude - half, 0.0), magnitude + half

    def phase_bounds(self, confidence: float = 0.99, circle: bool = True) -> tuple[Array, Array]:
        """Return the lowest and highest phase of the region [deg].

        Parameters
        ----------
        confidence : probability of the region.
        circle : as of ``magnitude_bounds``.

        Returns
        -------
        lower, upper, (n_out, n_in, n_freq) each, 180 deg on either side where the circle holds the origin.

        Raises
        ------
        AnalysisError : as of ``radius``.
        """
        half = self.radius(confidence) if circle else self._marginal(confidence)
        magnitude = self.magnitude
        inside = half >= magnitude
        ratio = np.divide(half, magnitude, out=np.ones_like(half), where=~inside)
        width = np.degrees(np.where(inside, np.pi, np.arcsin(ratio)))
        return self.phase - width, self.phase + width

    def select(
        self,
        outputs: str | int | Sequence[str | int] | None = None,
        inputs: str | int | Sequence[str | int] | None = None,
    ) -> FrfEstimate:
        """Return the estimates of some outputs and inputs by name or number (from 0), in the order asked.

        Raises
        ------
        UnknownNameError : a name or number that is not among them.
        AnalysisError : a name that several have.
        """
        rows = places(outputs, self.outputs, "output")
        columns = places(inputs, self.inputs, "input")
        lines = self.detection_lines
        if lines is not None:
            lines = replace(
                lines,
                amplitude=lines.amplitude[rows],
                noise=lines.noise[rows],
                outputs=tuple(self.outputs[i] for i in rows),
                output_units=tuple(self.output_units[i] for i in rows),
            )
        return replace(
            super().select(outputs, inputs),
            coherence=self.coherence[rows],
            partial_coherence=self.partial_coherence[np.ix_(rows, columns)],
            residual_covariance=self.residual_covariance[np.ix_(rows, rows)],
            input_gain=self.input_gain[np.ix_(columns, columns)],
            noise_level=None if self.noise_level is None else self.noise_level[np.ix_(rows, columns)],
            distortion_level=None if self.distortion_level is None else self.distortion_level[np.ix_(rows, columns)],
            detection_lines=lines,
        )

    def _at(self, kept: NDArray[np.bool_]) -> FrfEstimate:
        return replace(
            super()._at(kept),
            coherence=self.coherence[..., kept],
            partial_coherence=self.partial_coherence[..., kept],
            residual_covariance=self.residual_covariance[..., kept],
            input_gain=self.input_gain[..., kept],
            degrees_of_freedom=self.degrees_of_freedom[kept],
            noise_level=None if self.noise_level is None else self.noise_level[..., kept],
            distortion_level=None if self.distortion_level is None else self.distortion_level[..., kept],
        )

    def plot(
        self, axes: Sequence[Axes] | np.ndarray | None = None, label: str | None = None, confidence: float = 0.99
    ) -> np.ndarray:
        """Draw magnitude and phase over frequency with the confidence band shaded.

        Parameters
        ----------
        axes : what an earlier call returned, of this or a model's response, to draw over it; a new figure if None.
        label : name of this curve in the legend.
        confidence : of the band, the shadow of the circle on magnitude and on phase.

        Returns
        -------
        (2 n_out, n_in) array of matplotlib Axes: magnitude above phase.
        """
        from ibsdyn.plotting.frf_estimate import plot_frf_estimate

        return plot_frf_estimate(self, axes, label, checked_confidence(confidence))

    def _marginal(self, confidence: float) -> Array:
        level = checked_confidence(confidence)
        nu = self._known_degrees_of_freedom()
        return marginal_quantile(level, nu) * np.sqrt(self.variance)

    def _known_degrees_of_freedom(self) -> Array:
        if not np.all(self.degrees_of_freedom > 0):
            raise AnalysisError(
                f"{self.n_averages:.3g} averages for {len(self.inputs)} inputs leave no degree of freedom to estimate "
                "a variance with, so there is no confidence region. Measure longer, more periods or more runs, or take "
                "a shorter window."
            )
        return self.degrees_of_freedom

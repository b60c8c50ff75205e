"""Shock response spectra on log-log axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ibsdyn.plotting.bode import plain_hertz, whole_decades

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ibsdyn.shock import ShockSpectrum


def plot_shock_spectrum(spectrum: ShockSpectrum, axes: Axes | None, label: str | None) -> Axes:
    """Draw a shock response spectrum; see ``ShockSpectrum.plot``."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    quality = f"Q = {1 / (2 * spectrum.damping_ratio):.3g}" if spectrum.damping_ratio else "undamped"
    named = spectrum.title if label is None else label
    axes.loglog(spectrum.frequencies, spectrum.maximax, label=f"{named}, {quality}")
    axes.set_xlabel("natural frequency [Hz]")
    axes.set_ylabel(f"maximax acceleration [{spectrum.unit}]")
    axes.grid(True, which="both", alpha=0.25, linewidth=0.5)
    plain_hertz(axes)
    whole_decades(axes, spectrum.maximax)
    axes.legend(loc="best", fontsize="small")
    return axes

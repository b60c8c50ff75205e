"""Vibration of floors and of launchers as published spectra.

Tables that could not be checked against a second public source are left out: ECSS-E-ST-10-03, launchers' manuals.
"""

from __future__ import annotations

import numpy as np

from ibsdyn.errors import ModelError, known_keywords, nearest
from ibsdyn.psd import PSD
from ibsdyn.validation import number

# RMS velocity in one-third-octave bands [m/s] where the curve is flat, and its lowest frequency [Hz].
_CRITERIA = {
    "ISO workshop": (800e-6, 4.0),
    "ISO office": (400e-6, 4.0),
    "ISO residential day": (200e-6, 4.0),
    "ISO operating theatre": (100e-6, 4.0),
    "VC-A": (50e-6, 4.0),
    "VC-B": (25e-6, 4.0),
    "VC-C": (12.5e-6, 1.0),
    "VC-D": (6.25e-6, 1.0),
    "VC-E": (3.12e-6, 1.0),
    "VC-F": (1.56e-6, 1.0),
    "VC-G": (0.78e-6, 1.0),
}
# Below this VC-A, VC-B and the ISO curves are constant in acceleration [Hz].
_KNEE = 8.0
_HIGHEST = 80.0

# Breakpoints [Hz], [g²/Hz]; the overall RMS [g] that is published with each is in the tests.
_LAUNCH = {
    "GEVS qualification": ((20.0, 50.0, 800.0, 2000.0), (0.026, 0.16, 0.16, 0.026)),
    "GEVS acceptance": ((20.0, 50.0, 800.0, 2000.0), (0.013, 0.08, 0.08, 0.013)),
    "NASA workmanship": ((20.0, 80.0, 500.0, 2000.0), (0.01, 0.04, 0.04, 0.01)),
}
# Heavier components are tested at less [kg].
GEVS_HEAVIEST = 22.7


@known_keywords
def floor_vibration(criterion: str, unit: str = "m/s²") -> PSD:
    """Return the PSD of a floor that just keeps a vibration criterion in every one-third-octave band.

    Parameters
    ----------
    criterion : "ISO workshop" (coarsest), "ISO office", "ISO residential day", "ISO operating theatre", "VC-A" to
        "VC-G".
    unit : of the signal, "m/s²", "m/s" or "m".

    Raises
    ------
    ModelError : an unknown criterion or unit.

    Notes
    -----
    The criteria bound the RMS velocity v in one-third-octave bands: 50, 25, 12.5, 6.25, 3.12, 1.56, 0.78 µm/s, VC-C to
    VC-G from 1 to 80 Hz, VC-A and VC-B from 8 to 80 Hz with constant acceleration from 4 to 8 Hz (quoted as 260 and
    130 µg). A floor that reaches its criterion in all bands at once has the PSD v² / (0.232 f); a real one reaches it
    in a few, so this is an upper bound. The criteria say nothing outside of their frequencies; the PSD is zero there.
    The ISO curves have the shape of VC-A at 800, 400, 200 and 100 µm/s: the base curve of ISO 2631-2:1989 (5 mm/s² from
    4 to 8 Hz, 0.1 mm/s above) times 8, 4, 2 and 1.
    H. Amick, M. Gendreau, T. Busch, C. Gordon, Evolving criteria for research
    facilities: I - Vibration, Proc. SPIE 5933 (2005); IEST-RP-CC024.
    """
    if not isinstance(criterion, str) or criterion not in _CRITERIA:
        raise ModelError(f"floor_vibration: {criterion!r} is not known. {nearest(str(criterion), _CRITERIA)}")
    velocity, lowest = _CRITERIA[criterion]
    centres = np.array([lowest, _KNEE, _HIGHEST] if lowest > 1.0 else [lowest, _HIGHEST])
    rms = velocity * (np.minimum(1.0, centres / _KNEE) ** -1 if lowest > 1.0 else np.ones(2))
    return PSD.from_third_octaves(centres, rms, "m/s", criterion).to(unit)


@known_keywords
def launch_vibration(spectrum: str, mass: float | None = None) -> PSD:
    """Return a random vibration spectrum of launchers for components, acceleration [m/s²].

    Parameters
    ----------
    spectrum : "GEVS qualification", "GEVS acceptance" or "NASA workmanship".
    mass : of the component [kg]; the GEVS tables are for 22.7 kg at most, heavier ones are tested at less and are
        refused here.

    Raises
    ------
    ModelError : an unknown spectrum, or a component that is too heavy for it.

    Notes
    -----
    GSFC-STD-7000A, General Environmental Verification Standard, table 2.4-3: 14.1 and 10.0 g RMS over 20 to 2000 Hz.
    NASA-STD-7001, minimum workmanship: 6.8 g RMS. A launcher's own manual goes before these.
    """
    if not isinstance(spectrum, str) or spectrum not in _LAUNCH:
        raise ModelError(f"launch_vibration: {spectrum!r} is not known. {nearest(str(spectrum), _LAUNCH)}")
    carried = 0.0 if mass is None else number(mass, "launch_vibration: mass", "kg", above=0.0)
    if spectrum.startswith("GEVS") and carried > GEVS_HEAVIEST:
        raise ModelError(
            f"launch_vibration: the GEVS table is for components of {GEVS_HEAVIEST:g} kg at most, got {carried:g} kg."
        )
    frequencies, values = _LAUNCH[spectrum]
    return PSD(frequencies, values, "g", spectrum)

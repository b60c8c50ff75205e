"""From a deflection that is allowed to the stiffness that is needed."""

from __future__ import annotations

from ibsdyn.errors import ModelError, known_keywords
from ibsdyn.validation import number


@known_keywords
def required_stiffness(
    inertia: float,
    acceleration: float,
    deflection: float | None = None,
    beam_deflection: float | None = None,
) -> float:
    """Return the least stiffness that keeps a quasi-static deflection within its limit.

    Parameters
    ----------
    inertia : of what is carried, about the axis [kg m²]; a mass [kg] gives a translational stiffness.
    acceleration : [rad/s²] (or [m/s²]).
    deflection : allowed for the mirror [rad] (or [m]).
    beam_deflection : allowed for the reflected beam [rad]; it turns twice as far as the mirror, deflection =
        beam_deflection / 2.

    Returns
    -------
    k = inertia acceleration / deflection [N·m/rad] (or [N/m]).

    Raises
    ------
    ModelError : not exactly one of the two deflections, or a value that is not positive.

    Notes
    -----
    Torque balance k delta = I phidd. The formula holds well below the resonance at sqrt(k/I); the form
    I sqrt(phidd/delta) that is found in print has the unit kg m²/s and is not a stiffness.
    """
    if (deflection is None) == (beam_deflection is None):
        raise ModelError("required_stiffness: give either deflection= (the mirror's) or beam_deflection= (the beam's).")
    value, label = (deflection, "deflection") if deflection is not None else (beam_deflection, "beam_deflection")
    allowed = number(value, f"required_stiffness: {label}", "rad", above=0.0)
    if label == "beam_deflection":
        allowed = allowed / 2
    carried = number(inertia, "required_stiffness: inertia", "kg m²", above=0.0)
    accelerated = number(acceleration, "required_stiffness: acceleration", "rad/s²", above=0.0)
    return carried * accelerated / allowed

"""How far the reduced bodies of a model carry its results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fem_import import ReducedBody
from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array
from ibsdyn.components import FlexibleBody
from ibsdyn.errors import warn_user

if TYPE_CHECKING:
    from ibsdyn.modes import Modes

# A mode whose kinetic energy sits in a part, or inside of parts, belongs to them and not to the assembly.
_OF_THE_PART = 0.5
# A part that takes less of the strain energy than this moves the frequency by no more than its own error times it.
_TAKES_PART = 0.05


def reduction_errors(assembly: Assembly, frequencies: Array, shapes: Array) -> Array:
    """Return by how much reductions have raised each frequency, df/f (n_modes,); nan where a body does not know.

    frequencies (n_modes,) [Hz] in ascending order, 0 for rigid-body modes; shapes (N, n_modes) over all coordinates,
    unit modal mass. The residuals of several bodies act on different coordinates, so their first-order shifts add up.
    """
    errors = np.zeros(len(frequencies))
    elastic = slice(int(np.count_nonzero(frequencies == 0.0)), None)
    for body in _flexible(assembly):
        own = body.reduced.reduction_errors(frequencies[elastic], shapes[assembly.places[body.name]][:, elastic])
        errors[elastic] += np.nan if own is None else own
    return errors


def warn_of_modes_beyond(modes: Modes) -> None:
    """Warn where a mode of the assembly deforms a body at a frequency near or above its cut-off.

    The highest modes of any reduced body are what is left of its basis and lie above the cut-off by nature; little
    moves in them but the body itself, and they are not meant.
    """
    assembly, frequencies, shapes = modes._assembly, modes.frequencies, modes._full_shapes
    if not any(frequencies[-1] > _trusted(body.reduced) for body in _flexible(assembly)):
        return
    inside = np.zeros(len(frequencies))
    for body in _flexible(assembly):
        place, n_modes = assembly.places[body.name], len(body.reduced.frequencies)
        inside += np.diag(body.reduced.M)[-n_modes:] @ shapes[place][-n_modes:] ** 2 if n_modes else 0.0
    for body in _flexible(assembly):
        limit = _trusted(body.reduced)
        moves = np.maximum(modes.kinetic_energy[body.name], inside)
        takes_part = (modes.strain_energy[body.name] > _TAKES_PART) & (moves < _OF_THE_PART)
        beyond = np.flatnonzero((frequencies > limit) & takes_part)
        if len(beyond):
            first, count = beyond[0], len(beyond)
            which = f"Mode {first + 1}" if count == 1 else f"{count} modes from mode {first + 1} on"
            verb = "deforms" if count == 1 else "deform"
            warn_user(
                f"{which} ({frequencies[first]:.4g} Hz) {verb} {body.name!r} above {limit:.4g} Hz, where its reduction "
                f"is not to be trusted (cut-off {body.reduced.max_frequency:g} Hz / 1.5). If that matters, reduce it "
                f"with max_frequency={1.5 * frequencies[beyond[-1]]:.3g}, or as far as you need."
            )


def warn_of_frequencies_beyond(assembly: Assembly, frequencies: Array) -> None:
    """Warn where responses are asked for at frequencies that a reduction does not carry."""
    highest = float(np.max(frequencies))
    for body in _flexible(assembly):
        limit = _trusted(body.reduced)
        if highest > limit * (1.0 + 1e-9):
            warn_user(
                f"The frequencies go up to {highest:.4g} Hz, but {body.name!r} is reduced with a cut-off of "
                f"{body.reduced.max_frequency:g} Hz and not to be trusted above {limit:.4g} Hz (cut-off / 1.5). Reduce "
                f"it with max_frequency={1.5 * highest:.4g}, or end the frequencies there."
            )


def _flexible(assembly: Assembly) -> list[FlexibleBody]:
    return [body for body in assembly.bodies if isinstance(body, FlexibleBody)]


def _trusted(reduced: ReducedBody) -> float:
    """Return up to where a body serves [Hz]; without end where it does not say (a superelement without modes)."""
    return reduced.trusted_frequency if reduced.max_frequency > 0.0 else np.inf

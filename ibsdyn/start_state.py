"""Where a run begins: in the linear steady state of a periodic excitation, or at rest relative to the base."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.engine import StartState
from ibsdyn.errors import SimulationError
from ibsdyn.excitation import LINE_FLOOR
from ibsdyn.generalized_alpha import derivatives

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem

Complex = NDArray[np.complexfloating]
# A mean force below this share of the largest value is rounding.
MEAN_SHARE = 1e-9


def steady_state(
    system: LinearSystem, loads: Mapping[int, Array], bases: Mapping[int, Array], tables: Sequence[Array], step: float
) -> StartState:
    """Return the state at step 0 of the periodic response of the linear system, integrated with the run's steps.

    Parameters
    ----------
    system : the linear system; n free and n_base base coordinates.
    loads : (n,) generalised forces by input, for a unit of it.
    bases : (n_base,) displacements of the base by input, for a unit of it.
    tables : one period by input: forces, or displacements of the base, at the steps.
    step : [s].

    Raises
    ------
    SimulationError : an undamped mode is excited at its own frequency, or a mean force pushes a body away.
    """
    n, n_base = len(system.coordinates), len(system.base_coordinates)
    free, base = np.zeros((3, n)), np.zeros((3, n_base))
    for index, table in enumerate(tables):
        lines = np.asarray(scipy.fft.rfft(table)) * (2.0 / len(table))
        mean = 0.5 * lines[0].real
        size = np.abs(lines)
        size[0] = 0.0
        numbers = np.flatnonzero(size > LINE_FLOOR * size.max(initial=0.0))
        if numbers.size and 2 * numbers[-1] == len(table):
            lines[numbers[-1]] *= 0.5
        amplitudes = lines[numbers]
        velocity, acceleration = derivatives(
            np.asarray(2 * np.pi * numbers / (len(table) * step), dtype=np.float64), step
        )
        powers = np.stack([np.ones(len(numbers)), velocity, acceleration])
        if index in bases:
            column = bases[index]
            base += np.outer((powers * amplitudes).sum(axis=1).real, column)
            base[0] += mean * column
            free[0] += mean * (system.quasi_static_motion().motion[:n] @ column)
            response = _follow(system, column, velocity, acceleration) * amplitudes
        else:
            if abs(mean) > MEAN_SHARE * np.abs(table).max(initial=0.0):
                free[0] += mean * _static(system, loads[index])
            response = _respond(system, loads[index][:, None].astype(complex), velocity, acceleration) * amplitudes
        free += (powers[:, None, :] * response).sum(axis=2).real
    if not np.isfinite(free).all():
        raise SimulationError(
            "start='steady': the linear response is infinite: an undamped mode lies exactly at an excited line. Give "
            "the connections a damping ratio zeta, or start='rest'."
        )
    return _state(system, free, base)


def at_rest(
    system: LinearSystem, loads: Mapping[int, Array], bases: Mapping[int, Array], tables: Sequence[Array], step: float
) -> StartState:
    """Return the state at step 0 of bodies that move along with their base, or stand still where it does.

    The parameters are those of ``steady_state``.
    """
    n, n_base = len(system.coordinates), len(system.base_coordinates)
    base, force = np.zeros((3, n_base)), np.zeros(n)
    for index, table in enumerate(tables):
        if index in bases:
            base += np.outer(_derivatives_at_start(table, step), bases[index])
        else:
            force += table[0] * loads[index]
    motion = system.quasi_static_motion().motion[:n]
    free = base @ motion.T
    unbalanced = force - system.C @ free[1] - system.K @ free[0] - system.M_base @ base[2]
    unbalanced -= system.C_base @ base[1] + system.K_base @ base[0]
    free[2] = np.linalg.solve(system.M, unbalanced)
    return _state(system, free, base)


def _derivatives_at_start(table: Array, step: float) -> Array:
    """Return the first value of a table and its derivatives there, by differences of the third order."""
    if len(table) < 5:
        return np.array([table[0], 0.0, 0.0])
    first = table[:5] @ [-25.0, 48.0, -36.0, 16.0, -3.0] / (12.0 * step)
    second = table[:5] @ [35.0, -104.0, 114.0, -56.0, 11.0] / (12.0 * step**2)
    return np.array([table[0], first, second])


def _state(system: LinearSystem, free: Array, base: Array) -> StartState:
    whole = np.hstack([free, base]) @ system._to_full.T
    return StartState(*whole)


def _static(system: LinearSystem, load: Array) -> Array:
    if system._modal[2].any():
        raise SimulationError(
            "start='steady': a force or torque has a mean, and nothing holds the model against it; take the mean out "
            "or use start='rest'."
        )
    natural, shapes, _ = system._modal
    deflection: Array = shapes @ ((shapes.T @ load) / natural**2)
    return deflection


def _follow(system: LinearSystem, column: Array, velocity: Complex, acceleration: Complex) -> Complex:
    """Return (n, n_lines) the free coordinates for a unit motion of the base.

    As in the frequency responses: carried along quasi-statically, plus what inertia leaves behind.
    """
    n = len(system.coordinates)
    static = system.quasi_static_motion()
    carried = static.motion @ column
    inertia = system.M @ carried[:n] + system.M_base @ column
    pull: Complex = acceleration * inertia[:, None]
    if not static.strain_free:
        damping = system.C @ carried[:n] + system.C_base @ column
        strain = system.K @ carried[:n] + system.K_base @ column
        pull += velocity * damping[:, None] + strain[:, None]
    return carried[:n, None] + _respond(system, -pull, velocity, acceleration)


def _respond(system: LinearSystem, forces: Complex, velocity: Complex, acceleration: Complex) -> Complex:
    """Return (n, n_lines) the free coordinates under forces (n, n_lines) or, the same at each line, (n, 1)."""
    natural, shapes, _ = system._modal
    modal: Complex = shapes.T @ forces
    damping = shapes.T @ system.C @ shapes
    with np.errstate(divide="ignore", invalid="ignore"):  # infinities are refused by the caller, in words
        if not any(part.viscous for part in system._parts):
            dynamic = natural[:, None] ** 2 + velocity * np.diag(damping)[:, None] + acceleration
            diagonal: Complex = shapes @ (modal / dynamic)
            return diagonal
    moved: Complex = np.empty((len(natural), len(velocity)), dtype=complex)
    spread = np.broadcast_to(modal, moved.shape)
    for line, (rate, change) in enumerate(zip(velocity, acceleration, strict=True)):
        matrix = np.diag(natural**2 + change) + rate * damping
        try:
            moved[:, line] = np.linalg.solve(matrix, spread[:, line])
        except np.linalg.LinAlgError:
            moved[:, line] = np.inf
    physical: Complex = shapes @ moved
    return physical

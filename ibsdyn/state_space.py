"""The state-space form of a linear system, for control design and other tools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from ibsdyn.axes import Array
from ibsdyn.errors import AnalysisError
from ibsdyn.signals import QUANTITIES, BaseMotion, Input, Output, checked_inputs, checked_outputs

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem

# A feed-through of an input's derivative below this share of the largest is rounding.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u, SI with angles in rad.

    Attributes
    ----------
    A, B, C, D : (n_x, n_x), (n_x, n_u), (n_y, n_x), (n_y, n_u).
    states : n_x names.
    inputs, outputs : names.
    input_units, output_units : units of each.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]

    def to_control(self) -> Any:
        """Return a control.StateSpace of python-control with the same names (extra ``control``)."""
        from ibsdyn.interchange.views import state_space_to_control

        return state_space_to_control(self)


def state_space(
    system: LinearSystem, inputs: Input | Sequence[Input], outputs: Output | Sequence[Output]
) -> StateSpace:
    """Return a system's state space; see ``LinearSystem.to_state_space``.

    Notes
    -----
    The states are positions, velocities and, for a base that moves, its displacement and velocity as far as they are
    not inputs themselves. The derivatives of a base input are removed from the equations by shifting the states:
    with X = M^-1 M_base and Y = M^-1 C_base - M^-1 C X the states are p = x + X x_b and v = p' + Y x_b.
    """
    sources, sensors = checked_inputs(inputs), checked_outputs(outputs)
    n, count = len(system.coordinates), len(sources)
    motion = np.zeros((len(system.base_coordinates), count))
    force = np.zeros((n, count))
    for column, source in enumerate(sources):
        if isinstance(source, BaseMotion):
            motion[:, column] = system.base_motion(source)
        else:
            force[:, column] = system.load(source)
    moving = [column for column, source in enumerate(sources) if isinstance(source, BaseMotion)]
    factor = scipy.linalg.cho_factor(system.M)

    def per_mass(matrix: Array) -> Array:
        solved: Array = scipy.linalg.cho_solve(factor, matrix)
        return solved

    c, k = per_mass(system.C), per_mass(system.K)
    X = per_mass(system.M_base @ motion)
    Y = per_mass(system.C_base @ motion) - c @ X
    # x'' + c x' + k x + X b'' + ... = M^-1 f over b, the base's displacement per input:
    #   p' = v - Y b,  v' = -c v + (c Y - M^-1 K_base + k X) b - k p + M^-1 f
    drive = c @ Y - per_mass(system.K_base @ motion) + k @ X
    dynamics = np.block([[np.zeros((n, n)), np.eye(n)], [-k, -c]])
    by_base = np.vstack([-Y, drive])
    by_force = np.vstack([np.zeros((n, count)), per_mass(force)])

    # b follows from the input by as many integrations as the input is differentiated.
    states = [f"{name}" for name in system.coordinates] + [f"d/dt {name}" for name in system.coordinates]
    chains: dict[int, list[int]] = {}
    for column in moving:
        order = sources[column].order  # type: ignore[union-attr]  # moving lists the BaseMotions
        chains[column] = list(range(len(states), len(states) + order))
        states += [f"{sources[column].name}: base {QUANTITIES[level]}" for level in range(order)]
    size = len(states)
    A, B = np.zeros((size, size)), np.zeros((size, count))
    A[: 2 * n, : 2 * n] = dynamics
    B[: 2 * n] = by_force
    levels = _BaseLevels(chains, size, count)
    for column in moving:
        state_row, input_row = levels.of(column, 0)
        A[: 2 * n] += np.outer(by_base[:, column], state_row)
        B[: 2 * n] += np.outer(by_base[:, column], input_row)
        for level, state in enumerate(chains[column]):
            A[state], B[state] = levels.of(column, level + 1)

    C, D = np.zeros((len(sensors), size)), np.zeros((len(sensors), count))
    for row, (sensor, free, base) in enumerate(zip(sensors, *system.sensors(sensors), strict=True)):
        C[row], D[row] = _output(sensor, free, base @ motion, X, Y, dynamics, by_base, by_force, levels, moving)
    return StateSpace(
        A,
        B,
        C,
        D,
        tuple(states),
        tuple(source.name for source in sources),
        tuple(sensor.name for sensor in sensors),
        tuple(source.unit for source in sources),
        tuple(sensor.unit for sensor in sensors),
    )


class _BaseLevels:
    """Rows that give the derivatives of each base motion from the states and inputs."""

    def __init__(self, chains: dict[int, list[int]], size: int, count: int) -> None:
        self._chains, self._size, self._count = chains, size, count

    def of(self, column: int, level: int) -> tuple[Array, Array]:
        """Return the state row and the input row of derivative ``level`` of the base displacement."""
        state, input_ = np.zeros(self._size), np.zeros(self._count)
        chain = self._chains[column]
        if level < len(chain):
            state[chain[level]] = 1.0
        else:
            input_[column] = 1.0
        return state, input_

    def available(self, column: int, level: int) -> bool:
        """Tell whether a derivative exists without differentiating the input."""
        return level <= len(self._chains[column])


def _output(
    sensor: Output,
    free: Array,
    direct: Array,
    X: Array,
    Y: Array,
    dynamics: Array,
    by_base: Array,
    by_force: Array,
    levels: _BaseLevels,
    moving: list[int],
) -> tuple[Array, Array]:
    """Return a sensor's rows of C and D: its displacement row differentiated ``sensor.order`` times."""
    n = len(free)
    # The signal is state_row z + sum_level base_rows[level] b^(level) + force_row f, z the 2n shifted states.
    state_row = np.concatenate([free, np.zeros(n)])
    base_rows = [direct - free @ X]
    # Rounding of each row by what it is summed from; rows of different derivatives have different units.
    scale = [float((np.abs(direct) + np.abs(free) @ np.abs(X)).max(initial=0.0))]
    force_row = np.zeros(by_force.shape[1])
    for _ in range(sensor.order):
        force_row = state_row @ by_force
        base_rows = [state_row @ by_base, *base_rows]
        scale = [float((np.abs(state_row) @ np.abs(by_base)).max(initial=0.0)), *scale]
        state_row = state_row @ dynamics
    C, D = np.zeros(levels._size), force_row.copy()
    C[: 2 * n] = state_row
    for level, row in enumerate(base_rows):
        for column in moving:
            if levels.available(column, level):
                states, inputs = levels.of(column, level)
                C += row[column] * states
                D += row[column] * inputs
            elif abs(row[column]) > ROUNDING * scale[level]:
                raise AnalysisError(
                    f"output {sensor.name!r} [{sensor.unit}] needs the derivative of its input, which no state space "
                    "has; give the BaseMotion as quantity='acceleration'."
                )
    return C, D

"""How M, K and C of a linear system change with the numbers of its components, exactly, in modal coordinates.

A motion of the system is written as modes plus the quasi-static motion of the base. Both are held while a parameter
changes, and so are all frames: a CoG that moves changes the mass matrix about the point where it was, a fixation that
moves changes which motion of its frame "about its position" means. Frequencies and responses do not depend on the
frames, and nothing that must cancel is ever formed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ibsdyn.assembly import Assembly, Joint, body_mass_matrix
from ibsdyn.axes import DIRECTIONS, Array, rigid_transfer, rotate_six
from ibsdyn.components import Connection, FlexibleBody
from ibsdyn.elastic_parts import part_rows
from ibsdyn.errors import AnalysisError
from ibsdyn.parameters import Parameter
from ibsdyn.signals import Force, Output, Stroke, Torque, load_column, sensor_row

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem

# A change of the locks' rows below this is rounding; a weld does not care where it sits.
LOCK_TOLERANCE = 1e-12
# A change of redundant locks that leaves more than this share unmet would contradict the others.
CONTRADICTION = 1e-6
# Strain of a rigid-body mode above this share of the elastic modes' is no rounding.
HOLDS = 1e-9


@dataclass(frozen=True, eq=False)
class MatrixChange:
    """Derivatives to one parameter, over modes (n) and quasi-static base motions (n_base).

    Attributes
    ----------
    M, K : (n + n_base, n + n_base) of mass and stiffness.
    explicit : of the explicit dampers' matrix.
    weighted : of the stiffness in which every part counts with its damping ratio.
    motion : (N, n + n_base) of all coordinates, where locks turn; None where they do not.
    """

    M: Array
    K: Array
    explicit: Array
    weighted: Array
    motion: Array | None = None


class MotionBasis:
    """Modes and quasi-static base motions of a linear system, and what every part does in them.

    Parameters
    ----------
    system : about which the derivatives are taken.
    """

    def __init__(self, system: LinearSystem) -> None:
        omega, shapes, rigid = system._modal
        self.system = system
        self.assembly: Assembly = system._assembly
        self.omega, self.rigid = omega, rigid
        self.n = len(omega)
        static = system.quasi_static_motion().motion
        at_rest = np.zeros((len(static) - self.n, self.n))
        # (n + n_base, n + n_base) of the independent coordinates, and (N, n + n_base) of all
        self.vectors = np.hstack([np.vstack([shapes, at_rest]), static])
        self.motion: Array = system._to_full @ self.vectors
        self.joints = {joint.name: joint for joint in self.assembly.joints}
        self._deformations: dict[str, Array] = {}
        self._moves: dict[tuple[str, int], MatrixChange] = {}

    @property
    def size(self) -> int:
        """n + n_base."""
        return int(self.vectors.shape[1])

    @cached_property
    def energies(self) -> dict[str, Array]:
        """(n + n_base, n + n_base) stiffness of each part."""
        found = {}
        for part in self.system._parts:
            rows = part.rows @ self.vectors
            found[part.name] = rows.T @ rows
        return found

    @cached_property
    def weighted(self) -> Array:
        """(n + n_base, n + n_base) stiffness in which every part counts with its damping ratio."""
        total = np.zeros((self.size, self.size))
        for part in self.system._parts:
            total += part.zeta * self.energies[part.name]
        return total

    @cached_property
    def explicit(self) -> Array:
        """(n + n_base, n + n_base) explicit dampers; exactly zero where there are none."""
        if not any(part.viscous for part in self.system._parts):
            return np.zeros((self.size, self.size))
        projected: Array = self.vectors.T @ self.system._explicit_damping @ self.vectors
        return projected

    @cached_property
    def base_inertia(self) -> Array:
        """(n, n_base) inertia forces of the quasi-static motions, seen by the modes."""
        n = self.n
        static = self.vectors[:, n:]
        forces: Array = self.system.M @ static[:n] + self.system.M_base
        seen: Array = self.vectors[:n, :n].T @ forces
        return seen

    def sensor_row(self, sensor: Output) -> Array:
        """Return a sensor's (N,) row over all coordinates."""
        return sensor_row(sensor, self.assembly)

    def load_column(self, source: Force | Torque | Stroke) -> Array:
        """Return a unit load's (N,) forces on all coordinates."""
        return load_column(source, self.assembly)

    def change(self, parameter: Parameter) -> MatrixChange:
        """Return the derivatives to one parameter.

        Raises
        ------
        AnalysisError : nothing is differentiable there: a locked stiffness, a stiffness of zero that would hold a
            rigid-body motion, or a lock whose move contradicts others.
        """
        if parameter.component in self.joints:
            return self._joint_change(self.joints[parameter.component], parameter)
        item = self.assembly.items[parameter.component]
        if isinstance(item, FlexibleBody):
            return self._change(weighted=self._ratio_change(parameter.component))
        if parameter.kind == "place" and item in self.assembly.fixations:
            return self._change()  # only what "about its position" means: see signal_derivatives
        place = self.assembly.places[parameter.component]
        own = self.motion[place]
        block = _mass_change(parameter, body_mass_matrix(item), self.assembly.axis)
        return self._change(M=own.T @ block @ own)

    def _joint_change(self, joint: Joint, parameter: Parameter) -> MatrixChange:
        connection = joint.connection
        if parameter.kind == "zeta":
            return self._change(weighted=self._ratio_change(joint.name))
        if parameter.kind == "place":
            share = _centre_share(connection, parameter.field)
            if share == 0.0:
                return self._change()
            # Both positions of a connection move its elastic centre alike.
            moved = self._moves.get((joint.name, parameter.entry))
            if moved is None:
                moved = self._moves[joint.name, parameter.entry] = self._moved(joint, parameter, share)
            return moved
        if connection.locked[parameter.entry]:
            if parameter.kind == "damping":
                return self._change()  # a damper across a lock never moves
            raise AnalysisError(f"{parameter.address} is inf: a locked direction has no derivative.")
        row = self._deformation(joint)[parameter.entry]
        square = np.outer(row, row)
        if parameter.kind == "damping":
            return self._change(explicit=square)
        if parameter.value == 0.0 and self._holds_rigid_motion(row):
            raise AnalysisError(
                f"{parameter.address} is 0 and would hold a rigid-body motion; its frequency has no derivative there."
            )
        return self._change(K=square, weighted=self._ratio(joint.name) * square)

    def stroke_change(self, parameter: Parameter, stroke: Stroke) -> Array:
        """Return the derivative of what a stroke exerts on the modes, (n,): its connection's stiffness at work."""
        joint = self.joints[stroke.item]
        entry = 0 if self.assembly.axis is not None else DIRECTIONS.index(str(stroke.direction))
        if parameter.component != joint.name:
            return np.zeros(self.n)
        if parameter.kind == "stiffness" and parameter.entry == entry:
            along = self._deformation(joint)[entry]
        elif parameter.kind == "place":
            share = _centre_share(joint.connection, parameter.field)
            along = share * joint.connection.stiffness[entry] * self._turned(joint, parameter)[entry] @ self.motion
        else:
            return np.zeros(self.n)
        change: Array = along[: self.n]
        return change

    def _turned(self, joint: Joint, parameter: Parameter) -> Array:
        """Return the derivative of a joint's (6, N) deformation along its own axes as its elastic centre moves."""
        # Only rotations enter, and a lever does not change those.
        along = _lever_change(parameter.entry)
        turned: Array = rotate_six(joint.connection.axes_matrix).T @ along @ joint.relative
        return turned

    def _moved(self, joint: Joint, parameter: Parameter, share: float) -> MatrixChange:
        """Move an elastic centre: both ends see the rotations of what they are fixed to through another lever."""
        connection = joint.connection
        turned = self._turned(joint, parameter)
        rows, deformation = turned @ self.motion, self._deformation(joint)
        finite = np.where(connection.locked, 0.0, connection.stiffness)
        dampers = np.zeros(6) if connection.damping is None else np.where(connection.locked, 0.0, connection.damping)
        K = share * _sym(deformation.T @ (finite[:, None] * rows))
        explicit = share * _sym(deformation.T @ (dampers[:, None] * rows))
        change = self._change(K=K, explicit=explicit, weighted=self._ratio(joint.name) * K)
        lock_change = share * turned[np.array(connection.locked)] @ self.motion
        if np.abs(lock_change).max(initial=0.0) <= LOCK_TOLERANCE * np.abs(self.motion).max():
            return change
        return _sum(change, self._turned_locks(joint, lock_change, parameter))

    def _turned_locks(self, moved: Joint, lock_change: Array, parameter: Parameter) -> MatrixChange:
        """Let the coordinates that locks determine follow a lock whose rows change."""
        names = set(self.system.coordinates) | set(self.system.base_coordinates)
        determined = np.array([i for i, name in enumerate(self.assembly.names) if name not in names])
        locks = np.vstack([joint.locks for joint in self.assembly.joints if joint.locks.size])
        wanted = np.vstack(
            [
                lock_change if joint is moved else np.zeros((len(joint.locks), self.size))
                for joint in self.assembly.joints
                if joint.locks.size
            ]
        )
        follow = -np.linalg.lstsq(locks[:, determined], wanted, rcond=None)[0]
        if np.abs(locks[:, determined] @ follow + wanted).max() > CONTRADICTION * np.abs(wanted).max():
            raise AnalysisError(
                f"{parameter.address}: the locked directions of {moved.name!r} repeat others; moved alone they would "
                "contradict each other, so nothing has a derivative there."
            )
        motion = np.zeros_like(self.motion)
        motion[determined] = follow
        M, K, explicit, weighted = (np.zeros((self.size, self.size)) for _ in range(4))
        for body in self.assembly.bodies:
            place = self.assembly.places[body.name]
            M += _sym(self.motion[place].T @ body_mass_matrix(body) @ motion[place])
            if isinstance(body, FlexibleBody) and body.reduced.C is not None:
                explicit += _sym(self.motion[place].T @ body.reduced.C @ motion[place])
        for part in self.system._parts:
            rows = part_rows(self.assembly, part.name)
            stiffness = _sym((rows @ self.motion).T @ (rows @ motion))
            K += stiffness
            weighted += part.zeta * stiffness
        for joint in self.assembly.joints:
            explicit += _sym((joint.relative @ self.motion).T @ joint.damping @ (joint.relative @ motion))
        return MatrixChange(M, K, explicit, weighted, motion)

    def _deformation(self, joint: Joint) -> Array:
        """Return the (r, n + n_base) deformation of a joint along its own axes."""
        if joint.name not in self._deformations:
            self._deformations[joint.name] = joint.deformation @ self.motion
        return self._deformations[joint.name]

    def _holds_rigid_motion(self, row: Array) -> bool:
        modal = np.abs(row[: self.n])
        return bool(self.rigid.any() and modal[self.rigid].max() > HOLDS * modal.max())

    def _ratio(self, name: str) -> float:
        return next(part.zeta for part in self.system._parts if part.name == name)

    def _ratio_change(self, name: str) -> Array:
        part = next(part for part in self.system._parts if part.name == name)
        return np.zeros((self.size, self.size)) if part.viscous else self.energies[name]

    def _change(self, **given: Array) -> MatrixChange:
        zero = np.zeros((self.size, self.size))
        return MatrixChange(**{name: given.get(name, zero) for name in ("M", "K", "explicit", "weighted")})


def _centre_share(connection: Connection, field: str) -> float:
    """Return how far the elastic centre goes with a position: half way, unless it is given."""
    if connection.elastic_centre is None:
        return 0.5
    return 1.0 if field == "elastic_centre" else 0.0


def _lever_change(axis: int) -> Array:
    """Return the (6, 6) derivative of ``rigid_transfer`` to one component of the lever."""
    change: Array = rigid_transfer(np.eye(3)[axis]) - np.eye(6)
    return change


def _mass_change(parameter: Parameter, mass: Array, axis: str | None) -> Array:
    if axis is not None:
        return np.ones((1, 1))
    block = np.zeros((6, 6))
    if parameter.kind == "mass":
        block[:3, :3] = np.eye(3)
    elif parameter.kind == "inertia":
        i, j = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))[parameter.entry]
        block[3 + i, 3 + j] = block[3 + j, 3 + i] = 1.0
    else:
        block = _sym(mass @ _lever_change(parameter.entry))
    return block


def lever_derivative(axis: int, rows: Array) -> Array:
    """Return the derivative of (6, m) motion rows of a point to a move of that point along one axis."""
    moved: Array = _lever_change(axis) @ rows
    return moved


def _sym(matrix: Array) -> Array:
    """Return matrix + matrix^T, the derivative of a quadratic form with equal sides."""
    both: Array = matrix + matrix.T
    return both


def _sum(first: MatrixChange, second: MatrixChange) -> MatrixChange:
    return MatrixChange(
        M=first.M + second.M,
        K=first.K + second.K,
        explicit=first.explicit + second.explicit,
        weighted=first.weighted + second.weighted,
        motion=second.motion,
    )


def matrix_changes(
    basis: MotionBasis, parameters: Sequence[Parameter]
) -> tuple[list[Parameter], list[MatrixChange], dict[str, str]]:
    """Return the parameters that have derivatives, those derivatives, and by address why others have none."""
    kept, changes, refused = [], [], {}
    for parameter in parameters:
        try:
            change = basis.change(parameter)
        except AnalysisError as error:
            refused[parameter.address] = str(error)
        else:
            kept.append(parameter)
            changes.append(change)
    return kept, changes, refused

"""Components in, kinematics out: the coordinates of a model and how each connection strains with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_import import SensorPoint
from ibsdyn.axes import DIRECTIONS, Array, axis_index, rigid_transfer, rotate_six
from ibsdyn.components import GLOBAL_AXES, Connection, Fixation, FlexibleBody, Inertia1D, Item, RigidBody
from ibsdyn.errors import ModelError, UnknownNameError, nearest

# Positions typed by hand name a node to a micrometre.
SAME_PLACE = 1e-6


@dataclass(frozen=True, eq=False)
class Joint:
    """A connection resolved against the coordinates of its model.

    Attributes
    ----------
    connection : the component it comes from.
    centre : (3,) elastic centre [m].
    ends : (2, r, n) motions of end 1 and of end 2 at the elastic centre, global axes; r = 6, in 1-D models 1.
    stiffness, damping : (r, r) finite stiffness and explicit damping there, global axes.
    """

    connection: Connection
    centre: Array
    ends: Array
    stiffness: Array
    damping: Array

    @property
    def name(self) -> str:
        """The connection's name."""
        return self.connection.name

    @cached_property
    def relative(self) -> Array:
        """The (r, n) motion of end 2 minus that of end 1, global axes."""
        relative: Array = self.ends[1] - self.ends[0]
        return relative

    @cached_property
    def deformation(self) -> Array:
        """The same along the connection's own axes."""
        if len(self.relative) == 1 or self.connection.axes == GLOBAL_AXES:
            return self.relative
        own_axes: Array = rotate_six(self.connection.axes_matrix).T @ self.relative
        return own_axes

    @cached_property
    def locks(self) -> Array:
        """The (m, n) rows that are zero in every motion which respects the locked directions."""
        locked: Array = self.deformation[np.array(self.connection.locked)]
        return locked


class Assembly:
    """All coordinates of a model, those of its fixations last, and its resolved connections.

    Parameters
    ----------
    items : fixations and bodies by name, in the order in which the user added them.
    connections : connections by name.
    axis : the one direction of a 1-D model, or None in 3-D.
    """

    def __init__(self, items: Mapping[str, Item], connections: Mapping[str, Connection], axis: str | None) -> None:
        self.axis = axis
        self.items = dict(items)
        self.directions: tuple[str, ...] = DIRECTIONS if axis is None else (axis,)
        self.places: dict[str, slice] = {}
        self.sensor_points: dict[str, tuple[str, SensorPoint]] = {}
        self.frames: dict[str, Array] = {}
        self._motions: dict[str, Array] = {}
        names: list[str] = []
        fixations = [item for item in items.values() if isinstance(item, Fixation)]
        bodies = [item for item in items.values() if not isinstance(item, Fixation)]
        for item in [*bodies, *fixations]:
            self._place(item, names)
        self.names = tuple(names)
        self.is_base = np.arange(len(names)) >= len(names) - len(self.directions) * len(fixations)
        self.bodies = tuple(bodies)
        self.fixations = tuple(fixations)
        self.joints = tuple(self._joint(connection) for connection in connections.values())

    def _place(self, item: Item, names: list[str]) -> None:
        start = len(names)
        if isinstance(item, FlexibleBody):
            for interface, frame in item.reduced.interfaces.items():
                address = f"{item.name}.{interface}"
                first = start + item.reduced.coordinates.index(f"{interface}.x")
                self.places[address] = slice(first, first + 6)
                self.frames[address] = np.array(frame.position, dtype=float)
            for sensor, watched in item.reduced.sensors.items():
                address = f"{item.name}.{sensor}"
                self.sensor_points[address] = (item.name, watched)
                self.frames[address] = np.array(watched.position, dtype=float)
            names.extend(f"{item.name}.{coordinate}" for coordinate in item.reduced.coordinates)
            self.frames[item.name] = np.array(item.reduced.centre_of_mass, dtype=float)
        else:
            names.extend(f"{item.name}.{direction}" for direction in self.directions)
            self.frames[item.name] = reference_point(item)
        self.places[item.name] = slice(start, len(names))

    def address(self, name: str, what: str) -> str:
        """Return a name after checking that it stands for an item, an interface or a sensor point.

        Raises
        ------
        UnknownNameError : it stands for neither; ``what`` says who asked.
        """
        if name not in self.frames:
            raise UnknownNameError(f"{what}: {name!r} is not in the model. {nearest(name, self.frames)}")
        return name

    def motion(self, name: str, point: Sequence[float] | Array | None = None) -> Array:
        """Return the rows that give the motion of a point which moves with an item.

        Parameters
        ----------
        name : a body, a fixation, an interface or a sensor point; a flexible body's own name stands for its
            mass-weighted mean motion.
        point : (3,) global axes [m]; the item's own frame (CoG, position) if None.

        Returns
        -------
        (6, n) ; in 1-D models only the row of the model's axis is filled, of a sensor point whose rotation is not
        known the first three.

        Raises
        ------
        ModelError : a point beside a sensor point whose rotation is not known.
        """
        if point is None and name in self._motions:
            return self._motions[name]
        rows = self._motion(name, point)
        if point is None:
            rows.setflags(write=False)
            self._motions[name] = rows
        return rows

    def _motion(self, name: str, point: Sequence[float] | Array | None) -> Array:
        rows = np.zeros((6, len(self.names)))
        if name in self.sensor_points:
            return self._watched_motion(name, point, rows)
        place = self.places[name]
        if self.axis is not None:
            rows[axis_index(self.axis, name), place] = 1.0
            return rows
        item = self.items.get(name)
        carried = np.eye(6) if point is None else rigid_transfer(np.asarray(point, dtype=float) - self.frames[name])
        rows[:, place] = carried @ mean_motion(item) if isinstance(item, FlexibleBody) else carried
        return rows

    def tells_rotation(self, name: str) -> bool:
        """Return whether the motion of an item, an interface or a sensor point includes its rotation."""
        return name not in self.sensor_points or len(self.sensor_points[name][1].motion) == 6

    def _watched_motion(self, name: str, point: Sequence[float] | Array | None, rows: Array) -> Array:
        body, watched = self.sensor_points[name]
        rows[: len(watched.motion), self.places[body]] = watched.motion
        arm = np.zeros(3) if point is None else np.asarray(point, dtype=float) - self.frames[name]
        if self.tells_rotation(name):
            return rigid_transfer(arm) @ rows
        if np.linalg.norm(arm) > SAME_PLACE:
            x, y, z = self.frames[name]
            raise ModelError(
                f"sensor point {name!r} tells no rotation, so its motion is known at ({x:.6g}, {y:.6g}, {z:.6g}) m "
                "only. Leave position away, or give fi.reduce three nodes for it that are not on one line."
            )
        return rows

    def _joint(self, connection: Connection) -> Joint:
        centre = elastic_centre(connection)
        if self.axis is not None:
            row = axis_index(self.axis, connection.name)
            ends = np.array([self.motion(end)[row : row + 1] for end in (connection.item1, connection.item2)])
            k, c = connection.stiffness, connection.damping or (0.0,)
            stiffness = np.diag([0.0 if connection.locked[0] else k[0]])
            damping = np.diag([0.0 if connection.locked[0] else c[0]])
            return Joint(connection, centre, ends, stiffness, damping)
        ends = np.array([self.motion(end, centre) for end in (connection.item1, connection.item2)])
        return Joint(connection, centre, ends, connection.global_stiffness(), connection.global_damping())

    def rigid_motion(self) -> Array:
        """Return the (n, 6) coordinates of the whole model, base included, in a rigid motion about the origin.

        Raises
        ------
        ModelError : a 1-D model, which has only one.
        """
        if self.axis is not None:
            raise ModelError(f"a 1-D model along {self.axis} has no rigid motion in 3-D.")
        motion = np.zeros((len(self.names), 6))
        for name, item in self.items.items():
            if isinstance(item, FlexibleBody):
                motion[self.places[name]] = item.reduced.rigid_body_motion
            else:
                motion[self.places[name]] = rigid_transfer(self.frames[name])
        return motion


def reference_point(item: Fixation | RigidBody | Inertia1D) -> Array:
    """Return the point [m] whose motion an item's coordinates are."""
    if isinstance(item, RigidBody):
        return np.array(item.cog)
    return np.array(item.position) if isinstance(item, Fixation) else np.zeros(3)


def elastic_centre(connection: Connection) -> Array:
    """Return where a connection acts [m]: as given, or half way between its positions."""
    if connection.elastic_centre is not None:
        return np.array(connection.elastic_centre)
    if connection.position1 is None or connection.position2 is None:  # 1-D: no place at all
        return np.zeros(3)
    half_way: Array = 0.5 * (np.array(connection.position1) + np.array(connection.position2))
    return half_way


def mean_motion(body: FlexibleBody) -> Array:
    """Return the (6, n_body) mass-weighted mean motion of a flexible body, at its CoG.

    Notes
    -----
    The rigid motion with the body's linear and angular momentum: (R^T M R)^-1 R^T M q, R the rigid motions.
    """
    reduced = body.reduced
    rigid = reduced.rigid_body_motion @ rigid_transfer(-np.asarray(reduced.centre_of_mass))
    momentum = rigid.T @ reduced.M
    mean: Array = np.linalg.solve(momentum @ rigid, momentum)
    return mean


def body_mass_matrix(body: Item) -> Array:
    """Return a body's mass matrix over its own coordinates."""
    if isinstance(body, FlexibleBody):
        return np.asarray(body.reduced.M, dtype=float)
    if isinstance(body, Inertia1D):
        return np.array([[body.inertia]])
    mass = np.zeros((6, 6))
    if isinstance(body, RigidBody):
        mass[:3, :3] = body.mass * np.eye(3)
        mass[3:, 3:] = body.inertia_tensor
    return mass

"""Modal damping that turns along with rigid bodies in a large rotation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array


class TurningDamping:
    """The damping matrix of ratios of rigid bodies, over the velocities of their present state.

    Parameters
    ----------
    assembly : of rigid bodies and fixations, 3-D.
    forces : by connection (6, n_modes) force and moment at its elastic centre on its second end, global axes.

    Notes
    -----
    C = F F^T, F being the generalised forces of all connections in the undeformed state. In another one each
    connection's force turns with its first end and acts where its second end's elastic centre is, as its spring does.
    F^T then takes the rates at which connections deform, which are zero in any rigid motion of all together.
    """

    def __init__(self, assembly: Assembly, forces: Mapping[str, Array]) -> None:
        order = {name: place for place, name in enumerate(assembly.items)}
        self._frames = np.array([assembly.frames[name] for name in order])
        self._joints = [
            (
                order[joint.connection.item1],
                order[joint.connection.item2],
                joint.centre - assembly.frames[joint.connection.item2],
                forces[joint.name],
            )
            for joint in assembly.joints
        ]
        self._modes = next(iter(forces.values())).shape[1]

    def matrix(self, coordinates: Array) -> Array:
        """Return the (6 n, 6 n) matrix over velocities of positions and angles.

        Parameters
        ----------
        coordinates : (n, 6) displacements and angles of R = Rx Ry Rz of all items, in the assembly's order.
        """
        angles = coordinates[:, 3:]
        turned = Rotation.from_euler("XYZ", angles).as_matrix()
        places = self._frames + coordinates[:, :3]
        loads = np.zeros((len(coordinates), 6, self._modes))
        for one, other, lever, force in self._joints:
            push, twist = turned[one] @ force[:3], turned[one] @ force[3:]
            point = places[other] + turned[other] @ lever
            for item, sign in ((one, -1.0), (other, 1.0)):
                moment = twist + np.cross(point - places[item], push, axisb=0, axisc=0)
                loads[item, :3] += sign * push
                loads[item, 3:] += sign * moment
        for item, (about_x, about_y, _) in enumerate(angles):
            loads[item, 3:] = _rate_axes(about_x, about_y).T @ loads[item, 3:]
        flat = loads.reshape(-1, self._modes)
        damping: Array = flat @ flat.T
        return damping


def _rate_axes(about_x: float, about_y: float) -> Array:
    """Return (3, 3) the angular velocities of a unit rate of each angle, as columns, global axes."""
    sx, cx, sy, cy = np.sin(about_x), np.cos(about_x), np.sin(about_y), np.cos(about_y)
    return np.array([[1.0, 0.0, sy], [0.0, cx, -sx * cy], [0.0, sx, cx * cy]])

"""The translation of an assembly to Exudyn: its nodes, objects and markers, and the way back to its coordinates.

Items are given as dictionaries of what differs from Exudyn's defaults: its classes of items fill in and copy every
default, visualisation included, which takes three times as long as Exudyn itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ibsdyn.assembly import Assembly, Joint
from ibsdyn.axes import Array, is_rotation, rotate_six
from ibsdyn.components import Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.errors import ModelError, nearest
from ibsdyn.floating_frame import FloatingFrame

FlexibleMapping = Literal["small-deflection", "floating-frame"]
FLEXIBLE_MAPPINGS = ("small-deflection", "floating-frame")
# A rotation this much softer than the others is a hinge: it may turn far while they do not.
SOFT = 0.1
Points = Sequence[tuple[str, Array]]


@contextmanager
def silent() -> Iterator[None]:
    """Keep Exudyn from printing, and give the process its settings back afterwards."""
    config = exu.config
    before = (config.printToConsole, config.suppressWarnings)
    config.printToConsole, config.suppressWarnings = False, True
    try:
        yield
    finally:
        config.printToConsole, config.suppressWarnings = before


def checked_mapping(flexible: str) -> None:
    """Refuse a representation of flexible bodies that is none.

    Raises
    ------
    ModelError : unknown ``flexible``.
    """
    if flexible not in FLEXIBLE_MAPPINGS:
        raise ModelError(f"flexible={flexible!r} is not known. {nearest(str(flexible), FLEXIBLE_MAPPINGS)}")


class Translation:
    """The Exudyn nodes, objects and markers of an assembly; its locked directions are left to the caller.

    Parameters
    ----------
    assembly : coordinates and joints.
    mbs : an empty Exudyn system; the caller assembles it.
    flexible : how flexible bodies are represented.
    points : (address, (3,) position) of points of interfaces, beyond frames and elastic centres, that get markers.

    Attributes
    ----------
    nodes : by item or interface; that of a flexible body's own name holds its modes.
    objects : by item; an interface in small deflection is a massless body that moves with its node.
    floating, floating_nodes : by flexible body in a floating frame: its constants; frame node and node of modes.
    springs : the spring of each joint that has one, by connection.
    body_nodes : by flexible body in small deflection: its nodes, in the order of its reduced coordinates.
    """

    def __init__(self, assembly: Assembly, mbs: Any, flexible: FlexibleMapping, points: Points = ()) -> None:
        self.assembly = assembly
        self.points = points
        self.mbs = mbs
        self.flexible = flexible
        self.nodes: dict[str, int] = {}
        self.objects: dict[str, int] = {}
        self.floating: dict[str, FloatingFrame] = {}
        self.floating_nodes: dict[str, tuple[int, int]] = {}
        self.springs: dict[str, int] = {}
        self.body_nodes: dict[str, list[int]] = {}
        for item in [*self.assembly.bodies, *self.assembly.fixations]:
            if self.assembly.axis is not None:
                self._add_inertia_1d(item.name, item.inertia if isinstance(item, Inertia1D) else 0.0)
            elif isinstance(item, RigidBody):
                self._add_rigid_body(item)
            elif isinstance(item, Fixation):
                self._add_massless_body(item.name, np.array(item.position))
            elif isinstance(item, FlexibleBody):
                if self.flexible == "floating-frame":
                    self._add_floating_frame(item)
                else:
                    self._add_small_deflection(item)
        for joint in self.assembly.joints:
            if joint.stiffness.any() or joint.damping.any():
                self._add_spring(joint)

    # -- bodies

    def _add_inertia_1d(self, name: str, inertia: float) -> None:
        node = self.mbs.AddNode({"nodeType": "1D", "referenceCoordinates": [0.0]})
        assert self.assembly.axis is not None
        if is_rotation(self.assembly.axis):
            self.mbs.AddObject({"objectType": "RotationalMass1D", "nodeNumber": node, "inertia": inertia})
        else:
            self.mbs.AddObject({"objectType": "Mass1D", "nodeNumber": node, "mass": inertia})
        self.nodes[name] = node

    def _rigid_node(self, position: Array) -> int:
        node: int = self.mbs.AddNode({"nodeType": "RigidBodyRxyz", "referenceCoordinates": [*position, 0.0, 0.0, 0.0]})
        return node

    def _add_rigid_body(self, body: RigidBody) -> None:
        node = self._rigid_node(np.array(body.cog))
        xx, yy, zz, xy, xz, yz = body.inertia
        self.nodes[body.name] = node
        self.objects[body.name] = self.mbs.AddObject(
            {"objectType": "RigidBody", "nodeNumber": node, "mass": body.mass, "inertia": [xx, yy, zz, yz, xz, xy]}
        )

    def _add_massless_body(self, name: str, position: Array) -> None:
        # Rows of a fixation in the Jacobians become the base columns of the linear system. A marker on a node takes
        # no lever, one on a body does: so an interface has a massless body too.
        self.nodes[name] = self._rigid_node(position)
        self.objects[name] = self.mbs.AddObject(
            {"objectType": "RigidBody", "nodeNumber": self.nodes[name], "mass": 0.0, "inertia": [0.0] * 6}
        )

    def _generic_node(self, count: int) -> int:
        zeros = [0.0] * count
        node: int = self.mbs.AddNode(
            {
                "nodeType": "GenericODE2",
                "numberOfODE2Coordinates": count,
                "referenceCoordinates": zeros,
                "initialCoordinates": zeros,
                "initialCoordinates_t": zeros,
            }
        )
        return node

    def _add_small_deflection(self, body: FlexibleBody) -> None:
        reduced = body.reduced
        nodes = []
        for interface in reduced.interfaces:
            address = f"{body.name}.{interface}"
            self._add_massless_body(address, self.assembly.frames[address])
            nodes.append(self.nodes[address])
        if len(reduced.frequencies):
            self.nodes[body.name] = self._generic_node(len(reduced.frequencies))
            nodes.append(self.nodes[body.name])
        self.body_nodes[body.name] = nodes
        self.objects[body.name] = self.mbs.AddObject(
            {
                "objectType": "GenericODE2",
                "nodeNumbers": nodes,
                "massMatrix": reduced.M,
                "stiffnessMatrix": reduced.K,
                "dampingMatrix": [] if reduced.C is None else reduced.C,
            }
        )

    def _add_floating_frame(self, body: FlexibleBody) -> None:
        frame = FloatingFrame(body)
        for interface, at in body.reduced.interfaces.items():
            frame.add_cross(interface, np.array(at.position, dtype=float))
        for address, point in self.points:
            if address.split(".", 1)[0] == body.name and "." in address:
                frame.add_cross(address.split(".", 1)[1], point)
        for joint in self.assembly.joints:
            for end in (joint.connection.item1, joint.connection.item2):
                if "." in end and end.split(".", 1)[0] == body.name:
                    frame.add_cross(end.split(".", 1)[1], joint.centre)
        self.floating[body.name] = frame
        rigid = self.mbs.AddNode(
            {"nodeType": "RigidBodyEP", "referenceCoordinates": [*frame.origin, 1.0, 0.0, 0.0, 0.0]}
        )
        modes = self._generic_node(len(frame.kept))
        self.floating_nodes[body.name] = (rigid, modes)
        self.objects[body.name] = self.mbs.AddObject(
            {
                "objectType": "FFRFreducedOrder",
                "nodeNumbers": [rigid, modes],
                "massMatrixReduced": _container(frame.mass_matrix),
                "stiffnessMatrixReduced": _container(frame.stiffness),
                "dampingMatrixReduced": [] if frame.damping is None else _container(frame.damping),
                "modeBasis": frame.mode_basis,
                "referencePositions": frame.mesh_points,
                "mass": frame.mass,
                "inertia": frame.inertia,
                "centerOfMass": frame.centre_of_mass,
                "mPsiTildePsi": frame.psi_tilde_psi,
                "mPsiTildePsiTilde": frame.psi_tilde_psi_tilde,
                "mPhitTPsi": frame.phi_psi,
                "mPhitTPsiTilde": frame.phi_psi_tilde,
                "mXRefTildePsi": frame.x_psi,
                "mXRefTildePsiTilde": frame.x_psi_tilde,
                "computeFFRFterms": True,
            }
        )

    # -- joints

    def _add_spring(self, joint: Joint) -> None:
        if self.assembly.axis is not None:
            self.springs[joint.name] = self.mbs.AddObject(
                {
                    "objectType": "ConnectorCoordinateSpringDamper",
                    "markerNumbers": self.joint_markers(joint),
                    "stiffness": joint.stiffness[0, 0],
                    "damping": joint.damping[0, 0],
                }
            )
            return
        frame = spring_frame(joint)
        both = rotate_six(frame)
        self.springs[joint.name] = self.mbs.AddObject(
            {
                "objectType": "ConnectorRigidBodySpringDamper",
                "markerNumbers": self.joint_markers(joint),
                "stiffness": both.T @ joint.stiffness @ both,
                "damping": both.T @ joint.damping @ both,
                "rotationMarker0": frame,
                "rotationMarker1": frame,
                # The intrinsic formulation's Jacobian of the damper is wrong by 20 to 30 % (exudyn 1.13.6).
                "useIntrinsicFormulation": False,
            }
        )

    def joint_markers(self, joint: Joint) -> list[int]:
        """Return markers of both ends of a joint, in its elastic centre."""
        ends = (joint.connection.item1, joint.connection.item2)
        if self.assembly.axis is not None:
            return [self.coordinate_marker(self.nodes[end], 0) for end in ends]
        return [self.marker(end, joint.centre) for end in ends]

    def coordinate_marker(self, node: int, coordinate: int) -> int:
        """Return a marker of one coordinate of a node."""
        marker: int = self.mbs.AddMarker({"markerType": "NodeCoordinate", "nodeNumber": node, "coordinate": coordinate})
        return marker

    def marker(self, name: str, point: Array) -> int:
        """Return a marker of a point of a rigid body, a fixation or an interface.

        Parameters
        ----------
        point : (3,) global axes [m]; on an interface in a floating frame, one that has its cross of mesh points.
        """
        marker: int
        if "." in name and self.flexible == "floating-frame":
            body, interface = name.split(".", 1)
            mesh_nodes = self.floating[body].cross_nodes(interface, point)
            marker = self.mbs.AddMarker(
                {
                    "markerType": "SuperElementRigid",
                    "bodyNumber": self.objects[body],
                    "meshNodeNumbers": mesh_nodes,
                    "weightingFactors": [1.0 / len(mesh_nodes)] * len(mesh_nodes),
                }
            )
        else:
            local = point - self.assembly.frames[name]
            marker = self.mbs.AddMarker(
                {"markerType": "BodyRigid", "bodyNumber": self.objects[name], "localPosition": local}
            )
        return marker

    # -- back to the model's coordinates

    def item_nodes(self, name: str) -> list[int]:
        """Return the nodes of an item, in the order of the rows of ``_to_nodes``."""
        if not isinstance(self.assembly.items.get(name), FlexibleBody):
            return [self.nodes[name]]
        return list(self.floating_nodes[name]) if self.flexible == "floating-frame" else self.body_nodes[name]

    def _to_nodes(self, name: str) -> Array:
        """Return the (n_node, n_item) matrix from an item's coordinates to those of its nodes."""
        if name in self.floating:
            return self.floating[name].to_raw()
        place = self.assembly.places[name]
        return np.eye(place.stop - place.start)

    def to_raw(self) -> Array:
        """Return the (n_exudyn, n) matrix from the model's coordinates to Exudyn's; the system is assembled."""
        to_raw = np.zeros((self.mbs.systemData.ODE2Size(), len(self.assembly.names)))
        for name in self.assembly.items:
            rows = [row for node in self.item_nodes(name) for row in self._rows(node)]
            to_raw[rows, self.assembly.places[name]] = self._to_nodes(name)
        return to_raw

    def over_model(self, matrices: Array) -> Array:
        """Return (k, n_exudyn, n_exudyn) matrices over the model's coordinates, (k, n, n); the system is assembled."""
        if self.floating:
            to_raw = self.to_raw()
            taken_over: Array = to_raw.T @ matrices @ to_raw
            return taken_over
        items = [*self.assembly.bodies, *self.assembly.fixations]
        rows = [row for item in items for node in self.item_nodes(item.name) for row in self._rows(node)]
        if rows == list(range(len(rows))):  # as a rule: nodes are made in the order of the coordinates
            return matrices
        return matrices[:, rows][:, :, rows]

    def from_nodes(self, names: Sequence[str]) -> tuple[list[int], Array]:
        """Return the nodes of items, and the (n, n_node) matrix from their coordinates to the model's, linearised."""
        nodes: list[int] = []
        blocks: list[Array] = []
        for name in names:
            nodes += self.item_nodes(name)
            # Of full column rank: the pseudo-inverse is the inverse that leaves out the scalar Euler parameter.
            inverse = np.linalg.pinv(self._to_nodes(name))
            blocks.append(np.zeros((len(self.assembly.names), inverse.shape[1])))
            blocks[-1][self.assembly.places[name]] = inverse
        return nodes, np.hstack(blocks)

    def euler_parameter_rows(self) -> list[list[int]]:
        """Return where the four Euler parameters of each floating frame are among Exudyn's coordinates."""
        return [self._rows(rigid)[3:] for rigid, _ in self.floating_nodes.values()]

    def rigid_rows(self) -> NDArray[np.intp]:
        """Return the (n, 6) rows of rigid bodies and fixations, all items of the assembly, among the coordinates."""
        return np.array([self._rows(self.nodes[name]) for name in self.assembly.items])

    def rotation_rows(self) -> list[tuple[str, list[int]]]:
        """Return by rotating node its item and the three rows of its rotation among Exudyn's coordinates.

        Those of the angles, or of a floating frame's Euler parameters but the scalar one.
        """
        found = []
        for name in self.assembly.items:
            if name in self.floating_nodes:
                found.append((name, self._rows(self.floating_nodes[name][0])[4:]))
                continue
            modes = self.nodes[name] if name in self.body_nodes and name in self.nodes else None
            found += [(name, self._rows(node)[3:]) for node in self.item_nodes(name) if node != modes]
        return found

    def _rows(self, node: int) -> list[int]:
        return list(self.mbs.systemData.GetNodeLTGODE2(node))


def spring_frame(joint: Joint) -> Array:
    """Return the (3, 3) axes, as columns, in which a joint's spring measures: global, or its softest rotation last.

    Exudyn measures rotations as angles of R = Rx Ry Rz and puts the moments on the axes of the first end. With a large
    angle last all three belong together. With it first, as of a hinge about x, stiff moments about the other two are
    on axes that have not turned along: they bring in energy, and the body flutters.
    """
    stiffness = np.array(joint.connection.stiffness[3:])
    softest = int(stiffness.argmin())
    axes = joint.connection.axes_matrix
    others = np.delete(stiffness, softest)
    if not stiffness[softest] < SOFT * others.min() or abs(axes[2, softest]) == 1.0:
        return np.eye(3)
    turned: Array = axes[:, [(softest + 1) % 3, (softest + 2) % 3, softest]]
    return turned


def _container(matrix: Array) -> Any:
    container = exu.MatrixContainer()
    container.SetWithDenseMatrix(matrix, useDenseMatrix=True)
    return container

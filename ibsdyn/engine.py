"""The translation of an assembly to Exudyn, and the system Jacobians that come back; the only importer of Exudyn."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

# Exudyn reads a settings file from the user's home on import unless told otherwise.
os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")

import exudyn as exu
import exudyn.itemInterface as eii  # noqa: N813  # Exudyn's own abbreviation
from exudyn.rigidBodyUtilities import RigidBodyInertia

from ibsdyn.assembly import Assembly, Joint
from ibsdyn.axes import Array, is_rotation, rigid_transfer
from ibsdyn.components import Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.elastic_parts import damping_size, stiffness_size
from ibsdyn.errors import EngineError, ModelError, nearest
from ibsdyn.floating_frame import FloatingFrame

FlexibleMapping = Literal["small-deflection", "floating-frame"]
FLEXIBLE_MAPPINGS = ("small-deflection", "floating-frame")

# Jacobians of rigid models are symmetric to 1e-12; a floating frame's are differentiated numerically (1e-6).
ASYMMETRY_LIMIT = {"small-deflection": 1e-9, "floating-frame": 1e-4}
# Antisymmetric entries of C up to this rate [1/s] times the inertia, times the limit above, are rounding.
GYROSCOPIC_RATE = 10.0
# Frames at or within a nanometre of each other are one frame.
SAME_POINT = 1e-9


@dataclass(frozen=True, eq=False)
class FullMatrices:
    """M, C, K over all coordinates of an assembly, base included, before any lock is applied.

    K_size (N,) is the scale of K's rounding: its diagonal if nothing cancelled in it.
    """

    M: Array
    C: Array
    K: Array
    K_size: Array


@contextmanager
def _silent() -> Iterator[None]:
    """Keep Exudyn from printing, and give the process its settings back afterwards."""
    config = exu.config
    before = (config.printToConsole, config.suppressWarnings)
    config.printToConsole, config.suppressWarnings = False, True
    try:
        yield
    finally:
        config.printToConsole, config.suppressWarnings = before


def linearized_matrices(assembly: Assembly, flexible: FlexibleMapping = "small-deflection") -> FullMatrices:
    """Return Exudyn's mass matrix and the Jacobians of its forces in the undeformed state.

    Parameters
    ----------
    assembly : coordinates and joints; n coordinates.
    flexible : "small-deflection" (reduced matrices as they are) or "floating-frame" (large rigid motion of
        flexible bodies, the form that nonlinear simulations need; linearised it is the same).

    Returns
    -------
    FullMatrices of (n, n) arrays: M [kg, kg m, kg m²], C and K of the finite springs and dampers [SI].

    Raises
    ------
    ModelError : unknown ``flexible``, or a flexible body without what a floating frame needs.
    EngineError : Exudyn refuses the model or its Jacobians are unsymmetric or not finite.
    """
    if flexible not in FLEXIBLE_MAPPINGS:
        raise ModelError(f"flexible={flexible!r} is not known. {nearest(flexible, FLEXIBLE_MAPPINGS)}")
    with _silent():
        try:
            raw, to_raw = _exudyn_matrices(assembly, flexible)
        except (exu.ExudynError, RuntimeError) as error:
            raise EngineError(f"Exudyn refused the model: {error}") from error
    M, K, C = (to_raw.T @ matrix @ to_raw for matrix in raw)
    limit = ASYMMETRY_LIMIT[flexible]
    K_size = stiffness_size(assembly)
    return FullMatrices(
        M=_symmetric(M, "M", limit, np.abs(np.diag(M))),
        # Exudyn finds the velocity Jacobian of the gyroscopic terms by differences, about 1e-10 rad/s beside rest.
        C=_symmetric(C, "C", limit, damping_size(assembly) + GYROSCOPIC_RATE * np.abs(np.diag(M))),
        K=_symmetric(K, "K", limit, K_size),
        K_size=K_size,
    )


def _symmetric(matrix: Array, letter: str, limit: float, size: Array) -> Array:
    """Return the symmetric part after checking that nothing but rounding is lost.

    Parameters
    ----------
    size : (N,) scale of each diagonal entry before anything cancels in it.
    """
    asymmetry = np.abs(matrix - matrix.T)
    if not np.isfinite(matrix).all() or (asymmetry > limit * np.sqrt(np.outer(size, size))).any():
        raise EngineError(
            f"Exudyn's {letter} is unsymmetric (by up to {asymmetry.max():.2g}) or not finite; please report the model."
        )
    symmetric: Array = 0.5 * (matrix + matrix.T)
    return symmetric


def _exudyn_matrices(assembly: Assembly, flexible: FlexibleMapping) -> tuple[list[Array], Array]:
    container = exu.SystemContainer()
    builder = _Builder(assembly, container.AddSystem(), flexible)
    builder.build()
    settings = exu.SimulationSettings()
    # Dense Jacobians of 500 bodies take minutes, sparse ones a fraction of a second; the numbers are the same.
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    raw = builder.mbs.ComputeLinearizedSystem(simulationSettings=settings)[:3]
    return [np.asarray(m, dtype=float) for m in raw], builder.to_raw()


class _Builder:
    """One pass over an assembly that adds its Exudyn nodes, objects and markers."""

    def __init__(self, assembly: Assembly, mbs: Any, flexible: FlexibleMapping) -> None:
        self.assembly = assembly
        self.mbs = mbs
        self.flexible = flexible
        self.nodes: dict[str, int] = {}
        self.objects: dict[str, int] = {}
        self.floating: dict[str, FloatingFrame] = {}
        self.floating_nodes: dict[str, tuple[int, int]] = {}

    def build(self) -> None:
        for item in [*self.assembly.bodies, *self.assembly.fixations]:
            if self.assembly.axis is not None:
                self._add_inertia_1d(item.name, item.inertia if isinstance(item, Inertia1D) else 0.0)
            elif isinstance(item, RigidBody):
                self._add_rigid_body(item)
            elif isinstance(item, Fixation):
                self._add_fixation(item)
            elif isinstance(item, FlexibleBody):
                if self.flexible == "floating-frame":
                    self._add_floating_frame(item)
                else:
                    self._add_small_deflection(item)
        for joint in self.assembly.joints:
            if joint.stiffness.any() or joint.damping.any():
                self._add_joint(joint)
        self.mbs.Assemble()

    # -- bodies

    def _add_inertia_1d(self, name: str, inertia: float) -> None:
        node = self.mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0]))
        assert self.assembly.axis is not None
        if is_rotation(self.assembly.axis):
            self.mbs.AddObject(eii.ObjectRotationalMass1D(nodeNumber=node, physicsInertia=inertia))
        else:
            self.mbs.AddObject(eii.ObjectMass1D(nodeNumber=node, physicsMass=inertia))
        self.nodes[name] = node

    def _rigid_node(self, position: Array) -> int:
        node: int = self.mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*position, 0.0, 0.0, 0.0]))
        return node

    def _add_rigid_body(self, body: RigidBody) -> None:
        node = self._rigid_node(np.array(body.cog))
        inertia = RigidBodyInertia(mass=body.mass, inertiaTensor=body.inertia_tensor)
        self.nodes[body.name] = node
        self.objects[body.name] = self.mbs.AddObject(
            eii.ObjectRigidBody(nodeNumber=node, physicsMass=body.mass, physicsInertia=inertia.GetInertia6D())
        )

    def _add_fixation(self, fixation: Fixation) -> None:
        # A body without mass: its rows of the Jacobians become the base columns of the linear system.
        node = self._rigid_node(np.array(fixation.position))
        self.nodes[fixation.name] = node
        self.objects[fixation.name] = self.mbs.AddObject(
            eii.ObjectRigidBody(nodeNumber=node, physicsMass=0.0, physicsInertia=[0.0] * 6)
        )

    def _generic_node(self, count: int) -> int:
        zeros = [0.0] * count
        node: int = self.mbs.AddNode(
            eii.NodeGenericODE2(
                numberOfODE2Coordinates=count,
                referenceCoordinates=zeros,
                initialCoordinates=zeros,
                initialCoordinates_t=zeros,
            )
        )
        return node

    def _add_small_deflection(self, body: FlexibleBody) -> None:
        reduced = body.reduced
        nodes = []
        order: list[int] = []
        for interface in reduced.interfaces:
            address = f"{body.name}.{interface}"
            self.nodes[address] = self._rigid_node(self.assembly.frames[address])
            nodes.append(self.nodes[address])
            first = reduced.coordinates.index(f"{interface}.x")
            order += range(first, first + 6)
        modes = [i for i in range(len(reduced.coordinates)) if i not in set(order)]
        if modes:
            self.nodes[body.name] = self._generic_node(len(modes))
            nodes.append(self.nodes[body.name])
        pick = np.ix_(order + modes, order + modes)
        damping = reduced.C if reduced.C is not None else np.zeros_like(reduced.K)
        self.mbs.AddObject(
            eii.ObjectGenericODE2(
                nodeNumbers=nodes,
                massMatrix=reduced.M[pick],
                stiffnessMatrix=reduced.K[pick],
                dampingMatrix=damping[pick],
            )
        )

    def _add_floating_frame(self, body: FlexibleBody) -> None:
        frame = FloatingFrame(body)
        for interface, at in body.reduced.interfaces.items():
            frame.add_cross(interface, np.array(at.position, dtype=float))
        for joint in self.assembly.joints:
            for end in (joint.connection.item1, joint.connection.item2):
                if "." in end and end.split(".", 1)[0] == body.name:
                    frame.add_cross(end.split(".", 1)[1], joint.centre)
        self.floating[body.name] = frame
        rigid = self.mbs.AddNode(eii.NodeRigidBodyEP(referenceCoordinates=[*frame.origin, 1.0, 0.0, 0.0, 0.0]))
        modes = self._generic_node(len(frame.kept))
        self.floating_nodes[body.name] = (rigid, modes)
        self.objects[body.name] = self.mbs.AddObject(
            eii.ObjectFFRFreducedOrder(
                nodeNumbers=[rigid, modes],
                massMatrixReduced=_container(frame.mass_matrix),
                stiffnessMatrixReduced=_container(frame.stiffness),
                dampingMatrixReduced=[] if frame.damping is None else _container(frame.damping),
                modeBasis=frame.mode_basis,
                referencePositions=frame.mesh_points,
                mass=frame.mass,
                inertia=frame.inertia,
                centerOfMass=frame.centre_of_mass,
                mPsiTildePsi=frame.psi_tilde_psi,
                mPsiTildePsiTilde=frame.psi_tilde_psi_tilde,
                mPhitTPsi=frame.phi_psi,
                mPhitTPsiTilde=frame.phi_psi_tilde,
                mXRefTildePsi=frame.x_psi,
                mXRefTildePsiTilde=frame.x_psi_tilde,
                computeFFRFterms=True,
            )
        )

    # -- joints

    def _add_joint(self, joint: Joint) -> None:
        ends = (joint.connection.item1, joint.connection.item2)
        if self.assembly.axis is not None:
            markers = [
                self.mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=self.nodes[end], coordinate=0)) for end in ends
            ]
            self.mbs.AddObject(
                eii.ObjectConnectorCoordinateSpringDamper(
                    markerNumbers=markers, stiffness=joint.stiffness[0, 0], damping=joint.damping[0, 0]
                )
            )
            return
        frames = [self.assembly.frames[end] for end in ends if self._is_node_frame(end)]
        if len(frames) == 2 and np.abs(frames[0] - frames[1]).max() > SAME_POINT:
            self._add_joint_matrix(joint)
            return
        # A marker on a node takes no lever. A marker on a body does; so both ends meet at the node's frame and
        # the stiffness is carried there from the elastic centre.
        meeting = frames[0] if frames else joint.centre
        carry = rigid_transfer(joint.centre - meeting)
        self.mbs.AddObject(
            eii.ObjectConnectorRigidBodySpringDamper(
                markerNumbers=[self._marker(end, meeting, joint.centre) for end in ends],
                stiffness=carry.T @ joint.stiffness @ carry,
                damping=carry.T @ joint.damping @ carry,
                # The intrinsic formulation's Jacobian of the damper is wrong by 20 to 30 % (exudyn 1.13.6).
                intrinsicFormulation=False,
            )
        )

    def _is_node_frame(self, end: str) -> bool:
        return "." in end and self.flexible == "small-deflection"

    def _marker(self, end: str, meeting: Array, centre: Array) -> int:
        marker: int
        if self._is_node_frame(end):
            marker = self.mbs.AddMarker(eii.MarkerNodeRigid(nodeNumber=self.nodes[end]))
        elif "." in end:
            body, interface = end.split(".", 1)
            mesh_nodes = self.floating[body].cross_nodes(interface, centre)
            marker = self.mbs.AddMarker(
                eii.MarkerSuperElementRigid(
                    bodyNumber=self.objects[body],
                    meshNodeNumbers=mesh_nodes,
                    weightingFactors=[1.0 / len(mesh_nodes)] * len(mesh_nodes),
                )
            )
        else:
            local = meeting - self.assembly.frames[end]
            marker = self.mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=self.objects[end], localPosition=local))
        return marker

    def _add_joint_matrix(self, joint: Joint) -> None:
        # Two interface frames at different points: one stiffness matrix over both nodes.
        ends = (joint.connection.item1, joint.connection.item2)
        columns = np.r_[self.assembly.places[ends[0]], self.assembly.places[ends[1]]]
        relative = joint.relative[:, columns]
        self.mbs.AddObject(
            eii.ObjectGenericODE2(
                nodeNumbers=[self.nodes[end] for end in ends],
                massMatrix=np.zeros((12, 12)),
                stiffnessMatrix=relative.T @ joint.stiffness @ relative,
                dampingMatrix=relative.T @ joint.damping @ relative,
            )
        )

    # -- back to the model's coordinates

    def to_raw(self) -> Array:
        """Return the (n_exudyn, n) matrix from the model's coordinates to Exudyn's."""
        assembly = self.assembly
        size = self.mbs.systemData.ODE2Size()
        to_raw = np.zeros((size, len(assembly.names)))

        def rows(node: int) -> list[int]:
            return list(self.mbs.systemData.GetNodeLTGODE2(node))

        for item in [*assembly.bodies, *assembly.fixations]:
            place = assembly.places[item.name]
            if not isinstance(item, FlexibleBody):
                to_raw[rows(self.nodes[item.name]), place] = np.eye(place.stop - place.start)
            elif self.flexible == "floating-frame":
                frame_rows = [row for node in self.floating_nodes[item.name] for row in rows(node)]
                to_raw[frame_rows, place] = self.floating[item.name].to_raw()
            else:
                used: set[int] = set()
                for interface in item.reduced.interfaces:
                    address = f"{item.name}.{interface}"
                    to_raw[rows(self.nodes[address]), assembly.places[address]] = np.eye(6)
                    used.update(range(assembly.places[address].start, assembly.places[address].stop))
                modes = [i for i in range(place.start, place.stop) if i not in used]
                if modes:
                    to_raw[np.ix_(rows(self.nodes[item.name]), modes)] = np.eye(len(modes))
        return to_raw


def _container(matrix: Array) -> Any:
    container = exu.MatrixContainer()
    container.SetWithDenseMatrix(matrix, useDenseMatrix=True)
    return container

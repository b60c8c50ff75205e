"""The design loop of the hybrid mirror module written by hand: Exudyn and scipy without ibsdyn, and numpy alone.

What an engineer who knows the module would write for it and for nothing else: no checks, no names, no units, every
index typed in. Both give the modes, their damping ratios from strain energy, and the same 6 x 6 responses as ibsdyn.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import scipy.linalg

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")

import exudyn as exu
import exudyn.itemInterface as eii  # noqa: N813  # Exudyn's own abbreviation
from exudyn.rigidBodyUtilities import RigidBodyInertia

exu.config.printToConsole = False
exu.config.suppressWarnings = True


def lever(r: np.ndarray) -> np.ndarray:
    """Return the motion of a point at r from a frame, over the frame's six."""
    x, y, z = r
    transfer = np.eye(6)
    transfer[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return transfer


class ByHand:
    """The module with fixed topology: platform, base screws, flexure, tip screws, mirror.

    Parameters
    ----------
    flexure : reduced matrices; base and tip are its first twelve coordinates.
    frames : positions of base and tip [m].
    zetas : damping ratios of base screws, flexure and tip screws.
    """

    def __init__(self, flexure: Any, frames: tuple[np.ndarray, np.ndarray], zetas: tuple[float, float, float]) -> None:
        self.M_flexure, self.K_flexure = np.array(flexure.M), np.array(flexure.K)
        self.frames = frames
        self.zetas = zetas
        self.n = len(self.M_flexure) + 6

    def exudyn(self, p: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Return M and K over flexure, mirror, platform out of Exudyn's Jacobians."""
        mbs = exu.SystemContainer().AddSystem()
        base, tip = (
            mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*frame, 0, 0, 0])) for frame in self.frames
        )
        count = self.n - 18
        modes = mbs.AddNode(
            eii.NodeGenericODE2(
                numberOfODE2Coordinates=count,
                referenceCoordinates=[0.0] * count,
                initialCoordinates=[0.0] * count,
                initialCoordinates_t=[0.0] * count,
            )
        )
        mbs.AddObject(
            eii.ObjectGenericODE2(
                nodeNumbers=[base, tip, modes],
                massMatrix=self.M_flexure,
                stiffnessMatrix=self.K_flexure,
                dampingMatrix=np.zeros_like(self.K_flexure),
            )
        )
        mirror = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*p["cog"], 0, 0, 0]))
        inertia = RigidBodyInertia(mass=p["mass"], inertiaTensor=np.diag(p["inertia"])).GetInertia6D()
        body = mbs.AddObject(eii.ObjectRigidBody(nodeNumber=mirror, physicsMass=p["mass"], physicsInertia=inertia))
        platform = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[0.0] * 6))
        ground = mbs.AddObject(eii.ObjectRigidBody(nodeNumber=platform, physicsMass=0, physicsInertia=[0.0] * 6))
        for node, solid, origin, key, frame in (
            (base, ground, np.zeros(3), "base", self.frames[0]),
            (tip, body, np.array(p["cog"]), "tip", self.frames[1]),
        ):
            markers = [
                mbs.AddMarker(eii.MarkerNodeRigid(nodeNumber=node)),
                mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=solid, localPosition=frame - origin)),
            ]
            carry = lever(p[f"{key} centre"] - frame)
            mbs.AddObject(
                eii.ObjectConnectorRigidBodySpringDamper(
                    markerNumbers=markers,
                    stiffness=carry.T @ np.diag(p[key]) @ carry,
                    damping=np.zeros((6, 6)),
                    intrinsicFormulation=False,
                )
            )
        mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        M, K, _ = (np.asarray(m) for m in mbs.ComputeLinearizedSystem(simulationSettings=settings)[:3])
        return M, K

    def numpy(self, p: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Return the same M and K assembled with numpy."""
        n = self.n
        M, K = np.zeros((n + 6, n + 6)), np.zeros((n + 6, n + 6))
        M[: n - 6, : n - 6], K[: n - 6, : n - 6] = self.M_flexure, self.K_flexure
        M[n - 6 : n, n - 6 : n] = np.diag([p["mass"]] * 3 + list(p["inertia"]))
        for rows, stiffness in zip(self._strains(p), (p["base"], p["tip"]), strict=True):
            K += rows.T @ (np.array(stiffness)[:, None] * rows)
        return M, K

    def _strains(self, p: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        n = self.n
        base, tip = np.zeros((6, n + 6)), np.zeros((6, n + 6))
        base[:, :6] = lever(p["base centre"] - self.frames[0])
        base[:, n:] = -lever(p["base centre"])
        tip[:, 6:12] = -lever(p["tip centre"] - self.frames[1])
        tip[:, n - 6 : n] = lever(p["tip centre"] - p["cog"])
        return base, tip

    def modes_and_responses(
        self, M: np.ndarray, K: np.ndarray, p: dict[str, Any], frequencies: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return frequencies and ratios of all modes, and accelerations of the mirror per acceleration of the platform.

        All modes, not the twenty that are asked for, make the responses exact.
        """
        n = self.n
        squared, shapes = scipy.linalg.eigh(0.5 * (K + K.T)[:n, :n], 0.5 * (M + M.T)[:n, :n])
        energies = []
        for rows, stiffness in zip(self._strains(p), (p["base"], p["tip"]), strict=True):
            energies.append(np.array(stiffness) @ (rows[:, :n] @ shapes) ** 2)
        flexure = np.sum(shapes[: n - 6] * (self.K_flexure @ shapes[: n - 6]), axis=0)
        zeta = self.zetas[0] * energies[0] + self.zetas[1] * flexure + self.zetas[2] * energies[1]
        ratios = zeta / squared
        omega = np.sqrt(squared)
        # The whole module carried along rigidly, and what its inertia leaves behind.
        carried = np.linalg.lstsq(K[:n, :n], -K[:n, n:], rcond=None)[0]
        driven = shapes.T @ (M[:n, :n] @ carried + M[:n, n:])
        w = 2 * np.pi * frequencies
        dynamic = w**2 / (squared[:, None] - w**2 + 2j * (ratios * omega)[:, None] * w)
        seen = shapes[n - 6 : n]
        response = (seen[:, None, :] * driven.T[None]) @ dynamic + carried[n - 6 : n][:, :, None]
        return omega / (2 * np.pi), ratios, response

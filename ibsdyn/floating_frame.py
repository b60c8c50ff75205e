"""A reduced body in a floating frame: what stays constant while the body moves far and deforms little.

The frame sits on the body's first interface, so the deformation has no rigid-body part left in it: it is spanned by
the motion of the other interfaces relative to the first one and by the interior modes. Notation and terms as in
A. Zwölfer, J. Gerstmayr, The nodal-based floating frame of reference formulation with modal reduction, Acta
Mechanica 232 (2021) 835-851.
"""

from __future__ import annotations

import numpy as np

from ibsdyn.axes import Array, rigid_transfer, skew
from ibsdyn.components import FlexibleBody
from ibsdyn.errors import ModelError

# Half the size [m] of the cross of massless mesh points that carries an interface frame.
CROSS = 1e-2

_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


class FloatingFrame:
    """The constant matrices of a flexible body in a frame that floats with its first interface.

    Parameters
    ----------
    body : a free body with its inertia integrals.

    Raises
    ------
    ModelError : the part is held to the ground inside its own matrices, or the integrals are absent.
    """

    def __init__(self, body: FlexibleBody) -> None:
        reduced = body.reduced
        if not reduced.is_free:
            raise ModelError(
                f"flexible body {body.name!r} is fixed to the ground inside its FE export, so it cannot move far: "
                "export it without boundary conditions, or use flexible='small-deflection'."
            )
        if reduced.inertia_integrals is None:
            raise ModelError(
                f"flexible body {body.name!r} has no inertia integrals, which a floating frame needs: reduce it from "
                "a solid FE model with fem_import.reduce, or use flexible='small-deflection'."
            )
        first = next(iter(reduced.interfaces))
        start = reduced.coordinates.index(f"{first}.x")
        self.body = body
        self.origin = np.array(reduced.interfaces[first].position, dtype=float)
        self.frame_columns = np.arange(start, start + 6)
        self.kept = np.setdiff1d(np.arange(len(reduced.coordinates)), self.frame_columns)
        self.mass_matrix = reduced.M[np.ix_(self.kept, self.kept)]
        self.stiffness = reduced.K[np.ix_(self.kept, self.kept)]
        self.damping = None if reduced.C is None else reduced.C[np.ix_(self.kept, self.kept)]
        self._points: list[Array] = []
        self._fields: list[Array] = []
        self._crosses: dict[tuple[str, tuple[float, ...]], list[int]] = {}
        self._integrate()

    def _integrate(self) -> None:
        integrals = self.body.reduced.inertia_integrals
        assert integrals is not None
        mass, o = integrals.mass, self.origin
        p = integrals.translation[:, self.kept]
        first = integrals.rotation[:, :, self.kept] - o[:, None, None] * p[None, :, :]
        second = integrals.flexible[:, :, self.kept[:, None], self.kept[None, :]]
        moment = integrals.first_moment - mass * o
        about = integrals.first_moment
        spread = integrals.second_moment - np.outer(o, about) - np.outer(about, o) + mass * np.outer(o, o)
        count = len(self.kept)
        eye = np.eye(3)
        self.mass = mass
        self.centre_of_mass = moment / mass
        self.inertia = np.trace(spread) * eye - spread
        self.phi_psi = p
        self.phi_psi_tilde = np.hstack([skew(column) for column in p.T]) if count else np.zeros((3, 0))
        # skew(a)^T b = -a x b and skew(a)^T skew(b) = (a.b) I - b a^T, summed over the mass
        self.x_psi = -np.einsum("kpq,pqj->kj", _LEVI_CIVITA, first)
        dots = np.einsum("kkj->j", first)
        self.x_psi_tilde = (dots[None, :, None] * eye[:, None, :] - np.einsum("lkj->kjl", first)).reshape(3, 3 * count)
        self.psi_tilde_psi = -np.einsum("kpq,pqij->ikj", _LEVI_CIVITA, second).reshape(3 * count, count)
        pairs = np.einsum("kkij->ij", second)
        self.psi_tilde_psi_tilde = (
            pairs[:, None, :, None] * eye[None, :, None, :] - np.einsum("lkij->ikjl", second)
        ).reshape(3 * count, 3 * count)

    def add_cross(self, interface: str, point: Array) -> None:
        """Add six massless mesh points around ``point`` that move with an interface frame.

        An averaging marker over them then has exactly the frame's motion at that point, rigid lever included.
        """
        key = (interface, tuple(point))
        if key in self._crosses:
            return
        reduced = self.body.reduced
        start = reduced.coordinates.index(f"{interface}.x")
        frame = np.array(reduced.interfaces[interface].position)
        first = len(self._points)
        for offset in np.vstack([CROSS * np.eye(3), -CROSS * np.eye(3)]):
            field = np.zeros((3, len(reduced.coordinates)))
            field[:, start : start + 6] = rigid_transfer(point + offset - frame)[:3]
            self._points.append(point + offset - self.origin)
            self._fields.append(field[:, self.kept])
        self._crosses[key] = list(range(first, first + 6))

    def cross_nodes(self, interface: str, point: Array) -> list[int]:
        """Return the mesh point numbers of a cross that was added."""
        return self._crosses[interface, tuple(point)]

    @property
    def mesh_points(self) -> Array:
        """The (3 n_points,) reference positions in the frame [m]."""
        return np.concatenate(self._points) if self._points else np.zeros(0)

    @property
    def mode_basis(self) -> Array:
        """The (3 n_points, n_kept) displacement of the mesh points per deformation coordinate."""
        return np.vstack(self._fields) if self._fields else np.zeros((0, len(self.kept)))

    def to_raw(self) -> Array:
        """Return the (7 + n_kept, n) matrix from the body's own coordinates to frame position, Euler parameters
        and deformation, linearised: small rotations are twice the vector part of the Euler parameters."""
        reduced = self.body.reduced
        to_raw = np.zeros((7 + len(self.kept), len(reduced.coordinates)))
        to_raw[:3, self.frame_columns[:3]] = np.eye(3)
        to_raw[4:7, self.frame_columns[3:]] = 0.5 * np.eye(3)
        to_raw[7:, self.kept] = np.eye(len(self.kept))
        rigid = reduced.rigid_body_motion @ rigid_transfer(-self.origin)
        to_raw[7:, self.frame_columns] -= rigid[self.kept]
        return to_raw

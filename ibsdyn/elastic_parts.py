"""What stores strain energy, as rows whose squares are that energy: K = sum of rows^T rows.

An assembled K has lost the digits of what is soft beside what is stiff. Its factors have not: they tell which motions
strain nothing, and the singular values of all rows together are the natural frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import scipy.linalg

from fem_import import ReducedBody
from ibsdyn.assembly import Assembly, Joint
from ibsdyn.axes import Array
from ibsdyn.components import FlexibleBody

# A direction that strains less than this share of the stiffest geometry is free. Stiffness itself plays no part.
FREE_TOLERANCE = 1e-9
# Where the least strain is clearly above that, by an estimate that is right to a factor of ten or so, no direction can
# be free. In between the singular values decide.
HELD = 1e-5
# Eigenvalues of a reduced stiffness, scaled to a unit diagonal, that are below this are rounding of zero.
RIGID_EIGENVALUE = 1e-13


@dataclass(frozen=True, eq=False)
class ElasticPart:
    """A connection or a flexible body.

    Attributes
    ----------
    name : of the component.
    rows : (m, n + n_base) over the independent coordinates, the base's last; |rows q|² is twice the strain energy.
    zeta : relative damping ratio; zero where an explicit damper or an exported C stands in its place.
    viscous : whether such an explicit damper is there.
    """

    name: str
    rows: Array
    zeta: float
    viscous: bool

    def energy(self, shapes: Array) -> Array:
        """Return twice the strain energy of each column of ``shapes`` (n, n_modes), the base at rest."""
        doubled: Array = np.square(self.rows[:, : len(shapes)] @ shapes).sum(axis=0)
        return doubled


def elastic_parts(assembly: Assembly, transform: Array) -> tuple[ElasticPart, ...]:
    """Return the connections and flexible bodies of an assembly.

    Parameters
    ----------
    transform : (N, n + n_base) all coordinates from the independent ones.
    """
    parts = []
    for joint in assembly.joints:
        explicit = joint.connection.damping is not None
        zeta = 0.0 if explicit else joint.connection.zeta
        parts.append(ElasticPart(joint.name, _joint_rows(joint) @ transform, zeta, explicit))
    for body in assembly.bodies:
        if isinstance(body, FlexibleBody):
            explicit = body.reduced.C is not None
            rows = _flexible_rows(body) @ transform[assembly.places[body.name]]
            parts.append(ElasticPart(body.name, rows, 0.0 if explicit else body.zeta, explicit))
    return tuple(parts)


def part_rows(assembly: Assembly, name: str) -> Array:
    """Return the (m, N) rows over all coordinates of one connection or flexible body."""
    for joint in assembly.joints:
        if joint.name == name:
            return _joint_rows(joint)
    body = assembly.items[name]
    assert isinstance(body, FlexibleBody)  # nothing else strains
    own = _flexible_rows(body)
    rows = np.zeros((len(own), len(assembly.names)))
    rows[:, assembly.places[name]] = own
    return rows


def strain_rows(parts: Sequence[ElasticPart], count: int) -> Array:
    """Return the rows of all parts, (m, count), one below the other: K is their square."""
    # The row of zeros is for models that nothing strains: LAPACK takes no empty matrix.
    return np.vstack([*(part.rows for part in parts), np.zeros((1, count))])


def free_motions(rows: Array) -> Array:
    """Return an orthonormal basis (n, r) of the motions of the free coordinates that strain nothing.

    Parameters
    ----------
    rows : (m, n) of all that stores strain energy, over the free coordinates.
    """
    size = np.sqrt(np.einsum("ij,ij->i", rows, rows))[:, None]
    # Every row counts alike: soft beside stiff is still held.
    unit = rows / (size if size.all() else np.where(size > 0, size, 1.0))
    # Most models are held: the condition of the square shows it in a fraction of the time.
    square = unit.T @ unit
    factor, indefinite = scipy.linalg.lapack.dpotrf(square)
    if not indefinite and scipy.linalg.lapack.dpocon(factor, np.abs(square).sum(axis=0).max())[0] > HELD**2:
        return np.zeros((rows.shape[1], 0))
    basis: Array = scipy.linalg.null_space(unit, rcond=FREE_TOLERANCE)
    return basis


def stiffness_size(assembly: Assembly) -> Array:
    """Return (N,) what each diagonal of K would be if nothing cancelled: the scale of its rounding."""
    return _size(assembly, [joint.stiffness for joint in assembly.joints], "K")


def damping_size(assembly: Assembly) -> Array:
    """Return (N,) the same of the explicit dampers' C."""
    return _size(assembly, [joint.damping for joint in assembly.joints], "C")


def _size(assembly: Assembly, at_centre: Sequence[Array], letter: str) -> Array:
    size = np.zeros(len(assembly.names))
    for joint, matrix in zip(assembly.joints, at_centre, strict=True):
        diagonal = matrix.diagonal().tolist()  # where the largest entries are: the matrix is positive
        if not any(diagonal):
            continue
        # The ends separately, as their levers may cancel in the relative motion, and every direction with the
        # stiffest one's rounding: rotations and levers mix them before they cancel.
        squares = joint.ends[0] ** 2 + joint.ends[1] ** 2
        size += max(diagonal[:3]) * squares[:3].sum(axis=0)
        if len(matrix) == 6:
            size += (max(diagonal[3:]) + max(diagonal[:3]) * squares[:3].max()) * squares[3:].sum(axis=0)
    for body in assembly.bodies:
        own = getattr(body.reduced, letter) if isinstance(body, FlexibleBody) else None
        if own is not None:
            size[assembly.places[body.name]] += np.diag(own)
    return size


def _joint_rows(joint: Joint) -> Array:
    stiffness = np.array(joint.connection.stiffness)
    strains = (stiffness > 0) & np.isfinite(stiffness)
    rows: Array = np.sqrt(stiffness[strains])[:, None] * joint.deformation[strains]
    return rows


def _flexible_rows(body: FlexibleBody) -> Array:
    """Return the factor of a body's reduced stiffness, taken once: variants of a model share their bodies."""
    known = _FACTORS.get(body.reduced)
    if known is None:
        known = _FACTORS[body.reduced] = _factor(body.reduced)
    return known


def _factor(reduced: ReducedBody) -> Array:
    """Factor a reduced stiffness; that of a free body through its deformation alone, so that rigid motion is exact."""
    K = np.asarray(reduced.K)
    deformation = np.eye(len(K))
    if reduced.is_free:
        first = next(iter(reduced.interfaces))
        start = reduced.coordinates.index(f"{first}.x")
        frame = np.arange(start, start + 6)
        rigid = reduced.rigid_body_motion @ np.linalg.inv(reduced.rigid_body_motion[frame])
        deformation[:, frame] -= rigid
        kept = np.setdiff1d(np.arange(len(K)), frame)
        deformation, K = deformation[kept], K[np.ix_(kept, kept)]
    diagonal = np.diag(K)
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(K / np.outer(scale, scale))
    elastic = values > RIGID_EIGENVALUE * values.max(initial=0.0)
    rows: Array = (np.sqrt(values[elastic])[:, None] * vectors[:, elastic].T * scale) @ deformation
    rows.setflags(write=False)
    return rows


# A reduced body cannot change, so its factor holds as long as it lives.
_FACTORS: WeakKeyDictionary[ReducedBody, Array] = WeakKeyDictionary()

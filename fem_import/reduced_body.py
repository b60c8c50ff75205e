"""ReducedBody: the small matrices of a flexible part, its interfaces and mass properties."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_import.display import DisplayMesh
from fem_import.error_estimate import frequency_errors
from fem_import.errors import ExportError, InterfaceError, UnknownKeywordError
from fem_import.inertia_integrals import InertiaIntegrals
from fem_import.interfaces import check_interface_name
from fem_import.keywords import known_keywords
from fem_import.names import NamedItems
from fem_import.rigid_motion import mass_properties, rigid_motion_at

FloatArray: TypeAlias = NDArray[np.float64]

FRAME_DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
_SYMMETRY = 1e-9
_INDEFINITE = 1e-9
_FREE = 1e-8
USEFUL_SHARE = 1.5
"""Frequencies up to the cut-off over this are right to about 1 % (plain Craig-Bampton, measured)."""


@dataclass(frozen=True, eq=False)
class InterfaceFrame:
    """A frame of a reduced body: position (3,) [m], distance of its farthest node [m], tie, node labels."""

    name: str
    position: FloatArray
    radius: float = 0.0
    tie: str = "rigid"
    node_ids: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        self.position.setflags(write=False)
        self.node_ids.setflags(write=False)


@dataclass(frozen=True, eq=False)
class SensorPoint:
    """A watched point of a reduced body.

    position (3,) [m]; motion (6, n), or (3, n) where only translations are known: of the point per reduced coordinate;
    node_ids: whose mean motion it is.
    """

    name: str
    position: FloatArray
    motion: FloatArray
    node_ids: NDArray[np.int64]

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for array in (self.position, self.motion, self.node_ids):
            array.setflags(write=False)


@dataclass(frozen=True, eq=False, repr=False)
class ReducedBody:
    """A part reduced to frames of six and modal coordinates, SI. Made by `reduce`, `from_arrays` or `load`.

    Attributes
    ----------
    M, K, C : (n, n); C is None where the export had none.
    coordinates : n names: "base.x" ... "base.rz", "tip.x", ..., "mode1", ...
    interfaces : {name: InterfaceFrame}, in that order.
    frequencies : of the interior modes [Hz].
    max_frequency : the cut-off asked for [Hz].
    mass, centre_of_mass, inertia : [kg], (3,) [m], (3, 3) tensor about it [kg m²].
    is_free : whether rigid motion strains nothing.
    source, solver : where it comes from, what solved it.
    inertia_integrals : for a floating frame; None where not known.
    basis : (N, n) deflections of the model's DoF; saved only on demand.
    display : the skin and how it moves, for drawing; None where not known.
    sensors : {name: SensorPoint}, points that are watched without being interfaces.
    dynamic_compliance : (n, n), for `reduction_errors`; None where not known.
    method : how it was reduced.
    findings : doubts about the reduction, in words.

    Raises
    ------
    ExportError : the arrays contradict each other.
    """

    M: FloatArray
    K: FloatArray
    C: FloatArray | None
    interfaces: NamedItems[InterfaceFrame]
    frequencies: FloatArray
    max_frequency: float
    mass: float
    centre_of_mass: FloatArray
    inertia: FloatArray
    is_free: bool
    source: str
    solver: str
    inertia_integrals: InertiaIntegrals | None = None
    basis: FloatArray | None = None
    display: DisplayMesh | None = None
    sensors: NamedItems[SensorPoint] = field(default_factory=lambda: NamedItems("sensor point", {}))
    dynamic_compliance: FloatArray | None = None
    method: str = "given"
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the matrices and freeze all arrays."""
        n_frames = 6 * len(self.interfaces)
        if n_frames == 0:
            raise ExportError("A reduced body needs at least one interface.")
        size = len(self.M)
        if size != n_frames + len(self.frequencies):
            raise ExportError(
                f"M has {size} rows, but {len(self.interfaces)} interfaces and {len(self.frequencies)} modes make "
                f"{n_frames + len(self.frequencies)} coordinates."
            )
        for name in ("M", "K", "C"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _checked_symmetric(name, getattr(self, name), size))
        _refuse_indefinite(self.M, self.K, self.coordinates)
        for sensor in self.sensors.values():
            if sensor.motion.shape not in ((3, size), (6, size)):
                raise ExportError(
                    f"Sensor {sensor.name!r}: motion must be (6, {size}) or (3, {size}); got {sensor.motion.shape}."
                )
        if self.dynamic_compliance is not None and self.dynamic_compliance.shape != (size, size):
            raise ExportError(f"dynamic_compliance must be {(size, size)}; got {self.dynamic_compliance.shape}.")
        for name in ("M", "K", "C", "frequencies", "centre_of_mass", "inertia", "dynamic_compliance"):
            if getattr(self, name) is not None:
                getattr(self, name).setflags(write=False)

    @classmethod
    @known_keywords(UnknownKeywordError)
    def from_arrays(
        cls,
        M: ArrayLike,
        K: ArrayLike,
        interfaces: Mapping[str, ArrayLike],
        C: ArrayLike | None = None,
        *,
        max_frequency: float | None = None,
        source: str = "arrays",
    ) -> ReducedBody:
        """Make a body of a superelement's matrices.

        Parameters
        ----------
        M, K, C : (n, n) SI; rows: six (x y z rx ry rz, global axes) an interface in the order given, then modes
            that leave the interfaces at rest.
        interfaces : {name: position (3,) [m]}.
        max_frequency : up to where it is valid [Hz]; the highest interior mode if None.
        source : what reports call it.

        Raises
        ------
        ExportError, InterfaceError : arrays or positions that cannot be right.

        Notes
        -----
        Mass, CoG and inertia follow from M in rigid motion.
        """
        frames = {}
        for name, position in interfaces.items():
            check_interface_name(name)
            point = _as_floats(f"The position of interface {name!r}", position)
            if point.shape != (3,) or not np.all(np.isfinite(point)):
                raise InterfaceError(f"Interface {name!r}: position must be three finite numbers; got {position!r}.")
            frames[name] = InterfaceFrame(name, point)
        mass_matrix, stiffness = _as_floats("M", M), _as_floats("K", K)
        n_modes = len(np.atleast_1d(mass_matrix)) - 6 * len(frames)
        if n_modes < 0:
            raise ExportError(
                f"M has {len(mass_matrix)} rows, but {len(frames)} interfaces need {6 * len(frames)} coordinates alone."
            )
        for name, matrix in (("M", mass_matrix), ("K", stiffness)):
            if matrix.shape != (len(mass_matrix),) * 2:
                raise ExportError(f"{name} must be square and as large as M; got shape {matrix.shape}.")
        modal = np.arange(6 * len(frames), len(mass_matrix))
        frequencies = _interior_frequencies(mass_matrix[np.ix_(modal, modal)], stiffness[np.ix_(modal, modal)])
        if max_frequency is None:
            max_frequency = float(frequencies.max(initial=0.0))
        motion = frames_in_rigid_motion(list(frames.values()), n_modes)
        properties = mass_properties(motion.T @ mass_matrix @ motion, np.zeros(3))
        return cls(
            M=mass_matrix,
            K=stiffness,
            C=None if C is None else _as_floats("C", C),
            interfaces=NamedItems("interface", frames),
            frequencies=frequencies,
            max_frequency=max_frequency,
            mass=properties.mass,
            centre_of_mass=properties.centre_of_mass,
            inertia=properties.inertia,
            is_free=_strains_nothing(stiffness, motion),
            source=source,
            solver="given",
        )

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the rows of M, K and C."""
        frames = [f"{name}.{direction}" for name in self.interfaces for direction in FRAME_DIRECTIONS]
        return (*frames, *(f"mode{number}" for number in range(1, len(self.frequencies) + 1)))

    @property
    def trusted_frequency(self) -> float:
        """Frequency [Hz] up to which the body serves: the cut-off over 1.5."""
        return self.max_frequency / USEFUL_SHARE

    def reduction_errors(self, frequencies: ArrayLike, shapes: ArrayLike) -> FloatArray | None:
        """Estimate by how much the reduction has raised frequencies, of the body alone or of an assembly with it.

        Parameters
        ----------
        frequencies : (k,) [Hz], positive.
        shapes : (n, k) the body's reduced coordinates in these modes, which have unit modal mass.

        Returns
        -------
        (k,) df/f, as the missing interior modes would lower each frequency; too low an estimate above half of
        ``max_frequency``. None where the body does not know (a superelement of another program).
        """
        if self.dynamic_compliance is None:
            return None
        return frequency_errors(self.dynamic_compliance, self.K, 6 * len(self.interfaces), frequencies, shapes)

    @cached_property
    def checksum(self) -> str:
        """SHA-256 of everything that `save` writes, without the basis: equal for bodies that calculate alike."""
        from fem_import.reduced_body_file import body_checksum  # here: the file module needs this class

        return body_checksum(self)

    @cached_property
    def rigid_body_motion(self) -> FloatArray:
        """Coordinates (n, 6) in rigid translation and small rotation about the global origin; modes rest."""
        motion = frames_in_rigid_motion(list(self.interfaces.values()), len(self.frequencies))
        motion.setflags(write=False)
        return motion

    def __repr__(self) -> str:
        """Return one line: source, interfaces, modes, cut-off, mass."""
        return (
            f"ReducedBody({self.source}: interfaces {', '.join(self.interfaces)}; {len(self.frequencies)} interior "
            f"modes, cut-off {self.max_frequency:.6g} Hz; {self.mass:.6g} kg{'' if self.is_free else ', held'})"
        )

    def __str__(self) -> str:
        """Return a table an engineer reads."""
        centre, moments = self.centre_of_mass, np.diag(self.inertia)
        lines = [
            f"source           {self.source}, solver {self.solver}",
            f"mass             {self.mass:.6g} kg, CoG {centre[0]:.6g}, {centre[1]:.6g}, {centre[2]:.6g} m",
            f"Ixx, Iyy, Izz    {moments[0]:.6g}, {moments[1]:.6g}, {moments[2]:.6g} kg m2 about the CoG",
            f"support          {'free' if self.is_free else 'held to ground in the export'}",
        ]
        for frame in self.interfaces.values():
            x, y, z = frame.position
            lines.append(
                f"interface        {frame.name}: {frame.tie} at {x:.6g}, {y:.6g}, {z:.6g} m, {len(frame.node_ids)} "
                f"nodes within {frame.radius:.4g} m"
            )
        for sensor in self.sensors.values():
            x, y, z = sensor.position
            lines.append(
                f"sensor point     {sensor.name}: at {x:.6g}, {y:.6g}, {z:.6g} m, {len(sensor.node_ids)} nodes, "
                f"{'motion and rotation' if len(sensor.motion) == 6 else 'translations only'}"
            )
        lines.append(
            f"interior modes   {len(self.frequencies)}, cut-off {self.max_frequency:.6g} Hz, trusted up to "
            f"{self.trusted_frequency:.6g} Hz; {self.method}"
        )
        lines += [f"note             {finding}" for finding in self.findings]
        return "\n".join(lines)

    @known_keywords(UnknownKeywordError)
    def save(self, path: str | os.PathLike[str], basis: bool = False) -> None:
        """Write the body as .npz, whole or not at all.

        Parameters
        ----------
        path : of the file.
        basis : write the basis too: as large as the part, and needed only for the MAC of ``fi.mode_check``.

        Raises
        ------
        OSError : the file cannot be written.
        """
        from fem_import.reduced_body_file import write_body  # here: the file module needs this class

        write_body(self, path, basis)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ReducedBody:
        """Read a body that `save` wrote. Raises MissingFileError, ExportError for anything damaged."""
        from fem_import.reduced_body_file import read_body  # here: the file module needs this class

        return read_body(path)


def frames_in_rigid_motion(frames: list[InterfaceFrame], n_modes: int) -> FloatArray:
    """Return (6 n_frames + n_modes, 6): frames in rigid motion about the global origin, modes at rest."""
    blocks = [rigid_motion_at(frame.position, np.zeros(3)) for frame in frames]
    return np.vstack([*blocks, np.zeros((n_modes, 6))])


def _as_floats(name: str, values: Any) -> FloatArray:
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ExportError(f"{name} must be an array of real numbers; {error}.") from None


def _checked_symmetric(name: str, matrix: FloatArray, size: int) -> FloatArray:
    if matrix.shape != (size, size):
        raise ExportError(f"{name} must be {(size, size)}; got {matrix.shape}.")
    if not np.all(np.isfinite(matrix)):
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise ExportError(f"{name}[{row}, {column}] is {matrix[row, column]}; it must be finite.")
    diagonal = np.sqrt(abs(np.diag(matrix)))
    allowed = _SYMMETRY * np.maximum(np.outer(diagonal, diagonal), 1e-6 * diagonal.max(initial=0.0) ** 2)
    difference = abs(matrix - matrix.T)
    if np.any(difference > allowed):
        row, column = np.unravel_index(int(np.argmax(difference - allowed)), matrix.shape)
        raise ExportError(
            f"{name} is not symmetric: [{row}, {column}] is {matrix[row, column]:.6g} and [{column}, {row}] is "
            f"{matrix[column, row]:.6g}."
        )
    return np.asarray(0.5 * (matrix + matrix.T))


def _refuse_indefinite(M: FloatArray, K: FloatArray, coordinates: Sequence[str]) -> None:
    """M must be positive definite, K semi-definite, both scaled to a unit diagonal (m and rad alike)."""
    massless = np.flatnonzero(np.diag(M) == 0.0).tolist()
    if len(massless):
        raise ExportError(
            f"M is not positive definite: {coordinates[massless[0]]} has no mass ({len(massless)} such), which cannot "
            "be integrated in time. Give its node a mass and inertia that is small for the part (CONM2, MASS21, "
            "*MASS, *ROTARY INERTIA). The rotations of a single node of solid elements hold nothing: tie the nodes "
            "of the interface to one reference node (RBE2, RBE3, coupling) and retain that."
        )
    values, vectors = np.linalg.eigh(_unit_diagonal(M))
    if values[0] <= 0.0:
        most = coordinates[int(np.argmax(abs(vectors[:, 0])))]
        raise ExportError(
            f"M is not positive definite: scaled to a unit diagonal it has an eigenvalue {values[0]:.3g}, most of it "
            f"in {most}. Motion without mass cannot be integrated in time; give its node some mass and inertia, or "
            "condense it."
        )
    lowest = np.linalg.eigvalsh(_unit_diagonal(K))[0]
    if np.any(np.diag(K) < 0.0) or lowest < -_INDEFINITE:
        raise ExportError(
            f"K is not positive semi-definite: scaled to a unit diagonal it has an eigenvalue {lowest:.3g}."
        )


def _unit_diagonal(matrix: FloatArray) -> FloatArray:
    diagonal = np.diag(matrix)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    return np.asarray(matrix * np.outer(scale, scale))


def _interior_frequencies(mass: FloatArray, stiffness: FloatArray) -> FloatArray:
    """Return the frequencies [Hz] of the modal rows alone; zeros where the matrices are refused later."""
    if len(mass) == 0:
        return np.empty(0)
    if not (np.all(np.isfinite(mass)) and np.all(np.isfinite(stiffness))) or np.any(np.diag(mass) <= 0.0):
        return np.zeros(len(mass))
    scale = 1.0 / np.sqrt(np.diag(mass))
    values, vectors = np.linalg.eigh(mass * np.outer(scale, scale))
    if values[0] <= 0.0:
        return np.zeros(len(mass))
    root = scale[:, None] * vectors / np.sqrt(values)
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(root.T @ stiffness @ root), 0.0)) / (2.0 * np.pi))


def _strains_nothing(stiffness: FloatArray, motion: FloatArray) -> bool:
    if not np.all(np.isfinite(stiffness)):
        return False
    arm = float(abs(motion[:, 3:]).max(initial=0.0)) or 1.0
    scaled = motion / np.array([1.0, 1.0, 1.0, arm, arm, arm])
    row_sums = abs(stiffness) @ np.max(abs(scaled), axis=1)
    return bool(np.all(abs(stiffness @ scaled) <= _FREE * row_sums[:, None]))

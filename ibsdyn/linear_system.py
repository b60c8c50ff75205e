"""The labelled linear system M x'' + C x' + K x = F of a model, out of Exudyn's Jacobians."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_import.names import ReadOnlyMapping
from ibsdyn.assembly import Assembly
from ibsdyn.axes import Array
from ibsdyn.damping import damping_matrix, modal_diagonal, modal_ratios, strain_energy_shares
from ibsdyn.elastic_parts import ElasticPart, elastic_parts, stiffness_size, strain_rows
from ibsdyn.engine import FlexibleMapping, linearized_matrices
from ibsdyn.errors import EngineError, ModelError, known_keywords
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.harmonic import harmonic_response
from ibsdyn.locks import eliminate_locks
from ibsdyn.modes import Modes, undamped_modes
from ibsdyn.quasi_static import QuasiStaticMotion, quasi_static_motion
from ibsdyn.reduction_trust import warn_of_frequencies_beyond, warn_of_modes_beyond
from ibsdyn.signals import Input, Output, base_column, load_column, sensor_row
from ibsdyn.state_space import StateSpace, state_space

# How far Exudyn's K may be from the components' own: rounding, and in a floating frame numerical differentiation.
STIFFNESS_LIMIT = {"small-deflection": 1e-9, "floating-frame": 1e-4}


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """M x'' + C x' + K x = F - (M_base x_b'' + C_base x_b' + K_base x_b), small motions about the undeformed state.

    Attributes
    ----------
    M, K : (n, n) over the free coordinates; SI.
    coordinates : n names, as ``mirror.rz``, ``flexure.tip.x``, ``flexure.mode1``.
    M_base, K_base : (n, n_base) columns of the prescribed coordinates of the fixations.
    base_coordinates : n_base names, as ``platform.x``.
    redundant_locks : how many locked directions repeat others (the model is over-constrained by as many).
    """

    M: Array
    K: Array
    coordinates: tuple[str, ...]
    M_base: Array
    K_base: Array
    base_coordinates: tuple[str, ...]
    redundant_locks: int
    _assembly: Assembly
    _to_full: Array
    _explicit_damping: Array
    _parts: tuple[ElasticPart, ...]
    _modal: tuple[Array, Array, np.ndarray]
    _shares: dict[str, Array]
    _ratios: Array
    _quasi_static: QuasiStaticMotion

    def __repr__(self) -> str:
        """Name the size and what is in it."""
        return (
            f"LinearSystem({len(self.coordinates)} free coordinates, {len(self.base_coordinates)} base coordinates, "
            f"items: {', '.join(self._assembly.items)})"
        )

    @property
    def C(self) -> Array:
        """(n, n) viscous damping over the free coordinates: explicit dampers and damping ratios."""
        return self._damping[: len(self.coordinates), : len(self.coordinates)]

    @property
    def C_base(self) -> Array:
        """(n, n_base) columns of the same of the prescribed coordinates of the fixations."""
        return self._damping[: len(self.coordinates), len(self.coordinates) :]

    @cached_property
    def _damping(self) -> Array:
        damping = self._explicit_damping + damping_matrix(self.M, self.K_base, *self._modal, self._ratios)
        damping.setflags(write=False)
        return damping

    @cached_property
    def _modes(self) -> Modes:
        omega, shapes, rigid = self._modal
        full = self._to_full[:, : len(self.coordinates)] @ shapes
        ratios = self._ratios
        if any(part.viscous for part in self._parts):
            doubled = modal_diagonal(shapes, self.C)
            ratios = np.where(rigid, 0.0, doubled / (2.0 * np.where(rigid, 1.0, omega)))
        shares = self._shares
        frequencies = omega / (2 * np.pi)
        for array in (frequencies, ratios, full, *shares.values()):
            array.setflags(write=False)  # the modes are kept: what one caller changed the next would see
        return Modes(
            frequencies=frequencies,
            damping_ratios=ratios,
            shapes=shapes,
            coordinates=self.coordinates,
            strain_energy=ReadOnlyMapping(shares),
            rigid=rigid,
            _assembly=self._assembly,
            _full_shapes=full,
        )

    def modes(self) -> Modes:
        """Return the undamped modes with the base at rest, rigid-body modes (0 Hz) included.

        Warns
        -----
        ModelWarning : a mode of the assembly deforms a reduced body near or above its cut-off.
        """
        warn_of_modes_beyond(self._modes)
        return self._modes

    @known_keywords
    def frf(
        self,
        inputs: Input | Sequence[Input],
        outputs: Output | Sequence[Output],
        frequencies: Sequence[float] | Array,
        hysteretic: bool = False,
    ) -> FrequencyResponse:
        """Return the frequency responses from inputs to outputs, e^{+i omega t}.

        Parameters
        ----------
        inputs : Force, Torque, Stroke, BaseMotion; one or several.
        outputs : Sensor or CombinedSensor, one or several; absolute motion unless the sensor has ``relative_to``.
        frequencies : (n_freq,) [Hz].
        hysteretic : use the complex stiffness K_j (1 + 2 i zeta_j) of each part in place of the viscous matrix of
            the damping ratios; explicit dampers stay.

        Returns
        -------
        FrequencyResponse with ``response`` (n_out, n_in, n_freq).

        Raises
        ------
        ModelError : an input or output that the model does not have.
        AnalysisError : frequencies that are none, or at which the response is infinite.

        Warns
        -----
        ModelWarning : frequencies above what the reduction of a flexible body carries.
        """
        response = harmonic_response(self, inputs, outputs, frequencies, hysteretic)
        warn_of_frequencies_beyond(self._assembly, response.frequencies)
        return response

    @known_keywords
    def to_state_space(self, inputs: Input | Sequence[Input], outputs: Output | Sequence[Output]) -> StateSpace:
        """Return A, B, C, D of the same inputs and outputs, for python-control, scipy and MATLAB.

        Raises
        ------
        ModelError : an input or output that the model does not have.
        AnalysisError : an output that needs the derivative of an input (an acceleration under a displacement input).
        """
        return state_space(self, inputs, outputs)

    # What the analyses need of signals, over the independent coordinates.

    def load(self, signal: Input) -> Array:
        """Return the (n,) generalised forces of a unit force, torque or stroke."""
        n = len(self.coordinates)
        column: Array = self._to_full[:, :n].T @ load_column(signal, self._assembly)  # type: ignore[arg-type]  # checked
        return column

    def modal_damping(self) -> Array:
        """Return the (N, N) viscous matrix of the damping ratios over all coordinates of the assembly.

        Of coordinates that locks determine it has none: what they do follows from the independent ones.
        """
        names = self._assembly.names
        places = [names.index(name) for name in (*self.coordinates, *self.base_coordinates)]
        damping = np.zeros((len(names), len(names)))
        natural, shapes, rigid = self._modal
        damping[np.ix_(places, places)] = damping_matrix(self.M, self.K_base, natural, shapes, rigid, self._ratios)
        return damping

    def damping_forces(self) -> dict[str, Array]:
        """Return the forces of connections whose F F^T is the damping of the ratios, where all bodies are rigid.

        Returns
        -------
        By connection (r, n_modes) at its elastic centre on its second end, global axes: those of each mode, times the
        root of 2 zeta_r / omega_r³.
        """
        natural, shapes, rigid = self._modal
        kept = ~rigid
        moved = self._to_full[:, : len(self.coordinates)] @ shapes[:, kept]
        scaled = moved * np.sqrt(2.0 * self._ratios[kept] / natural[kept] ** 3)
        return {joint.name: joint.stiffness @ joint.relative @ scaled for joint in self._assembly.joints}

    def base_motion(self, signal: Input) -> Array:
        """Return the (n_base,) base displacements of a unit motion of a fixation."""
        return base_column(signal, self._assembly)  # type: ignore[arg-type]  # the caller has told it from a force

    def quasi_static_motion(self) -> QuasiStaticMotion:
        """Return how the bodies follow a base that moves infinitely slowly."""
        return self._quasi_static

    def sensors(self, sensors: Sequence[Output]) -> tuple[Array, Array]:
        """Return the displacement rows of sensors over the free (n_out, n) and the base coordinates (n_out, n_base)."""
        rows = np.array([sensor_row(sensor, self._assembly) for sensor in sensors]) @ self._to_full
        n = len(self.coordinates)
        return rows[:, :n], rows[:, n:]


def checked_system(value: object, what: str) -> LinearSystem:
    """Return a linear system; ModelError for anything else, a model that is not linearised above all."""
    if not isinstance(value, LinearSystem):
        raise ModelError(f"{what} takes a linear system, from model.linearize(), got {value!r}.")
    return value


def linearize(assembly: Assembly, flexible: FlexibleMapping = "small-deflection") -> LinearSystem:
    """Return the linear system of an assembly.

    Raises
    ------
    ModelError : locks that contradict each other, or a floating frame without its integrals.
    EngineError : Exudyn refuses the model.
    AnalysisError : a mass matrix that is not positive definite or a stiffness that is indefinite.
    """
    elimination = eliminate_locks(assembly)
    n, transform = len(elimination.free), elimination.to_full
    M, C, K = (_projected(matrix, transform) for matrix in linearized_matrices(assembly, flexible))
    parts = elastic_parts(assembly, transform)
    rows = strain_rows(parts, len(K))
    _refuse_other_stiffness(K, rows, assembly, transform, STIFFNESS_LIMIT[flexible])
    omega, shapes, rigid = undamped_modes(M[:n, :n], rows[:, :n])
    shares = strain_energy_shares(parts, shapes, rigid)
    ratios = modal_ratios(parts, shares, n)
    for matrix in (M, C, K, shapes, omega, rigid):
        matrix.setflags(write=False)
    return LinearSystem(
        M=M[:n, :n],
        K=K[:n, :n],
        coordinates=tuple(assembly.names[place] for place in elimination.free),
        M_base=M[:n, n:],
        K_base=K[:n, n:],
        base_coordinates=tuple(assembly.names[place] for place in elimination.base),
        redundant_locks=elimination.redundant,
        _assembly=assembly,
        _to_full=transform,
        _explicit_damping=C,
        _parts=parts,
        _modal=(omega, shapes, rigid),
        _shares=shares,
        _ratios=ratios,
        _quasi_static=quasi_static_motion(assembly, rows, elimination.independent, n),
    )


def _refuse_other_stiffness(K: Array, rows: Array, assembly: Assembly, transform: Array, limit: float) -> None:
    """Hold Exudyn's stiffness against the strain energy of the parts: two ways to the same matrix."""
    difference = np.abs(K - rows.T @ rows)
    size = np.sqrt(np.abs(K.diagonal()))
    if (difference <= limit * np.outer(size, size)).all():
        return
    # Where something cancelled in the diagonal, rounding is as large as what it is made of.
    size = np.abs(transform.T) @ np.sqrt(stiffness_size(assembly))
    if (difference > limit * np.outer(size, size)).any():
        raise EngineError(
            f"Exudyn's stiffness differs by {difference.max():.2g} from that of the components; "
            "please report the model."
        )


def _projected(matrix: Array, transform: Array) -> Array:
    if len(transform) == transform.shape[1]:  # nothing is locked: the identity
        return matrix
    projected = transform.T @ matrix @ transform
    symmetric: Array = 0.5 * (projected + projected.T)
    return symmetric

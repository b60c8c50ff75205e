"""First derivatives of frequency responses to the parameters of a model, for all parameters at once.

Where all damping comes from ratios, the modal sum is differentiated term by term: residues, frequencies and rates.
Explicit dampers couple the modes; then -lambda^T Z' eta with the adjoint solution lambda of every output.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.harmonic import differentiate, dynamic_compliance, orders
from ibsdyn.mode_derivatives import ModeDerivatives
from ibsdyn.parameter_derivatives import MatrixChange, MotionBasis, lever_derivative
from ibsdyn.parameters import Parameter
from ibsdyn.signals import BaseMotion, CombinedSensor, Force, Input, Output, Stroke, Torque, direction_row

Complex = NDArray[np.complex128]


class ResponseDerivatives:
    """Responses of a system and their derivatives, between chosen inputs and outputs.

    Parameters
    ----------
    basis : modes and quasi-static motions of the system.
    parameters, changes, modes : P parameters and what they do.
    inputs, outputs : n_in and n_out signals.
    """

    def __init__(
        self,
        basis: MotionBasis,
        parameters: Sequence[Parameter],
        changes: Sequence[MatrixChange],
        modes: ModeDerivatives,
        inputs: Sequence[Input],
        outputs: Sequence[Output],
    ) -> None:
        self._basis = basis
        self._changes = changes
        self._modes = modes
        n, size, count = basis.n, basis.size, len(parameters)
        system = basis.system
        self._orders = orders(inputs, outputs)
        # Sensors over modes and base motions; loads on modes; base motions: each with its derivatives.
        self._rows = np.hstack(system.sensors(outputs)) @ basis.vectors
        self._row_changes = np.zeros((count, len(outputs), size))
        self._loads = np.zeros((n, len(inputs)))
        self._load_changes = np.zeros((count, n, len(inputs)))
        self._base = np.zeros((size - n, len(inputs)))
        self._base_changes = np.zeros((count, size - n, len(inputs)))
        shapes = basis.vectors[:n, :n]
        for i, source in enumerate(inputs):
            if isinstance(source, BaseMotion):
                self._base[:, i] = system.base_motion(source)
            else:
                self._loads[:, i] = shapes.T @ system.load(source)
        # A parameter that has the very same change as an earlier one has the same derivatives.
        first: dict[int, int] = {}
        self._same = [first.setdefault(id(change), p) for p, change in enumerate(changes)]
        for p, (parameter, change) in enumerate(zip(parameters, changes, strict=True)):
            moves = parameter.kind == "place" and parameter.component in basis.assembly.items
            for o, sensor in enumerate(outputs):
                if moves:
                    self._row_changes[p, o] = _sensor_change(basis, parameter, sensor)
                if change.motion is not None:
                    self._row_changes[p, o] += basis.sensor_row(sensor) @ change.motion
            for i, source in enumerate(inputs):
                if not isinstance(source, BaseMotion):
                    self._load_changes[p, :, i] = _load_change(basis, parameter, source)
                    if change.motion is not None:
                        self._load_changes[p, :, i] += basis.load_column(source) @ change.motion[:, :n]
                elif moves:
                    self._base_changes[p, :, i] = _base_change(basis, parameter, source)

    def at(self, frequencies: Array) -> tuple[Complex, Complex]:
        """Return responses (n_out, n_in, n_freq) and derivatives (P, n_out, n_in, n_freq) at frequencies [Hz]."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # 0 Hz: the caller sees what is infinite
            if self._basis.explicit.any():
                response, derivatives = self._coupled(2 * np.pi * frequencies)
            else:
                response, derivatives = self._modal_sum(2 * np.pi * frequencies), self._modal(2 * np.pi * frequencies)
            for values in (response, derivatives):
                differentiate(values, 2j * np.pi * frequencies, self._orders)
            return response, derivatives

    def derivatives_at(self, frequencies: Array) -> Complex:
        """Return the derivatives alone, (P, n_out, n_in, n_freq), at frequencies [Hz]."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            omega = 2 * np.pi * frequencies
            derivatives = self._coupled(omega)[1] if self._basis.explicit.any() else self._modal(omega)
            differentiate(derivatives, 1j * omega, self._orders)
            return derivatives

    @cached_property
    def _rates(self) -> Array:
        """2 zeta omega of each mode, zero of rigid-body modes."""
        basis = self._basis
        safe = np.where(basis.rigid, 1.0, basis.omega)
        rates: Array = np.where(basis.rigid, 0.0, 2.0 * np.diag(basis.weighted)[: basis.n] / safe)
        return rates

    def _modal_sum(self, omega: Array) -> Complex:
        n, rows = self._basis.n, self._rows
        inverse = self._inverse(omega)
        response: Complex = np.repeat((rows[:, n:] @ self._base)[:, :, None].astype(complex), len(omega), axis=2)
        for load, factor in ((self._loads, np.ones(1)), (self._basis.base_inertia @ self._base, omega**2)):
            if load.any():
                seen = (rows[:, None, :n] * load.T) @ inverse.view(float)
                response += seen.view(complex) * factor
        return response

    def _inverse(self, omega: Array) -> Complex:
        """Return the (n, n_freq) dynamic compliance of each mode."""
        natural = self._basis.omega**2 + 0j
        return dynamic_compliance(natural, self._rates, omega, 1.0)

    def _modal(self, omega: Array) -> Complex:
        basis, modes = self._basis, self._modes
        n = basis.n
        rows, base_rows = self._rows[:, :n], self._rows[:, n:]
        safe = np.where(basis.rigid, 1.0, basis.omega)
        inverse = self._inverse(omega)
        # Derivatives of what each mode shows and of what drives it, shapes included; by power of i omega.
        row_changes = self._row_changes[:, :, :n] + rows @ modes.shapes
        turned = np.swapaxes(modes.shapes, 1, 2)
        K, M, explicit = (
            np.array([getattr(change, name)[:n, n:] for change in self._changes]) for name in ("K", "M", "explicit")
        )
        if basis.system.quasi_static_motion().strain_free:
            K, explicit = np.zeros_like(K), np.zeros_like(explicit)  # whatever changes; what is there is rounding
        static_rate = (self._rates / safe**2)[:, None] * K + explicit
        inertia = basis.base_inertia
        loads = [self._loads, np.zeros_like(self._loads), -inertia @ self._base]
        load_changes = [
            self._load_changes + turned @ loads[0] - K @ self._base,
            -static_rate @ self._base,
            turned @ loads[2] - M @ self._base - inertia @ self._base_changes,
        ]
        direct_changes = self._row_changes[:, :, n:] @ self._base + base_rows @ self._base_changes
        squared = inverse**2
        terms: list[tuple[Array, Complex]] = [(direct_changes[..., None], np.ones((1, len(omega)), dtype=complex))]
        for power in range(3):
            f, df = loads[power], load_changes[power]
            factor = (1j * omega) ** power
            if f.any() or df.any():
                residues = row_changes[:, :, None, :] * f.T + rows[:, None, :] * np.swapaxes(df, 1, 2)[:, None]
                terms.append((residues, inverse * factor))
            if f.any():
                # Repeated frequencies have blocks; both modes of a pair have the same 1 / Z².
                terms.append((-_blocks(rows, modes.eigenvalue_blocks, f), squared * factor))
                terms.append((-_blocks(rows, modes.damping_blocks, f), squared * (factor * 1j * omega)))
        return _sum_of_products(terms, self._same)

    def _coupled(self, omega: Array) -> tuple[Complex, Complex]:
        basis = self._basis
        n, size = basis.n, basis.size
        s = 1j * omega
        safe, rate = np.where(basis.rigid, 1.0, basis.omega), self._rates
        damping = np.diag(rate) + basis.explicit[:n, :n]
        dynamic = np.diag(basis.omega**2) + s[:, None, None] * damping - (omega**2)[:, None, None] * np.eye(n)
        inverse = np.linalg.inv(dynamic)
        coupling = s[:, None, None] * basis.explicit[:n, n:] - (omega**2)[:, None, None] * basis.base_inertia
        motion = inverse @ (self._loads - coupling @ self._base)
        adjoint = self._rows[:, :n] @ inverse
        whole = np.concatenate([motion, np.broadcast_to(self._base, (len(omega), *self._base.shape))], axis=1)
        response = self._rows @ whole
        derivatives = np.empty((len(self._changes), *self._orders.shape, len(omega)), dtype=complex)
        flat = np.swapaxes(whole, 1, 2).reshape(-1, size)
        for p, change in enumerate(self._changes):
            K, C, M = change.K[:n].copy(), np.zeros((n, size)), change.M[:n]
            K[basis.rigid] = 0.0
            K[:, :n][:, basis.rigid] = 0.0
            C[:, :n] = self._rate_matrix_change(rate, p) + change.explicit[:n, :n]
            C[:, n:] = (rate / safe**2)[:, None] * K[:, n:] + change.explicit[:n, n:]
            parts = [np.swapaxes((flat @ matrix.T).reshape(len(omega), -1, n), 1, 2) for matrix in (K, C, M)]
            forces = parts[0] + s[:, None, None] * parts[1] - (omega**2)[:, None, None] * parts[2]
            forces = self._load_changes[p] - forces - coupling @ self._base_changes[p]
            own = self._row_changes[p] @ whole + self._rows[:, n:] @ self._base_changes[p]
            derivatives[p] = np.moveaxis(own + adjoint @ forces, 0, -1)
        return np.ascontiguousarray(np.moveaxis(response, 0, -1)), derivatives

    def _rate_matrix_change(self, rate: Array, p: int) -> Array:
        """Return the derivative of phi^T C phi, C from ratios, in modes that are held: those turn, C follows them."""
        n = self._basis.n
        follow = self._changes[p].M[:n, :n] + self._modes.shapes[p]
        turning = follow * rate
        change: Array = turning + turning.T + self._modes.damping_blocks[p]
        return change


def _blocks(rows: Array, blocks: Array, loads: Array) -> Array:
    """Return (P, n_out, n_in, n) of rows_g block_gh loads_h, summed over g."""
    shown = rows @ blocks
    residues: Array = shown[:, :, None, :] * loads.T
    return residues


def _sum_of_products(terms: Sequence[tuple[Array, Complex]], same: Sequence[int]) -> Complex:
    """Return the sum of residues (P, n_out, n_in, m) times dynamics (m, n_freq) as real products.

    Each parameter's from the first to the last term that it has; what an earlier one has already, ``same``, is copied.
    """
    residues = np.concatenate([own for own, _ in terms], axis=3)
    dynamic = np.concatenate([own for _, own in terms])
    ends = np.cumsum([0, *(len(own) for _, own in terms)]).tolist()
    has = np.array([own.any(axis=(1, 2, 3)) for own, _ in terms]).T
    spans = [(ends[t[0]], ends[t[-1] + 1]) if len(t) else (0, 0) for t in map(np.flatnonzero, has)]
    result = np.empty((*residues.shape[:3], dynamic.shape[1]), dtype=complex)
    # Neighbours that have the same terms go together.
    for ((first, last), known), group in groupby(range(len(same)), key=lambda p: (spans[p], same[p] < p)):
        run = list(group)
        if known:
            for p in run:
                result[p] = result[same[p]]
        else:
            own = slice(run[0], run[-1] + 1)
            out = result[own].reshape(-1, dynamic.shape[1]).view(float)
            np.matmul(residues[own, ..., first:last].reshape(len(out), -1), dynamic[first:last].view(float), out=out)
    return result


def _moves_along(basis: MotionBasis, parameter: Parameter, item: str) -> bool:
    """Tell whether a parameter moves the point that an item's name stands for: a CoG or a fixation's position."""
    return parameter.kind == "place" and parameter.component == item and item in basis.assembly.items


def _sensor_change(basis: MotionBasis, parameter: Parameter, sensor: Output) -> Array:
    if isinstance(sensor, CombinedSensor):
        parts = [weight * _sensor_change(basis, parameter, part) for weight, part in sensor.parts]
        combined: Array = np.sum(parts, axis=0)
        return combined
    if sensor.position is not None or not _moves_along(basis, parameter, sensor.item):
        return np.zeros(basis.size)
    assembly = basis.assembly
    rows = assembly.motion(sensor.item)
    if sensor.relative_to is not None:
        rows = rows - assembly.motion(sensor.relative_to, assembly.frames[sensor.item])
    change: Array = direction_row(sensor, assembly) @ lever_derivative(parameter.entry, rows) @ basis.motion
    return change


def _load_change(basis: MotionBasis, parameter: Parameter, source: Force | Torque | Stroke) -> Array:
    if isinstance(source, Stroke):
        return basis.stroke_change(parameter, source)
    if not isinstance(source, Force) or source.position is not None:
        return np.zeros(basis.n)
    if not _moves_along(basis, parameter, source.item):
        return np.zeros(basis.n)
    rows = lever_derivative(parameter.entry, basis.assembly.motion(source.item))
    change: Array = direction_row(source, basis.assembly) @ rows @ basis.motion[:, : basis.n]
    return change


def _base_change(basis: MotionBasis, parameter: Parameter, source: BaseMotion) -> Array:
    """Return how the motion of a fixation's frame, held in place, changes as the centre of rotation moves away."""
    assembly = basis.assembly
    if not _moves_along(basis, parameter, source.item):
        return np.zeros(int(assembly.is_base.sum()))
    motion = np.zeros(len(assembly.names))
    motion[assembly.places[source.item]] = -lever_derivative(
        parameter.entry, direction_row(source, assembly)[:, None]
    ).ravel()
    seen: Array = motion[assembly.is_base]
    return seen

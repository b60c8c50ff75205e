"""Harmonic responses of a linear system: one eigenproblem, then every frequency is a matrix product.

The undamped modes diagonalise M and K, and C too where all damping comes from ratios. Explicit dampers couple the
modes; then the first-order form is diagonalised in modal coordinates, where it is well scaled, and checked against a
direct solution. Where its eigenvectors are ill-conditioned, every frequency is solved directly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ibsdyn.axes import Array
from ibsdyn.damping import modal_diagonal
from ibsdyn.errors import AnalysisError
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.quasi_static import QuasiStaticMotion
from ibsdyn.signals import BaseMotion, CombinedSensor, Input, Output, Sensor, Stroke, checked_inputs, checked_outputs

if TYPE_CHECKING:
    from ibsdyn.linear_system import LinearSystem

Complex = NDArray[np.complexfloating]
# Solver(loads, rows, weights): loads (n, m), rows (p, n) in modal coordinates, weights (n_freq,) or 1
# -> (p, m, n_freq) of weights times rows D(omega)^-1 loads
Solver = Callable[[Complex, Array, NDArray[np.floating] | float], Complex]

# Beyond this the eigenvectors of the first-order form have lost half of the digits.
CONDITION_LIMIT = 1e8
# What the fast way may differ from a direct solution at the frequencies where it is checked.
CHECK_TOLERANCE = 1e-8
# Modal coupling below this share of what it is summed from is rounding.
ROUNDING = 1e-10
CHUNK_BYTES = 64e6
# A block of a diagonal system's frequencies and modes, that of one real array of several; and its frequencies at least.
BLOCK_BYTES, LEAST_BLOCK = 2**16, 32


def harmonic_response(
    system: LinearSystem,
    inputs: Input | Sequence[Input],
    outputs: Output | Sequence[Output],
    frequencies: Sequence[float] | Array,
    hysteretic: bool,
) -> FrequencyResponse:
    """Return the responses of a system; see ``LinearSystem.frf``."""
    sources, sensors = checked_inputs(inputs), checked_outputs(outputs)
    hertz = checked_frequencies(frequencies)
    if not isinstance(hysteretic, bool):
        raise AnalysisError(f"hysteretic must be True or False, got {hysteretic!r}.")
    omega = 2 * np.pi * hertz
    _, shapes, rigid = system._modal
    rows, base_rows = system.sensors(sensors)
    static = system.quasi_static_motion()
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # infinities are refused below, in words
        solver, K_static = _solver(system, omega, hysteretic, static)
        s = 1j * omega
        shape = (len(sensors), len(sources), len(omega))
        response: Complex | None = None
        order = orders(sources, sensors)
        powers, base = _driving(system, sources, K_static, hysteretic)
        for power in range(3):
            driven = np.flatnonzero(powers[power].any(axis=0))
            if len(driven):
                own = order[:, driven] + power
                alike = int(own[0, 0]) if own[0, 0] % 2 == 0 and (own == own[0, 0]).all() else 0
                # As a rule one even, real power of i omega goes with all; the solver has it for nothing.
                seen = solver(powers[power][:, driven], rows @ shapes, (s**alike).real if alike else 1.0)
                differentiate(seen, s, own - alike)
                if len(driven) < len(sources):
                    some, seen = seen, np.zeros(shape, dtype=complex)
                    seen[:, driven] = some
                response = seen if response is None else response + seen
        if response is None:
            response = np.zeros(shape, dtype=complex)
        carried = static.seen_by(rows, base_rows) @ base
        for exponent in set(order[carried != 0.0].tolist()):
            alike = (carried != 0.0) & (order == exponent)
            if exponent == 0:
                response.real += np.where(alike, carried, 0.0)[:, :, None]
            else:
                response[alike] += carried[alike][:, None] * s**exponent
    _refuse_infinite(response, hertz, rigid)
    return FrequencyResponse(
        frequencies=hertz,
        response=np.asarray(response, dtype=np.complex128),
        outputs=tuple(sensor.name for sensor in sensors),
        inputs=tuple(source.name for source in sources),
        output_units=tuple(sensor.unit for sensor in sensors),
        input_units=tuple(source.unit for source in sources),
    )


def modal_response(
    system: LinearSystem, inputs: Sequence[Input], frequencies: Array, hysteretic: bool = False
) -> Complex:
    """Return how the modes answer inputs: what they leave behind a base that moves, in displacement.

    Parameters
    ----------
    inputs : n_in of them.
    frequencies : (n_freq,) above 0 [Hz].
    hysteretic : as in ``LinearSystem.frf``.

    Returns
    -------
    (n_modes, n_in, n_freq) modal coordinates per unit of each input. A sensor sees them through its row times the
    shapes, and besides the base's own motion, carried along quasi-statically.
    """
    omega = 2 * np.pi * frequencies
    solver, K_static = _solver(system, omega, hysteretic, system.quasi_static_motion())
    s = 1j * omega
    powers, _ = _driving(system, inputs, K_static, hysteretic)
    order = np.array([_order(source) for source in inputs])
    eye = np.eye(len(system.coordinates))
    response = np.zeros((len(eye), len(inputs), len(omega)), dtype=complex)
    for power in range(3):
        driven = np.flatnonzero(powers[power].any(axis=0))
        if len(driven):
            exponent = (power - order[driven])[None, :, None]
            response[:, driven] += solver(powers[power][:, driven], eye, 1.0) * s**exponent
    return response


def carried_response(
    system: LinearSystem, inputs: Sequence[Input], outputs: Sequence[Output], frequencies: Array
) -> Complex:
    """Return what outputs see of a base that carries everything along quasi-statically, (n_out, n_in, n_freq)."""
    rows, base_rows = system.sensors(outputs)
    seen = system.quasi_static_motion().seen_by(rows, base_rows) @ _base_motions(system, inputs)
    order = orders(inputs, outputs)
    carried: Complex = seen[:, :, None] * (2j * np.pi * frequencies) ** order[:, :, None]
    return carried


def differentiate(values: Complex, s: Complex, orders: NDArray[np.integer]) -> None:
    """Multiply contiguous (..., n_out, n_in, n_freq) values by (i omega) to the power of their orders, in place."""
    own = set(orders.ravel().tolist())
    for order in own - {0}:
        factor = s**order
        if len(own) > 1:
            values[..., orders == order, :] *= factor
        elif order % 2:
            values *= factor
        else:  # as a rule, and real: a third of the time
            pairs = values.view(float)
            pairs *= np.repeat(factor.real, 2)


def checked_frequencies(frequencies: object) -> Array:
    """Return frequencies [Hz] as an array.

    Raises
    ------
    AnalysisError : empty, not one-dimensional, negative or not finite.
    """
    given = np.asarray(frequencies)
    if given.dtype.kind not in "iuf":
        raise AnalysisError(f"frequencies must be real numbers [Hz], got {frequencies!r}.")
    hertz = np.atleast_1d(given.astype(float))
    if hertz.ndim != 1 or not hertz.size:
        raise AnalysisError(f"frequencies must be a list of numbers [Hz], got shape {hertz.shape}.")
    bad = hertz[~np.isfinite(hertz) | (hertz < 0)]
    if bad.size:
        raise AnalysisError(f"frequencies must be finite and not negative [Hz], got {bad[0]}.")
    return hertz


def _base_motions(system: LinearSystem, sources: Sequence[Input]) -> Array:
    """Return the (n_base, n_in) motions of the base's coordinates per unit of each input's motion."""
    base = np.zeros((len(system.base_coordinates), len(sources)))
    for column, source in enumerate(sources):
        if isinstance(source, BaseMotion):
            base[:, column] = system.base_motion(source)
    return base


def _driving(
    system: LinearSystem, sources: Sequence[Input], K_static: Complex, hysteretic: bool
) -> tuple[Complex, Array]:
    """Return the (3, n, n_in) modal loads by power of i omega, and the (n_base, n_in) motions of the base.

    The motion is the base's own, carried along quasi-statically, plus what is left behind. What is left behind is
    driven by inertia alone, so that it keeps its digits at low frequency, where absolute motions would cancel.
    """
    natural, shapes, _ = system._modal
    static = system.quasi_static_motion()
    n = len(natural)
    powers: Complex = np.zeros((3, n, len(sources)), dtype=complex)
    base = _base_motions(system, sources)
    for column, source in enumerate(sources):
        if not isinstance(source, BaseMotion):
            powers[0, :, column] = shapes.T @ system.load(source)
            if hysteretic and isinstance(source, Stroke):
                # The stroke strains the connection's complex stiffness: a free one moves by the stroke, unlagged.
                zeta = next(part.zeta for part in system._parts if part.name == source.item)
                powers[0, :, column] *= 1 + 2j * zeta
    C_static = system._explicit_damping[:n] @ static.motion
    M_static = system.M @ static.motion[:n] + system.M_base
    for power, matrix in enumerate((K_static, C_static, M_static)):
        if not (static.strain_free and power < 2):
            powers[power] -= shapes.T @ (matrix @ base)
    return powers, base


def orders(inputs: Sequence[Input], outputs: Sequence[Output]) -> NDArray[np.intp]:
    """Return how many times each response differentiates, (n_out, n_in): the output's motion less the input's."""
    shown, given = (np.array([_order(signal) for signal in signals], dtype=np.intp) for signals in (outputs, inputs))
    difference: NDArray[np.intp] = shown[:, None] - given
    return difference


def _order(signal: Input | Output) -> int:
    return signal.order if isinstance(signal, (BaseMotion, Sensor, CombinedSensor)) else 0


def _refuse_infinite(response: Complex, hertz: Array, rigid: np.ndarray) -> None:
    if np.isfinite(response.view(float)).all():
        return
    bad = np.flatnonzero(~np.isfinite(response).all(axis=(0, 1)))
    if hertz[bad[0]] == 0.0:
        cause = (
            "the model has rigid-body modes"
            if rigid.any()
            else "an acceleration or velocity has no static displacement"
        )
        raise AnalysisError(f"at 0 Hz the response is infinite or undefined: {cause}. Start above 0 Hz.")
    raise AnalysisError(
        f"at {hertz[bad[0]]:.6g} Hz the response is infinite: an undamped mode lies exactly there. Give the "
        "connections a damping ratio zeta."
    )


def _solver(system: LinearSystem, omega: Array, hysteretic: bool, static: QuasiStaticMotion) -> tuple[Solver, Complex]:
    """Return the solver in modal coordinates, and the (n, n_base) forces of the quasi-static motion (hysteretic)."""
    natural, shapes, _ = system._modal
    n = len(natural)
    forces: Complex = np.zeros((n, len(system.base_coordinates)), dtype=complex)
    if not hysteretic and not any(part.viscous for part in system._parts):
        # The matrix of damping ratios is diagonal in the modes by construction; what lies beside is rounding.
        return _diagonal_solver(natural**2 + 0j, 2.0 * system._ratios * natural, omega), forces
    stiffness = np.diag(natural**2).astype(complex)
    if hysteretic:
        for part in system._parts:
            if part.zeta:
                deformation = part.rows[:, :n] @ shapes
                stiffness += 2j * part.zeta * (deformation.T @ deformation)
                forces += 2j * part.zeta * (part.rows[:, :n].T @ (part.rows @ static.motion))
        coupling = system._explicit_damping[:n, :n]
        damping = shapes.T @ coupling @ shapes
    else:
        coupling = system.C
        damping = shapes.T @ coupling @ shapes
    # What cancels in a mode leaves rounding of the size of what cancelled: rigid-body modes above all.
    coupled_damping = _without_rounding(damping, modal_diagonal(np.abs(shapes), np.abs(coupling)))
    coupled_stiffness = _without_rounding(stiffness, np.abs(np.diag(stiffness)))
    if _is_diagonal(coupled_damping) and _is_diagonal(coupled_stiffness):
        return _diagonal_solver(np.diag(coupled_stiffness), np.diag(coupled_damping).real, omega), forces
    fast = None
    if not coupled_damping.any():
        fast = _second_order_solver(coupled_stiffness, omega)
    elif not hysteretic:
        fast = _first_order_solver(natural, coupled_damping.real.astype(float), omega)
    direct = _direct_solver(coupled_stiffness, coupled_damping, omega)
    if fast is not None and _agree(fast, coupled_stiffness, coupled_damping, omega):
        return fast, forces
    return direct, forces


def _without_rounding(matrix: NDArray[np.complexfloating] | Array, size: Array) -> Complex:
    """Return a modal matrix without the entries that are rounding beside the (n,) sizes of what they are made of."""
    cleaned = np.array(matrix, dtype=complex)
    cleaned[np.abs(cleaned) <= ROUNDING * np.sqrt(np.outer(size, size))] = 0.0
    return cleaned


def _is_diagonal(matrix: Complex) -> bool:
    return not np.any(matrix - np.diag(np.diag(matrix)))


def _diagonal_solver(stiffness: Complex, damping: NDArray[np.floating], omega: Array) -> Solver:
    n = len(stiffness)
    step = max(LEAST_BLOCK, BLOCK_BYTES // (8 * n))

    def solve(loads: Complex, rows: Array, weights: NDArray[np.floating] | float) -> Complex:
        shape = (len(rows), loads.shape[1], len(omega))
        residues = (rows[:, None, :] * (loads if loads.imag.any() else loads.real).T[None, :, :]).reshape(-1, n)
        result = np.empty((len(residues), len(omega)), dtype=complex)
        # In blocks that stay in the cache: fetching fresh memory would take longer than to calculate.
        for start in range(0, len(omega), step):
            part = slice(start, start + step)
            weighted = weights[part] if isinstance(weights, np.ndarray) else weights
            dynamic = dynamic_compliance(stiffness, damping, omega[part], weighted)
            if np.iscomplexobj(residues):
                np.matmul(residues, dynamic, out=result[:, part])
            else:  # real times complex is one real product, half the work
                np.matmul(residues, dynamic.view(float), out=result[:, part].view(float))
        return result.reshape(shape)

    return solve


def dynamic_compliance(
    stiffness: Complex, damping: NDArray[np.floating], omega: Array, weights: NDArray[np.floating] | float
) -> NDArray[np.complex128]:
    """Return the (n, n_freq) weight / (k - omega² + i omega c); a complex division would take three times as long."""
    real = stiffness.real[:, None] - omega**2
    minus_imaginary = -damping[:, None] * omega
    if stiffness.imag.any():
        minus_imaginary -= stiffness.imag[:, None]
    square = real * real
    square += minus_imaginary * minus_imaginary
    np.divide(weights, square, out=square)
    dynamic = np.empty(square.shape, dtype=complex)
    np.multiply(real, square, out=dynamic.real)
    np.multiply(minus_imaginary, square, out=dynamic.imag)
    return dynamic


def _second_order_solver(stiffness: Complex, omega: Array) -> Solver | None:
    """Diagonalise a complex symmetric stiffness (hysteretic damping); None where that is ill-conditioned."""
    eigenvalues, vectors = np.linalg.eig(stiffness)
    if not np.linalg.cond(vectors) < CONDITION_LIMIT:
        return None
    left = np.linalg.inv(vectors)
    dynamic = 1.0 / (eigenvalues[:, None] - omega**2)

    def solve(loads: Complex, rows: Array, weights: NDArray[np.floating] | float) -> Complex:
        residues = (rows @ vectors)[:, None, :] * (left @ loads).T[None, :, :]
        result: Complex = residues @ (dynamic * weights)
        return result

    return solve


def _first_order_solver(natural: Array, damping: Array, omega: Array) -> Solver | None:
    """Diagonalise the first-order form in modal coordinates; None where that is ill-conditioned.

    Modes that neither strain nor meet a damper have a defective double zero; they are split off and solved in closed
    form, 1 / (-omega²).
    """
    free = (natural == 0) & ~damping.any(axis=0)
    bound = np.flatnonzero(~free)
    w = natural[bound]
    # Scaling displacement by omega makes the undamped part skew-symmetric: its eigenvectors are orthogonal.
    scale = np.where(w > 0, w, np.median(w[w > 0]) if (w > 0).any() else 1.0)
    m = len(bound)
    first_order = np.block(
        [
            [np.zeros((m, m)), np.diag(scale)],
            [np.diag(-(w**2) / scale), -damping[np.ix_(bound, bound)]],
        ]
    )
    poles, vectors = np.linalg.eig(first_order)
    if not np.linalg.cond(vectors) < CONDITION_LIMIT:
        return None
    left = np.linalg.inv(vectors)
    dynamic = 1.0 / (1j * omega[None, :] - poles[:, None])
    rigid_dynamic = -1.0 / omega**2

    def solve(loads: Complex, rows: Array, weights: NDArray[np.floating] | float) -> Complex:
        observed = (rows[:, bound] / scale) @ vectors[:m]
        driven = left[:, m:] @ loads[bound]
        result: Complex = (observed[:, None, :] * driven.T[None, :, :]) @ (dynamic * weights)
        if free.any():
            result = result + (rows[:, free] @ loads[free])[:, :, None] * (rigid_dynamic * weights)
        return result

    return solve


def _direct_solver(stiffness: Complex, damping: Complex, omega: Array) -> Solver:
    n = len(stiffness)
    step = max(1, int(CHUNK_BYTES / (16 * n * n)))
    eye = np.eye(n)

    def solve(loads: Complex, rows: Array, weights: NDArray[np.floating] | float) -> Complex:
        result = np.empty((len(rows), loads.shape[1], len(omega)), dtype=complex)
        for start in range(0, len(omega), step):
            w = omega[start : start + step, None, None]
            dynamic = stiffness - w**2 * eye + 1j * w * damping
            try:
                motion: Complex = np.linalg.solve(dynamic, np.broadcast_to(loads, (len(w), *loads.shape)))
            except np.linalg.LinAlgError:
                motion = np.stack([_solve_or_infinite(matrix, loads) for matrix in dynamic])
            result[:, :, start : start + step] = np.moveaxis(rows @ motion, 0, -1)
        result *= weights
        return result

    return solve


def _solve_or_infinite(matrix: Complex, loads: Complex) -> Complex:
    try:
        solved: Complex = np.linalg.solve(matrix, loads)
    except np.linalg.LinAlgError:
        return np.full(loads.shape, np.inf, dtype=complex)
    return solved


def _agree(fast: Solver, stiffness: Complex, damping: Complex, omega: Array) -> bool:
    """Compare the fast solver with direct solutions at some frequencies, for a fixed set of loads and rows."""
    n = len(stiffness)
    samples = np.unique(np.linspace(0, len(omega) - 1, 5).astype(int))
    rng = np.random.default_rng(0)
    loads, rows = rng.normal(size=(n, 2)).astype(complex), rng.normal(size=(2, n))
    quick = fast(loads, rows, 1.0)[:, :, samples]
    exact = _direct_solver(stiffness, damping, omega[samples])(loads, rows, 1.0)
    error = np.abs(quick - exact).max(axis=(0, 1))
    return bool(np.all(error <= CHECK_TOLERANCE * np.abs(exact).max(axis=(0, 1))))

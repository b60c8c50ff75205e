"""The nonlinear run of a model: excitations in, a record of excitations and sensors out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from ibsdyn.assembly import Assembly, body_mass_matrix
from ibsdyn.axes import Array, is_rotation
from ibsdyn.components import FlexibleBody
from ibsdyn.engine import BaseDrive, FlexibleMapping, LoadDrive, TimeIntegration, TurningDamping, checked_mapping
from ibsdyn.errors import ExcitationError, ModelError, SimulationError, SimulationWarning, warn_user
from ibsdyn.excitation import Excitation, positive, sample_count, sampled
from ibsdyn.generalized_alpha import frequency_error, longest_step
from ibsdyn.linear_system import LinearSystem, linearize
from ibsdyn.multisine import common_period
from ibsdyn.prescribed_motion import displacement_table
from ibsdyn.sensing import parts_of, recorded_items, sensor_signals
from ibsdyn.signals import BaseMotion, Input, Output, checked_inputs, checked_outputs
from ibsdyn.start_state import at_rest, steady_state
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import point

Excitations = Mapping[Input, Excitation | ArrayLike] | Sequence[tuple[Input, Excitation | ArrayLike]]

STARTS = ("steady", "rest")
# The default step: what it may shift the highest excited frequency, and a resonance in shares of its damping ratio. A
# shift by such a share changes the response beside the peak by as much.
HIGHEST_ERROR, SHARE_OF_DAMPING = 2.5e-4, 0.01
# A lightly damped mode would ask for ever shorter steps; below this shift other errors are larger.
LEAST_ERROR = 1e-5
# Ratios below this are rounding: such a mode has no width that a shift could be held against.
UNDAMPED = 1e-9
# What a step may leave unbalanced: a share of the forces at work, and so many times the rounding of positions, below
# which Newton's iteration finds no end (measured: five to ten).
FORCE_SHARE, ROUNDING_LEFT = 1e-8, 30.0
# Forces at this many times the rounding come out with an error of 1e-3, at ten times that with 1e-4 (measured).
SMALLEST_FORCE = 20.0
# What is linear about the undeformed state is told of beyond this rotation [rad]: half a percent of a lever.
FAR = 0.1
# Warnings begin where the default is missed by five.
COARSE = 5.0


@dataclass(frozen=True, eq=False)
class _Task:
    """What is run, checked and completed."""

    inputs: tuple[Input, ...]
    excitations: tuple[Excitation, ...]
    outputs: tuple[Output, ...]
    sample_rate: float
    n_samples: int
    period: int | None


def simulate(
    assembly: Assembly,
    title: str,
    excitations: Excitations,
    sensors: Output | Sequence[Output],
    duration: float | None,
    sample_rate: float | None,
    start: str | None,
    gravity: Sequence[float] | None,
    flexible: FlexibleMapping,
    steps_per_sample: int | None,
    progress: bool,
) -> TimeRecord:
    """Return the record of a run; see ``Model.simulate``."""
    checked_mapping(flexible)
    task = _task(excitations, sensors, duration, sample_rate)
    pull = np.zeros(3) if gravity is None else np.array(point(gravity, "gravity [m/s²]"))
    system = linearize(assembly)
    _refuse_what_cannot_run(assembly, system, pull)
    bases = {i: system.base_motion(s) for i, s in enumerate(task.inputs) if isinstance(s, BaseMotion)}
    loads = {i: system.load(s) for i, s in enumerate(task.inputs) if not isinstance(s, BaseMotion)}
    system.sensors(task.outputs)  # refuses what the model does not have
    sensors_read, weights = parts_of(task.outputs)
    begin = _start(start, task)
    steps = _steps_per_sample(system, task, steps_per_sample)
    step = 1.0 / (task.sample_rate * steps)
    drives: list[BaseDrive | LoadDrive] = []
    tables = []
    for index, (source, excitation) in enumerate(zip(task.inputs, task.excitations, strict=True)):
        if isinstance(source, BaseMotion):
            tables.append(displacement_table(excitation, source.order, steps, source.name))
        else:
            tables.append(excitation.refined(steps))
            drives.append(LoadDrive(source, tables[index]))
    drives += _base_drives(assembly, system, bases, tables, steps * (task.n_samples - 1) + 1)
    if begin == "steady":
        state = steady_state(system, loads, bases, tables, step)
    else:
        state = at_rest(system, loads, bases, tables, step)
    damping = system.modal_damping()
    # What a flexible body's own ratio makes does not turn along.
    rigid = assembly.axis is None and not any(isinstance(item, FlexibleBody) for item in assembly.items.values())
    run = TimeIntegration(
        assembly=assembly,
        flexible=flexible,
        damping=damping,
        turning_damping=TurningDamping(assembly, system.damping_forces()) if rigid and damping.any() else None,
        gravity=pull,
        drives=drives,
        recorded=recorded_items(sensors_read, assembly, flexible),
    )
    tolerance = _tolerance(system, loads, bases, tables, step, pull)
    with _bar(title, steps * (task.n_samples - 1), progress) as bar:
        coordinates, turned = run.run(
            state,
            step,
            steps,
            task.n_samples,
            tolerance,
            lambda made: bar.update(made - bar.n),
        )
    if not rigid:
        _warn_of_large_rotations(turned, assembly, damping, flexible)
    responses = weights @ sensor_signals(sensors_read, coordinates, assembly, flexible)
    driven = [_over(e.samples, task.n_samples) for e in task.excitations]
    signals: tuple[Input | Output, ...] = (*task.inputs, *task.outputs)
    return TimeRecord(
        np.vstack([*driven, responses]),
        [signal.name for signal in signals],
        [signal.unit for signal in signals],
        task.sample_rate,
        period=task.period if task.period is not None and task.period <= task.n_samples else None,
        title=title,
    )


def _task(
    excitations: Excitations,
    sensors: Output | Sequence[Output],
    duration: float | None,
    sample_rate: float | None,
) -> _Task:
    pairs = _pairs(excitations)
    inputs = checked_inputs([source for source, _ in pairs])
    outputs = checked_outputs(sensors)
    names = [signal.name for signal in (*inputs, *outputs)]
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f"simulate: {names.count(name)} inputs or sensors are called {name!r}; give one a name=.")
    rate = _rate([signal for _, signal in pairs], sample_rate)
    signals = tuple(
        signal.at_rate(rate) if isinstance(signal, Excitation) else sampled(signal, rate, f"excitation of {name!r}")
        for (_, signal), name in zip(pairs, names, strict=False)
    )
    if duration is not None:
        count = sample_count(duration, rate, "simulate")
    else:
        count = max(signal.periods * signal.n_samples for signal in signals)
    for signal, name in zip(signals, names, strict=False):
        if not signal.is_periodic and signal.n_samples < count:
            raise ExcitationError(
                f"{signal.name} of {name!r} has {signal.n_samples} samples ({signal.n_samples / rate:g} s), the run "
                f"{count} ({count / rate:g} s); append zeros if nothing acts afterwards, or shorten duration."
            )
    return _Task(inputs, signals, outputs, rate, count, common_period(signals))


def _pairs(excitations: Excitations) -> list[tuple[Input, Excitation | ArrayLike]]:
    listed = list(excitations.items()) if isinstance(excitations, Mapping) else excitations
    if not isinstance(listed, (list, tuple)) or not all(isinstance(p, (list, tuple)) and len(p) == 2 for p in listed):
        raise ModelError(
            "simulate: excitations must be a dict {input: excitation} or a list of pairs (input, excitation), as "
            f"{{ibs.BaseMotion('platform', 'z'): ibs.multisine(...)}}; got {excitations!r}."
        )
    return [(source, signal) for source, signal in listed]


def _rate(signals: Sequence[Excitation | ArrayLike], sample_rate: float | None) -> float:
    if sample_rate is not None:
        return positive(sample_rate, "simulate: sample_rate", "Hz")
    rates = {signal.sample_rate for signal in signals if isinstance(signal, Excitation)}
    if not rates:
        raise ExcitationError("simulate: plain samples do not tell their rate; give sample_rate= [Hz].")
    return max(rates)


def _refuse_what_cannot_run(assembly: Assembly, system: LinearSystem, gravity: Array) -> None:
    if system.redundant_locks:
        raise SimulationError(
            f"{system.redundant_locks} locked directions (inf) repeat others, so a run cannot tell how they share the "
            "load; give them finite stiffnesses, or leave out the ones that are not needed."
        )
    if gravity.any():
        if assembly.axis is not None and is_rotation(assembly.axis):
            raise ModelError(f"gravity: the model is 1-D about {assembly.axis}; weight does not turn it.")
        if system._modal[2].any():
            raise SimulationError(
                "gravity: the model has rigid-body modes, so it falls and has no equilibrium; connect it to a fixation "
                "or leave gravity out."
            )


def _start(start: str | None, task: _Task) -> str:
    periodic = all(excitation.is_periodic for excitation in task.excitations)
    if start is None:
        return "steady" if periodic else "rest"
    if start not in STARTS:
        raise ModelError(f"simulate: start={start!r} is not known; 'steady' or 'rest'.")
    if start == "steady" and not periodic:
        other = next(e.name for e in task.excitations if not e.is_periodic)
        raise ExcitationError(f"simulate: start='steady' needs periodic excitations, but {other} has no period.")
    return start


def steps_needed(system: LinearSystem, excitations: Sequence[Excitation], sample_rate: float) -> int:
    """Return the steps per sample that the excited band and the modes in it need."""
    frequencies, allowed = _allowed_errors(system, excitations, sample_rate)
    return max(1, math.ceil(1.0 / (longest_step(frequencies, allowed) * sample_rate) - 1e-9))


def _allowed_errors(system: LinearSystem, excitations: Sequence[Excitation], sample_rate: float) -> tuple[Array, Array]:
    """Return frequencies [Hz], and by which share the integrator may shift each."""
    highest = max(excitation.band()[1] for excitation in excitations)
    modes = system.modes()
    within = (modes.frequencies > 0) & (modes.frequencies <= (highest if highest > 0 else 0.5 * sample_rate))
    within &= modes.damping_ratios > UNDAMPED
    frequencies = modes.frequencies[within]
    allowed = np.clip(SHARE_OF_DAMPING * modes.damping_ratios[within], LEAST_ERROR, None)
    if highest > 0:
        frequencies, allowed = np.r_[frequencies, highest], np.r_[allowed, HIGHEST_ERROR]
    if not frequencies.size:
        frequencies, allowed = np.array([0.5 * sample_rate]), np.array([HIGHEST_ERROR])
    return frequencies, allowed


def _steps_per_sample(system: LinearSystem, task: _Task, given: int | None) -> int:
    """Return the steps per sample: those asked for, or those that are needed."""
    needed = steps_needed(system, task.excitations, task.sample_rate)
    if given is None:
        return needed
    if not isinstance(given, (int, np.integer)) or isinstance(given, bool) or given < 1:
        raise ModelError(f"simulate: steps_per_sample must be a whole number from 1 on, got {given!r}.")
    step = 1.0 / (task.sample_rate * given)
    frequencies, allowed = _allowed_errors(system, task.excitations, task.sample_rate)
    excess = frequency_error(frequencies, step) / allowed
    if excess.max() > COARSE:
        worst = int(excess.argmax())
        share = 100 * frequency_error(frequencies[worst], step)
        warn_user(
            f"simulate: the step of {step:.3g} s is coarse: at {frequencies[worst]:.4g} Hz it shifts frequencies by "
            f"{share:.2g} %, where {100 * allowed[worst]:.2g} % would do; steps_per_sample={needed} is enough.",
            SimulationWarning,
        )
    return int(given)


def _tolerance(
    system: LinearSystem,
    loads: Mapping[int, Array],
    bases: Mapping[int, Array],
    tables: Sequence[Array],
    step: float,
    gravity: Array,
) -> float:
    """Return the unbalanced force [N or N·m] that a step may leave: a small share of what the excitations bring about.

    Raises
    ------
    SimulationError : the excitations are lost in the rounding of positions.
    """
    n = len(system.coordinates)
    inertia = system.M @ system.quasi_static_motion().motion[:n] + system.M_base
    sizes = [0.0]
    for index, table in enumerate(tables):
        if index in loads:
            sizes.append(float(np.abs(loads[index]).max() * np.std(table)))
        else:
            acceleration = np.diff(table, 2) / step**2
            sizes.append(float(np.abs(inertia @ bases[index]).max() * np.std(acceleration)))
    base_moves = max((float(np.abs(tables[index]).max()) for index in bases), default=0.0)
    rounding = _rounding(system._assembly, base_moves, gravity)
    if 0.0 < max(sizes) < SMALLEST_FORCE * rounding:
        raise SimulationError(
            f"the excitations bring about forces of {max(sizes):.2g} N or N·m only, lost in the rounding of positions "
            f"(stiffness times 1e-16 of the model's size: {rounding:.2g}); make them "
            f"{SMALLEST_FORCE * rounding / max(sizes):.2g} times larger at least. So far down the model is linear: use "
            "linearize().frf(...)."
        )
    return max(FORCE_SHARE * max(sizes), ROUNDING_LEFT * rounding)


def _rounding(assembly: Assembly, base_moves: float, gravity: Array) -> float:
    """Return the force [N or N·m] of rounding: of positions, which the springs multiply, and of weight."""
    # In 3-D springs stretch by differences of positions, in 1-D by those of displacements.
    frames = [float(np.abs(frame).max()) for frame in assembly.frames.values()]
    reach = base_moves + (max(frames) if assembly.axis is None else 0.0)
    stiffness = [np.abs(joint.stiffness) for joint in assembly.joints]
    sizes = [float(k[:3, :3].max()) * reach + float(k[3:, 3:].max(initial=0.0)) for k in stiffness]
    weight = sum(float(np.abs(body_mass_matrix(body)).max()) for body in assembly.bodies) * float(np.abs(gravity).max())
    return float(np.finfo(float).eps) * (max(sizes, default=0.0) + weight)


def _base_drives(
    assembly: Assembly, system: LinearSystem, bases: Mapping[int, Array], tables: Sequence[Array], count: int
) -> list[BaseDrive]:
    """Return the table of each base coordinate that moves: the sum of all inputs that move it."""
    drives = []
    directions = len(assembly.directions)
    for row, coordinate in enumerate(system.base_coordinates):
        moving = [(tables[index], column[row]) for index, column in bases.items() if column[row]]
        if not moving:
            continue
        lengths = {len(table) for table, _ in moving}
        length = lengths.pop() if len(lengths) == 1 else count
        total = sum((share * _over(table, length) for table, share in moving), np.zeros(length))
        drives.append(BaseDrive(coordinate.rsplit(".", 1)[0], row % directions, total))
    return drives


def _warn_of_large_rotations(
    turned: Mapping[str, Array], assembly: Assembly, damping: Array, flexible: FlexibleMapping
) -> None:
    """Warn of items that turned further than what is linear in them allows."""
    far = {name: turns for name, turns in turned.items() if turns.max(initial=0.0) > FAR}
    stiff = {name: turns for name, turns in far.items() if isinstance(assembly.items[name], FlexibleBody)}
    if stiff and flexible == "small-deflection":
        name, angle = _furthest(stiff)
        warn_user(
            f"simulate: {name!r} turns by {angle:.2g} rad, in flexible='small-deflection' an error of about "
            f"{50 * angle**2:.2g} % of its motion; use 'floating-frame'.",
            SimulationWarning,
        )
    damped = {name: turns for name, turns in far.items() if _damping_turns_wrong(damping, assembly, name, turns)}
    if damped:
        name, angle = _furthest(damped)
        warn_user(
            f"simulate: {name!r} turns by {angle:.2g} rad, but damping ratios (zeta) are those of small motions about "
            "the undeformed state: the dampers do not turn along and brake the rotation itself. Give the connections "
            "explicit dampers (damping=), which turn along, or zeta=0.",
            SimulationWarning,
        )


def _damping_turns_wrong(damping: Array, assembly: Assembly, name: str, turns: Array) -> bool:
    """Whether an item that turned has ratios that act otherwise than about its undeformed state.

    Where they brake rotation alone, as on a hinge whose other directions are locked, turning about one axis changes
    nothing.
    """
    acting = np.abs(damping[assembly.places[name]]).max(axis=1)
    if isinstance(assembly.items[name], FlexibleBody):
        return bool(acting.any())
    if acting[:3].max() > UNDAMPED * np.abs(damping).max():
        return True
    return bool(acting[3:].any() and np.sort(turns)[-2] > FAR)


def _furthest(turned: Mapping[str, Array]) -> tuple[str, float]:
    name = max(turned, key=lambda item: float(turned[item].max()))
    return name, float(turned[name].max())


def _over(values: Array, count: int) -> Array:
    """Return ``count`` values, begun again where there are fewer."""
    return np.resize(values, count)


def _bar(title: str, steps: int, progress: bool) -> AbstractContextManager[Any]:
    # disable=None keeps quiet where there is no terminal; short runs need no bar.
    bar: AbstractContextManager[Any] = tqdm(
        total=steps,
        desc=title,
        unit=" steps",
        unit_scale=True,
        delay=1.0,
        leave=False,
        disable=None if progress else True,
    )
    return bar

"""What a newcomer should be told about a model before its results are believed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ibsdyn.assembly import Assembly, reference_point
from ibsdyn.axes import DIRECTIONS, INERTIA_NAMES, Array
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, Item, RigidBody
from ibsdyn.disturbances import AnyDisturbance, Tone
from ibsdyn.elastic_parts import elastic_parts, free_motions, strain_rows
from ibsdyn.errors import ModelError
from ibsdyn.locks import Elimination, eliminate_locks
from ibsdyn.signals import BaseMotion, Input, Output, base_column, load_column, sensor_row
from ibsdyn.validation import in_words

# Bounds between which a precision machine lives; what is outside was probably typed in another unit.
GYRATION_RADIUS = (3e-4, 3.0)
# A body's radius of gyration beside the distance from its CoG to where it is held, either way.
GYRATION_RATIO = 30.0
MASS = (1e-7, 1e5)
FARTHEST_POSITION = 50.0
STIFFNESS_ARM = (1e-6, 5.0)
# Above this a part is no longer lightly damped: modal strain energy and real modes lose their meaning.
HIGH_ZETA = 0.3
# A lever from an interface's frame that is so many times the interface's own radius is probably a mistake.
LEVER_RATIO = 3.0
# What is left of a unit motion below this is rounding.
MOTION_TOLERANCE = 1e-8


def findings(axis: str | None, items: Mapping[str, Item], connections: Mapping[str, Connection]) -> list[str]:
    """Return in words what is suspicious in a list of components; empty if nothing is."""
    if all(isinstance(item, Fixation) for item in items.values()):
        return ["the model is empty: it has no body; add one with rigid_body(...) or flexible_body(...)."]
    assembly = Assembly(items, connections, axis)
    return [
        *_unconnected(items, connections),
        *_holding(assembly),
        *_damping(items, connections),
        *_units(items, connections),
        *_reach(assembly),
        *_ground(items),
    ]


def signal_findings(
    assembly: Assembly,
    inputs: Mapping[str, Input],
    sensors: Mapping[str, Output],
    disturbances: Mapping[str, AnyDisturbance],
) -> list[str]:
    """Return in words which inputs, sensors and disturbances the model cannot use."""
    found = []
    driven = [s for d in disturbances.values() for s in ((d.input,) if isinstance(d, Tone) else d.inputs)]
    for signal in dict.fromkeys((*inputs.values(), *sensors.values(), *driven)):
        try:
            if isinstance(signal, Output):
                sensor_row(signal, assembly)
            elif isinstance(signal, BaseMotion):
                base_column(signal, assembly)
            else:
                load_column(signal, assembly)
        except ModelError as error:
            found.append(str(error))
    return found


def _unconnected(items: Mapping[str, Item], connections: Mapping[str, Connection]) -> list[str]:
    ends = {end for c in connections.values() for end in (c.item1, c.item2)}
    held = {end.split(".", 1)[0] for end in ends}
    found = []
    for name, item in items.items():
        if name not in held:
            what = "holds nothing" if isinstance(item, Fixation) else "is not connected to anything"
            found.append(f"{name} {what}: no connection names it.")
        elif isinstance(item, FlexibleBody):
            unused = [f"{name}.{i}" for i in item.reduced.interfaces if f"{name}.{i}" not in ends]
            if unused:
                found.append(f"{name}: nothing is connected to {in_words(unused)}.")
    return found


def _holding(assembly: Assembly) -> list[str]:
    """Locks that contradict or repeat each other, and directions that nothing holds."""
    try:
        elimination = eliminate_locks(assembly)
    except ModelError as error:
        return [str(error)]
    return [*_redundant(elimination.redundant), *_free_directions(assembly, elimination)]


def _redundant(redundant: int) -> list[str]:
    if not redundant:
        return []
    return [
        f"the model is over-constrained {redundant} times: that many locked directions (inf) repeat others. Real "
        "parts would be forced into place there; give one of the parallel connections a finite stiffness."
    ]


def _free_directions(assembly: Assembly, elimination: Elimination) -> list[str]:
    count = len(elimination.free)
    rows = strain_rows(elastic_parts(assembly, elimination.to_full), elimination.to_full.shape[1])
    null = elimination.to_full[:, :count] @ free_motions(rows[:, :count])
    if not null.shape[1]:
        return []
    connected = {end.split(".", 1)[0] for j in assembly.joints for end in (j.connection.item1, j.connection.item2)}
    found = []
    whole: list[str] = []
    for body in assembly.bodies:
        if body.name not in connected:
            continue
        words = _free_words(assembly, body, null)
        if words == "in all six directions":
            whole.append(body.name)
        elif words:
            found.append(f"{body.name} is free {words}: no stiffness holds it.")
    if whole:
        verb = "is" if len(whole) == 1 else "are"
        found.insert(
            0,
            f"{in_words(whole)} {verb} free in all six directions: no fixation holds on (six rigid-body modes at 0 "
            "Hz).",
        )
    return found


def _free_words(assembly: Assembly, body: Item, null: Array) -> str:
    """Describe the free motions of one body: along axes where they are, else as a rotation or translation."""
    motions = assembly.motion(body.name) @ null
    if assembly.axis is not None:
        return _axis_words([assembly.axis]) if np.abs(motions).max() > MOTION_TOLERANCE else ""
    left, sizes, _ = np.linalg.svd(motions)
    space = left[:, : int((sizes > MOTION_TOLERANCE * max(sizes.max(), 1.0)).sum())]
    if space.shape[1] == 6:
        return "in all six directions"
    pure = [i for i in range(6) if np.linalg.norm(space[i]) > 1 - 1e-9]
    words = _axis_words([DIRECTIONS[i] for i in pure]) if pure else ""
    rest = space - np.eye(6)[:, pure] @ space[pure]
    others, sizes, _ = np.linalg.svd(rest)
    combined = others[:, : space.shape[1] - len(pure)]
    centre = assembly.frames[body.name]
    return " and ".join([w for w in [words] if w] + [_screw_words(v, centre) for v in combined.T])


def _axis_words(directions: list[str]) -> str:
    return in_words([f"to rotate about {d[1]}" if d.startswith("r") else f"to move along {d}" for d in directions])


def _screw_words(motion: Array, centre: Array) -> str:
    shift, turn = motion[:3], motion[3:]
    rate = float(np.linalg.norm(turn))
    if rate < 1e-6 * float(np.linalg.norm(shift)):
        return f"to move along {_vector(_unit(shift))}"
    through = centre + np.cross(turn, shift) / rate**2
    unit = _unit(turn)
    named = [d for d, e in zip("xyz", np.eye(3), strict=True) if np.abs(unit - e).max() < 1e-6]
    line = named[0] if named else f"an axis along {_vector(unit)}"
    return f"to rotate about {line} through {_vector(through)} m"


def _unit(v: Array) -> Array:
    """Return the direction of a line: length 1, its largest component positive."""
    direction: Array = v / (np.linalg.norm(v) * np.sign(v[np.abs(v).argmax()]))
    return direction


def _vector(v: Array) -> str:
    return "(" + ", ".join(f"{0.0 if abs(x) < 5e-7 else x:.4g}" for x in v) + ")"


def _damping(items: Mapping[str, Item], connections: Mapping[str, Connection]) -> list[str]:
    found = []
    damped = False
    for connection in connections.values():
        if connection.damping is not None:
            damped = damped or any(connection.damping)
            if connection.zeta:
                found.append(f"{connection.name}: damping= is given and replaces zeta = {connection.zeta:g}.")
        else:
            damped = damped or connection.zeta > 0
            if connection.zeta > HIGH_ZETA:
                found.append(f"{connection.name}: {high_zeta_words(connection.zeta)}")
    for item in items.values():
        if isinstance(item, FlexibleBody):
            if item.reduced.C is not None:
                damped = True
                if item.zeta:
                    found.append(
                        f"{item.name}: the export brought a damping matrix, which replaces zeta = {item.zeta:g}."
                    )
            else:
                damped = damped or item.zeta > 0
                if item.zeta > HIGH_ZETA:
                    found.append(f"{item.name}: {high_zeta_words(item.zeta)}")
    if not damped:
        found.append(
            "nothing is damped: responses are infinite at the resonances; give the connections a zeta (0.005 to 0.02 "
            "is usual for metal parts and bolted joints)."
        )
    return found


def high_zeta_words(zeta: float) -> str:
    """Return what to say of a damping ratio that is too high to be meant."""
    return (
        f"zeta = {zeta:g} is {100 * zeta:.0f} % of critical damping, beyond what modal damping describes; was a "
        "percentage meant?"
    )


def _units(items: Mapping[str, Item], connections: Mapping[str, Connection]) -> list[str]:
    found = []
    for item in items.values():
        if isinstance(item, RigidBody):
            found += _body_units(item, connections)
        if isinstance(item, FlexibleBody):
            positions = [frame.position for frame in item.reduced.interfaces.values()]
        else:
            positions = [] if isinstance(item, Inertia1D) else [reference_point(item)]
        found += _far(item.name, positions)
    for connection in connections.values():
        found += _far(connection.name, [p for p in (connection.position1, connection.position2) if p is not None])
        found += _arm(connection)
    return found


def _body_units(body: RigidBody, connections: Mapping[str, Connection]) -> list[str]:
    found = []
    if not MASS[0] <= body.mass <= MASS[1]:
        found.append(f"{body.name}: a mass of {body.mass:g} kg is doubtful; units are kg.")
    radii = np.sqrt(np.array(body.inertia[:3]) / body.mass)
    worst = int(np.argmax(np.abs(np.log(radii))))
    if not GYRATION_RADIUS[0] <= radii[worst] <= GYRATION_RADIUS[1]:
        found.append(
            f"{body.name}: {INERTIA_NAMES[worst]} = {body.inertia[worst]:g} kg m² with {body.mass:g} kg means a "
            f"radius of gyration of {radii[worst]:.3g} m, which is doubtful; units are kg m² (1 kg mm² is 1e-6 kg "
            "m²)."
        )
    reach = _reach_of(body, connections)
    largest = float(radii.max())
    if not found and reach > 0 and not 1 / GYRATION_RATIO <= largest / reach <= GYRATION_RATIO:
        found.append(
            f"{body.name}: it is held {reach:.3g} m from its CoG, but its inertia means a radius of gyration of "
            f"{largest:.3g} m; do the units fit each other (m, kg, kg m²)?"
        )
    return found


def _reach_of(body: RigidBody, connections: Mapping[str, Connection]) -> float:
    """Return the largest distance [m] from a body's CoG to a connection of its own; 0 without any."""
    points = [
        position
        for c in connections.values()
        for item, position in ((c.item1, c.position1), (c.item2, c.position2))
        if item == body.name and position is not None
    ]
    return max((float(np.linalg.norm(np.subtract(p, body.cog))) for p in points), default=0.0)


def _far(name: str, positions: Sequence[ArrayLike]) -> list[str]:
    worst = max((float(np.abs(np.asarray(p, dtype=float)).max()) for p in positions), default=0.0)
    if worst <= FARTHEST_POSITION:
        return []
    return [f"{name}: a position of {worst:g} m is doubtful; units are m (were millimetres typed?)."]


def _arm(connection: Connection) -> list[str]:
    if len(connection.stiffness) != 6:
        return []
    finite = [0.0 if math.isinf(k) else k for k in connection.stiffness]
    move, turn = max(finite[:3]), max(finite[3:])
    if not move or not turn:
        return []
    arm = math.sqrt(turn / move)
    if STIFFNESS_ARM[0] <= arm <= STIFFNESS_ARM[1]:
        return []
    return [
        f"{connection.name}: {turn:g} N·m/rad beside {move:g} N/m means springs {arm:.2g} m apart, which is "
        "doubtful; units are N/m and N·m/rad."
    ]


def _reach(assembly: Assembly) -> list[str]:
    if assembly.axis is not None:
        return []
    frames = np.array(list(assembly.frames.values()))
    size = float(np.linalg.norm(frames.max(axis=0) - frames.min(axis=0)))
    found = []
    for joint in assembly.joints:
        first, second = joint.connection.position1, joint.connection.position2
        gap = float(np.linalg.norm(np.subtract(first, second))) if first and second else 0.0
        for end in (joint.connection.item1, joint.connection.item2):
            if "." not in end:
                continue
            body, interface = end.split(".", 1)
            item = assembly.items[body]
            assert isinstance(item, FlexibleBody)
            radius = float(item.reduced.interfaces[interface].radius)
            near = max(LEVER_RATIO * radius, 0.05 * size)
            lever = float(np.linalg.norm(joint.centre - assembly.frames[end]))
            if lever > near:
                found.append(
                    f"{joint.name} acts {1e3 * lever:.3g} mm away from interface {end} (whose radius is "
                    f"{1e3 * radius:.3g} mm), on a rigid lever; is its position right?"
                )
            elif gap > near:
                found.append(
                    f"{joint.name} joins interface {end} (radius {1e3 * radius:.3g} mm) to a place "
                    f"{1e3 * gap:.3g} mm away; does the part lie where the model has it?"
                )
        if gap > 2 * size > 0:
            found.append(
                f"{joint.name}: its two positions are {gap:.3g} m apart in a model of {size:.3g} m; are both in metres?"
            )
    return found


def _ground(items: Mapping[str, Item]) -> list[str]:
    return [
        f"{item.name} is fixed to the ground inside its FE export: a moving fixation does not move that ground."
        for item in items.values()
        if isinstance(item, FlexibleBody) and not item.reduced.is_free
    ]

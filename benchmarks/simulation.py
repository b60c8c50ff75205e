"""Steps a second of `model.simulate` against Exudyn scripts of the same model written by hand.

`python benchmarks/simulation.py` prints ratios (above one: `simulate` is faster). Each ratio is the median over
runs that alternate, so that a busy machine disturbs both alike. `simulate` counts everything it does: linearisation,
start state, translation, the run, the sensors. A script counts its run only.
"""

from __future__ import annotations

import argparse
import functools
import os
import statistics
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ibsdyn as ibs  # first: it keeps Exudyn from reading settings of the user's home

import exudyn as exu  # isort: skip
import exudyn.itemInterface as eii  # isort: skip  # noqa: N813
import numpy as np
from exudyn.FEM import FEMinterface, HCBstaticModeSelection, ObjectFFRFreducedOrderInterface
from exudyn.rigidBodyUtilities import RigidBodyInertia

import fem_import as fi

os.environ.setdefault("OMP_NUM_THREADS", "1")

FLEXURE = Path(__file__).parents[1] / "examples" / "mirror_flexure" / "flexure.inp"
RATE, STEPS_PER_SAMPLE = 2000.0, 10
STEP = 1.0 / (RATE * STEPS_PER_SAMPLE)
STIFFNESS, DAMPING = (1e6, 2e6, 3e6, 4e3, 5e3, 3e3), (50.0, 60.0, 70.0, 0.2, 0.3, 0.2)
INERTIA = (0.01, 0.012, 0.008, 0.001, 0.0, 0.0005)
MIRROR_INERTIA = (1.5e-4, 1.2e-4, 1.0e-4, 1e-5, 0.0, 2e-5)
MOUNT, GLUE = (2e8, 3e8, 2e8, 1e5, 2e5, 1e5), (1e8, 2e8, 1e8, 2e4, 1e4, 3e4)
OFFSET = np.array([0.01, 0.005, 0.0])  # of the mirror from the tip
BASE, GROUND = "base", "ground"
BASE_NODE = 0  # of the scripts, which add it first


def main() -> None:
    """Run all comparisons and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0, help="simulated time of a rigid run")
    parser.add_argument("--repeats", type=int, default=5)
    chosen = parser.parse_args()
    exu.config.printToConsole, exu.config.suppressWarnings = False, True
    samples = int(chosen.seconds * RATE)
    rigid(samples, chosen.repeats)
    flexible(max(samples // 5, 100), chosen.repeats)


def rigid(samples: int, repeats: int) -> None:
    """Three bodies in a row on a base that moves."""
    table = shaking(samples)
    sensor = ibs.Sensor("b2", "x", quantity="displacement")
    dampers, ratios = chain(damping=DAMPING), chain(zeta=0.01)
    for what, directions in (("one direction", ("x",)), ("all six directions", ("x", "y", "z", "rx", "ry", "rz"))):
        ours = functools.partial(simulate, dampers, BASE, directions, sensor, table)
        for how in ("table", "function"):
            by_hand = functools.partial(chain_by_hand, table, len(directions), how)
            compare(f"three rigid bodies, base driven in {what}, script with a {how}", ours, by_hand, repeats)
    ours = functools.partial(simulate, ratios, BASE, ("x",), sensor, table)
    by_hand = functools.partial(chain_by_hand, table, 1, "table", ratios.linearize().modal_damping())
    compare("the same with damping ratios, script with their matrix", ours, by_hand, repeats)


def flexible(samples: int, repeats: int) -> None:
    """A mirror on a flexure in a floating frame, on a platform that moves along z."""
    table = shaking(samples)
    part = fi.read_calculix(FLEXURE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cut-offs below the first mode: the size of the basis is what counts here
        body = fi.reduce(part, {"base": "BASE", "tip": "TIP"}, max_frequency=3000.0)
    model, at = hybrid(body)
    sensor = ibs.Sensor("mirror", "z", quantity="displacement")
    ours = functools.partial(simulate, model, GROUND, ("z",), sensor, table)
    fem = exudyn_reduction(part, len(body.coordinates))
    by_hand = functools.partial(flexure_by_hand, fem, part, at, table)
    compare(f"mirror on a flexure, floating frame, {len(body.coordinates)} coordinates", ours, by_hand, repeats)


def shaking(samples: int) -> np.ndarray:
    """Return the base's displacement at the samples, at rest at both ends."""
    time_ = np.arange(samples) / RATE
    return np.asarray(1e-6 * np.sin(2 * np.pi * 20 * time_) * np.sin(np.pi * time_ / time_[-1]) ** 4)


def compare(what: str, ours: Callable[[], Any], theirs: Callable[[], Any], repeats: int) -> None:
    """Time both in turn and print steps a second, their ratio, and how far the two motions are apart."""
    rates: list[tuple[float, float]] = []
    for _ in range(repeats):
        (a, steps, moved), (b, _, by_hand) = timed(ours), timed(theirs)
        rates.append((steps / a, steps / b))
    ratio = statistics.median(a / b for a, b in rates)
    apart = np.abs(moved - by_hand).max() / np.abs(by_hand).max()
    ours_rate, their_rate = (statistics.median(rate) for rate in zip(*rates, strict=True))
    print(
        f"{what}: {ours_rate:,.0f} steps/s, script {their_rate:,.0f}, ratio {ratio:.2f}; motions differ by {apart:.1e}",
        flush=True,
    )


def timed(run: Callable[[], tuple[float | None, int, np.ndarray]]) -> tuple[float, int, np.ndarray]:
    """Return seconds, steps and the motion; a script tells its own seconds."""
    begin = time.perf_counter()
    seconds, steps, motion = run()
    return (time.perf_counter() - begin if seconds is None else seconds), steps, motion


def simulate(
    model: ibs.Model, base: str, directions: tuple[str, ...], sensor: ibs.Sensor, table: np.ndarray
) -> tuple[None, int, np.ndarray]:
    """Run through ibsdyn."""
    driven = {ibs.BaseMotion(base, direction, "displacement"): table for direction in directions}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # step and cut-off are given: this is about speed
        record = model.simulate(driven, sensor, sample_rate=RATE, steps_per_sample=STEPS_PER_SAMPLE)
    return None, (len(table) - 1) * STEPS_PER_SAMPLE, record.signals[-1]


def chain(damping: tuple[float, ...] | None = None, zeta: float = 0.0) -> ibs.Model:
    """Return three bodies in a row."""
    model = ibs.Model("chain")
    model.fixation(BASE)
    before = BASE
    for i in range(3):
        model.rigid_body(f"b{i}", mass=1.0 + i, cog=(0.02 * i, 0.01, 0.1 * (i + 1)), inertia=INERTIA)
        at = (0.01 * i, 0.0, 0.1 * i + 0.05)
        model.connection(f"s{i}", before, f"b{i}", position1=at, stiffness=STIFFNESS, damping=damping, zeta=zeta)
        before = f"b{i}"
    return model


def hybrid(body: fi.ReducedBody) -> tuple[ibs.Model, dict[str, np.ndarray]]:
    """Return the mirror on its flexure, and where its connections and bodies are."""
    base, tip = (np.array(body.interfaces[name].position) for name in ("base", "tip"))
    model = ibs.Model("hybrid")
    model.fixation(GROUND, position=base)
    model.flexible_body("flexure", body)
    model.rigid_body("mirror", mass=0.3, cog=tip + OFFSET, inertia=MIRROR_INERTIA)
    damping = tuple(1e-6 * k for k in MOUNT)
    model.connection("mount", GROUND, "flexure.base", position1=base, stiffness=MOUNT, damping=damping)
    model.connection("glue", "flexure.tip", "mirror", position2=tip, stiffness=GLUE, damping=damping)
    return model, {"base": base, "tip": tip, "mirror": tip + OFFSET}


# -- the scripts


def prescribed_base(mbs: Any, position: Any, directions: list[int], values: np.ndarray, how: str) -> int:
    """Add a node that is held in all directions and moved along some; return its body."""
    node = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*position, 0, 0, 0]))
    body = mbs.AddObject(eii.ObjectRigidBody(nodeNumber=node, physicsMass=0.0, physicsInertia=[0.0] * 6))
    ground = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))

    def offset(_system: Any, t: float, _item: int, _offset: float) -> float:
        return float(values[round(t / STEP)])

    held = []
    for coordinate in range(6):
        markers = [ground, mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))]
        function = offset if how == "function" and coordinate in directions else 0
        held.append(mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=markers, offsetUserFunction=function)))
    if how == "table":

        def before_step(system: Any, t: float) -> bool:
            for direction in directions:
                system.SetObjectParameter(held[direction], "offset", values[round(t / STEP)])
            return True

        mbs.SetPreStepUserFunction(before_step)
    return int(body)


def spring(mbs: Any, markers: list[int], stiffness: tuple[float, ...], damping: tuple[float, ...]) -> None:
    """Add a spring-damper of six directions."""
    mbs.AddObject(
        eii.ObjectConnectorRigidBodySpringDamper(
            markerNumbers=markers, stiffness=np.diag(stiffness), damping=np.diag(damping), intrinsicFormulation=False
        )
    )


def rigid_body(mbs: Any, mass: float, cog: np.ndarray, inertia: tuple[float, ...]) -> tuple[int, int]:
    """Add a rigid body; return its node and itself."""
    xx, yy, zz, xy, xz, yz = inertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    node = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*cog, 0, 0, 0]))
    six = RigidBodyInertia(mass=mass, inertiaTensor=tensor).GetInertia6D()
    return node, mbs.AddObject(eii.ObjectRigidBody(nodeNumber=node, physicsMass=mass, physicsInertia=six))


def refined(table: np.ndarray) -> np.ndarray:
    """Return the base's displacement at the steps."""
    from scipy.interpolate import make_interp_spline

    return np.asarray(
        make_interp_spline(np.arange(len(table)), table, k=5)(
            np.arange((len(table) - 1) * STEPS_PER_SAMPLE + 1) / STEPS_PER_SAMPLE
        )
    )


def run(mbs: Any, node: int, direction: int, samples: int) -> tuple[float, int, np.ndarray]:
    """Assemble and integrate; return the seconds of the run, its steps and a node's displacement."""
    sensor = mbs.AddSensor(
        eii.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=exu.OutputVariableType.Displacement)
    )
    mbs.Assemble()
    steps = (samples - 1) * STEPS_PER_SAMPLE
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = steps * STEP
    settings.timeIntegration.adaptiveStep = False
    settings.timeIntegration.newton.relativeTolerance = 1e-5
    settings.timeIntegration.newton.absoluteTolerance = 1e-8
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = STEPS_PER_SAMPLE * STEP
    begin = time.perf_counter()
    mbs.SolveDynamic(settings)
    seconds = time.perf_counter() - begin
    return seconds, steps, mbs.GetSensorStoredData(sensor)[:, 1 + direction]


def chain_by_hand(
    table: np.ndarray, directions: int, how: str, damping: np.ndarray | None = None
) -> tuple[float, int, np.ndarray]:
    """Three bodies in a row as a script writes them; with dampers in the springs, or with a damping matrix."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    before, place = prescribed_base(mbs, (0, 0, 0), list(range(directions)), refined(table), how), np.zeros(3)
    nodes = []
    for i in range(3):
        cog, at = np.array([0.02 * i, 0.01, 0.1 * (i + 1)]), np.array([0.01 * i, 0.0, 0.1 * i + 0.05])
        node, body = rigid_body(mbs, 1.0 + i, cog, INERTIA)
        nodes.append(node)
        markers = [
            mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=number, localPosition=at - origin))
            for number, origin in ((before, place), (body, cog))
        ]
        spring(mbs, markers, STIFFNESS, DAMPING if damping is None else (0.0,) * 6)
        before, place = body, cog
    if damping is not None:
        mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[*nodes, BASE_NODE], dampingMatrix=damping))
    return run(mbs, nodes[-1], 0, len(table))


def exudyn_reduction(part: fi.FEModel, coordinates: int) -> FEMinterface:
    """Return Exudyn's own Craig-Bampton reduction of the same part, with as many coordinates."""
    from scipy import sparse

    fem = FEMinterface()
    fem.nodes = {"Position": part.positions}
    order = np.argsort([3 * node + direction for node, direction in zip(*places(part), strict=True)])
    for name, matrix in (("massMatrix", part.M), ("stiffnessMatrix", part.K)):
        sorted_ = sparse.csr_array(matrix)[order][:, order].tocsr()
        setattr(fem, name, sparse.csr_matrix(sorted_))
    fem.nodeSets = []
    nodes = [node_rows(part, name) for name in ("BASE", "TIP")]
    fem.ComputeHurtyCraigBamptonModes(
        boundaryNodesList=nodes,
        nEigenModes=coordinates - 12,
        useSparseSolver=True,
        computationMode=HCBstaticModeSelection.RBE2,
    )
    return fem


def places(part: fi.FEModel) -> tuple[list[int], list[int]]:
    """Return row of the node and direction 0..2 of each degree of freedom."""
    row = {int(label): i for i, label in enumerate(part.node_ids)}
    return [row[int(label)] for label in part.dofs[:, 0]], [int(direction) - 1 for direction in part.dofs[:, 1]]


def node_rows(part: fi.FEModel, name: str) -> list[int]:
    """Return the rows of a node set."""
    row = {int(label): i for i, label in enumerate(part.node_ids)}
    return [row[int(label)] for label in part.node_sets[name]]


def flexure_by_hand(
    fem: FEMinterface, part: fi.FEModel, at: dict[str, np.ndarray], table: np.ndarray
) -> tuple[float, int, np.ndarray]:
    """The mirror on its flexure as a script writes it: Exudyn's interface, averaging markers over the node sets."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = prescribed_base(mbs, at["base"], [2], refined(table), "table")
    cms = ObjectFFRFreducedOrderInterface(fem)
    added = cms.AddObjectFFRFreducedOrder(
        mbs, positionRef=[0, 0, 0], initialVelocity=[0] * 3, initialAngularVelocity=[0] * 3
    )
    node, mirror = rigid_body(mbs, 0.3, at["mirror"], MIRROR_INERTIA)
    ends = []
    for name in ("BASE", "TIP"):
        rows = node_rows(part, name)
        ends.append(
            mbs.AddMarker(
                eii.MarkerSuperElementRigid(
                    bodyNumber=added["oFFRFreducedOrder"],
                    meshNodeNumbers=np.array(rows),
                    weightingFactors=np.full(len(rows), 1.0 / len(rows)),
                )
            )
        )
    damping = tuple(1e-6 * k for k in MOUNT)
    moved = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground, localPosition=[0, 0, 0]))
    glued = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=mirror, localPosition=at["tip"] - at["mirror"]))
    spring(mbs, [moved, ends[0]], MOUNT, damping)
    spring(mbs, [ends[1], glued], GLUE, damping)
    return run(mbs, node, 2, len(table))


if __name__ == "__main__":
    main()

"""Nonlinear runs with a flexible body, in a floating frame and in small deflection."""

from pathlib import Path

import numpy as np
import pytest
from test_simulation import assert_close_channels, frf_errors

import fem_import as fi
import ibsdyn as ibs

FLEXURE = Path(__file__).parents[1] / "examples" / "mirror_flexure" / "flexure.inp"
MAPPINGS = ("floating-frame", "small-deflection")
RATE = 2000.0
LINES = ibs.band_lines(10, 400, 10)
INERTIA = (1.5e-4, 1.2e-4, 1.0e-4, 1e-5, 0, 2e-5)


@pytest.fixture(scope="module")
def reduced():
    return fi.reduce(fi.read_calculix(FLEXURE), {"base": "BASE", "tip": "TIP"}, max_frequency=3000.0)


def hybrid(body):
    """A mirror on a flexure on a mount; neither elastic centre lies in an interface's frame."""
    base, tip = (np.array(body.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("hybrid")
    model.fixation("platform", position=(0, 0, 0))
    model.flexible_body("flexure", body, zeta=0.01)
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0.005, 0.0], inertia=INERTIA)
    mount, glue = (2e8, 3e8, 2e8, 1e5, 2e5, 1e5), (1e8, 2e8, 1e8, 2e4, 1e4, 3e4)
    model.connection("mount", "platform", "flexure.base", position1=base - [0, 0.01, 0], stiffness=mount, zeta=0.01)
    model.connection("glue", "flexure.tip", "mirror", position2=tip + [0.004, 0, 0.002], stiffness=glue, zeta=0.02)
    return model


def clamped(body):
    """The same with both interfaces locked to their neighbours."""
    base, tip = (np.array(body.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("clamped")
    model.fixation("platform", position=base)
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0.005, 0.0], inertia=INERTIA)
    model.connection("flexure", "platform", "mirror", position1=base, position2=tip, stiffness=(1e6,) * 6, zeta=0.01)
    model.replace_with_flexible("flexure", body)
    return model


def point(body):
    return np.array(body.interfaces["tip"].position) + [0.01, 0.02, 0.03]


@pytest.mark.parametrize("flexible", MAPPINGS)
@pytest.mark.parametrize(
    ("source", "amplitude", "seen"),
    [
        (ibs.BaseMotion("platform", "z"), 1e-3, ("z", "ry")),
        (ibs.BaseMotion("platform", "rx", "displacement"), 1e-9, ("y", "z")),
        (ibs.Force("flexure.tip", "z", position=(0, 0, 0.05)), 1e-4, ("z", "ry")),
        (ibs.Force("flexure", "y"), 1e-4, ("x", "rz")),
        (ibs.Torque("flexure", "rx"), 1e-5, ("z", "rx")),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_small_excitation_gives_the_linear_frf(reduced, flexible, source, amplitude, seen):
    sensors = [
        ibs.Sensor("mirror", seen[0]),
        ibs.Sensor("flexure.tip", seen[0], position=point(reduced), quantity="velocity"),
        ibs.Sensor("mirror", seen[1], relative_to="flexure.base", quantity="displacement"),
        ibs.Sensor("flexure", seen[0], quantity="displacement"),  # fewer derivatives than its tip
        ibs.Sensor("flexure.tip", seen[1]),
    ]
    assert frf_errors(hybrid(reduced), source, amplitude, sensors, LINES, RATE, flexible=flexible).max() < 1e-3


@pytest.fixture(scope="module")
def watched():
    """The flexure with two points that are watched: all nodes of its middle, and a single node near the tip."""
    part = fi.read_calculix(FLEXURE)
    frames = [part.positions[np.isin(part.node_ids, part.node_sets[name])].mean(axis=0) for name in ("BASE", "TIP")]
    middle = fi.Plane(0.5 * (frames[0] + frames[1]), frames[1] - frames[0], thickness=4e-3)
    inner = np.setdiff1d(
        part.node_ids[np.linalg.norm(part.positions - frames[1], axis=1) < 0.01], part.node_sets["TIP"]
    )
    ends = {"base": "BASE", "tip": "TIP"}
    return fi.reduce(part, ends, max_frequency=3000.0, sensors={"middle": middle, "probe": int(inner[0])})


@pytest.mark.parametrize("flexible", MAPPINGS)
@pytest.mark.parametrize(
    ("source", "amplitude"),
    [(ibs.BaseMotion("platform", "z"), 1e-3), (ibs.Force("flexure.probe", "y"), 1e-4)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_sensor_points_see_and_carry_what_the_linear_frf_says(watched, flexible, source, amplitude):
    main = source.direction
    sensors = [
        ibs.Sensor("flexure.probe", main),
        ibs.Sensor("flexure.middle", main, quantity="velocity"),
        ibs.Sensor("flexure.middle", {"z": "ry", "y": "rz"}[main], quantity="displacement"),
        ibs.Sensor("flexure.probe", main, quantity="displacement", relative_to="mirror"),
    ]
    assert frf_errors(hybrid(watched), source, amplitude, sensors, LINES, RATE, flexible=flexible).max() < 1e-3


@pytest.mark.parametrize("flexible", MAPPINGS)
def test_interfaces_locked_to_their_neighbours(reduced, flexible):
    sensors = [ibs.Sensor("mirror", "z"), ibs.Sensor("flexure.tip", "ry")]
    errors = frf_errors(
        clamped(reduced), ibs.BaseMotion("platform", "z"), 1e-2, sensors, LINES[::3], RATE, flexible=flexible
    )
    assert errors.max() < 1e-3


def test_both_forms_are_one_at_small_amplitude_and_part_at_large(reduced):
    model = hybrid(reduced)
    sensors = [ibs.Sensor("mirror", d) for d in ("y", "z", "ry")]
    parted = []
    for amplitude in (1e-2, 100.0):
        sine = ibs.multisine(LINES[::4], amplitude, sample_rate=RATE)
        runs = [
            model.simulate({ibs.BaseMotion("platform", "z"): sine}, sensors, flexible=flexible).signals[2:]
            for flexible in MAPPINGS
        ]
        parted.append(np.abs(runs[0] - runs[1]).max() / np.abs(runs[0]).max())
    assert parted[0] < 1e-4
    assert parted[1] > 10 * parted[0]


@pytest.mark.parametrize("flexible", MAPPINGS)
def test_sag_under_gravity_is_the_linear_deflection(reduced, flexible):
    """Weights put on the free coordinates by hand, solved with the linear system's stiffness."""
    model = hybrid(reduced)
    gravity = np.array([3.0, -9.0, 4.0])
    system = model.linearize()
    weight = system.M @ model.assembly().rigid_motion()[: len(system.coordinates), :3] @ gravity
    sag = np.linalg.solve(system.K, weight)
    names = [f"{item}.{d}" for item in ("mirror", "flexure.tip") for d in ("x", "y", "z", "rx", "ry", "rz")]
    sensors = [ibs.Sensor(*name.rsplit(".", 1), quantity="displacement") for name in names]
    record = model.simulate(
        {ibs.Force("mirror", "x"): np.zeros(5)}, sensors, sample_rate=RATE, gravity=gravity, flexible=flexible
    )
    expected = sag[[system.coordinates.index(name) for name in names]]
    for part in (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)):
        scale = np.abs(expected[part]).max()
        np.testing.assert_allclose(record.signals[1:][part, -1], expected[part], atol=1e-3 * scale)


def test_a_floating_frame_turns_far(watched):
    """The platform turns through 0.9 rad: all points of the flexible body go round with it, a little behind."""
    reduced = watched
    model = clamped(reduced)
    base = np.array(reduced.interfaces["base"].position)
    time = np.arange(400) / RATE
    angle = 0.9 * np.sin(np.pi * time / 0.4) ** 2
    spots = {"flexure.tip": point(reduced), "flexure": np.array(reduced.centre_of_mass)}
    spots |= {f"flexure.{name}": sensor.position for name, sensor in reduced.sensors.items()}
    sensors = [
        ibs.Sensor(item, d, position=spot, quantity="displacement") for item, spot in spots.items() for d in "xy"
    ]
    sensors.append(ibs.Sensor("flexure.tip", "rz", quantity="displacement"))
    # Ratios in a model with flexible bodies do not turn along; at this speed they change little.
    with pytest.warns(ibs.SimulationWarning, match=r"turns by 0\.9 rad, but damping ratios"):
        record = model.simulate({ibs.BaseMotion("platform", "rz", "displacement"): angle}, sensors, sample_rate=RATE)
    turn = np.array([[np.cos(angle) - 1, -np.sin(angle)], [np.sin(angle), np.cos(angle) - 1]])
    for k, spot in enumerate(spots.values()):
        circle = np.einsum("ijt,j->it", turn, (spot - base)[:2])
        assert np.abs(circle).max() > 1e-3
        assert_close_channels(record.signals[1 + 2 * k : 3 + 2 * k], circle, 5e-3)
    np.testing.assert_allclose(record.signals[-1], angle, atol=2e-3)
    with pytest.warns(ibs.SimulationWarning, match=r"'flexure' turns by 0\.9 rad, in flexible='small-deflection'"):
        model.simulate(
            {ibs.BaseMotion("platform", "rz", "displacement"): angle},
            sensors,
            sample_rate=RATE,
            flexible="small-deflection",
        )


def test_a_part_that_is_held_inside_its_own_matrices_cannot_float(reduced):
    """K of the reduced part with a spring to the ground added: only small deflection is left."""
    start = reduced.coordinates.index("base.x")
    K = reduced.K.copy()
    K[range(start, start + 6), range(start, start + 6)] += np.array([1e8] * 3 + [1e5] * 3)
    frames = {name: frame.position for name, frame in reduced.interfaces.items()}
    held = fi.ReducedBody.from_arrays(reduced.M, K, interfaces=frames)
    model = ibs.Model("held")
    model.flexible_body("flexure", held, zeta=0.01)
    force, sensor = ibs.Force("flexure.tip", "z"), ibs.Sensor("flexure.tip", "z", quantity="displacement")
    sine = ibs.multisine(LINES[::8], 1e-2, sample_rate=RATE)
    with pytest.raises(ibs.ModelError, match="small-deflection"):
        model.simulate({force: sine}, sensor)
    assert frf_errors(model, force, 1e-2, [sensor], LINES[::8], RATE, flexible="small-deflection")[0] < 1e-3

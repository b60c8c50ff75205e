"""Accelerometers: what they read of a motion, and the way back from six of them to the motion."""

import numpy as np
import pytest
from scipy import signal

import ibsdyn as ibs

GRAVITY = (0.0, 0.0, -9.81)


def _accelerometer(**changes):
    given = {"name": "Y1", "item": "mirror", "position": (0.01, 0.02, 0.03), "direction": "z"}
    return ibs.Accelerometer(**(given | changes))


def _motion(accelerometers, acceleration, rotation, sample_rate=1000.0):
    """A record of the true motion: (3, n) acceleration of every point, (3, n) rotation of the item."""
    sensors = ibs.motion_sensors(accelerometers)
    values = [(rotation if s.is_rotation else acceleration)["xyz".index(s.direction[-1])] for s in sensors]
    return ibs.TimeRecord(values, [s.name for s in sensors], [s.unit for s in sensors], sample_rate)


def test_its_sensor_is_that_of_the_linear_system():
    one = _accelerometer(direction=(0, 0, 2))
    assert one.sensor == ibs.Sensor("mirror", (0, 0, 1), (0.01, 0.02, 0.03), quantity="acceleration", name="Y1")
    assert len(one.motion_sensors) == 6
    # the rotation of an item is asked for once
    assert len(ibs.motion_sensors([one, _accelerometer(name="Y2")])) == 9


def test_cross_axis_senses_the_two_directions_across():
    values = np.array([[1.0, -1.0], [10.0, -10.0], [100.0, -100.0]])
    for direction, expected in (("z", 100 + 0.02 * 1 + 0.05 * 10), ("x", 1 + 0.02 * 10 + 0.05 * 100)):
        one = _accelerometer(direction=direction, cross_axis=(0.02, 0.05))
        np.testing.assert_allclose(one.across @ one.unit_direction, 0, atol=1e-15)
        record = ibs.accelerometer_record(_motion([one], values, 0 * values), one)
        np.testing.assert_allclose(record["Y1"], [expected, -expected])


def test_a_tilt_is_seen_as_g_theta():
    tilt = 1e-4 * np.sin(2 * np.pi * 5 * np.arange(2000) / 1000)
    still = np.zeros((3, 2000))
    turned = np.stack([still[0], tilt, still[0]])
    one = _accelerometer(direction="x", dc_coupled=True)
    # the support pushes up with +g; a turn about +y lowers the end of x by theta, so x feels -g theta
    shown = ibs.accelerometer_record(_motion([one], still, turned), one, gravity=GRAVITY)["Y1"]
    np.testing.assert_allclose(shown, -9.81 * np.sin(tilt), atol=1e-12)


def test_only_dc_coupled_ones_show_constant_gravity():
    still = np.zeros((3, 4))
    for coupled, expected in ((True, 9.81), (False, 0.0)):
        one = _accelerometer(dc_coupled=coupled)
        shown = ibs.accelerometer_record(_motion([one], still, still), one, gravity=GRAVITY)["Y1"]
        np.testing.assert_allclose(shown, expected)


def test_it_turns_with_its_item():
    # turned by 90 degrees about z, an accelerometer along x feels what moves along y
    rotation = np.array([[0.0], [0.0], [np.pi / 2]])
    one = _accelerometer(direction="x", dc_coupled=True)
    shown = ibs.accelerometer_record(_motion([one], np.array([[1.0], [7.0], [0.0]]), rotation), one)["Y1"]
    np.testing.assert_allclose(shown, 7.0)


def test_noise_has_the_density_asked_for_and_follows_the_seed():
    one = _accelerometer(noise_density=3e-4)
    motion = _motion([one], np.zeros((3, 200_000)), np.zeros((3, 200_000)))
    first, again, other = (ibs.accelerometer_record(motion, one, seed=seed)["Y1"] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    _, density = signal.welch(first, fs=1000.0, nperseg=1000)
    assert np.sqrt(density[5:-5].mean()) == pytest.approx(3e-4, rel=0.01)


def test_beyond_its_range_it_clips_and_says_so():
    one = _accelerometer(range=2.0)
    values = np.array([[0.0] * 4, [0.0] * 4, [3.0, -3.0, 1.0, -1.0]])
    with pytest.warns(
        ibs.RecordWarning, match=r"'Y1' goes up to 3 m/s², beyond its range of 2; 2 of 4 samples"
    ) as seen:
        record = ibs.accelerometer_record(_motion([one], values, 0 * values), one)
    np.testing.assert_array_equal(record["Y1"], [2.0, -2.0, 1.0, -1.0])
    assert seen[0].filename == __file__


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"direction": "rz"}, "is a rotation"),
        ({"cross_axis": 5}, "2 % is 0.02"),
        ({"noise_density": -1.0}, "noise_density must not be below 0"),
        ({"range": 0.0}, "range must be above 0"),
        ({"dc_coupled": 1}, "True or False"),
        ({"position": (0, 0)}, "position must be 3 numbers"),
    ],
)
def test_impossible_data_sheets_are_refused(changes, words):
    with pytest.raises(ibs.ModelError, match=words):
        _accelerometer(**changes)


def test_a_record_without_the_motion_says_what_to_simulate():
    record = ibs.TimeRecord([[0.0, 1.0]], ["Y1"], ["m/s²"], 1.0)
    with pytest.raises(ibs.RecordError, match=r"'mirror: true rx' is missing.*motion_sensors"):
        ibs.accelerometer_record(record, _accelerometer())


# --- six accelerometers to six motions ---------------------------------------------------------------------------


def _rigid_readings(accelerometers, q, at):
    """n . (u + theta x r), from the definition."""
    return np.array(
        [one.unit_direction @ (q[:3] + np.cross(q[3:], np.array(one.position) - at)) for one in accelerometers]
    )


def _random_set(rng, count):
    return [
        ibs.Accelerometer(
            f"U{i}", "base", rng.normal(size=3) * 0.05, rng.normal(size=3), noise_density=0.5 + rng.random()
        )
        for i in range(count)
    ]


@pytest.mark.parametrize("count", [6, 9])
def test_it_gives_back_the_motion_of_any_point(count):
    rng = np.random.default_rng(count)
    listed = _random_set(rng, count)
    q, at = rng.normal(size=6), rng.normal(size=3)
    way = ibs.MotionReconstruction(listed, at=at)
    record = ibs.TimeRecord(_rigid_readings(listed, q, at)[:, None] * [1.0, -1.0], way.names, ["m/s²"] * count, 10.0)
    motion = way.motion(record)
    np.testing.assert_allclose(motion.signals[:, 0], q, rtol=1e-9)
    assert motion.names[5] == "base.rz acceleration"
    assert motion.units == ("m/s²",) * 3 + ("rad/s²",) * 3


def test_weights_are_those_of_the_least_variance():
    rng = np.random.default_rng(3)
    listed = _random_set(rng, 9)
    way = ibs.MotionReconstruction(listed)
    # the textbook's normal equations, with the point in their middle
    noise = np.array([one.noise_density for one in listed])
    R, W = way.matrix, np.diag(noise**-2)
    np.testing.assert_allclose(way.inverse, np.linalg.solve(R.T @ W @ R, R.T @ W), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(way.noise_density**2, np.diag(np.linalg.inv(R.T @ W @ R)), rtol=1e-9)


def test_the_cube_sees_all_motions_equally():
    way = ibs.MotionReconstruction(ibs.bracket("base", (0.1, 0.2, 0.3), 0.05))
    assert way.names == ("U1", "U2", "U3", "U4", "U5", "U6")
    assert way.condition_number == pytest.approx(1.0)
    # two sensors average a translation; a rotation is their difference over the edge
    np.testing.assert_allclose(way.inverse @ way.inverse.T, np.diag([0.5] * 3 + [2 / 0.05**2] * 3), atol=1e-9)


def test_the_condition_number_does_not_depend_on_units_or_on_the_point():
    rng = np.random.default_rng(4)
    listed = _random_set(rng, 6)
    large = [ibs.Accelerometer(a.name, "base", 1000 * np.array(a.position) + 5, a.direction) for a in listed]
    numbers = [
        ibs.MotionReconstruction(listed).condition_number,
        ibs.MotionReconstruction(listed, at=(3, 4, 5)).condition_number,
        ibs.MotionReconstruction(large).condition_number,
    ]
    np.testing.assert_allclose(numbers, numbers[0], rtol=1e-9)


def _placed(*lines):
    return [ibs.Accelerometer(f"U{i}", "base", position, direction) for i, (position, direction) in enumerate(lines)]


FACES = list(ibs.bracket("base", (0, 0, 0), 0.1))


@pytest.mark.parametrize(
    ("listed", "words"),
    [
        # all along x, y at z = 0 and none along z: three motions out of the plane
        (
            _placed(
                *(
                    ((x, y, 0.0), d)
                    for x, y, d in [(0, 0, "x"), (0, 1, "x"), (0, 2, "x"), (0, 0, "y"), (1, 0, "y"), (2, 0, "y")]
                )
            ),
            r"sees a translation along z; a rotation about x .*; a rotation about y ",
        ),
        (FACES[:5], r"5 accelerometers cannot see six motions\. No accelerometer of U1, U2, U3, U4, U5"),
        # every line of action meets the z axis through (0.2, 0.3): nothing feels a turn about it
        (
            _placed(
                *(((0.2 + r, 0.3, z), "x") for r, z in [(0.1, 0), (0.2, 0.1)]),
                *(((0.2, 0.3 + r, z), "y") for r, z in [(0.1, 0), (0.2, 0.1)]),
                *(((0.2 + x, 0.3 + y, 0), "z") for x, y in [(0, 0), (0.1, 0), (0, 0.1)]),
            ),
            r"sees a rotation about z through \(0.2, 0.3, .*\) m\. Add or move",
        ),
        # all at one place
        (
            _placed(*(((0, 0, 0.1), d) for d in "xyzxyz")),
            r"a rotation about x .*; a rotation about y .*; a rotation about z",
        ),
    ],
)
def test_a_motion_that_is_not_seen_is_named(listed, words):
    with pytest.raises(ibs.AnalysisError, match=words):
        ibs.MotionReconstruction(listed)


def test_a_motion_that_is_hardly_seen_is_named():
    listed = [
        *FACES[:4],
        ibs.Accelerometer("U5", "base", (0, 0, 0.001), "x"),
        ibs.Accelerometer("U6", "base", (0, 0, -0.001), "x"),
    ]
    with pytest.warns(ibs.ModelWarning, match=r"a rotation about y through \(0, 0, 0\) m 50 times worse") as seen:
        ibs.MotionReconstruction(listed)
    assert seen[0].filename == __file__


def test_consistency_tells_a_wrong_sign_where_there_are_more_than_six():
    rng = np.random.default_rng(5)
    listed = _random_set(rng, 9)
    way = ibs.MotionReconstruction(listed)
    readings = np.array([_rigid_readings(listed, q, np.zeros(3)) for q in rng.normal(size=(50, 6))]).T
    record = ibs.TimeRecord(readings, way.names, ["m/s²"] * 9, 10.0)
    assert way.consistency(record) == pytest.approx(1.0, abs=1e-12)
    readings[4] *= -1
    assert way.consistency(ibs.TimeRecord(readings, way.names, ["m/s²"] * 9, 10.0)) < 0.95
    six = ibs.MotionReconstruction(listed[:6])
    with pytest.raises(ibs.AnalysisError, match="a seventh"):
        six.consistency(record)


def test_responses_change_their_basis_there_and_back():
    model = ibs.Model("box")
    model.fixation("base", position=(0.01, 0.02, 0.03))
    model.rigid_body("box", mass=2.0, cog=(0, 0, 0.1), inertia=(2e-3, 3e-3, 4e-3, 0, 0, 0))
    model.connection("k", "base", "box", position1=(0, 0, 0.05), stiffness=(1e6, 1e6, 2e6, 1e3, 1e3, 1e3), zeta=0.01)
    frf = model.linearize().frf(
        [ibs.BaseMotion("base", d) for d in ("x", "y", "z", "rx", "ry", "rz")],
        [ibs.Sensor("box", "x", name="Y1"), ibs.Sensor("box", (0, 1, 1), position=(0, 0, 0.2), name="Y2")],
        [10.0, 100.0],
    )
    way = ibs.MotionReconstruction(ibs.bracket("base", (0, 0, -0.05), 0.05), at=(0.01, 0.02, 0.03))
    on_sensors = way.to_accelerometers(frf)
    assert on_sensors.inputs == ("U1", "U2", "U3", "U4", "U5", "U6")
    # a motion q gives the outputs G q, and the readings R q give the same
    q = np.random.default_rng(6).normal(size=6)
    readings = _rigid_readings(way.accelerometers, q, np.array(way.at))
    expected = np.einsum("oif,i->of", frf.response, q)
    np.testing.assert_allclose(np.einsum("oif,i->of", on_sensors.response, readings), expected, rtol=1e-9)
    np.testing.assert_allclose(way.to_motion(on_sensors).response, frf.response, rtol=1e-9, atol=1e-12)
    with pytest.raises(ibs.AnalysisError, match="six accelerations"):
        way.to_accelerometers(frf.select(inputs=[0, 1]))


def test_accelerometers_of_two_items_and_wrong_units_are_refused():
    with pytest.raises(ibs.ModelError, match=r"'Y1' is on 'mirror', 'U1' on 'base'"):
        ibs.MotionReconstruction([*FACES, _accelerometer()])
    with pytest.raises(ibs.ModelError, match="accelerometers must be a list of different names"):
        ibs.MotionReconstruction([*FACES, FACES[0]])
    way = ibs.MotionReconstruction(FACES)
    with pytest.raises(ibs.RecordError, match="'U1' is in 'V'"):
        way.motion(ibs.TimeRecord(np.ones((6, 2)), way.names, ["V"] * 6, 1.0))

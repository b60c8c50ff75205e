"""Optical sensitivities against rays that are traced off moved mirrors, and the angle that doubles."""

import numpy as np
import pytest
from analytic import lever, random_rotation
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import ibsdyn as ibs


def trace(origin, direction, planes, end):
    """Reflect a ray off planes (point, normal) and meet the plane ``end``; exact, no linearisation."""
    at, d = np.array(origin, float), np.array(direction, float)
    for place, n in planes:
        at = at + d * (n @ (place - at)) / (n @ d)
        d = d - 2 * (d @ n) * n
    place, n = end
    return at + d * (n @ (place - at)) / (n @ d), d


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_three_mirrors_against_traced_rays(seed):
    rng = np.random.default_rng(seed)
    origin, d = rng.normal(size=3), random_rotation(rng)[0]
    mirrors, at, heading = [], origin, d
    for name in "abc":
        at = at + rng.uniform(0.1, 1.0) * heading
        n = random_rotation(rng)[0]
        while abs(n @ heading) < 0.2:
            n = random_rotation(rng)[0]
        inside = random_rotation(rng)[0]
        inside = inside - (inside @ n) * n  # any point of the plane will do
        mirrors.append(ibs.FlatMirror(name, at + inside, 3 * n))
        heading = heading - 2 * (heading @ n) * n
    path = ibs.BeamPath(origin, 2 * d, mirrors, length=0.7)
    planes = [(np.array(m.position), np.array(m.normal)) for m in mirrors]
    final = path.points[-1]
    nominal, out = trace(origin, d, planes, (final, heading))
    np.testing.assert_allclose(nominal, final, atol=1e-12)
    np.testing.assert_allclose([path.u @ path.v, path.u @ out, path.v @ out], 0, atol=1e-12)
    step = 1e-5
    for k, name in enumerate("abc"):
        for direction in range(6):
            ends = []
            for sign in (1, -1):
                moved = list(planes)
                place, n = planes[k]
                pivot = path.points[k + 1]
                motion = sign * step * np.eye(6)[direction]
                turn = Rotation.from_rotvec(motion[3:]).as_matrix()
                moved[k] = (pivot + turn @ (place - pivot) + motion[:3], turn @ n)
                ends.append(trace(origin, d, moved, (final, heading)))
            shift, turn = ((a - b) / (2 * step) for a, b in zip(*ends, strict=True))
            axes = np.vstack([path.u, path.v])
            np.testing.assert_allclose(path.displacement[name][:, direction], axes @ shift, atol=2e-6)
            np.testing.assert_allclose(path.angle[name][:, direction], axes @ turn, atol=2e-6)


def test_a_beam_turns_twice_as_far_as_the_mirror():
    """At 45°: 2 about the axis across the plane of incidence, 2 cos 45° about the mirror's axis in that plane."""
    mirror = ibs.FlatMirror("mirror", (0, 0, 0), (-1, 0, 1))
    path = ibs.BeamPath((-1, 0, 0), (1, 0, 0), mirror, length=2.0, up=(0, 1, 0))
    np.testing.assert_allclose(path.points, [[-1, 0, 0], [0, 0, 0], [0, 0, 2]], atol=1e-12)
    np.testing.assert_allclose(path.u, [0, 1, 0])
    np.testing.assert_allclose(path.v, [-1, 0, 0], atol=1e-12)
    # about y, in the plane of incidence: n turns by theta, the beam from z towards x by 2 theta
    np.testing.assert_allclose(path.angle["mirror"][:, 4], [0, -2], atol=1e-12)
    np.testing.assert_allclose(path.displacement["mirror"][:, 4], [0, -4], atol=1e-12)
    in_plane = np.array([1, 0, 1]) / np.sqrt(2)  # axis in the mirror's plane and in the plane of incidence
    turned = path.angle["mirror"][:, 3:] @ in_plane
    np.testing.assert_allclose(np.abs(turned), [np.sqrt(2), 0], atol=1e-12)
    about_normal = path.angle["mirror"][:, 3:] @ np.array([-1, 0, 1])
    np.testing.assert_allclose(about_normal, 0, atol=1e-12)
    # a shift along the normal by s moves the beam sideways by sqrt(2) s; along the mirror's plane it does nothing
    along = path.displacement["mirror"][:, :3] @ (np.array([-1, 0, 1]) / np.sqrt(2))
    np.testing.assert_allclose(np.abs(along), [0, np.sqrt(2)], atol=1e-12)
    np.testing.assert_allclose(path.displacement["mirror"][:, :3] @ in_plane, 0, atol=1e-12)
    assert "-2 ry [rad/rad]" in str(path)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_what_moves_as_one_body_sees_no_motion(seed):
    """Source, three mirrors and detector on one rigid body: any motion of it leaves the spot where it is."""
    rng = np.random.default_rng(seed)
    at, heading = rng.normal(size=3), random_rotation(rng)[0]
    start, mirrors = (at, heading), []
    for _ in range(3):
        at = at + rng.uniform(0.1, 1.0) * heading
        n = random_rotation(rng)[0]
        while abs(n @ heading) < 0.2:
            n = random_rotation(rng)[0]
        mirrors.append(ibs.FlatMirror("body", at, n))
        heading = heading - 2 * (heading @ n) * n
    path = ibs.BeamPath(*start, mirrors, length=0.7, source="body", detector="body")
    assert list(path.angle) == ["source", "body", "body (2)", "body (3)", "detector"]
    places = np.vstack([path.points[:1], path.points[1:4], path.points[4:]])
    for table in (path.angle, path.displacement):
        total = sum(matrix @ lever(place) for matrix, place in zip(table.values(), places, strict=True))
        np.testing.assert_allclose(total, 0, atol=1e-12)
        assert max(np.abs(matrix).max() for matrix in table.values()) > 0.1


def module():
    model = ibs.Model("module")
    model.fixation("platform", position=(0, 0, 0))
    model.rigid_body("mirror", mass=0.25, cog=(0, 0, 0.02), inertia=(1e-4, 1e-4, 2e-4, 0, 0, 0))
    model.connection(
        "mount", "platform", "mirror", position1=(0, 0, -0.03), stiffness=(1e6, 2e6, 3e6, 50, 80, 90), zeta=0.01
    )
    return model


def test_beam_is_an_output_like_any_other():
    """FRF of the beam is that of the mirror times the sensitivity; a pivot beside the point of incidence counts."""
    path = ibs.BeamPath(
        (-1, 0, 0), (1, 0, 0), ibs.FlatMirror("mirror", (0, 0, 0), (-1, 0, 1)), length=2.0, up=(0, 1, 0)
    )
    system = module().linearize()
    floor = ibs.BaseMotion("platform", "x")
    f = [3.0, 40.0]
    beam = system.frf(floor, [path.sensor("angle", "v"), path.sensor("displacement", "v", name="spot")], f)
    tilt = system.frf(floor, ibs.Sensor("mirror", "ry", quantity="displacement"), f).response[0, 0]
    x = system.frf(floor, ibs.Sensor("mirror", "x", (0, 0, 0), quantity="displacement"), f).response[0, 0]
    z = system.frf(floor, ibs.Sensor("mirror", "z", (0, 0, 0), quantity="displacement"), f).response[0, 0]
    np.testing.assert_allclose(beam.response[0, 0], -2 * tilt, rtol=1e-9)
    # d = x, n = (-1, 0, 1)/sqrt2: the point of incidence moves along x by (x - z), the detector sees -x as v
    np.testing.assert_allclose(beam.response[1, 0], -(x - z) - 4 * tilt, rtol=1e-9)
    assert beam.outputs == ("beam angle v", "spot")
    assert beam.output_units == ("rad", "m")
    noise = ibs.Disturbance("floor", floor, ibs.floor_vibration("VC-C"))
    rms = ibs.vibration_budget(system, path.sensor("angle", "v"), noise).rms[0]
    of_mirror = ibs.vibration_budget(system, ibs.Sensor("mirror", "ry", quantity="displacement"), noise).rms[0]
    assert rms == pytest.approx(2 * of_mirror, rel=1e-9)


def test_simulated_beam_is_the_sum_of_its_parts():
    path = ibs.BeamPath(
        (-1, 0, 0), (1, 0, 0), ibs.FlatMirror("mirror", (0, 0, 0), (-1, 0, 1)), length=2.0, up=(0, 1, 0)
    )
    tilt = ibs.Sensor("mirror", "ry", quantity="displacement", name="tilt")
    push = {ibs.Force("mirror", "x", position=(0, 0, 0.03)): np.r_[np.ones(10), np.zeros(90)] * 1e-3}
    record = module().simulate(
        push, [path.sensor("angle", "v"), tilt], duration=0.1, sample_rate=1000.0, progress=False
    )
    assert np.abs(record["tilt"]).max() > 0
    np.testing.assert_allclose(record["beam angle v"], -2 * record["tilt"], rtol=1e-12)


def test_combined_sensors_are_sums():
    model = module()
    system = model.linearize()
    left, right = (ibs.Sensor("mirror", "z", (x, 0, 0), quantity="displacement") for x in (-0.05, 0.05))
    tilt = ibs.CombinedSensor("tilt", [(10.0, left), (-10.0, right)], "rad")
    frf = system.frf(ibs.Torque("mirror", "ry"), [tilt, ibs.Sensor("mirror", "ry", quantity="displacement")], [10.0])
    assert frf.response[0, 0, 0] == pytest.approx(frf.response[1, 0, 0], rel=1e-10)
    space = system.to_state_space(ibs.Torque("mirror", "ry"), tilt)
    at = space.C @ np.linalg.solve(2j * np.pi * 10 * np.eye(len(space.A)) - space.A, space.B) + space.D
    assert at[0, 0] == pytest.approx(frf.response[0, 0, 0], rel=1e-9)
    for parts, words in (
        ([], "no parts"),
        ([left], "pairs"),
        ([(1, left), (1, ibs.Sensor("mirror", "z"))], "acceleration, displacement"),
    ):
        with pytest.raises(ibs.ModelError, match=words):
            ibs.CombinedSensor("x", parts, "m")


def test_the_length_of_a_normal_does_not_matter():
    for size in (1e-200, 1.0, 1e200):
        np.testing.assert_allclose(ibs.FlatMirror("m", (0, 0, 0), (-size, 0, size)).normal, (-(0.5**0.5), 0, 0.5**0.5))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"direction": (-1, 0, 0)}, "runs away"),
        ({"direction": (1, 0, 1)}, "runs along"),
        ({"direction": (0, 0, 0)}, "zero"),
        ({"mirrors": []}, "one at least"),
        ({"mirrors": None}, "one at least, got None"),
        ({"up": (0, 0, 1)}, "lies along"),
    ],
)
def test_beams_that_cannot_be(change, words):
    given_ = {
        "origin": (-1, 0, 0),
        "direction": (1, 0, 0),
        "mirrors": ibs.FlatMirror("m", (0, 0, 0), (-1, 0, 1)),
        "length": 1.0,
    } | change
    with pytest.raises(ibs.ModelError, match=words):
        ibs.BeamPath(**given_)
    good = ibs.BeamPath((-1, 0, 0), (1, 0, 0), ibs.FlatMirror("m", (0, 0, 0), (-1, 0, 1)), 1.0)
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'angle'"):
        good.sensor("angel", "u")
    with pytest.raises(ibs.UnknownNameError, match="'u' and 'v'"):
        good.sensor("angle", "x")

"""Flexible parts in a model: joined to each other, watched at sensor points, and how far they are to be trusted."""

import numpy as np
import pytest
from analytic import lever
from own_fe import brick_block, frequencies
from scipy.linalg import eigh

import fem_import as fi
import ibsdyn as ibs

SIZE = (0.12, 0.012, 0.009)
WHOLE = brick_block((12, 2, 2), SIZE)
CUT = 0.05


def half(first, last):
    """The elements of the whole bar between two places, meshed by themselves."""
    count = round((last - first) / 0.01)
    block = brick_block((count, 2, 2), (last - first, *SIZE[1:]))
    block.positions[:, 0] += first
    return fi.FEModel.from_arrays(**block.arrays)


@pytest.fixture(scope="module")
def halves():
    corner = fi.Plane((0.12, 0, 0), (1, 0, 0)) & fi.Box((0, SIZE[1], SIZE[2]), (1, 1, 1))
    left = fi.reduce(half(0.0, CUT), {"cut": "RIGHT"}, 150e3, sensors={"end": fi.Plane((0, 0, 0), (1, 0, 0))})
    right = fi.reduce(half(CUT, 0.12), {"cut": "LEFT"}, 150e3, sensors={"corner": corner})
    return left, right


def joined(halves):
    model = ibs.Model("bar of two parts")
    model.flexible_body("left", halves[0], zeta=0.01)
    model.flexible_body("right", halves[1], zeta=0.01)
    model.connection("weld", "left.cut", "right.cut", stiffness=[np.inf] * 6)
    return model


def whole():
    """Dense K, M of the bar meshed as one, its nodes on the cut following one frame (the last six coordinates)."""
    positions, n = WHOLE.positions, len(WHOLE.dofs)
    on_cut = np.flatnonzero(abs(positions[:, 0] - CUT) < 1e-9)
    centre = positions[on_cut].mean(axis=0)
    tied = np.isin(np.arange(n) // 3, on_cut)
    frame = np.zeros((n, 6))
    for node in on_cut:
        frame[3 * node : 3 * node + 3] = lever(positions[node] - centre)[:3]
    L = np.hstack([np.eye(n)[:, ~tied], frame])
    return L.T @ WHOLE.K @ L, L.T @ WHOLE.M @ L, L


def test_two_joined_parts_are_the_part_meshed_as_one(halves):
    K, M, _ = whole()
    expected = frequencies(K, M)
    found = joined(halves).linearize().modes()
    assert np.count_nonzero(found.rigid) == 6
    below = expected[6:][expected[6:] < 50e3]
    assert len(below) >= 10
    np.testing.assert_allclose(found.frequencies[6 : 6 + len(below)], below, rtol=2e-5)
    assert sum(body.mass for body in halves) == pytest.approx(np.sum(WHOLE.M[::3, ::3]), rel=1e-12)


def test_responses_at_sensor_points_are_those_of_the_part_meshed_as_one(halves):
    """From a force on one part's sensor point to the motion of the other's, damping exactly structural."""
    system = joined(halves).linearize()
    K, M, L = whole()
    end = np.flatnonzero(WHOLE.positions[:, 0] < 1e-9)
    corner = int(np.argmin(np.linalg.norm(WHOLE.positions - SIZE, axis=1)))
    levers = np.vstack([lever(WHOLE.positions[node] - WHOLE.positions[end].mean(axis=0))[:3] for node in end])
    mean = np.linalg.pinv(levers)
    watch_end = np.zeros((6, L.shape[0]))
    for column, node in enumerate(end):
        watch_end[:, 3 * node : 3 * node + 3] = mean[:, 3 * column : 3 * column + 3]
    watch_corner = np.zeros((3, L.shape[0]))
    watch_corner[:, 3 * corner : 3 * corner + 3] = np.eye(3)
    grid = np.array([200.0, 1500.0, 4000.0, 9000.0, 20e3])
    inputs = [ibs.Force("left.end", "z"), ibs.Torque("left.end", "rx")]
    outputs = [ibs.Sensor("right.corner", d, quantity="displacement") for d in "xyz"]
    outputs += [ibs.Sensor("left.end", d, quantity="displacement") for d in ("z", "ry")]
    got = system.frf(inputs, outputs, grid, hysteretic=True).response
    observe = np.vstack([watch_corner, watch_end[[2, 4]]]) @ L
    load = (watch_end[[2, 3]] @ L).T
    for index, frequency in enumerate(grid):
        dynamic = K * (1 + 0.02j) - (2 * np.pi * frequency) ** 2 * M
        full = observe @ np.linalg.solve(dynamic, load)
        np.testing.assert_allclose(got[:, :, index], full, rtol=2e-3, atol=2e-3 * abs(full).max(axis=0).min())


def test_a_sensor_point_carries_no_connection_and_may_tell_no_rotation(halves):
    model = joined(halves)
    model.fixation("wall", position=(0, 0, 0))
    with pytest.raises(ibs.ModelError, match="'end' is a sensor point, which carries no connection"):
        model.connection("clamp", "wall", "left.end", stiffness=[1e6] * 6)
    system = model.linearize()
    for signal, words in [
        (ibs.Sensor("right.corner", "rz"), "too few nodes to know a rotation"),
        (ibs.Sensor("right.corner", "x", position=(0, 0, 0)), "tells no rotation, so its motion is known at"),
        (ibs.Sensor("right.korner", "x"), "Did you mean 'right.corner'"),
    ]:
        with pytest.raises(ibs.ModelError, match=words):
            system.frf(ibs.Force("left.end", "x"), signal, [100.0])
    with pytest.raises(ibs.ModelError, match="too few nodes"):
        system.frf(ibs.Torque("right.corner", "rz"), ibs.Sensor("left.end", "x"), [100.0])


def test_a_static_load_bends_a_sensor_point_exactly(halves):
    """A cantilever of one part: the reduced tip deflection under a tip load is the full one at 0 Hz."""
    part = half(0.0, CUT)
    body = fi.reduce(part, {"root": "LEFT"}, 60e3, sensors={"tip": "RIGHT"})
    model = ibs.Model("cantilever")
    model.fixation("wall", position=(0, 0, 0))
    model.flexible_body("leaf", body)
    model.connection("clamp", "wall", "leaf.root", stiffness=[np.inf] * 6)
    tip = ibs.Sensor("leaf.tip", "z", quantity="displacement")
    found = model.linearize().frf(ibs.Force("leaf.tip", "z"), tip, [1e-3]).response[0, 0, 0]
    free = ~np.isin(part.dofs[:, 0], part.node_sets["LEFT"])
    load = np.where(np.isin(part.dofs[:, 0], part.node_sets["RIGHT"]) & (part.dofs[:, 1] == 3), 1.0, 0.0)
    load = load[free] / len(part.node_sets["RIGHT"])
    full = load @ np.linalg.solve(part.K.toarray()[np.ix_(free, free)], load)
    assert found == pytest.approx(full, rel=1e-7)


def on_a_soft_mount(max_frequency, **reduction):
    part = half(0.0, CUT)
    body = fi.reduce(part, {"root": "LEFT", "tip": "RIGHT"}, max_frequency, **reduction)
    model = ibs.Model("leaf and mirror")
    model.fixation("wall", position=(0, 0, 0))
    model.flexible_body("leaf", body)
    model.rigid_body("mirror", mass=0.05, cog=(0.06, 0.006, 0.0045), inertia=(4e-6, 3e-6, 3e-6, 0, 0, 0))
    model.connection("clamp", "wall", "leaf.root", stiffness=[np.inf] * 6)
    model.connection("glue", "leaf.tip", "mirror", stiffness=[np.inf] * 6)
    return model, part, body


@pytest.mark.filterwarnings("ignore::fem_import.ExportWarning")
def test_modes_and_responses_beyond_the_cut_off_warn():
    model, *_ = on_a_soft_mount(2000.0)
    system = model.linearize()
    with pytest.warns(ibs.ModelWarning, match=r"deform 'leaf' above 1333 Hz.*cut-off 2000 Hz / 1\.5") as caught:
        modes = system.modes()
    assert caught[0].filename == __file__
    first = modes.frequencies[modes.frequencies > 2000.0 / 1.5][0]
    assert f"({first:.4g} Hz)" in str(caught[0].message)
    with pytest.warns(ibs.ModelWarning, match=r"go up to 1500 Hz, but 'leaf'.*max_frequency=2250"):
        system.frf(ibs.Force("mirror", "z"), ibs.Sensor("mirror", "z"), [100.0, 1500.0])


@pytest.mark.filterwarnings("error")
def test_a_sufficient_reduction_is_silent():
    system = on_a_soft_mount(60e3)[0].linearize()
    assert system.modes().frequencies[0] < 2000.0
    system.frf(ibs.Force("mirror", "z"), ibs.Sensor("mirror", "z"), [100.0, 20e3])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_error_of_assembly_modes_is_estimated():
    """Against the unreduced assembly, with a basis bad enough to see it."""
    model, part, body = on_a_soft_mount(30e3, method="guyan")
    modes = model.linearize().modes()
    tied = {name: np.isin(part.dofs[:, 0], part.node_sets[name]) for name in ("LEFT", "RIGHT")}
    frame = np.zeros((len(part.dofs), 6))
    centre = body.interfaces["tip"].position
    for row in np.flatnonzero(tied["RIGHT"])[::3]:
        frame[row : row + 3] = lever(part.positions[part.dofs[row, 0] - 1] - centre)[:3]
    L = np.hstack([np.eye(len(part.dofs))[:, ~tied["LEFT"] & ~tied["RIGHT"]], frame])
    K, M = L.T @ part.K @ L, L.T @ part.M @ L
    arm = lever(np.array([0.06, 0.006, 0.0045]) - centre)
    M[-6:, -6:] += arm.T @ np.diag([0.05] * 3 + [4e-6, 3e-6, 3e-6]) @ arm
    full = np.sqrt(eigh(K, M, eigvals_only=True)[:6]) / (2 * np.pi)
    true = modes.frequencies[:6] / full - 1
    assert np.all(true > 1e-8)
    np.testing.assert_allclose(modes.reduction_errors[:6], true, rtol=0.1)

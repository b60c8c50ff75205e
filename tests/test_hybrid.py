"""Flexible bodies in a model: against the unreduced FE assembly, and in both of Exudyn's forms."""

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg
from analytic import lever

import fem_import as fi
import ibsdyn as ibs
from ibsdyn.engine.translation import Translation, silent

FLEXURE = Path(__file__).parents[1] / "examples" / "mirror_flexure" / "flexure.inp"
INERTIA = (1.5e-4, 1.2e-4, 1.0e-4, 1e-5, 0, 2e-5)
TENSOR = np.array([[1.5e-4, 1e-5, 0], [1e-5, 1.2e-4, 2e-5], [0, 2e-5, 1.0e-4]])
MOUNT = (2e8, 3e8, 2e8, 1e5, 2e5, 1e5)
GLUE = (1e8, 2e8, 1e8, 2e4, 1e4, 3e4)
CUT_OFF = 7000.0


@pytest.fixture(scope="module")
def part():
    return fi.read_calculix(FLEXURE)


@pytest.fixture(scope="module")
def reduced(part):
    return fi.reduce(part, {"base": "BASE", "tip": "TIP"}, max_frequency=CUT_OFF)


def hybrid(body, flexure=0.005, mount=0.01, glue=0.02):
    """Base on a mount whose elastic centre is off the interface frame, mirror on glue that is off it too; ratios."""
    base, tip = (np.array(body.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("hybrid")
    model.fixation("platform", position=(0, 0, 0))
    model.flexible_body("flexure", body, zeta=flexure)
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0.005, 0.0], inertia=INERTIA)
    model.connection("mount", "platform", "flexure.base", position1=base - [0, 0.01, 0], stiffness=MOUNT, zeta=mount)
    model.connection("glue", "flexure.tip", "mirror", position2=tip + [0.004, 0, 0.002], stiffness=GLUE, zeta=glue)
    return model


def full_assembly(part, body, tie, sets):
    """The same machine with every node of the FE mesh: K, M over [nodes, mirror's six], K to the platform's six."""
    base, tip = (np.array(body.interfaces[i].position) for i in ("base", "tip"))
    n = len(part.dofs)
    place = {int(label): i for i, label in enumerate(part.node_ids)}
    row = {(int(a), int(d)): i for i, (a, d) in enumerate(part.dofs)}

    def tied_nodes(name, position):
        """Rows of a set's translations, and the rigid motion of those about the frame."""
        labels = [int(label) for label in part.node_sets[name]]
        rows = [row[label, d] for label in labels for d in (1, 2, 3)]
        return np.array(rows), np.vstack([lever(part.positions[place[label]] - position)[:3] for label in labels])

    def frame_motion(rows, levers, position, point):
        """(6, N) motion of a point fixed to the frame; least squares is exact for a rigid set, the mean otherwise."""
        average = lever(point - position) @ np.linalg.solve(levers.T @ levers, levers.T)
        entries = (average.ravel(), (np.repeat(np.arange(6), len(rows)), np.tile(rows, 6)))
        return sp.csr_array(sp.coo_array(entries, shape=(6, n + 12)))

    def six(matrix, first):
        entries = (matrix.ravel(), (np.repeat(np.arange(6), 6), np.tile(np.arange(6), 6) + first))
        return sp.csr_array(sp.coo_array(entries, shape=(6, n + 12)))

    mirror = np.zeros((6, 6))
    mirror[:3, :3], mirror[3:, 3:] = 0.3 * np.eye(3), TENSOR
    M = sp.block_diag([part.M, mirror, sp.csr_array((6, 6))]).tocsr()
    K = sp.block_diag([part.K, sp.csr_array((12, 12))]).tocsr()
    rows_base, levers_base = tied_nodes(sets[0], base)
    rows_tip, levers_tip = tied_nodes(sets[1], tip)
    cog, at_mount, at_glue = tip + [0.01, 0.005, 0.0], base - [0, 0.005, 0], tip + [0.002, 0, 0.001]
    mount = frame_motion(rows_base, levers_base, base, at_mount) - six(lever(at_mount), n + 6)
    glue = six(lever(at_glue - cog), n) - frame_motion(rows_tip, levers_tip, tip, at_glue)
    K = K + mount.T @ sp.diags_array(MOUNT) @ mount + glue.T @ sp.diags_array(GLUE) @ glue
    if tie == "rigid":
        keep = np.setdiff1d(np.arange(n), np.r_[rows_base, rows_tip])
        T = sp.lil_array((n + 12, len(keep) + 24))
        T[keep, np.arange(len(keep))] = 1.0
        T[rows_base, len(keep) : len(keep) + 6] = levers_base
        T[rows_tip, len(keep) + 6 : len(keep) + 12] = levers_tip
        T[np.arange(n, n + 12), np.arange(len(keep) + 12, len(keep) + 24)] = 1.0
        T = T.tocsr()
        K, M = T.T @ K @ T, T.T @ M @ T
    free = K.shape[0] - 6
    return K.tocsc()[:free, :free], M.tocsc()[:free, :free], K.tocsc()[:free, free:]


def solve_frames(dynamic, loads, frames):
    """Solve with the last coordinates condensed: rigid frames touch every node of theirs and would fill a factor."""
    inner = dynamic.shape[0] - frames
    factor = scipy.sparse.linalg.splu(
        dynamic[:inner, :inner], permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    coupling = dynamic[:inner, inner:].toarray()
    solved = factor.solve(np.hstack([coupling, loads[:inner]]))
    schur = dynamic[inner:, inner:].toarray() - coupling.T @ solved[:, :frames]
    return np.linalg.solve(schur, loads[inner:] - coupling.T @ solved[:, frames:])


def largest_frf_error(part, body, tie, sets, cut_off):
    """Largest error of the hybrid's base-to-mirror FRFs, as a share of each one's peak below the cut-off.

    1 % structural damping everywhere, so that the unreduced assembly needs no modes of its own.
    """
    zeta = 0.01
    system = hybrid(body, flexure=zeta, mount=zeta, glue=zeta).linearize()
    resonances = system.modes().frequencies
    resonances = resonances[resonances < cut_off]
    assert len(resonances) > 6
    if tie == "average":  # its springs couple all nodes of an interface: a factor takes seconds
        resonances = resonances[[0, 3, -1]]
    frequencies = np.unique(np.r_[np.geomspace(10, cut_off, 3), resonances])
    bases = [ibs.BaseMotion("platform", d, "displacement") for d in ("x", "z", "ry")]
    sensors = [ibs.Sensor("mirror", d, quantity="displacement") for d in ("x", "y", "z", "rx", "ry", "rz")]
    got = system.frf(bases, sensors, frequencies, hysteretic=True).response
    K, M, K_base = full_assembly(part, body, tie, sets)
    expected = np.empty_like(got)
    for f, frequency in enumerate(frequencies):
        dynamic = (K * (1 + 2j * zeta) - (2 * np.pi * frequency) ** 2 * M).tocsc()
        loads = -(1 + 2j * zeta) * K_base[:, [0, 2, 4]].toarray()
        expected[:, :, f] = solve_frames(dynamic, loads, 18 if tie == "rigid" else 6)[-6:]
    peak = np.abs(expected).max(axis=2, keepdims=True)
    # responses that symmetry makes zero are held against the largest of their unit
    peak = np.maximum(peak, 1e-3 * np.stack([peak[:3].max(axis=0)] * 3 + [peak[3:].max(axis=0)] * 3))
    return np.max(np.abs(got - expected) / peak)


def is_small(validated, over, error):
    """Hold the error of FRFs over a part against one hundredth of the peak."""
    validated(
        f"base to mirror over {over}: error of 18 FRFs at their resonances",
        "the same assembly unreduced, all nodes, put together with SciPy",
        0.0,
        error,
        atol=0.01,
        against="calculations by hand",
        unit="of the peak",
    )


@pytest.mark.parametrize("tie", ["rigid", "average"])
def test_frf_equals_the_unreduced_fe_assembly(part, tie, validated):
    body = fi.reduce(part, {"base": "BASE", "tip": "TIP"}, max_frequency=CUT_OFF, tie=tie)
    error = largest_frf_error(part, body, tie, ("BASE", "TIP"), CUT_OFF)
    is_small(validated, f"a reduced FE part, {tie} interfaces", error)


def test_frf_of_the_real_leaf_spring(shared, validated):
    part = fi.read_calculix(shared / "data" / "calculix_leafspring" / "free_ms.inp")
    body = fi.reduce(part, {"base": "IF_BASE", "tip": "IF_TIP"}, max_frequency=3000.0)
    error = largest_frf_error(part, body, "rigid", ("IF_BASE", "IF_TIP"), 3000.0)
    is_small(validated, "CalculiX's leaf spring, 15048 DoF", error)


def test_floating_frame_linearises_to_the_same(reduced):
    model = hybrid(reduced)
    small, floating = (model.linearize(flexible=f) for f in ("small-deflection", "floating-frame"))
    assert small.coordinates == floating.coordinates
    for letter, tolerance in (("M", 1e-9), ("K", 2e-6), ("C", 1e-5)):
        a, b = getattr(small, letter), getattr(floating, letter)
        scale = np.sqrt(np.outer(np.diag(a), np.diag(a)))
        assert np.max(np.abs(a - b) / scale) < tolerance, letter
    # and so do responses, the floating frame's solved here from its own matrices
    frequencies = np.linspace(10, 1500, 40)
    frf = small.frf(
        ibs.BaseMotion("platform", "z", "displacement"),
        ibs.Sensor("mirror", "rz", quantity="displacement"),
        frequencies,
    )
    z, rz = floating.base_coordinates.index("platform.z"), floating.coordinates.index("mirror.rz")
    solved = []
    for w in 2 * np.pi * frequencies:
        dynamic = floating.K + 1j * w * floating.C - w**2 * floating.M
        coupling = floating.K_base + 1j * w * floating.C_base - w**2 * floating.M_base
        solved.append(np.linalg.solve(dynamic, -coupling[:, z])[rz])
    np.testing.assert_allclose(frf.response[0, 0], solved, atol=1e-4 * np.abs(solved).max())


def test_base_and_interfaces_follow_a_rigid_motion(reduced):
    model = hybrid(reduced)
    system = model.linearize()
    motion = model.assembly().rigid_motion()
    n = len(system.coordinates)
    for free, base in ((system.K, system.K_base), (system.C, system.C_base)):
        forces = free @ motion[:n] + base @ motion[n:]
        size = np.abs(free) @ np.abs(motion[:n]) + np.abs(base) @ np.abs(motion[n:])
        assert np.max(np.abs(forces) / size.max(axis=0)) < 1e-7
    free = ibs.Model("free")
    free.flexible_body("flexure", reduced)
    modes = free.linearize().modes()
    assert modes.rigid.sum() == 6
    assert not modes.frequencies[:6].any()


def test_equal_ratios_come_back_and_an_exported_matrix_replaces_them(reduced):
    model = ibs.Model("m")
    model.fixation("ground")
    model.flexible_body("flexure", reduced, zeta=0.02)
    model.connection("mount", "ground", "flexure.base", stiffness=MOUNT, zeta=0.02)
    np.testing.assert_allclose(model.linearize().modes().damping_ratios, 0.02, rtol=1e-6)
    frames = {name: frame.position for name, frame in reduced.interfaces.items()}
    exported = fi.ReducedBody.from_arrays(reduced.M, reduced.K, interfaces=frames, C=1e-6 * reduced.K)
    model = ibs.Model("m")
    model.fixation("ground")
    model.flexible_body("flexure", exported, zeta=0.3)
    model.connection("mount", "ground", "flexure.base", stiffness=MOUNT, damping=1e-6 * np.array(MOUNT))
    system = model.linearize()
    scale = np.sqrt(np.outer(np.diag(system.K), np.diag(system.K)))
    assert np.max(np.abs(system.C - 1e-6 * system.K) / scale) < 1e-9 * 1e-6 * 1e3
    modes = system.modes()
    np.testing.assert_allclose(modes.damping_ratios, 1e-6 * np.pi * modes.frequencies, rtol=1e-6)


def test_locked_to_its_neighbours(reduced):
    """A flexure whose interfaces are locked leaves the mirror's coordinates and its modes only."""
    base, tip = (np.array(reduced.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("m")
    model.fixation("ground", position=base)
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0, 0], inertia=INERTIA)
    model.connection(
        "flexure",
        "ground",
        "mirror",
        position1=base,
        position2=tip,
        stiffness=(1e6,) * 3 + (500,) * 3,
        zeta=0.01,
    )
    names = set(model.items) | set(model.connections)
    body = model.replace_with_flexible("flexure", reduced)
    assert body.zeta == 0.01
    assert names <= set(model.items) | set(model.connections)
    system = model.linearize()
    assert {c.rsplit(".", 1)[0] for c in system.coordinates} == {"mirror", "flexure"}
    assert not any(c.startswith(("flexure.base", "flexure.tip")) for c in system.coordinates)
    stiff = ibs.Model("s")
    stiff.fixation("ground", position=base)
    stiff.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0, 0], inertia=INERTIA)
    stiff.flexible_body("flexure", reduced)
    stiff.connection("a", "ground", "flexure.base", stiffness=(1e13,) * 3 + (1e10,) * 3)
    stiff.connection("b", "flexure.tip", "mirror", stiffness=(1e13,) * 3 + (1e10,) * 3)
    np.testing.assert_allclose(system.modes().frequencies[:6], stiff.linearize().modes().frequencies[:6], rtol=5e-5)


def test_replacing_a_rigid_body_keeps_every_name(reduced):
    base, tip = (np.array(reduced.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("m")
    model.fixation("ground")
    inertia = reduced.inertia
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0, 0], inertia=INERTIA)
    six = (inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2])
    model.rigid_body("flexure", mass=reduced.mass, cog=reduced.centre_of_mass, inertia=six)
    model.connection("mount", "ground", "flexure", position1=base, stiffness=MOUNT, zeta=0.01)
    model.connection("glue", "flexure", "mirror", position1=tip, stiffness=GLUE, zeta=0.01)
    script = (
        [ibs.Force("flexure", "x"), ibs.BaseMotion("ground", "z")],
        [ibs.Sensor("flexure", "z"), ibs.Sensor("mirror", "rz")],
    )
    rigid = model.linearize().frf(*script, [0.5]).response
    model.replace_with_flexible("flexure", reduced, zeta=0.005)
    assert model.connections["mount"].item2 == "flexure.base"
    assert model.connections["glue"].item1 == "flexure.tip"
    assert model.connections["glue"].stiffness == GLUE
    flexible = model.linearize().frf(*script, [0.5]).response
    # far below all resonances base motion carries everything along; the flexure's mean motion is that of its CoG
    np.testing.assert_allclose(flexible[0, 1], 1.0, rtol=1e-4)
    np.testing.assert_allclose(rigid[0, 1], 1.0, rtol=1e-4)


def test_mean_motion_of_a_free_flexible_body_is_newtons(reduced):
    model = ibs.Model("free")
    model.flexible_body("flexure", reduced)
    system = model.linearize()
    frf = system.frf(
        [ibs.Force("flexure", "y"), ibs.Force("flexure.tip", "y")], ibs.Sensor("flexure", "y"), [5.0, 800.0]
    )
    np.testing.assert_allclose(frf.response[0, 0], 1 / reduced.mass, rtol=1e-9)
    # wherever it acts, a force moves the centre of gravity by F / m, elastic or not
    np.testing.assert_allclose(frf.response[0, 1], 1 / reduced.mass, rtol=1e-7)


def beam_cantilever(length, radius, count, E=2e11, nu=0.3, rho=8000.0):
    """A round Euler-Bernoulli beam with rotary inertia along x, six coordinates a node: K, M, positions, dofs."""
    area, second, h = np.pi * radius**2, np.pi * radius**4 / 4, length / count
    bend = E * second / h**3 * hermite(12, 6, 4, 2, h)
    swing = rho * area * h / 420 * np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h * h, 13 * h, -3 * h * h],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
        ]
    ) + rho * second / (30 * h) * hermite(36, 3, 4, -1, h)
    rod, bar = np.array([[1, -1], [-1, 1]]), np.array([[2, 1], [1, 2]])
    flip = np.diag([1, -1, 1, -1])  # z and ry turn the other way round than y and rz
    twist, polar = E / (2 * (1 + nu)) * 2 * second / h, rho * 2 * second * h / 6
    K, M = np.zeros((6 * (count + 1),) * 2), np.zeros((6 * (count + 1),) * 2)
    for a in range(0, 6 * count, 6):
        for places, k, m in (
            ([a + 1, a + 5, a + 7, a + 11], bend, swing),
            ([a + 2, a + 4, a + 8, a + 10], flip @ bend @ flip, flip @ swing @ flip),
            ([a, a + 6], E * area / h * rod, rho * area * h / 6 * bar),
            ([a + 3, a + 9], twist * rod, polar * bar),
        ):
            K[np.ix_(places, places)] += k
            M[np.ix_(places, places)] += m
    positions = np.zeros((count + 1, 3))
    positions[:, 0] = np.linspace(0, length, count + 1)
    dofs = np.array([(node + 1, d) for node in range(1, count + 1) for d in range(1, 7)])
    return K[6:, 6:], M[6:, 6:], positions, dofs


def hermite(a, b, c, d, h):
    """The pattern that bending stiffness and rotary inertia of a beam element share."""
    return np.array(
        [
            [a, b * h, -a, b * h],
            [b * h, c * h * h, -b * h, d * h * h],
            [-a, -b * h, a, -b * h],
            [b * h, d * h * h, -b * h, c * h * h],
        ]
    )


def test_nafems_fv4_cantilever_with_two_offset_masses(validated):
    """Beam clamped at x = 0, two masses on rigid arms at its tip: published frequencies."""
    K, M, positions, dofs = beam_cantilever(length=10.0, radius=0.25, count=40)
    part = fi.FEModel.from_arrays(K, M, positions, dofs, node_ids=np.arange(1, 42))
    with pytest.warns(fi.ExportWarning):
        beam = fi.reduce(part, interfaces={"tip": [41]}, max_frequency=200.0)
    model = ibs.Model("FV4")
    model.flexible_body("beam", beam)
    point = (1e-3,) * 3 + (0,) * 3  # point masses
    model.rigid_body("heavy", mass=10000.0, cog=(10, 2, 0), inertia=point)
    model.rigid_body("light", mass=1000.0, cog=(10, -2, 0), inertia=point)
    for name in ("heavy", "light"):
        model.connection(f"arm {name}", "beam.tip", name, position1=(10, 0, 0), stiffness=(np.inf,) * 6)
    modes = model.linearize().modes()
    validated(
        "cantilever (FE part) with two rigid masses off its tip",
        "NAFEMS FV4; Ansys Verification Manual VMP09-T4",
        [1.723, 1.727, 7.413, 9.972, 18.155, 26.957],
        modes.frequencies[:6],
        rtol=5e-4,
        against="published cases",
        unit="Hz",
    )
    assert any("fixed to the ground" in finding for finding in model.check())
    with pytest.raises(ibs.ModelError, match="cannot move far"):
        model.linearize(flexible="floating-frame")


def between(reduced):
    """platform -k1- blade -k2- mirror, where the flexure will take the blade's place."""
    base, tip = (np.array(reduced.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("m")
    model.fixation("platform", position=base)
    model.rigid_body("blade", mass=0.08, cog=(base + tip) / 2, inertia=(1e-5,) * 3 + (0,) * 3)
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0, 0], inertia=INERTIA)
    model.connection("k1", "platform", "blade", position1=base, stiffness=MOUNT, zeta=0.01)
    model.connection("k2", "blade", "mirror", position1=tip, stiffness=GLUE, zeta=0.01)
    return model


def test_connections_that_are_replaced_leave_the_part_locked_to_their_other_end(reduced):
    model = between(reduced)
    model.replace_with_flexible("flexure", reduced, parts=["k1", "blade", "k2"])
    assert set(model.connections) == {"flexure-base", "flexure-tip"}
    modes = model.linearize().modes()
    assert not modes.rigid.any()
    clamped = ibs.Model("clamped")
    clamped.fixation("platform", position=reduced.interfaces["base"].position)
    clamped.rigid_body("mirror", mass=0.3, cog=model.items["mirror"].cog, inertia=INERTIA)
    clamped.flexible_body("flexure", reduced)
    clamped.connection("a", "platform", "flexure.base", stiffness=(np.inf,) * 6)
    clamped.connection("b", "flexure.tip", "mirror", stiffness=(np.inf,) * 6)
    np.testing.assert_allclose(modes.frequencies, clamped.linearize().modes().frequencies, rtol=1e-9)
    assert list(model.items) == ["platform", "flexure", "mirror"]  # the part stands where the blade stood
    half = between(reduced)
    half.replace_with_flexible("blade", reduced, parts=["blade", "k1"])
    assert half.connections["k2"].item1 == "blade.tip"
    assert half.connections["blade-base"].locked == (True,) * 6


def test_parts_that_have_nothing_to_do_with_it_are_refused(reduced):
    model = between(reduced)
    model.rigid_body("far", mass=1.0, cog=(1, 0, 0), inertia=(1e-3,) * 3 + (0,) * 3)
    model.connection("away", "mirror", "far", position1=(1, 0, 0), stiffness=GLUE)
    for parts, words in (
        (["blade", "away"], "both stay"),
        (["k1", "k2"], "name the bodies"),
        ([], "list of different names"),
        ("blade", "list of different names"),
        (["blade", "blade"], "list of different names"),
        ([["blade"]], "list of different names"),
    ):
        before = (dict(model.items), dict(model.connections))
        with pytest.raises(ibs.ModelError, match=words):
            model.replace_with_flexible("blade", reduced, parts=parts)
        assert (dict(model.items), dict(model.connections)) == before
    with pytest.raises(ibs.ModelError, match="must be"):
        model.replace_with_flexible("blade", reduced, interfaces=["base"])


def test_a_part_that_lies_elsewhere_is_told(reduced):
    model = ibs.Model("m")
    model.fixation("ground", position=(1, 0, 0))
    model.rigid_body("mirror", mass=0.3, cog=(1.05, 0, 0), inertia=INERTIA)
    model.connection("flexure", "ground", "mirror", (1, 0, 0), (1.04, 0, 0), (1e6,) * 3 + (500,) * 3, damping=(1,) * 6)
    with pytest.warns(ibs.ModelWarning, match="explicit damping"):
        model.replace_with_flexible("flexure", reduced, zeta=0.01, interfaces={"ground": "base", "mirror": "tip"})
    assert any("does the part lie where the model has it" in finding for finding in model.check())


class Witness:
    """An Exudyn system that looks up every item it is given: of a key that it does not know Exudyn says nothing."""

    def __init__(self, mbs):
        self._mbs = mbs
        self.seen = set()

    def __getattr__(self, name):
        own = getattr(self._mbs, name)
        if name not in ("AddNode", "AddObject", "AddMarker"):
            return own

        def add(item):
            number = own(item)
            known = getattr(self._mbs, name.replace("Add", "Get"))(number)
            assert item.keys() <= known.keys(), item.keys() - known.keys()
            self.seen.add(next(iter(item.values())))
            return number

        return add


@pytest.fixture
def mbs():
    import exudyn  # here, after ibsdyn has kept it from reading settings of the user's

    return Witness(exudyn.SystemContainer().AddSystem())


@pytest.mark.parametrize(
    ("flexible", "body"), [("small-deflection", "GenericODE2"), ("floating-frame", "FFRFreducedOrder")]
)
def test_exudyn_knows_every_key_of_its_items(reduced, mbs, flexible, body):
    with silent():
        Translation(hybrid(reduced).assembly(), mbs, flexible)
    assert mbs.seen >= {"RigidBody", "ConnectorRigidBodySpringDamper", "BodyRigid", body}


@pytest.mark.parametrize(("axis", "body"), [("x", "Mass1D"), ("rz", "RotationalMass1D")])
def test_exudyn_knows_every_key_of_its_items_in_1d(mbs, axis, body):
    model = ibs.Model("1-D", axis=axis)
    model.fixation("floor")
    model.rigid_body("mass", **{"inertia" if axis == "rz" else "mass": 2.0})
    model.connection("spring", "floor", "mass", stiffness=1e4)
    with silent():
        Translation(model.assembly(), mbs, "small-deflection")
    assert mbs.seen >= {"1D", body, "ConnectorCoordinateSpringDamper", "NodeCoordinate"}

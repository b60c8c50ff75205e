"""Free-interface, static and selected bases, sensor points, effective masses and the cache: against dense algebra."""

import io
import os
import re
import sys

import numpy as np
import pytest
from own_fe import brick_block, euler_beam, flexure_block, frequencies
from scipy.linalg import eigh, null_space

import fem_import as fi

FLEXURE = flexure_block()
ENDS = {"base": "LEFT", "tip": "RIGHT"}
METHODS = ("craig-bampton", "craig-chang", "guyan")
TIES = ("rigid", "average")


@pytest.fixture(scope="module")
def flexure():
    return fi.FEModel.from_arrays(**FLEXURE.arrays)


def tie_basis(block, points):
    """Return L: all DoF per free DoF and rigid frame of each end, written out by hand."""
    tied = np.isin(block.dofs[:, 0], np.concatenate([block.node_sets[name] for name in ("LEFT", "RIGHT")]))
    frames = np.zeros((len(tied), 12))
    for index, name in enumerate(("LEFT", "RIGHT")):
        for node in block.node_sets[name]:
            arm = block.positions[node - 1] - points[index]
            rows = slice(3 * (node - 1), 3 * node)
            frames[rows, 6 * index : 6 * index + 3] = np.eye(3)
            for axis in range(3):
                frames[rows, 6 * index + 3 + axis] = np.cross(np.eye(3)[axis], arm)
    return np.hstack([np.eye(len(tied))[:, ~tied], frames])


def full_matrices(block, body):
    """Return dense K, M of the full model with the frames of a body as its last or extra coordinates."""
    if body.interfaces["base"].tie == "average":
        return block.K.toarray(), block.M.toarray()
    L = tie_basis(block, [frame.position for frame in body.interfaces.values()])
    return L.T @ block.K @ L, L.T @ block.M @ L


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("tie", TIES)
@pytest.mark.filterwarnings("ignore::fem_import.ExportWarning")
def test_mass_properties_survive_every_method(flexure, tie, method):
    body = fi.reduce(flexure, ENDS, 60e3, tie=tie, method=method)
    motion, full = body.rigid_body_motion, flexure.rigid_body_motion()
    assert np.max(abs(body.K @ motion)) < 1e-12 * np.max(abs(body.K[:12, :12]))
    np.testing.assert_allclose(motion.T @ body.M @ motion, full.T @ (FLEXURE.M @ full), rtol=1e-9, atol=1e-15)
    values = eigh(body.K, body.M, eigvals_only=True)
    assert np.all(abs(values[:6]) < 1e-9 * values[6])
    np.testing.assert_allclose(body.K[:12, 12:], 0.0)


@pytest.mark.parametrize("tie", TIES)
def test_free_interface_modes_are_kept_exactly(flexure, tie):
    """What a part does on its own below the cut-off, a free-interface basis holds to rounding."""
    body = fi.reduce(flexure, ENDS, 60e3, tie=tie, method="craig-chang", inertia_vectors=False)
    full = frequencies(*full_matrices(FLEXURE, body))[6:]
    below = full[full < 60e3]
    assert len(below) >= 5
    np.testing.assert_allclose(frequencies(body.K, body.M)[6 : 6 + len(below)], below, rtol=1e-8)
    assert len(body.frequencies) == len(below) + 6  # and six inertia-relief vectors


@pytest.mark.parametrize("tie", TIES)
def test_free_and_fixed_interface_bases_converge_to_the_same(flexure, tie):
    """On springs to ground, where neither basis holds the modes: frequencies and receptances at the tip."""
    springs = np.diag([3e6, 5e6, 8e6, 400.0, 300.0, 500.0, 1e6, 2e6, 1e6, 90.0, 90.0, 90.0])
    frequency = np.geomspace(300.0, 30e3, 40)
    last = None
    for cutoff in (40e3, 80e3, 160e3):
        found, receptance = [], []
        for method in ("craig-bampton", "craig-chang"):
            body = fi.reduce(flexure, ENDS, cutoff, tie=tie, method=method)
            K = np.array(body.K)
            K[:12, :12] += springs
            found.append(frequencies(K, body.M)[:8])
            omega2 = (2 * np.pi * frequency) ** 2
            receptance.append(np.array([np.linalg.inv(K * (1 + 0.02j) - w * body.M)[6:12, 6:12] for w in omega2]))
        spread = np.max(abs(found[1] / found[0] - 1.0))
        scale = np.sqrt(
            np.einsum("fi,fj->fij", *(2 * [np.max(abs(np.diagonal(receptance[0], axis1=1, axis2=2)), 0)[None]]))
        )
        difference = np.max(abs(receptance[1] - receptance[0]) / scale)
        assert last is None or spread < 0.5 * last or spread < 1e-8
        last = spread
    assert spread < 1e-6
    assert difference < 1e-4


def test_the_free_interface_basis_of_a_held_part():
    block = brick_block((8, 2, 2), (0.08, 0.01, 0.01))
    kept = np.flatnonzero(~np.isin(block.dofs[:, 0], block.node_sets["LEFT"]))
    part = fi.FEModel.from_arrays(
        block.K[kept][:, kept], block.M[kept][:, kept], block.positions, block.dofs[kept], node_sets=block.node_sets
    )
    with pytest.warns(fi.ExportWarning, match="fixed to ground"):
        body = fi.reduce(part, {"tip": "RIGHT"}, 40e3, tie="average", method="craig-chang")
    full = frequencies(block.K.toarray()[np.ix_(kept, kept)], block.M.toarray()[np.ix_(kept, kept)])
    np.testing.assert_allclose(frequencies(body.K, body.M)[:5], full[:5], rtol=1e-8)


def test_a_single_free_interface(flexure):
    body = fi.reduce(flexure, {"base": "LEFT"}, 60e3, tie="average", method="craig-chang")
    np.testing.assert_allclose(frequencies(body.K, body.M)[6:10], frequencies(FLEXURE.K, FLEXURE.M)[6:10], rtol=1e-8)


@pytest.mark.parametrize("tie", TIES)
def test_guyan_is_the_static_condensation(flexure, tie):
    body = fi.reduce(flexure, ENDS, 15e3, tie=tie, method="guyan")
    K, M = FLEXURE.K.toarray(), FLEXURE.M.toarray()
    L = tie_basis(FLEXURE, [frame.position for frame in body.interfaces.values()])
    if tie == "rigid":
        Kt, Mt, n = L.T @ K @ L, L.T @ M @ L, L.shape[1] - 12
        condensed = np.vstack([-np.linalg.solve(Kt[:n, :n], Kt[:n, n:]), np.eye(12)])
        expected = condensed.T @ Kt @ condensed, condensed.T @ Mt @ condensed
    else:
        A = np.vstack([np.linalg.pinv(L[:, -12:][:, 6 * i : 6 * i + 6]) for i in range(2)])
        Z = null_space(A)
        shapes = np.linalg.pinv(A) - Z @ np.linalg.solve(Z.T @ K @ Z, Z.T @ K @ np.linalg.pinv(A))
        expected = shapes.T @ K @ shapes, shapes.T @ M @ shapes
    assert body.M.shape == (12, 12)
    for found, wanted in zip((body.K, body.M), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-7 * np.max(abs(wanted)))


def test_guyan_says_where_it_ends(flexure):
    first = fi.reduce(flexure, ENDS, 60e3).frequencies[0]
    with pytest.warns(fi.ExportWarning, match="'guyan' keeps no mode.*first is at " + re.escape(f"{first:.4g} Hz")):
        fi.reduce(flexure, ENDS, 1.1 * first, method="guyan")


def test_an_error_in_the_trusted_range_is_said(flexure):
    with pytest.warns(fi.ExportWarning, match=r"raises the mode .* by at least \d.*Take inertia_vectors=True"):
        body = fi.reduce(flexure, ENDS, 60e3, inertia_vectors=False)
    said = float(body.findings[0].split("at least ")[1].split(" %")[0]) / 100
    full = frequencies(*full_matrices(FLEXURE, body))[6:]
    own = frequencies(body.K, body.M)[6:]
    true = own / full[: len(own)] - 1
    assert 0.5 * said < np.max(true[own < 40e3]) < 3 * said


def test_modes_that_the_frames_do_not_feel_are_left_out(flexure):
    """Participation by dense modes; the body stays right, as the inertia vectors take over."""
    every = fi.reduce(flexure, ENDS, 100e3, inertia_vectors=False)
    factors = every.M[12:, :12]
    share = np.max(
        factors**2 / (2 * np.pi * every.frequencies[:, None]) ** 2 / np.diag(every.dynamic_compliance)[:12], 1
    )
    inner = ~np.isin(FLEXURE.dofs[:, 0], np.concatenate([FLEXURE.node_sets["LEFT"], FLEXURE.node_sets["RIGHT"]]))
    L = tie_basis(FLEXURE, [frame.position for frame in every.interfaces.values()])
    n = inner.sum()
    Kt, Mt = L.T @ FLEXURE.K @ L, L.T @ FLEXURE.M @ L
    shapes = np.linalg.solve(Kt[:n, :n], -Kt[:n, n:])
    loads = Mt[:n, :n] @ shapes + Mt[:n, n:]
    whole = np.einsum("ij,ij->j", loads, np.linalg.solve(Kt[:n, :n], loads))
    np.testing.assert_allclose(np.diag(every.dynamic_compliance)[:12], whole, rtol=1e-6)
    limit = 0.999 * float(np.sort(share)[len(share) // 3])
    with pytest.warns(fi.ExportWarning, match="raises the mode"):
        chosen = fi.reduce(flexure, ENDS, 100e3, inertia_vectors=False, min_participation=limit)
    np.testing.assert_allclose(chosen.frequencies, every.frequencies[share >= limit])
    repaired = fi.reduce(flexure, ENDS, 100e3, min_participation=limit)
    full = frequencies(Kt, Mt)[6:]
    np.testing.assert_allclose(frequencies(repaired.K, repaired.M)[6:11], full[:5], rtol=1e-3)


@pytest.mark.parametrize("tie", TIES)
@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang"])
def test_a_sensor_point_keeps_its_motion_and_its_compliance(tie, method):
    """The middle of a block held at both ends: static compliance exact, receptance far beyond the first mode."""
    block = brick_block((8, 2, 2), (0.16, 0.02, 0.02))
    part = fi.FEModel.from_arrays(**block.arrays)
    middle = fi.Plane((0.08, 0, 0), (1, 0, 0))
    top = int(part.node_ids[np.argmin(np.linalg.norm(part.positions - [0.08, 0.02, 0.02], axis=1))])
    body = fi.reduce(part, ENDS, 12e3, tie=tie, method=method, sensors={"optic": middle, "accelerometer": top})
    optic, node = body.sensors["optic"], body.sensors["accelerometer"]
    assert optic.motion.shape == (6, len(body.K))
    assert node.motion.shape == (3, len(body.K))
    np.testing.assert_allclose(optic.position, [0.08, 0.01, 0.01])
    rigid = body.rigid_body_motion
    np.testing.assert_allclose(
        node.motion @ rigid[:, 3:], np.cross(np.eye(3), node.position).T * -1.0 * -1.0, atol=1e-9
    )
    watch = np.zeros((3, len(block.dofs)))
    watch[:, 3 * (top - 1) : 3 * top] = np.eye(3)
    K, M = block.K.toarray(), block.M.toarray()
    # Both frames on springs, so that the part is held whatever the tie.
    springs = np.diag([1e7, 1e7, 1e7, 5e2, 5e2, 5e2] * 2)
    L = tie_basis(block, [frame.position for frame in body.interfaces.values()])
    if tie == "rigid":
        held = L.T @ K @ L
        held[-12:, -12:] += springs
        mass, watched = L.T @ M @ L, watch @ L
    else:
        A = np.vstack([np.linalg.pinv(L[:, -12:][:, 6 * i : 6 * i + 6]) for i in range(2)])
        held, mass, watched = K + A.T @ springs @ A, M, watch
    reduced = np.array(body.K)
    reduced[:12, :12] += springs
    static = node.motion @ np.linalg.solve(reduced, node.motion.T)
    np.testing.assert_allclose(static, watched @ np.linalg.solve(held, watched.T), rtol=1e-7, atol=1e-7 * static.max())
    w = (2 * np.pi * 6e3) ** 2
    full = watched @ np.linalg.solve(held - w * mass, watched.T)
    np.testing.assert_allclose(
        node.motion @ np.linalg.solve(reduced - w * body.M, node.motion.T), full, atol=5e-3 * abs(full).max()
    )
    plain = fi.reduce(part, ENDS, 12e3, tie=tie, method=method)
    assert len(plain.K) < len(body.K) <= len(plain.K) + 9


def test_sensor_points_that_cannot_be(flexure):
    node = int(FLEXURE.node_sets["LEFT"][0])
    for sensors, words in [
        ({"tip": node}, "'tip' is an interface already"),
        ({"a.b": node}, "cannot name an interface"),
        ({"a": fi.Interface("LEFT", tie="rigid")}, "make it an interface"),
        ({"a": fi.Interface([node], position=(9, 9, 9))}, "is a single node, which tells no rotation"),
        ({"a": 10**6}, "^Sensor 'a' names node 1000000, which arrays does not have"),
        (["a"], "sensors must be a mapping"),
    ]:
        with pytest.raises(fi.InterfaceError, match=words):
            fi.reduce(flexure, ENDS, 60e3, sensors=sensors)


def test_effective_masses_are_those_of_the_modes(flexure):
    body = fi.reduce(flexure, ENDS, 60e3, inertia_vectors=False)
    found = fi.effective_masses(body)
    L = tie_basis(FLEXURE, [frame.position for frame in body.interfaces.values()])
    n = L.shape[1] - 12
    inner = L[:, :n]
    values, shapes = eigh(inner.T @ FLEXURE.K @ inner, inner.T @ FLEXURE.M @ inner)
    below = np.sqrt(values) < 2 * np.pi * 60e3
    factors = shapes.T @ inner.T @ (FLEXURE.M @ flexure.rigid_body_motion(body.centre_of_mass))
    np.testing.assert_allclose(found.masses, factors[below] ** 2, rtol=1e-5, atol=1e-9 * factors.max() ** 2)
    np.testing.assert_allclose(found.total[:3], body.mass)
    np.testing.assert_allclose(found.above_cutoff, 1 - (factors[below] ** 2).sum(axis=0) / found.total, atol=1e-7)
    energy = factors**2 / values[:, None]
    np.testing.assert_allclose(found.static_residual, 1 - energy[below].sum(0) / energy.sum(0), atol=1e-5)
    assert np.all(fi.effective_masses(fi.reduce(flexure, ENDS, 60e3)).static_residual < 1e-9)
    assert "above cut-off" in str(found)
    assert found.plot().get_ylabel().endswith("[% of the total]")


def test_both_ties_are_compared(flexure):
    spread = fi.compare_ties(flexure, ENDS, 60e3)
    rigid, average = (fi.reduce(flexure, ENDS, 60e3, tie=tie) for tie in TIES)
    np.testing.assert_allclose(
        spread.rigid_frequencies, frequencies(rigid.K, rigid.M)[6 : 6 + len(spread.rigid_frequencies)]
    )
    assert np.all(spread.frequency_spread > -1e-9)
    for name, values in spread.average_stiffness.items():
        assert name == "tip"
        np.testing.assert_allclose(values, 1 / np.diag(np.linalg.inv(average.K[6:12, 6:12])), rtol=1e-9)
    assert np.all(spread.stiffness_spread["tip"] > -1e-9)
    assert "stiffness at tip" in str(spread)
    assert len(spread.plot().patches) == len(spread.frequency_spread) + 6


def test_the_cache_is_keyed_by_content(flexure, tmp_path):
    folder = tmp_path / "cache"
    first = fi.reduce(flexure, ENDS, 60e3, cache=folder)
    (path,) = folder.iterdir()
    stamp = path.stat().st_mtime_ns
    again = fi.reduce(flexure, ENDS, 60e3, cache=folder)
    assert path.stat().st_mtime_ns == stamp
    for name in ("M", "K", "basis", "dynamic_compliance", "frequencies"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert np.all(np.diag(fi.mode_check(flexure, again, n_modes=3).mac) > 0.999)
    heavier = fi.FEModel.from_arrays(**(FLEXURE.arrays | {"M": 1.001 * FLEXURE.M}))
    fi.reduce(heavier, ENDS, 60e3, cache=folder)
    fi.reduce(flexure, ENDS, 61e3, cache=folder)
    fi.reduce(flexure, ENDS, 60e3, tie="average", cache=folder)
    fi.reduce(flexure, ENDS, 60e3, cache=folder, sensors={"watch": 40})
    assert len(list(folder.iterdir())) == 5


def test_a_broken_cache_file_is_noticed_and_made_anew(flexure, tmp_path):
    whole = fi.reduce(flexure, ENDS, 60e3, cache=tmp_path)
    (path,) = tmp_path.iterdir()
    content = bytearray(path.read_bytes())
    for broken in (content[: len(content) // 2], b"", content[:3000] + b"\xff" + content[3001:]):
        path.write_bytes(bytes(broken))
        with pytest.warns(fi.ExportWarning, match="cannot be used and is made anew"):
            body = fi.reduce(flexure, ENDS, 60e3, cache=tmp_path)
        np.testing.assert_array_equal(body.K, whole.K)
        assert os.listdir(tmp_path) == [path.name]
    np.testing.assert_array_equal(fi.ReducedBody.load(path).K, whole.K)


def test_findings_are_said_again_from_the_cache(flexure, tmp_path):
    for _ in range(2):
        with pytest.warns(fi.ExportWarning, match="too low"):
            body = fi.reduce(flexure, ENDS, 5e3, cache=tmp_path)
        assert "too low" in str(body)


def test_a_cache_that_is_a_file_is_refused(flexure, tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(fi.ReductionError, match="is a file; give a folder"):
        fi.reduce(flexure, ENDS, 60e3, cache=tmp_path / "file")


@pytest.mark.parametrize("folder", [5, True, "", "a\0b", ["cache"]])
def test_a_cache_that_is_no_folder_is_refused(flexure, folder):
    with pytest.raises(fi.ReductionError, match="cache must be a folder; got"):
        fi.reduce(flexure, ENDS, 60e3, cache=folder)


@pytest.mark.parametrize("tie", TIES)
@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang"])
def test_pairs_of_a_symmetric_part_agree_in_shape_too(tie, method):
    """The modes of a pair have no axes of their own: any two in their plane are as good. A pair may be cut in two."""
    bar = fi.FEModel.from_arrays(**brick_block((6, 2, 2), (0.1, 0.01, 0.01)).arrays)
    body = fi.reduce(bar, ENDS, 60e3, tie=tie, method=method)
    for n_modes in (1, 2, 3):
        check = fi.mode_check(bar, body, n_modes=n_modes)
        assert check.mac.shape == (n_modes, n_modes)
        np.testing.assert_allclose(check.mac, np.eye(n_modes), atol=1e-5)
    assert abs(check.tied[1] / check.tied[0] - 1) < 1e-6


def test_a_line_of_point_masses_has_no_free_modes():
    beam = euler_beam(0.2, 4, 7e10, 2.7e10, 2700.0, 1e-4, 1e-9, 2e-9)
    lumped = np.diag(np.where(beam.dofs[:, 1] <= 3, 1e-3, 0.0))
    part = fi.FEModel.from_arrays(**{**beam.arrays, "M": lumped})
    assert "moves no mass" in str(part.report())
    with pytest.raises(fi.ReductionError, match="no inertia against one of its rigid-body motions"):
        fi.reduce(part, {"root": "ROOT"}, 3e4, method="craig-chang")
    with pytest.raises(fi.ExportError, match=r"root\.rx has no mass .*CONM2"):
        fi.reduce(part, {"root": "ROOT"}, 3e4)


@pytest.mark.parametrize(("share", "method"), [(1.0, "craig-bampton"), (-0.1, "craig-bampton"), (0.1, "guyan")])
def test_bad_participation(flexure, share, method):
    with pytest.raises(fi.ReductionError, match="min_participation"):
        fi.reduce(flexure, ENDS, 60e3, method=method, min_participation=share)


def test_a_terminal_sees_the_stages_and_a_file_nothing(flexure, monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    for stream, seen in ((Terminal(), True), (io.StringIO(), False)):
        monkeypatch.setattr(sys, "stderr", stream)
        fi.reduce(flexure, ENDS, 60e3)
        text = stream.getvalue()
        assert bool(text) == seen
        if seen:
            for stage in ("reducing arrays", "checking the export", "factoring", "modes below 60000 Hz", "projection"):
                assert stage in text


def test_what_is_no_part_and_no_body_is_refused(flexure):
    body = fi.reduce(flexure, ENDS, 60e3)
    with pytest.raises(fi.ReductionError, match="in this order; got ReducedBody and FEModel"):
        fi.mode_check(body, flexure)
    with pytest.raises(fi.ReductionError, match="got FEModel"):
        fi.effective_masses(flexure)
    for n_modes in ("3", 2.5, True, 0, float("nan")):
        with pytest.raises(fi.ReductionError, match="n_modes must be a whole number above 0; got"):
            fi.mode_check(flexure, body, n_modes=n_modes)
    for frequency in ("3", [1.0], -1.0, float("nan")):
        with pytest.raises(fi.ReductionError, match="max_frequency must be a positive number of Hz; got"):
            fi.mode_check(flexure, body, max_frequency=frequency)
    with pytest.raises(fi.InterfaceError, match="interfaces must be a mapping"):
        fi.compare_ties(flexure, ["LEFT"], 60e3)

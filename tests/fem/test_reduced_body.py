"""ReducedBody: by hand, saved and loaded; mode_check."""

import pickle

import numpy as np
import pytest
from own_fe import euler_beam, flexure_block

import fem_import as fi


@pytest.fixture(scope="module")
def part():
    return fi.FEModel.from_arrays(**flexure_block().arrays)


@pytest.fixture(scope="module")
def body(part):
    interfaces = {"base": "LEFT", "tip": fi.Interface("RIGHT", tie="average")}
    return fi.reduce(part, interfaces, 60e3)


def two_frames():
    """A beam element as a superelement: mass and stiffness of two frames."""
    beam = euler_beam(2.0, 1, 2e11, 8e10, 7850.0, 1e-2, 1e-5, 2e-5)
    return beam.M.toarray(), beam.K.toarray(), {"base": (0, 0, 0), "tip": (2.0, 0, 0)}


def test_coordinates_are_named(body):
    assert body.coordinates[:7] == ("base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz", "tip.x")
    assert body.coordinates[12] == "mode1"
    assert len(body.coordinates) == len(body.M)


def test_from_arrays_finds_mass_and_freedom():
    M, K, interfaces = two_frames()
    body = fi.ReducedBody.from_arrays(M, K, interfaces)
    assert body.is_free
    assert body.mass == pytest.approx(7850 * 1e-2 * 2.0)
    np.testing.assert_allclose(body.centre_of_mass, [1.0, 0, 0], atol=1e-12)
    assert body.inertia[1, 1] == pytest.approx(body.mass * 2.0**2 / 12 + 7850.0 * 1e-5 * 2.0)
    grounded = fi.ReducedBody.from_arrays(M, K + np.diag(1e-3 * np.diag(K)), interfaces)
    assert not grounded.is_free


def test_from_arrays_takes_modes():
    M, K, interfaces = two_frames()
    more = fi.ReducedBody.from_arrays(
        np.pad(M, (0, 1)) + np.diag([0.0] * 12 + [2.0]),
        np.pad(K, (0, 1)) + np.diag([0.0] * 12 + [2.0 * (2 * np.pi * 440.0) ** 2]),
        interfaces,
    )
    np.testing.assert_allclose(more.frequencies, [440.0])
    assert more.max_frequency == pytest.approx(440.0)
    assert more.coordinates[-1] == "mode1"


M, K, FRAMES = two_frames()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((M[:10, :10], K[:10, :10], FRAMES), fi.ExportError, "need 12 coordinates"),
        ((M, K[:11, :11], FRAMES), fi.ExportError, "K must be square"),
        ((M + np.eye(12, k=1), K, FRAMES), fi.ExportError, "M is not symmetric"),
        ((-M, K, FRAMES), fi.ExportError, "M is not positive definite"),
        ((M, -K, FRAMES), fi.ExportError, "K is not positive semi-definite"),
        ((M * np.nan, K, FRAMES), fi.ExportError, "must be finite"),
        ((M, K, {"base": (0, 0), "tip": (1, 0, 0)}), fi.InterfaceError, "'base'.*three finite"),
        ((M, K, {"ba.se": (0, 0, 0), "tip": (1, 0, 0)}), fi.InterfaceError, "without dots"),
        ((M, "K", FRAMES), fi.ExportError, "K must be an array"),
    ],
)
def test_bad_matrices_are_refused_in_words(arguments, error, words):
    with pytest.raises(error, match=words):
        fi.ReducedBody.from_arrays(*arguments)


def test_save_and_load_is_exact(body, tmp_path):
    path = tmp_path / "flexure.npz"
    body.save(path)
    loaded = fi.ReducedBody.load(path)
    for name in ("M", "K", "frequencies", "centre_of_mass", "inertia"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(body, name))
    for name in ("mass", "max_frequency", "is_free", "source", "solver", "coordinates", "C"):
        assert getattr(loaded, name) == getattr(body, name)
    for name, frame in body.interfaces.items():
        other = loaded.interfaces[name]
        np.testing.assert_array_equal(other.position, frame.position)
        np.testing.assert_array_equal(other.node_ids, frame.node_ids)
        assert (other.radius, other.tie) == (frame.radius, frame.tie)
    np.testing.assert_array_equal(loaded.inertia_integrals.flexible, body.inertia_integrals.flexible)
    assert loaded.basis is None
    assert [file.name for file in tmp_path.iterdir()] == ["flexure.npz"]
    assert pickle.loads(pickle.dumps(loaded)).coordinates == body.coordinates


def test_a_failed_save_leaves_the_old_file(body, tmp_path, monkeypatch):
    path = tmp_path / "flexure.npz"
    body.save(path)
    before = path.read_bytes()

    def fail(*_args, **_arrays):
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez", fail)
    with pytest.raises(OSError, match="disk full"):
        body.save(path)
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def attempt(path):
    try:
        return fi.ReducedBody.load(path), None
    except fi.ExportError as error:
        return None, error


def test_damaged_files_are_refused(body, tmp_path):
    path = tmp_path / "flexure.npz"
    body.save(path)
    good = path.read_bytes()
    random = np.random.default_rng(3)
    for _ in range(60):
        at = int(random.integers(0, len(good)))
        path.write_bytes(good[:at] if random.random() < 0.3 else good[:at] + bytes([good[at] ^ 0x55]) + good[at + 1 :])
        loaded, error = attempt(path)
        if error is not None:
            assert "flexure.npz" in str(error)
        else:  # a byte that says nothing, such as a date in the archive
            np.testing.assert_array_equal(loaded.M, body.M)
    np.savez(path, M=body.M)
    with pytest.raises(fi.ExportError, match="not a saved ReducedBody"):
        fi.ReducedBody.load(path)
    with np.errstate(all="ignore"):
        path.write_bytes(b"no archive at all")
    with pytest.raises(fi.ExportError, match="damaged"):
        fi.ReducedBody.load(path)
    with pytest.raises(fi.MissingFileError):
        fi.ReducedBody.load(tmp_path / "none.npz")


def test_changed_content_fails_the_checksum(body, tmp_path):
    path = tmp_path / "flexure.npz"
    body.save(path)
    with np.load(path) as archive:
        arrays = dict(archive)
    arrays["mass"] = arrays["mass"] * 2
    np.savez(path, **arrays)
    with pytest.raises(fi.ExportError, match="checksum"):
        fi.ReducedBody.load(path)


def test_mode_check_compares_like_with_like(part, body, tmp_path):
    check = fi.mode_check(part, body, n_modes=4)
    assert np.max(abs(check.differences)) < 1e-5
    assert np.min(np.diag(check.mac)) > 1 - 1e-6
    assert np.all(check.tie_stiffening > 0)
    assert "MAC" in str(check)
    assert check.plot().get_xlabel() == "frequency [Hz]"
    body.save(tmp_path / "b.npz")
    again = fi.mode_check(part, fi.ReducedBody.load(tmp_path / "b.npz"), n_modes=4)
    np.testing.assert_allclose(again.tied, check.tied, rtol=1e-12)
    assert again.mac is None


def test_mode_check_refuses_another_part(body):
    beam = euler_beam(1.0, 4, 2e11, 8e10, 7850.0, 1e-2, 1e-5, 2e-5)
    with pytest.raises(fi.ReductionError, match="another part"):
        fi.mode_check(fi.FEModel.from_arrays(**beam.arrays), body)


def test_texts(body):
    assert "tip: average at" in str(body)
    assert "interfaces base, tip" in repr(body)

"""One part, assembled by CalculiX, in each program's text format and in two systems of units: one reduced body."""

import io
import shutil
import subprocess
import sys
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from calculix_files import deck_text, write_export
from export_writers import (
    write_abaqus_job,
    write_ansys_mmf_job,
    write_hbmat_job,
    write_matrix_market_job,
    write_punch,
)
from own_fe import flexure_block, frequencies
from scipy import sparse

import fem_import as fi

INTERFACES = {"base": "LEFT", "tip": "RIGHT"}


@dataclass(frozen=True)
class Written:
    """What the writers need of a part."""

    K: Any
    M: Any
    positions: np.ndarray
    dofs: np.ndarray
    elements: np.ndarray
    node_sets: dict


def in_millimetres(part):
    """The same part in mm, t, s: forces in N, masses in t = N s2/mm."""
    return replace(part, K=part.K * 1e-3, M=part.M * 1e-3, positions=part.positions * 1e3)


def read_calculix(folder, part, units):
    return fi.read(write_export(folder, part, digits=16), units=units)


def read_hbmat(folder, part, units):
    return fi.read(write_hbmat_job(folder, part), units=units)


def read_ansys_export(folder, part, units):
    path = write_ansys_mmf_job(folder, part)
    others = {"nodes": folder / "nodes.txt", "mapping": folder / "map.txt"}
    return fi.read(path, units=units, node_sets=part.node_sets, **others)


def read_matrix_market(folder, part, units):
    return fi.read(write_matrix_market_job(folder, part), units=units, dofs=folder / "dofs.csv")


def read_abaqus(layout):
    return lambda folder, part, units: fi.read(write_abaqus_job(folder, part, layout), units=units)


def read_punch(folder, part, units):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ExportWarning)  # ten digits
        return fi.read(write_punch(folder, part), units=units, node_sets=part.node_sets)


FORMATS = {
    "CalculiX": (read_calculix, 16),
    "Ansys HBMAT": (read_hbmat, 16),
    "Ansys *EXPORT": (read_ansys_export, 16),
    "Matrix Market": (read_matrix_market, 16),
    "Abaqus MATRIX INPUT": (read_abaqus("MATRIX INPUT"), 16),
    "Abaqus LABELS": (read_abaqus("LABELS"), 16),
    "Abaqus COORDINATE": (read_abaqus("COORDINATE"), 16),
    "Nastran DMIG": (read_punch, 10),
}


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    """The flexure as CalculiX assembles it; by the tests' own elements where CalculiX is not there."""
    own = flexure_block()
    if shutil.which("ccx") is None:
        return Written(own.K, own.M, own.positions, own.dofs, own.elements, own.node_sets)
    deck = tmp_path_factory.mktemp("ccx") / "part.inp"
    deck.write_text(deck_text(own))
    subprocess.run(["ccx", deck.stem], cwd=deck.parent, check=True, capture_output=True, timeout=60)
    exported = fi.read(deck)
    order = np.lexsort((exported.dofs[:, 1], exported.dofs[:, 0]))
    K, M = (sparse.csr_array(matrix[order][:, order]) for matrix in (exported.K, exported.M))
    return Written(K, M, own.positions, exported.dofs[order], own.elements, own.node_sets)


@pytest.fixture(scope="module")
def reference(part):
    model = fi.FEModel.from_arrays(part.K, part.M, part.positions, part.dofs, node_sets=part.node_sets)
    return fi.reduce(model, INTERFACES, 6e4)


@pytest.mark.parametrize("units", ["SI", "mm-t-s"])
@pytest.mark.parametrize("name", FORMATS)
def test_every_text_format_gives_the_same_reduced_body(tmp_path, part, reference, name, units):
    read, digits = FORMATS[name]
    model = read(tmp_path / "export", part if units == "SI" else in_millimetres(part), units)
    assert model.digits == digits
    body = fi.reduce(model, INTERFACES, 6e4)
    assert body.coordinates == reference.coordinates
    # The last printed digit of K weighs as much as its stiffest entries do against the softest elastic mode.
    own = frequencies(reference.K, reference.M)[6:]
    stiffest = np.max(part.K.diagonal() / part.M.diagonal())
    room = max(1e-8, 10.0 ** (1 - digits) * stiffest / (2 * np.pi * own[0]) ** 2)
    assert room < 1e-4
    assert body.mass == pytest.approx(reference.mass, rel=10.0 ** (2 - digits) * 100)
    np.testing.assert_allclose(
        body.inertia, reference.inertia, rtol=0, atol=10.0 ** (4 - digits) * reference.inertia.max()
    )
    np.testing.assert_allclose(frequencies(body.K, body.M)[6:], own, rtol=room)
    frames = slice(0, 12)
    for ours, theirs in ((body.K, reference.K), (body.M, reference.M)):
        scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))[frames, frames]
        np.testing.assert_allclose(ours[frames, frames] / scale, theirs[frames, frames] / scale, rtol=0, atol=room)


def test_the_part_is_as_calculix_assembled_it(part):
    """Its mass is that of the bricks, and it is free: what every format carries on."""
    model = fi.FEModel.from_arrays(part.K, part.M, part.positions, part.dofs, node_sets=part.node_sets)
    own = flexure_block()
    motion = np.tile(np.eye(3), (len(own.positions), 1))
    assert model.report().mass == pytest.approx(np.trace(motion.T @ (own.M @ motion)) / 3, rel=1e-12)
    assert model.report().support == "free"


@pytest.mark.parametrize("name", FORMATS)
def test_a_terminal_sees_which_file_is_read_and_a_file_nothing(tmp_path, part, monkeypatch, name):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    for stream in (Terminal(), io.StringIO()):
        monkeypatch.setattr(sys, "stderr", stream)
        FORMATS[name][0](tmp_path / type(stream).__name__, part, "SI")
        assert ("reading " in stream.getvalue()) == stream.isatty()
        if stream.isatty():
            read = [path.name for path in (tmp_path / "Terminal").iterdir() if path.name in stream.getvalue()]
            assert any("mas" in file.lower() or "_M" in file or file.endswith(".pch") for file in read)

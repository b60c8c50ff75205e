"""Matrix Market, NPZ and MATLAB: our own part there and back, hostile files."""

import gzip
import io
import pickle
import re
import sys
import zipfile

import numpy as np
import pytest
from export_writers import (
    write_dof_table,
    write_full,
    write_matrix_market_job,
)
from own_fe import brick_block, frequencies
from reader_checks import assert_damage_is_answered, assert_same_part
from scipy import io as scipy_io
from scipy import sparse

import fem_import as fi
from fem_import.readers.long_text import LongText
from fem_import.readers.triplets import parse_triplets

BLOCK = brick_block((3, 1, 2), (0.03, 0.01, 0.02))


@pytest.fixture
def market(tmp_path):
    return write_matrix_market_job(tmp_path / "mm", BLOCK)


def read_market(path):
    return fi.read(path, units="SI", dofs=path.with_name("dofs.csv"))


def test_matrix_market_with_a_dof_table(market):
    part = read_market(market)
    assert_same_part(part, BLOCK)
    for name, nodes in BLOCK.node_sets.items():
        np.testing.assert_array_equal(part.node_sets[name], nodes)
    write_dof_table(market.with_name("dofs.csv"), BLOCK, separator=";", by_name=True)
    assert_same_part(read_market(market), BLOCK)


def test_matrix_market_as_scipy_writes_it(market):
    scipy_io.mmwrite(market, sparse.coo_matrix(BLOCK.K), symmetry="general", precision=16)
    dense = (BLOCK.M + BLOCK.M.T).toarray() / 2
    scipy_io.mmwrite(market.with_name("part_M.mtx"), dense, symmetry="symmetric", precision=16)
    assert_same_part(read_market(market), BLOCK)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("dofs.csv", lambda t: t.replace("direction", "dir", 1), "no column 'direction'"),
        ("dofs.csv", lambda t: "".join(t.splitlines(True)[:-1]), "72 rows and dofs.csv has 71"),
        ("dofs.csv", lambda t: re.sub(r"\n1,1,", "\n1,7,", t), "direction '7'"),
        ("dofs.csv", lambda t: re.sub(r"\n1,2,", "\n1,1,", t), "occurs 2 times"),
        ("dofs.csv", lambda t: re.sub(r"\n1,2,0\.0", "\n1,2,0.5", t), "is at"),
        ("dofs.csv", lambda t: re.sub(r"\n1,(\d),0\.0", r"\n1,\1,nan", t), "is at|not finite"),
        ("dofs.csv", lambda t: t.replace("\n1,1,", "\n1;1,", 1), "fields for"),
        ("part_K.mtx", lambda t: t.replace("symmetric", "hermitian"), "hermitian"),
        ("part_K.mtx", lambda t: t.replace("\n72 72 ", "\n99999999999999 99999999999999 ", 1), "has 99999999"),
        ("part_K.mtx", lambda t: t.replace("\n72 72 ", "\n72 72\n", 1), "sizes"),
        ("part_M.mtx", lambda t: t.replace("matrix coordinate", "vector coordinate"), "line 1"),
    ],
)
def test_damage_is_refused_in_words(market, name, change, words):
    path = market.with_name(name)
    path.write_text(change(path.read_text()))
    with pytest.raises(fi.ExportError, match=words):
        read_market(market)


def test_matrix_market_needs_its_table_and_units(market):
    with pytest.raises(fi.ExportError, match="Give dofs="):
        fi.read(market, units="SI")
    with pytest.raises(fi.ExportError, match="Give units="):
        fi.read(market, dofs=market.with_name("dofs.csv"))
    market.with_name("part_M.mtx").unlink()
    with pytest.raises(fi.MissingFileError, match=r"part_M\.mtx is not beside"):
        read_market(market)


def named(model, **more):
    sets = {f"set_{name}": nodes for name, nodes in model.node_sets.items()}
    return {"K": model.K.toarray(), "M": model.M.toarray(), "positions": model.positions, **sets, **more}


def test_npz_dense_and_sparse(tmp_path):
    path = tmp_path / "part.npz"
    np.savez_compressed(path, **named(BLOCK))
    part = fi.read(path, units="SI")
    assert_same_part(part, BLOCK)
    np.testing.assert_array_equal(part.node_sets["LEFT"], BLOCK.node_sets["LEFT"])
    K, M = BLOCK.K.tocsr(), BLOCK.M.tocoo()
    arrays = {"K_data": K.data, "K_indices": K.indices, "K_indptr": K.indptr}
    arrays |= {"M_data": M.data, "M_row": M.coords[0], "M_col": M.coords[1], "dofs": BLOCK.dofs}
    np.savez(path, positions=BLOCK.positions, **arrays)
    assert_same_part(fi.read_npz(path, units="SI"), BLOCK)
    np.savez(path, **arrays)
    with pytest.raises(fi.ExportError, match="holds no positions"):
        fi.read(path, units="SI")
    write_dof_table(tmp_path / "dofs.csv", BLOCK)
    assert_same_part(fi.read(path, units="SI", dofs=tmp_path / "dofs.csv"), BLOCK)


def test_npz_never_unpickles_and_believes_no_header(tmp_path):
    path = tmp_path / "part.npz"

    class Bomb:
        def __reduce__(self):
            return (sys.exit, (1,))

    np.savez(path, **named(BLOCK, dofs=np.array([Bomb()], dtype=object)), allow_pickle=True)
    with pytest.raises(fi.ExportError, match="Python objects"):
        fi.read(path, units="SI")
    with zipfile.ZipFile(path, "w") as archive:
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**7, 10**7)})
        archive.writestr("K.npy", header.getvalue())
    with pytest.raises(fi.ExportError, match="declares shape"):
        fi.read(path, units="SI")
    path.write_bytes(pickle.dumps(BLOCK.positions))
    with pytest.raises(fi.ExportError):
        fi.read_npz(path, units="SI")
    body = fi.reduce(fi.FEModel.from_arrays(**BLOCK.arrays), {"left": "LEFT"}, 3e5)
    body.save(path)
    with pytest.raises(fi.ExportError, match=r"fi\.ReducedBody\.load"):
        fi.read(path, units="SI")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"K": None}, "holds no K: the stiffness"),
        ({"M": None}, r"holds no M .*: the mass"),
        ({"E": BLOCK.M.toarray()}, "names of one matrix"),
        ({"K": BLOCK.K.toarray() * (1 + 0.01j)}, "complex"),
        ({"K": np.array(["a"])}, "no matrix of numbers"),
        ({"K": BLOCK.K.toarray()[:-1]}, "71 rows for 24 positions"),
        ({"K": np.full((72, 72), np.nan)}, "must be finite"),
        ({"positions": BLOCK.positions[:-1]}, "72 rows for 23 positions"),
        ({"set_TIP": np.array([99])}, "names node 99"),
    ],
)
def test_wrong_arrays_are_refused_in_words(tmp_path, change, words):
    arrays = {name: array for name, array in {**named(BLOCK), **change}.items() if array is not None}
    np.savez(tmp_path / "part.npz", **arrays)
    with pytest.raises(fi.ExportError, match=words):
        fi.read(tmp_path / "part.npz", units="SI")


def test_matlab_with_other_names_says_which_there_are(tmp_path):
    """mphmatrix' eliminated matrices, and its struct saved as it is."""
    path = tmp_path / "part.mat"
    scipy_io.savemat(
        path, {"Kc": sparse.csc_matrix(BLOCK.K), "Ec": sparse.csc_matrix(BLOCK.M), "positions": BLOCK.positions}
    )
    with pytest.raises(fi.ExportError, match=r"holds no K.* Did you mean 'Kc'.*names=\{'K': "):
        fi.read(path, units="SI")
    part = fi.read(path, units="SI", names={"K": "Kc", "E": "Ec"})
    assert_same_part(part, BLOCK)
    scipy_io.savemat(path, {"m": {"K": sparse.csc_matrix(BLOCK.K)}, "positions": BLOCK.positions})
    with pytest.raises(fi.ExportError, match=r"'m'.*fields of a struct"):
        fi.read(path, units="SI")
    with pytest.raises(fi.ExportError, match=r"no matrix 'm'.*struct"):
        fi.read(path, units="SI", names={"K": "m"})


def test_matlab_version_5_with_the_names_of_comsol(tmp_path):
    path = tmp_path / "part.mat"
    C = 1e-5 * BLOCK.K
    nodes = np.column_stack([np.arange(1, len(BLOCK.positions) + 1), BLOCK.positions])
    arrays = {"K": sparse.csc_matrix(BLOCK.K), "E": sparse.csc_matrix(BLOCK.M), "D": sparse.csc_matrix(C)}
    scipy_io.savemat(path, {**arrays, "nodes": nodes, "dofs": BLOCK.dofs.astype(float), "set_TIP": [[1.0, 2.0]]})
    part = fi.read(path, units="SI")
    assert_same_part(part, BLOCK)
    np.testing.assert_allclose(part.C.toarray(), C.toarray(), rtol=1e-12, atol=1e-9)
    np.testing.assert_array_equal(part.node_sets["TIP"], [1, 2])
    scipy_io.savemat(path, {"Stiff": BLOCK.K.toarray(), "Mass": BLOCK.M.toarray(), "positions": BLOCK.positions})
    assert_same_part(fi.read(path, units="SI", names={"K": "Stiff", "M": "Mass"}), BLOCK)
    with pytest.raises(fi.ExportError, match="no matrix 'Masss'"):
        fi.read(path, units="SI", names={"K": "Stiff", "M": "Masss"})
    with pytest.raises(fi.UnknownNameError, match=r"has no .position'.*Did you mean 'positions'"):
        fi.read(path, units="SI", names={"position": "xyz"})


def test_matlab_with_indices_out_of_range(tmp_path):
    """Compiled code would write outside its memory."""
    K = sparse.csc_matrix(BLOCK.K)
    K.indices[5] = 10**6
    scipy_io.savemat(tmp_path / "part.mat", {**named(BLOCK), "K": K})
    with pytest.raises(fi.ExportError, match="K is no sparse matrix"):
        fi.read(tmp_path / "part.mat", units="SI")


def write_matlab_73(path, model):
    h5py = pytest.importorskip("h5py", reason="the extra [matlab]")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, matrix in (("K", model.K), ("M", model.M)):
            columns = sparse.csc_array(matrix)
            group = file.create_group(name)
            group.attrs["MATLAB_sparse"] = np.uint64(columns.shape[0])
            for key, array in (("data", columns.data), ("ir", columns.indices), ("jc", columns.indptr)):
                group[key] = array if key == "data" else array.astype("u8")
        file["positions"] = model.positions.T
        file["dofs"] = np.asarray(model.dofs).T.astype(float)
        file["set_LEFT"] = model.node_sets["LEFT"][None, :].astype(float)
    content = bytearray(path.read_bytes())
    content[:124] = b"MATLAB 7.3 MAT-file".ljust(124)
    path.write_bytes(content)


def test_matlab_version_73(tmp_path, monkeypatch):
    path = tmp_path / "part.mat"
    write_matlab_73(path, BLOCK)
    part = fi.read(path, units="SI")
    assert_same_part(part, BLOCK)
    np.testing.assert_array_equal(part.node_sets["LEFT"], BLOCK.node_sets["LEFT"])
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ImportError, match=r'pip install "ibsdyn\[matlab\]"'):
        fi.read(path, units="SI")


def test_matlab_73_that_declares_too_much(tmp_path):
    h5py = pytest.importorskip("h5py", reason="the extra [matlab]")
    path = tmp_path / "part.mat"
    with h5py.File(path, "w") as file:
        file.create_dataset("K", shape=(10**6, 10**6), chunks=(1000, 1000), dtype="f8")
    with pytest.raises(fi.ExportError, match="declares shape"):
        fi.read_matlab(path, units="SI")


def test_damage_never_gives_another_exception(tmp_path, market):
    assert_damage_is_answered(market.parent, lambda: read_market(market), range(120))
    for name, write in (
        ("a.npz", lambda path: np.savez(path, **named(BLOCK))),
        ("b.npz", lambda path: np.savez_compressed(path, **named(BLOCK))),
        ("a.mat", lambda path: scipy_io.savemat(path, named(BLOCK))),
        ("b.mat", lambda path: scipy_io.savemat(path, {**named(BLOCK), "K": sparse.csc_matrix(BLOCK.K)})),
        ("c.mat", lambda path: write_matlab_73(path, BLOCK)),
    ):
        folder = tmp_path / name.replace(".", "_")
        folder.mkdir()
        write(folder / name)
        assert_damage_is_answered(folder, lambda path=folder / name: fi.read(path, units="SI"), range(80), at_least=0)


HALF_READ = [
    b"1.0D0",
    b"1.5-105",
    b"1..5",
    b"2 3",
    b"0x1p3",
    b"",
    b"1.e5.5",
    b"1e400",
    b"+",
    b"1.0 # note",
    b"1.0e",
    b"1.0E+",
    b"-",
    b"1.0e5 .",
]


@pytest.mark.parametrize("value", HALF_READ)
def test_lines_that_are_none_are_never_half_read(value):
    """Parsers that stop at the first wrong character would read 1.0D0 as 1 and 1.5-105 as 1.5."""
    with pytest.raises(fi.ExportError, match=r"row column value|not a finite"):
        parse_triplets(LongText(b"1 1 1.0E0\n1 1 " + value + b"\n"), "x")


def test_gzip_that_is_cut_or_followed_by_more(market):
    packed = gzip.compress(market.read_bytes())
    market.unlink()
    path = market.with_name("part_K.mtx.gz")
    beside = {"dofs": market.with_name("dofs.csv"), "mass": market.with_name("part_M.mtx")}
    for content, words in ((packed[:-20], "truncated|cannot be read"), (packed + b"more", "follows the packed")):
        path.write_bytes(content)
        with pytest.raises(fi.ExportError, match=words):
            fi.read_matrix_market(path, units="SI", **beside)
    path.write_bytes(packed[:400] + gzip.compress(b""))
    with pytest.raises(fi.ExportError, match="cannot be read"):
        fi.read_matrix_market(path, units="SI", **beside)


def test_folders_and_pipes_are_no_files(tmp_path):
    import os

    with pytest.raises(fi.ExportError, match="is not a file"):
        fi.read(tmp_path, units="SI")
    os.mkfifo(tmp_path / "pipe.mtx")
    with pytest.raises(fi.ExportError, match="is not a file"):
        fi.read(tmp_path / "pipe.mtx", units="SI")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("part.op2", "MATOP4= or DMIGPCH"),
        ("job.odb", r"\*MATRIX OUTPUT"),
        ("part.rst", r"the \.full file, or HBMAT"),
        ("job.frd", "SOLVER=MATRIXSTORAGE"),
        ("part.mph", "mphmatrix"),
    ],
)
def test_files_that_programs_keep_beside_are_told_from_exports(tmp_path, name, words):
    path = tmp_path / name
    path.write_bytes(b"\x04\0\0\0" * 100)
    for options in ({}, {"interfaces": {"base": 1}}):
        with pytest.raises(fi.ExportError, match=f"{name} is .*{words}.*docs/import.md"):
            fi.read(path, units="SI", **options)


def test_full_file_gives_the_same_body(tmp_path):
    path = tmp_path / "part.full"
    write_full(path, BLOCK)
    (tmp_path / "nodes.txt").write_text(
        "".join(f"{i} {x!r} {y!r} {z!r}\n" for i, (x, y, z) in enumerate(BLOCK.positions.tolist(), start=1))
    )
    part = fi.read(path, units="SI", nodes=tmp_path / "nodes.txt", node_sets=BLOCK.node_sets)
    ours, own = (fi.reduce(item, {"a": "LEFT"}, 3e5) for item in (part, fi.FEModel.from_arrays(**BLOCK.arrays)))
    np.testing.assert_allclose(frequencies(ours.K, ours.M)[6:], frequencies(own.K, own.M)[6:], rtol=1e-9)

"""The Nastran readers: real OUTPUT4 and DMIG, our own writers, superelements, damage."""

import gzip
import re

import numpy as np
import pytest
from export_writers import grid_cards, punch, write_punch
from own_fe import brick_block, euler_beam, frequencies
from reader_checks import assert_damage_is_answered, assert_same_part, sample
from scipy import sparse

import fem_import as fi
from fem_import.readers.nastran_bulk import parse_bulk
from fem_import.readers.nastran_columns import split_columns
from fem_import.readers.nastran_op4 import parse_op4

BLOCK = brick_block((3, 1, 2), (0.03, 0.01, 0.02))
BEAM = euler_beam(0.2, 4, 7e10, 2.7e10, 2700.0, 1e-4, 1e-9, 2e-9)


def write_op4_binary(path, matrices, order="<", single=False, strings=True, big=False, i8=False):
    """i8: as Nastran writes with 8-byte words, in which a name has four characters a word."""
    whole, spelled = (order + "i8", "{:8s}{:8s}") if i8 else (order + "i4", "{:4s}{:4s}")
    with path.open("wb") as stream:

        def record(*parts):
            body = b"".join(np.asarray(part).tobytes() for part in parts)
            mark = np.array([len(body)], order + "i4").tobytes()
            stream.write(mark + body + mark)

        real, per_value = (order + "f4", 1) if single else (order + "f8", 1 if i8 else 2)
        for name, matrix in matrices.items():
            dense = matrix.toarray()
            n = len(dense)
            kind = 1 if single else 2
            label = spelled.format(name[:4], name[4:])
            record(np.array([n, -n if big else n, 6, kind], whole), np.frombuffer(label.encode(), "u1"))
            for column in range(n):
                rows = np.flatnonzero(dense[:, column])
                if not len(rows):
                    continue
                if not strings:
                    values = dense[rows[0] : rows[-1] + 1, column].astype(real)
                    head = [column + 1, rows[0] + 1, per_value * len(values)]
                    record(np.array(head, whole), values)
                    continue
                parts, n_words = [], 0
                for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
                    length = per_value * len(run)
                    head = [length + 1, run[0] + 1] if big else [(length + 1) * 65536 + run[0] + 1]
                    parts += [np.array(head, whole), dense[run, column].astype(real)]
                    n_words += length + len(head)
                record(np.array([column + 1, 0, n_words], whole), *parts)
            record(np.array([n + 1, 1, per_value], whole), np.ones(1, real))


def six_each(model):
    """The block as Nastran has it: six rows a grid point, the rotations of solids empty."""
    n = len(model.positions)
    rows = (6 * np.arange(n)[:, None] + np.arange(3)).ravel()
    grow = sparse.csr_array((np.ones(3 * n), (rows, np.arange(3 * n))), shape=(6 * n, 3 * n))
    return {"KGG": grow @ model.K @ grow.T, "MGG": grow @ model.M @ grow.T}


I8_LAYOUTS = [{"i8": True, **more} for more in ({}, {"strings": False}, {"big": True}, {"order": ">"})]


@pytest.mark.parametrize("layout", [{}, {"strings": False}, {"big": True}, {"order": ">"}, *I8_LAYOUTS])
def test_output4_binary_with_bulk_data(tmp_path, layout):
    write_op4_binary(tmp_path / "part.op4", six_each(BLOCK), **layout)
    (tmp_path / "part.bdf").write_text("CEND\nBEGIN BULK\n" + grid_cards(BLOCK) + "ENDDATA\n")
    part = fi.read(tmp_path / "part.op4", units="SI", bulk=tmp_path / "part.bdf", node_sets=BLOCK.node_sets)
    assert_same_part(part, BLOCK)
    assert part.digits is None
    (tmp_path / "part.op4.gz").write_bytes(gzip.compress((tmp_path / "part.op4").read_bytes()))
    assert_same_part(fi.read(tmp_path / "part.op4.gz", units="SI", bulk=tmp_path / "part.bdf"), BLOCK)


def test_output4_of_another_writer(tmp_path):
    op4 = pytest.importorskip("pyyeti.nastran.op4", reason="an independent writer; pip install pyyeti")
    matrix = BLOCK.K.toarray() / 1e6
    for binary in (True, False):
        for layout in ("dense", "bigmat", "nonbigmat"):
            path = tmp_path / f"{layout}{binary}.op4"
            op4.write(str(path), {"KGG": matrix}, sparse=layout, binary=binary)
            found = parse_op4(path.read_bytes(), path.name)["KGG"]
            read = np.zeros_like(matrix)
            read[found.rows, found.columns] = found.values
            np.testing.assert_allclose(read, matrix, rtol=1e-15)


def test_plate_of_nastran():
    eigenvalues = {}
    for name in ("testplate_kgg.op4", "testplate_kgg_ascii.op4"):
        found = parse_op4(sample("nastran", name).read_bytes(), name)["KGG"]
        K = np.zeros((726, 726))
        K[found.rows, found.columns] = found.values
        np.testing.assert_array_equal(K, K.T)
        eigenvalues[name] = np.linalg.eigvalsh(K)
        assert np.count_nonzero(abs(eigenvalues[name]) < 1e-3 * eigenvalues[name][6]) == 6
        assert found.digits == (10 if "ascii" in name else None)
    np.testing.assert_allclose(*[values[6:] for values in eigenvalues.values()], rtol=1e-5)


def test_output4_samples_of_all_kinds():
    """The same matrices in text and binary: dense, sparse, single, double, complex, empty."""
    text, binary = (parse_op4(sample("nastran", n).read_bytes(), n) for n in ("mat_t_s1.op4", "mat_b_s1.op4"))
    assert set(text) == set(binary) >= {"EYE10", "LOW", "NULL", "RND1CS", "RND1RD", "STRINGS"}
    for name, found in text.items():
        other = binary[name]
        assert (found.size, found.is_complex) == (other.size, other.is_complex)
        read = [sparse.coo_array((m.values, (m.rows, m.columns)), shape=(50, 50)).toarray() for m in (found, other)]
        np.testing.assert_allclose(*read, rtol=1e-6)
    np.testing.assert_array_equal(text["EYE10"].values, np.ones(10))


def test_dmig_samples():
    found = parse_bulk(sample("nastran", "dmig.pch").read_text(), "dmig.pch").matrices
    assert {"KAAX", "MAAX", "BAAX"} <= set(found)
    assert found["KAAX"].form == 6
    terms = found["KAAX"]
    assert (*terms.columns[0], *terms.rows[0], terms.values[0]) == (101, 1, 101, 1, 155.6)
    assert (*terms.columns[1], *terms.rows[1], terms.values[1]) == (102, 1, 101, 1, -155.6)
    assert found["KAAX"].digits == 10
    with pytest.raises(fi.ExportError, match=r"holds no mass matrix"):
        fi.read(sample("nastran", "dmig_sparse.pch"), units="SI")


def test_punch_in_large_field_warns_of_ten_digits(tmp_path):
    path = write_punch(tmp_path / "p", BLOCK)
    with pytest.warns(fi.ExportWarning, match="10 digits") as caught:
        part = fi.read(path, units="SI")
    assert caught[0].filename == __file__
    assert part.digits == 10
    assert_same_part(part, BLOCK, digits=9)


def test_columns_in_large_field_are_taken_as_arrays_or_term_by_term(tmp_path):
    """Both ways give the same terms; a tab leaves the file to the slower one."""
    text = write_punch(tmp_path / "p", BLOCK).read_text()
    columns, others = split_columns(text)
    assert set(columns) == {"KAAX", "MAAX"}
    assert not any(line.startswith("DMIG*") for _, line in others)
    slow_text = text.replace("*       ", "*\t", 1)
    assert split_columns(slow_text) == ({}, list(enumerate(slow_text.splitlines(), start=1)))
    fast, slow = (parse_bulk(each, "x.pch") for each in (text, slow_text))
    for name, matrix in fast.matrices.items():
        other = slow.matrices[name]
        for ours, theirs in ((matrix.rows, other.rows), (matrix.columns, other.columns), (matrix.values, other.values)):
            np.testing.assert_array_equal(ours, theirs)
        assert (matrix.form, matrix.digits) == (other.form, other.digits) == (6, 10)
    np.testing.assert_array_equal(fast.nodes.positions, slow.nodes.positions)


def test_punch_in_small_field(tmp_path):
    with pytest.warns(fi.ExportWarning, match="digits"):
        part = fi.read_nastran(write_punch(tmp_path / "p", BLOCK, large=False), units="SI")
    np.testing.assert_allclose(part.K.diagonal(), BLOCK.K.diagonal(), rtol=1e-3)


def test_free_field_cards():
    text = "$ comment\nGRID,7,,1.,2.-1,3.0D0\nGRID           8             1.5     0.    -2.+1\nGRID,9\n"
    nodes = parse_bulk(text, "x.bdf").nodes
    np.testing.assert_array_equal(nodes.labels, [7, 8, 9])
    np.testing.assert_allclose(nodes.positions, [[1, 0.2, 3], [1.5, 0, -20], [0, 0, 0]])


@pytest.fixture
def superelement(tmp_path):
    body = fi.reduce(fi.FEModel.from_arrays(**BEAM.arrays), {"root": "ROOT", "tip": "TIP"}, 3e4)
    n_modes = len(body.frequencies)
    dofs = [(node, c) for node in (1, 5) for c in range(1, 7)] + [(90001 + k, 0) for k in range(n_modes)]
    matrices = {"KAAX": sparse.csr_array(body.K), "MAAX": sparse.csr_array(body.M)}
    (tmp_path / "se").mkdir()
    path = tmp_path / "se" / "se.pch"
    path.write_text("".join(punch(name, m, dofs) for name, m in matrices.items()) + grid_cards(BEAM))
    write_op4_binary(path.with_suffix(".op4"), matrices)
    return body, path


def test_external_superelement_becomes_a_reduced_body(superelement):
    body, path = superelement
    interfaces = {"root": 1, "tip": 5}
    exact = fi.read(
        path.with_suffix(".op4"), units="SI", interfaces=interfaces, positions={1: (0, 0, 0), 5: (0.2, 0, 0)}
    )
    np.testing.assert_array_equal(exact.K, body.K)
    assert exact.mass == pytest.approx(2700 * 1e-4 * 0.2, rel=1e-9)
    with pytest.warns(fi.ExportWarning) as caught:
        punched = fi.read_nastran_superelement(path, interfaces, units="SI")
    assert any("10 digits" in str(item.message) for item in caught)
    np.testing.assert_allclose(punched.K, body.K, rtol=1e-8, atol=1e-8 * body.K.max())
    np.testing.assert_allclose(frequencies(punched.K, punched.M)[6:], frequencies(body.K, body.M)[6:], rtol=1e-6)
    with pytest.raises(fi.ExportError, match=r"fi\.read\(path.*interfaces=.*fi\.read_nastran_superelement"):
        fi.read(path, units="SI")
    with (
        pytest.warns(fi.ExportWarning, match="10 digits"),
        pytest.raises(fi.InterfaceError, match="node 5 is retained and is no interface"),
    ):
        fi.read_nastran_superelement(path, {"root": 1}, units="SI")


def extern(n_modes):
    """The EXTRN of the beam's superelement, small fields that touch, going on in lines that start with blanks."""
    pairs = [(20110001, 123456), (20110005, 123456), *((90001 + k, 0) for k in range(n_modes))]
    fields = "".join(f"{label:8d}{components:8d}" for label, components in pairs)
    lines = [fields[at : at + 64] for at in range(0, len(fields), 64)]
    return "EXTRN   " + "\n        ".join(lines) + "\n"


def test_output4_superelement_with_rows_and_turned_axes_of_its_punch_file(superelement, tmp_path):
    """As EXTSEOUT with MATOP4 writes: no labels, empty 1 x 1 matrices, GRIDs in systems of their own."""
    body, _ = superelement
    n_modes = len(body.frequencies)
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])  # columns: the axes of system 20110001
    T = np.eye(12 + n_modes)
    T[6:9, 6:9] = T[9:12, 9:12] = turn
    empty = sparse.csr_array((1, 1))
    matrices = {"KAA": sparse.csr_array(T.T @ body.K @ T), "MAA": sparse.csr_array(T.T @ body.M @ T)}
    path = tmp_path / "n.op4"
    write_op4_binary(path, matrices | {"BXX": empty, "K4XX": empty, "KASMX": empty, "MUG1": empty}, i8=True)
    tip = turn.T @ [0.2, 0.0, 0.0]
    bulk = tmp_path / "n.pch"
    bulk.write_text(
        "$ comment\nBEGIN SUPER      10\n"
        "CORD2R *20110001                        0.              0.\n"
        "*       0.              .8              0.              .6\n"
        "*       .6              0.              -.8\n" + extern(n_modes) + f"GRID   *20110001\n"
        f"GRID   *20110005        20110001        {tip[0]:<16.9f}{tip[1]:<16.9f}\n*       {tip[2]:<16.9f}20110001\n"
        f"SPOINT     90001    THRU{90000 + n_modes:8d}\n"
    )
    read = fi.read(path, units="SI", interfaces={"tip": 20110005, "root": 20110001}, bulk=bulk)
    assert read.is_free
    order = [*range(6, 12), *range(6), *range(12, 12 + n_modes)]
    np.testing.assert_allclose(read.K, body.K[np.ix_(order, order)], atol=1e-12 * body.K.max())
    np.testing.assert_allclose(read.M, body.M[np.ix_(order, order)], atol=1e-12 * body.M.max())
    with pytest.raises(fi.InterfaceError, match="node 20110005 is retained"):
        fi.read(path, units="SI", interfaces={"root": 20110001}, bulk=bulk)
    with pytest.raises(fi.ExportError, match=r"read that one, with this one as bulk="):
        fi.read(bulk, units="SI")
    cut = tmp_path / "cut.pch"
    cut.write_text(bulk.read_text().replace("20110005  123456", "20110005     126"))
    write_op4_binary(path, {name: m[: m.shape[0] - 3, : m.shape[0] - 3] for name, m in matrices.items()})
    with pytest.raises(fi.ExportError, match=r"GRID 20110005 .* cannot be turned"):
        fi.read(path, units="SI", interfaces={"root": 20110001}, bulk=cut)


def test_grid_points_in_cylinders_and_spheres():
    """Positions and directions by hand: r, theta, z and r, theta (from the pole), phi."""
    text = (
        "CORD2C,1,0,1.,2.,3.,1.,2.,4.\n,2.,2.,3.\n"  # at (1, 2, 3), axes as the basic ones
        "CORD2S,2,1,0.,0.,0.,0.,0.,1.\n,1.,90.,0.\n"  # its x axis along the basic y
        "GRID,10,1,2.,90.,5.,1\nGRID,11,2,2.,90.,90.,2\nGRID,12,2,4.,60.,0.,1\n"
    )
    found = parse_bulk(text, "x.bdf")
    expected = [[1, 4, 8], [-1, 2, 3], [1, 2 + 4 * np.sin(np.pi / 3), 5]]
    np.testing.assert_allclose(found.nodes.positions, expected, atol=1e-14)
    columns = {10: [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], 11: [[-1, 0, 0], [0, 0, -1], [0, -1, 0]]}
    for label, directions in columns.items():
        np.testing.assert_allclose(found.axes[label].T, directions, atol=1e-14)
    for change, words in (("CORD2S,2,2,", "defined in it"), ("CORD2S,2,9,", "system 9 is not defined")):
        with pytest.raises(fi.ExportError, match=words):
            parse_bulk(text.replace("CORD2S,2,1,", change), "x.bdf")
    with pytest.raises(fi.ExportError, match="lie on a line"):
        parse_bulk(text.replace(",2.,2.,3.", ",1.,2.,9."), "x.bdf")


def test_text_output4_of_large_and_of_old_files():
    """Sizes that need 16 columns are announced by |I16; old headers tell no format, which is 5E16.9 then."""
    wide = (
        "              19       -10000001       2       1MATDT   1P,3E23.16|I16\n       1       0       4\n"
        "       3     700\n 1.5000000000000000E+00-2.5000000000000000E+00\n      20       1       1\n"
        " 1.0000000000000000E+00\n"
    )
    old = "       3       2       2       1SE_START\n       2       1       2\n 1.000000000E+00-4.000000000E+00\n"
    found = parse_op4((wide + old + "       4       1       1\n 1.000000000E+00\n").encode(), "x.op4")
    assert found["MATDT"].size == found["SE_START"].size == -1
    np.testing.assert_array_equal([found["MATDT"].rows, found["MATDT"].columns], [[699, 700], [0, 0]])
    np.testing.assert_array_equal(found["MATDT"].values, [1.5, -2.5])
    np.testing.assert_array_equal([found["SE_START"].rows, found["SE_START"].columns], [[0, 1], [1, 1]])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("MAAX", "LAAX"), "no mass matrix"),
        (lambda t: t + "GRID,3,,0.,0.,0.\n", "occurs 2 times"),
        (lambda t: t.replace("GRID*", "GRAD*"), "no GRID cards"),
        (lambda t: re.sub(r"(GRID\* +3)" + " " * 16, r"\1" + f"{7:16d}", t), "coordinate system 7 is not defined"),
        (lambda t: t.replace("DMIG", "DMYG"), "no reader knows|in the .op4 beside it"),
        (lambda t: t.replace("DMIG    MAAX", "DMIG    NAAX", 1), "before its declaration|has no declaration"),
        (lambda t: re.sub(r"\d\.\d{9}D", "1.0000000x0D", t, count=1), "expected a number"),
        (lambda t: t.replace("KAAX           0       6", "KAAX           0       9"), "no stiffness matrix"),
        (lambda t: t[:-4], "within a line"),
        (lambda t: t.replace("KAAX", "K2AX", 1), "before its declaration|has no declaration"),
        (lambda t: t.replace("MAAX", "KBBX").replace("KAAX", "KCCX"), "say which is the stiffness"),
    ],
)
def test_damaged_punch_files_are_refused(tmp_path, change, words):
    path = write_punch(tmp_path / "p", BLOCK)
    path.write_text(change(path.read_text()))
    with pytest.raises((fi.ExportError, fi.MissingFileError), match=words):
        fi.read(path, units="SI")


def test_output4_needs_its_rows_and_units(tmp_path):
    path = tmp_path / "part.op4"
    write_op4_binary(path, six_each(BLOCK))
    with pytest.raises(fi.ExportError, match="Give bulk="):
        fi.read(path, units="SI")
    with pytest.raises(fi.ExportError, match="Give units="):
        fi.read(path)
    with pytest.raises(fi.ExportError, match=r"no matrix 'KGGG'.*Did you mean 'KGG'"):
        fi.read(path, units="SI", names={"K": "KGGG"})
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(fi.ExportError, match="truncated"):
        fi.read(path, units="SI")


def test_damage_never_gives_another_exception(tmp_path, superelement):
    punched = write_punch(tmp_path / "p", BLOCK)
    assert_damage_is_answered(punched.parent, lambda: fi.read(punched, units="SI"), range(100))
    _, path = superelement
    path.unlink()
    positions = {1: (0, 0, 0), 5: (0.2, 0, 0)}
    assert_damage_is_answered(
        path.parent,
        lambda: fi.read_nastran_superelement(
            path.with_suffix(".op4"), {"root": 1, "tip": 5}, units="SI", positions=positions
        ),
        range(150),
    )


def test_damage_of_text_output4_never_gives_another_exception(tmp_path):
    content = sample("nastran", "testplate_kgg_ascii.op4").read_bytes()[:60_000]
    path = tmp_path / "plate.op4"
    path.write_bytes(content[: content.rfind(b"\n") + 1])
    bulk = tmp_path / "plate.bdf"
    bulk.write_text("GRID,1\n")
    assert_damage_is_answered(tmp_path, lambda: fi.read(path, units="SI", bulk=bulk), range(60))

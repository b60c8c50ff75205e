"""The Ansys text readers: the published rotor, our own writers, damage."""

import gzip
import re

import numpy as np
import pytest
from export_writers import write_ansys_mmf_job, write_cdb, write_coordinate, write_full, write_hbmat_job
from own_fe import brick_block, euler_beam, frequencies
from reader_checks import assert_damage_is_answered, assert_same_part, in_node_order, sample

import fem_import as fi

BLOCK = brick_block((3, 1, 2), (0.03, 0.01, 0.02))
# Case 09: published for the rotor with K scaled by 1e-2 (github jgerstmayr/EXUDYN, compareAbaqusAnsysRotor...).
ROTOR = [104.63701, 104.63701, 187.82409, 212.32970, 224.55211, 238.68791, 284.20472, 284.20472]


@pytest.fixture
def hbmat(tmp_path):
    return write_hbmat_job(tmp_path / "hb", BLOCK)


@pytest.fixture
def exported(tmp_path):
    return write_ansys_mmf_job(tmp_path / "mmf", BLOCK)


def read_exported(stiffness):
    return fi.read(
        stiffness, units="SI", nodes=stiffness.with_name("nodes.txt"), mapping=stiffness.with_name("map.txt")
    )


def edit(path, change):
    path.write_text(change(path.read_text()))


def test_rotor_of_case_09():
    folder = sample("rotor")
    part = fi.read(
        folder / "rotorAnsysStiffnessMatrixSparse.txt",
        units="SI",
        nodes=folder / "rotorAnsysNodalCoordinates.txt",
        mapping=folder / "rotorAnsysMatrixDofMappingVector.txt",
    )
    assert part.K.shape == (345, 345)
    report = part.report()
    assert report.is_free
    assert report.mass == pytest.approx(77.96605, rel=1e-7)
    found = frequencies(part.K, part.M)
    assert np.all(found[:6] < 1e-2)
    np.testing.assert_allclose(found[6:14], ROTOR, rtol=1e-7)
    assert found[6] == pytest.approx(104.63701055079783, rel=1e-9)


def test_hbmat_with_mapping_and_archive(hbmat):
    part = fi.read(hbmat, units="SI")
    assert_same_part(part, BLOCK)
    assert part.digits == 16
    for name, nodes in BLOCK.node_sets.items():
        np.testing.assert_array_equal(part.node_sets[name], nodes)


def test_hbmat_gzipped(hbmat):
    for file in list(hbmat.parent.iterdir()):
        file.with_name(file.name + ".gz").write_bytes(gzip.compress(file.read_bytes()))
        file.unlink()
    assert_same_part(fi.read(hbmat.with_name("stiff.matrix.gz"), units="SI"), BLOCK)


def test_export_with_a_vector_of_nodes_and_decimal_commas(exported):
    assert_same_part(read_exported(exported), BLOCK)


def test_rotational_dofs_and_units(tmp_path):
    """The same beam written in SI and in t, mm, s: the models agree, rotations too."""
    beam = euler_beam(0.2, 4, 7e10, 2.7e10, 2700.0, 1e-4, 1e-9, 2e-9)
    si = write_hbmat_job(tmp_path / "si", beam)
    length = np.where(np.tile(np.arange(6) < 3, 5), 1e-3, 1.0)  # [m] of a unit of each DoF
    scale = np.outer(length, length)

    class InMillimetres:
        # Work in N mm = 1e-3 J; mass in t, so that force is in N.
        K = beam.K.multiply(scale * 1e3).tocsr()
        M = beam.M.multiply(scale * 1e3).tocsr()
        positions, dofs, node_sets = beam.positions * 1e3, beam.dofs, beam.node_sets

    mm = write_hbmat_job(tmp_path / "mm", InMillimetres)
    first, second = fi.read(si, units="SI"), fi.read(mm, units="mm-t-s")
    np.testing.assert_allclose(first.positions, second.positions, rtol=1e-13)
    for one, other in ((first.K, second.K), (first.M, second.M)):
        np.testing.assert_allclose(one.toarray(), other.toarray(), rtol=1e-13, atol=1e-15 * abs(one).max())
    bodies = [fi.reduce(part, {"root": "ROOT", "tip": "TIP"}, 3e4) for part in (first, second)]
    np.testing.assert_allclose(bodies[0].frequencies, bodies[1].frequencies, rtol=1e-9)
    assert bodies[0].mass == pytest.approx(2700 * 1e-4 * 0.2, rel=1e-12)


def test_units_are_required_and_said_how(hbmat):
    with pytest.raises(fi.ExportError, match=r"does not say its units\. Give units=.*'mm-t-s'"):
        fi.read(hbmat)
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'mm-t-s'"):
        fi.read(hbmat, units="mm-ts")
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'mapping'"):
        fi.read(hbmat, units="SI", maping="x")


def test_general_symmetry_and_dense_arrays(exported):
    write_coordinate(
        exported,
        fi.read(exported, units="SI", nodes=exported.with_name("nodes.txt"), mapping=exported.with_name("map.txt")).K,
        symmetric=False,
    )
    assert_same_part(read_exported(exported), BLOCK)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("stiff.matrix", lambda t: t[:-500], "truncated"),
        ("stiff.matrix", lambda t: t.replace("RSA", "CSA", 1), "CSA; real assembled"),
        (
            "stiff.matrix",
            lambda t: re.sub(r"(RSA\s+72\s+72\s+)\d+", r"\g<1>999999999999", t),
            "999999999999 numbers|announce",
        ),
        ("stiff.matrix", lambda t: t.replace("D+", "X+", 1), "is not a number"),
        ("stiff.matrix", lambda t: re.sub(r"\d\.\d{15}D\+\d\d", "NaN", t, count=1), "not finite|not a number"),
        ("mass.matrix", lambda t: re.sub(r"\d\.\d{15}D-\d\d", "0.000000000000000D+00", t), "density"),
        ("stiff.mapping", lambda t: "".join(t.splitlines(True)[:-1]), "stiff.matrix has 72 rows|order the rows"),
        ("stiff.mapping", lambda t: t.replace("UX", "TEMP", 1), "TEMP of node"),
        ("stiff.mapping", lambda t: t.replace("        3 ", "        4 ", 1), "equation 4 follows 2"),
        (
            "mass.mapping",
            lambda t: t.replace("UX", "XU", 1).replace("UY", "UX", 1).replace("XU", "UY", 1),
            "differently",
        ),
        ("stiff.cdb", lambda t: t[: t.index("N,R5.3")], "no end"),
        ("stiff.cdb", lambda t: t[: t.index("CMBLOCK")].replace("NBLOCK", "NBLOK"), "no NBLOCK"),
        ("stiff.cdb", lambda t: t.replace("(3i9,", "(3x9,"), "format"),
        ("stiff.cdb", lambda t: t.replace("\n       24  ", "\n      124  "), "rows of node 24"),
        ("stiff.cdb", lambda t: re.sub(r"(CMBLOCK,LEFT\s+,NODE,\s+)(\d+)", r"\g<1>90", t), "announces 90|holds"),
        ("stiff.cdb", lambda t: re.sub(r"(LEFT[^\n]*\n\(8i10\)\n) {9}1", r"\g<1>       777", t), "names node 777"),
    ],
)
def test_damage_of_hbmat_is_refused_in_words(hbmat, name, change, words):
    edit(hbmat.with_name(name), change)
    with pytest.raises(fi.ExportError, match=words):
        fi.read(hbmat, units="SI")


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("partStiffness.txt", lambda t: "".join(t.splitlines(True)[:-3]), "announces .* entries and has"),
        ("partStiffness.txt", lambda t: t.replace("real symmetric", "complex symmetric"), "complex"),
        ("partStiffness.txt", lambda t: t.replace("72 72 ", "72 73 "), "72 x 73"),
        (
            "partStiffness.txt",
            lambda t: re.sub(r"\n72 72 (\d+)", r"\n9999999 9999999 \1", t),
            "rows and|of different runs|3 or 6",
        ),
        ("partStiffness.txt", lambda t: t.replace("real symmetric", "real general"), "only the lower one"),
        (
            "partStiffness.txt",
            lambda t: re.sub(
                r"\n2 1 (\S+)", r"\n1 2 \1\n2 1 \1", re.sub(r"\n72 72 (\d+)", lambda m: f"\n72 72 {int(m[1]) + 1}", t)
            ),
            "twice",
        ),
        ("partMass.txt", lambda t: t.replace("E-", "D-", 1), "row column value"),
        ("map.txt", lambda t: t.replace("24 1\n", "23 1\n", 1), "numbers are announced"),
        ("map.txt", lambda t: re.sub(r"\n7\n", "\n8\n", t), "occurs 2 times"),
        ("nodes.txt", lambda t: t[:-8], "within a line"),
        ("nodes.txt", lambda t: t.replace("0,01", "0.0,1", 1), "a comma and a dot"),
        (
            "nodes.txt",
            lambda t: "\n".join(line for line in t.split("\n") if not line.startswith("7\t")),
            "rows of node 7",
        ),
        ("nodes.txt", lambda t: re.sub(r"\n7\t([^\t]*)\t[^\t]*\t", r"\n7\t\1\t", t), "label x y z"),
        ("nodes.txt", lambda t: re.sub(r"\n7\t.*", "\n7\t0\t0\t0\t0\t0\t45", t), "rotated nodal"),
    ],
)
def test_damage_of_an_export_is_refused_in_words(exported, name, change, words):
    edit(exported.with_name(name), change)
    with pytest.raises(fi.ExportError, match=words):
        read_exported(exported)


def test_missing_files_name_the_cure(hbmat, exported):
    with pytest.raises(fi.ExportError, match="Give mapping="):
        fi.read(exported, units="SI", nodes=exported.with_name("nodes.txt"))
    with pytest.raises(fi.MissingFileError, match="CDWRITE"):
        fi.read(exported, units="SI", mapping=exported.with_name("map.txt"))
    hbmat.with_name("mass.matrix").unlink()
    with pytest.raises(fi.MissingFileError, match=r"mass\.matrix is not beside.*never formed"):
        fi.read(hbmat, units="SI")
    with pytest.raises(fi.MissingFileError, match="does not exist"):
        fi.read(hbmat.with_name("other.matrix"), units="SI")
    with pytest.raises(fi.ExportError, match="holds no matrices"):
        fi.read(hbmat.with_name("stiff.cdb"), units="SI")


def test_few_digits_warn(tmp_path):
    with pytest.warns(fi.ExportWarning, match="8 digits") as caught:
        fi.read(write_hbmat_job(tmp_path / "short", BLOCK, digits=8), units="SI")
    assert caught[0].filename == __file__


def test_node_table_as_listed_by_nlist(tmp_path):
    from fem_import.readers.node_table import read_node_table

    path = tmp_path / "nlist.lis"
    page = " LIST ALL SELECTED NODES.   DSYS= 0\n\n   NODE        X        Y        Z      THXY    THYZ    THZX\n"
    path.write_text(page + "      1  0.0  0.1000E-01  2.\n" + page + "      7  1.  -.5  1.E-3  0.00  0.00  0.00\n")
    nodes = read_node_table(path)
    np.testing.assert_array_equal(nodes.labels, [1, 7])
    np.testing.assert_array_equal(nodes.positions, [[0, 0.01, 2], [1, -0.5, 1e-3]])
    path.write_text("1, 0.5, 0.25, 0\n2,0.5,0.25,1\n")
    np.testing.assert_array_equal(read_node_table(path).positions, [[0.5, 0.25, 0], [0.5, 0.25, 1]])


def test_archive_of_ansys():
    from fem_import.readers.ansys_cdb import read_archive

    nodes = read_archive(sample("ansys_full", "HexBeam.cdb"))
    assert len(nodes.labels) == 321
    np.testing.assert_allclose(nodes.positions.max(axis=0), [1, 1, 5])
    assert {name: len(found) for name, found in nodes.sets.items()} == {"NCOMP2": 98, "NODE_SELECTION": 164}


def test_damage_never_gives_another_exception(hbmat, exported):
    assert_damage_is_answered(hbmat.parent, lambda: fi.read(hbmat, units="SI"), range(150))
    assert_damage_is_answered(exported.parent, lambda: read_exported(exported), range(150))


def test_a_gzip_bomb_is_refused(exported):
    content = gzip.compress(exported.read_bytes() + b"1 1 0.0\n" * (1 << 24))
    (exported.parent / "bombStiffness.txt.gz").write_bytes(content)
    with pytest.raises(fi.ExportError, match="unpacks to more than"):
        fi.read_ansys(exported.parent / "bombStiffness.txt.gz", exported.with_name("partMass.txt"), units="SI")


BEAM = euler_beam(0.2, 4, 7e10, 2.7e10, 2700.0, 1e-4, 1e-9, 2e-9)


@pytest.fixture
def superelement(tmp_path):
    """The beam reduced to its end nodes 1 and 5, as APDL Math exports it: dense, masters ascending, modes last."""
    body = fi.reduce(fi.FEModel.from_arrays(**BEAM.arrays), {"root": "ROOT", "tip": "TIP"}, 3e4)
    folder = tmp_path / "sub"
    folder.mkdir()
    for name, matrix in (("stiff", body.K), ("mass", body.M)):
        numbers = "".join(f"{value:.15E}\n" for value in matrix.T.ravel().tolist())
        (folder / f"part_{name}.txt").write_text(
            f"%%MatrixMarket matrix array real general\n% Creator: ANSYS Inc\n{len(matrix)} {len(matrix)}\n{numbers}"
        )
    return body, folder / "part_stiff.txt"


POSITIONS = {1: (0, 0, 0), 5: (0.2, 0, 0)}


def test_superelement_becomes_a_reduced_body(superelement):
    body, path = superelement
    read = fi.read(path, units="SI", interfaces={"root": 1, "tip": 5}, positions=POSITIONS)
    assert isinstance(read, fi.ReducedBody)
    np.testing.assert_allclose(read.K, body.K, rtol=1e-14, atol=1e-15 * body.K.max())
    np.testing.assert_allclose(read.M, body.M, rtol=1e-14, atol=1e-15 * body.M.max())
    assert read.is_free
    assert read.mass == pytest.approx(2700 * 1e-4 * 0.2, rel=1e-9)
    nodes = path.with_name("nodes.txt")
    nodes.write_text("1 0. 0. 0.\n5 200. 0. 0.\n")
    # The same numbers as if in mm, t, s: the frequencies scale as the units do.
    length = np.r_[np.tile([1e-3, 1e-3, 1e-3, 1, 1, 1], 2), np.ones(len(body.frequencies))]
    for name, matrix in (("stiff", body.K), ("mass", body.M)):
        scaled = matrix * np.outer(length, length) * 1e3
        file = path.with_name(f"part_{name}.txt")
        head = file.read_text().splitlines(keepends=True)[:3]
        file.write_text("".join(head) + "".join(f"{value:.15E}\n" for value in scaled.ravel().tolist()))
    mm = fi.read_ansys_substructure(path, {"tip": 5, "root": 1}, units="mm-t-s", nodes=nodes)
    assert mm.coordinates[0] == "tip.x"
    np.testing.assert_allclose(frequencies(mm.K, mm.M)[6:], frequencies(body.K, body.M)[6:], rtol=1e-9)
    assert mm.mass == pytest.approx(body.mass, rel=1e-9)


def test_superelement_rows_in_another_order_are_noticed(superelement):
    body, path = superelement
    with pytest.warns(fi.ExportWarning, match="does not move freely"):
        fi.read_ansys_substructure(path, {"root": 1, "tip": 5}, units="SI", positions=POSITIONS, masters=[5, 1])
    given = {9: (0, 0, 0), 5: (0.2, 0, 0)}  # the root has the larger label and comes first
    read = fi.read_ansys_substructure(path, {"root": 9, "tip": 5}, units="SI", positions=given, masters=[9, 5])
    np.testing.assert_allclose(read.K, body.K, rtol=1e-14, atol=1e-15 * body.K.max())


def test_superelements_that_cannot_be_used_are_refused_in_words(superelement):
    _, path = superelement
    both = {"root": 1, "tip": 5}
    binary = path.with_name("part.sub")
    binary.write_bytes(b"\x64\x00\x00\x00" * 100)
    for options in ({}, {"interfaces": both}):
        with pytest.raises(fi.ExportError, match=r"IMPORT,SUB,part\.sub,STIFF.*fi\.read_ansys_substructure"):
            fi.read(binary, units="SI", **options)
    with pytest.raises(fi.ExportError, match="Give nodes= or positions="):
        fi.read(path, units="SI", interfaces=both)
    with pytest.raises(fi.InterfaceError, match="node 5 of interfaces is not among masters"):
        fi.read_ansys_substructure(path, both, units="SI", positions=POSITIONS, masters=[1])
    with pytest.raises(fi.ExportError, match="master nodes with UX to ROTZ need 60"):
        fi.read_ansys_substructure(path, both, units="SI", positions=POSITIONS, masters=range(1, 11))
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'masters'"):
        fi.read_ansys_substructure(path, both, units="SI", master=[1])
    assert_damage_is_answered(
        path.parent, lambda: fi.read(path, units="SI", interfaces=both, positions=POSITIONS), range(60), at_least=5
    )


def test_interfaces_of_a_whole_model_are_sent_to_reduce(hbmat):
    with pytest.raises(fi.ExportError, match=r"no superelement.*fi\.reduce"):
        fi.read(hbmat, units="SI", interfaces={"left": 1})


@pytest.fixture
def full(tmp_path):
    path = tmp_path / "full" / "part.full"
    path.parent.mkdir()
    order = np.random.default_rng(2).permutation(len(BLOCK.positions)) + 1
    write_full(path, BLOCK, nodes_first=order)
    write_cdb(path.with_suffix(".cdb"), BLOCK)
    return path


def test_full_file(full):
    part = fi.read(full, units="SI")
    assert_same_part(part, BLOCK)
    assert part.digits is None
    np.testing.assert_array_equal(part.node_sets["LEFT"], BLOCK.node_sets["LEFT"])


def test_full_file_without_the_constrained_rows(full):
    held = BLOCK.node_sets["LEFT"]
    write_full(full, BLOCK, constrained=held)
    part = fi.read(full, units="SI")
    free = ~np.isin(BLOCK.dofs[:, 0], held)
    np.testing.assert_array_equal(part.dofs, BLOCK.dofs[free])
    np.testing.assert_allclose(part.K.toarray(), BLOCK.K.toarray()[np.ix_(free, free)], rtol=1e-14, atol=1e-4)


def test_full_files_of_ansys(validated):
    folder = sample("ansys_full")
    beam = fi.read(folder / "file.full", units="SI", nodes=folder / "HexBeam.cdb")
    assert beam.K.shape == (900, 900)
    validated(
        "clamped beam out of Ansys' file.full, first frequencies",
        "PyMAPDL Reader's example, same file",
        [1283.20, 1283.20, 5781.975],
        frequencies(beam.K, beam.M)[:3],
        rtol=1e-6,
        against="other programs",
        unit="Hz",
    )
    nodes = sample("rotor", "rotorAnsysNodalCoordinates.txt")
    rotor = fi.read(folder / "sparse.full", units="SI", nodes=nodes)
    found = frequencies(rotor.K, rotor.M)
    assert found.shape == (345,)
    assert np.all(found[:6] < 1e-2)
    assert found[6] == pytest.approx(116.733, rel=1e-5)
    assert rotor.report().is_free


def test_full_files_agree_with_the_reader_of_ansys():
    reader = pytest.importorskip("ansys.mapdl.reader", reason="an independent reader; pip install ansys-mapdl-reader")
    path = sample("ansys_full", "sparse.full")
    _, K, M = reader.read_binary(str(path)).load_km(sort=True)
    part = fi.read(path, units="SI", nodes=sample("rotor", "rotorAnsysNodalCoordinates.txt"))
    for ours, theirs in zip(in_node_order(part), (K, M), strict=True):
        upper = theirs.toarray()
        np.testing.assert_array_equal(ours, upper + np.triu(upper, 1).T)


def header_word(place):
    return 4 * (103 + 2 + place)


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (0, 7, "does not say"),
        (1, 2**31 - 1, "equations are announced"),
        (8, 5, "terms and 5 are announced"),
        (10, 1, "lumped"),
        (13, 1, "unsymmetric"),
        (18, 2**30, "no record is found"),
        (20, 3, "3 constraint equations"),
        (33, 0, "no mass matrix.*never formed"),
        (35, 17, "no record|not read"),
    ],
)
def test_full_files_that_cannot_be_used_are_refused_in_words(full, place, value, words):
    content = bytearray(full.read_bytes())
    content[header_word(place) : header_word(place) + 4] = int(value).to_bytes(4, "little")
    full.write_bytes(content)
    with pytest.raises(fi.ExportError, match=words):
        fi.read(full, units="SI")


def test_damage_of_a_full_file_never_gives_another_exception(full):
    assert_damage_is_answered(full.parent, lambda: fi.read(full, units="SI"), range(150))

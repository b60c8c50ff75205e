"""The Abaqus readers: the published rotor, all text formats, decks with instances, substructures, damage."""

import gzip
import re
from dataclasses import replace

import numpy as np
import pytest
from export_writers import abaqus_deck, abaqus_lines, write_abaqus_job
from own_fe import brick_block, euler_beam, frequencies
from reader_checks import assert_damage_is_answered, assert_same_part, sample
from scipy import sparse

import fem_import as fi
from fem_import.readers.abaqus import _parsed_table
from fem_import.readers.abaqus_deck import read_abaqus_deck
from fem_import.readers.long_text import LongText

BLOCK = brick_block((3, 1, 2), (0.03, 0.01, 0.02))
LAYOUTS = ["MATRIX INPUT", "LABELS", "COORDINATE"]


@pytest.fixture
def job(tmp_path):
    return write_abaqus_job(tmp_path / "job", BLOCK)


def edit(path, change):
    path.write_text(change(path.read_text()))


def test_rotor_of_case_09(validated):
    part = fi.read(sample("rotor", "rotorDiscTest.inp"), units="SI")
    report = part.report()
    assert report.is_free
    assert report.mass == pytest.approx(77.96605, rel=1e-6)
    found = frequencies(1e-2 * part.K, part.M)
    assert np.all(found[:6] < 1e-2)
    assert found[6] == pytest.approx(104.6370132606291, rel=1e-9)
    validated(
        "free rotor out of Abaqus' matrices (E / 100), first elastic frequencies",
        "Exudyn's test models: the same rotor from Abaqus and Ansys",
        [104.63701, 104.63701, 187.82409],
        found[6:9],
        rtol=1e-6,
        against="other programs",
        unit="Hz",
    )


def test_rotor_on_springs_of_case_09_reduced():
    """K = 2e8 N/m at the means of the end faces, 20 modes: the published figures of the full order."""
    part = fi.read(sample("rotor", "rotorDiscTestSTIF1.mtx"), units="SI")
    ends = {name: part.node_ids[abs(part.positions[:, 2] - z) < 1e-6] for name, z in (("left", 0.0), ("right", 0.5))}
    assert [len(nodes) for nodes in ends.values()] == [9, 9]
    published = {
        "average": [252.7166, 311.1018, 311.1018, 568.8229, 568.8229, 1225.9215, 1225.9215, 1878.2409],
        "rigid": [253.0184, 311.2793, 311.2793, 569.1614, 569.1614, 1226.5024, 1226.5024, 1878.2413],
    }
    for tie, expected in published.items():
        body = fi.reduce(part, ends, 9000.0, tie=tie)
        K = np.array(body.K)
        names = list(body.coordinates)
        for coordinate in ("left.x", "left.y", "left.z", "right.x", "right.y"):
            K[names.index(coordinate), names.index(coordinate)] += 2e8
        found = frequencies(K, body.M)
        assert found[0] < 1e-2 * expected[0]  # the spin about the axis is free
        np.testing.assert_allclose(found[1:9], expected, rtol=1.2e-3)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("parts", [True, False])
def test_all_text_formats(tmp_path, layout, parts):
    path = write_abaqus_job(tmp_path / "job", BLOCK, layout, parts=parts)
    part = fi.read(path, units="SI")
    assert_same_part(part, BLOCK)
    assert part.digits == 16
    for name, nodes in BLOCK.node_sets.items():
        np.testing.assert_array_equal(part.node_sets[name], nodes)
    for other in ("job_STIF1.mtx", "job_MASS1.mtx"):
        file = path.with_name(other)
        file.with_name(file.name + ".gz").write_bytes(gzip.compress(file.read_bytes()))
        file.unlink()
    assert_same_part(fi.read(path.with_name("job_STIF1.mtx.gz"), units="SI"), BLOCK)


def test_constrained_dofs_are_left_out(job):
    held = BLOCK.node_sets["LEFT"]
    K = sparse.lil_array(BLOCK.K)
    rows = np.flatnonzero(np.isin(BLOCK.dofs[:, 0], held))
    for row in rows:
        K[row, :] = 0
        K[:, row] = 0
        K[row, row] = 1e36
    job.with_name("job_STIF1.mtx").write_text(abaqus_lines(sparse.csr_array(K), BLOCK.dofs, "MATRIX INPUT"))
    part = fi.read(job, units="SI")
    free = np.setdiff1d(np.arange(len(BLOCK.dofs)), rows)
    np.testing.assert_array_equal(part.dofs, BLOCK.dofs[free])
    np.testing.assert_allclose(part.K.toarray(), BLOCK.K.toarray()[np.ix_(free, free)], rtol=1e-14, atol=1e-4)
    assert part.report().support == "held"


def test_internal_nodes_with_mass_are_refused_and_without_are_condensed(job):
    with pytest.raises(fi.ExportError, match="internal node -1 with mass"):
        fi.read(sample("abaqus_beam", "model.inp"), units="SI")
    # An inner node between two springs of 2 k each: k between the nodes 1 and 2 along x.
    spring = 3e7
    inner = f"-1,1, -1,1, {4 * spring:.15e}\n1,1, -1,1, {-2 * spring:.15e}\n-1,1, 2,1, {-2 * spring:.15e}\n"
    K = sparse.lil_array(BLOCK.K)
    K[0, 0] += 2 * spring
    K[3, 3] += 2 * spring
    job.with_name("job_STIF1.mtx").write_text(abaqus_lines(sparse.csr_array(K), BLOCK.dofs, "MATRIX INPUT") + inner)
    part = fi.read(job, units="SI")
    expected = BLOCK.K.toarray()
    expected[np.ix_([0, 3], [0, 3])] += spring * np.array([[1, -1], [-1, 1]])
    np.testing.assert_allclose(part.K.toarray(), expected, rtol=1e-13, atol=1e-4)


def test_units(job):
    part, scaled = fi.read(job, units="SI"), fi.read(job, units="mm-t-s")
    np.testing.assert_allclose(scaled.K.toarray(), 1e3 * part.K.toarray())
    with pytest.raises(fi.ExportError, match="Give units="):
        fi.read(job)


def test_instance_is_placed(tmp_path):
    turn = "0.1, 0.2, 0.3\n0.1, 0.2, 0.3, 0.1, 0.2, 5.3, 90.\n"  # then 90 degrees about a line along z through there
    (tmp_path / "job.inp").write_text(abaqus_deck(BLOCK, instance_lines=turn))
    nodes = read_abaqus_deck(tmp_path / "job.inp")
    x, y, z = BLOCK.positions.T
    np.testing.assert_allclose(nodes.positions, np.column_stack([0.1 - y, 0.2 + x, 0.3 + z]), atol=1e-15)
    # About a line that does not pass through the part's origin.
    (tmp_path / "job.inp").write_text(abaqus_deck(BLOCK, instance_lines="0, 0, 0\n1, 0, 0, 1, 0, 1, 180.\n"))
    np.testing.assert_allclose(
        read_abaqus_deck(tmp_path / "job.inp").positions, np.column_stack([2 - x, -y, z]), atol=1e-15
    )


def test_systems_of_a_flat_deck(tmp_path):
    """CAE places the instances of a flat deck by *SYSTEM: shifted, turned in the plane, turned in space, and back."""
    (tmp_path / "job.inp").write_text(
        "*System\n1., 2., 3.\n*Node\n1, 1., 0., 0.\n*System\n1., 0., 0., 1., 5., 7.\n*Node\n2, 1., 2., 3.\n"
        "*System\n -0.05, 0., -0.25, -0.05, 0., -1.25\n -0.05, 1., -0.25\n*Node\n3, 0.25, 0.5, 2.\n"
        "*System\n*Node\n4, 4., 5., 6.\n"
    )
    nodes = read_abaqus_deck(tmp_path / "job.inp")
    expected = [[2, 2, 3], [1 - 2, 1, 3], [-0.05 + 2, 0.5, -0.5], [4, 5, 6]]
    np.testing.assert_allclose(nodes.positions, expected, atol=1e-15)


def test_matrices_of_single_elements_are_refused(tmp_path):
    path = tmp_path / "job_STIF1.mtx"
    path.write_text("1,1,1,1,1,  5.0e+00\n1,1,1,2,1, -5.0e+00\n")
    path.with_name("job_MASS1.mtx").write_text(path.read_text())
    with pytest.raises(fi.ExportError, match="without ELEMENT BY ELEMENT"):
        fi.read(path, units="SI")


DECK = """*Heading
*Part, name="My Part"
*Node, nset=ALL
 7, 0., 0., 0.
*Include, input=more.inp
*Element, type=T3D2, elset=Bar
 1, 7,
 9
*Nset, nset=ends, generate
7, 9, 2
*Nset, nset=ofbar, elset=BAR
*End Part
*Assembly, name=Assembly
*Instance, name=one, part="my part"
*End Instance
*Nset, nset=ENDS, instance=One
8,
*Nset, nset=mixed
one.7, One.ofbar, ENDS
*End Assembly
"""


def test_deck_grammar(tmp_path):
    (tmp_path / "job.inp").write_text(DECK)
    (tmp_path / "more.inp").write_text("8, 1.0D0\n** comment\n*NODE, INPUT=last.dat\n")
    (tmp_path / "last.dat").write_text("9, 0., 2., 0., 0., 0., 1.\n")
    nodes = read_abaqus_deck(tmp_path / "job.inp")
    np.testing.assert_array_equal(nodes.labels, [7, 9])  # a data line of an included file has no keyword above it
    (tmp_path / "more.inp").write_text("*NODE\n8, 1.0D0\n** comment\n*NODE, INPUT=last.dat\n")
    nodes = read_abaqus_deck(tmp_path / "job.inp")
    np.testing.assert_array_equal(nodes.positions, [[0, 0, 0], [1, 0, 0], [0, 2, 0]])
    assert {name: list(found) for name, found in nodes.sets.items()} == {
        "ALL": [7],
        "ENDS": [8],
        "one.ends": [7, 9],
        "ofbar": [7, 9],
        "mixed": [7, 8, 9],
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda t: t.replace("*End Assembly", "*Instance, name=two, part=block\n*End Instance\n*End Assembly"),
            "noPartsInput",
        ),
        (lambda t: t.replace("*End Assembly", "*Node\n99, 0, 0, 0\n*End Assembly"), "nodes of its own"),
        (
            lambda t: t.replace("*End Assembly", "*Transform, nset=LEFT\n0,1,0,1,0,0\n*End Assembly"),
            "not in global axes",
        ),
        (lambda t: t.replace("*Node\n", "*Nod\n"), "define no nodes"),
        (lambda t: t.replace("part=block", "part=blok"), "'blok' is not defined"),
        (lambda t: t.replace("instance=block-1", "instance=block-2", 1), "'block-2' is not defined"),
        (lambda t: t.replace("*Node\n", "*System\n1,0,0,1,1,0\n1,2,0\n*Node\n"), "points lie on a line"),
        (lambda t: t.replace("*Node\n", "*System\n1,0,0,1\n*Node\n"), "a point on the local x axis"),
        (lambda t: t.replace("*End Part", "*Ngen\n1, 9\n*End Part"), "Write all nodes"),
        (lambda t: t.replace("*Nset", "*Nset, elset=NONE", 1), "element set 'NONE'"),
        (lambda t: t.replace("*Nset, nset=LEFT", "*Nset, nset=LEFT, generate", 1), "first, last"),
        (lambda t: t.replace("nset=LEFT, instance=block-1\n", "nset=LEFT, instance=block-1\n5555,\n"), "5555"),
        (
            lambda t: t.replace("nset=LEFT, instance=block-1\n", "nset=LEFT, instance=block-1\nLEFTT,\n"),
            "neither a node",
        ),
        (lambda t: "*Include, input=job.inp\n" + t, "circle"),
        (lambda t: t.replace("*End Part", "*Node\n3, 0, 0, 0\n*End Part"), "defined 2 times"),
        (lambda t: t.replace("*End Instance", "nan, 0, 0\n*End Instance", 1), "finite"),
        (lambda t: t.replace("*End Instance", "0, 0, 0\n1, 1, 1, 1, 1, 1, 90\n*End Instance", 1), "no direction"),
        (lambda t: re.sub(r"\n +24,", "\n 124,", t), "rows of node 24|numbers its nodes"),
    ],
)
def test_decks_that_cannot_be_right_are_refused(job, change, words):
    edit(job, change)
    with pytest.raises(fi.ExportError, match=words):
        fi.read(job, units="SI")


def test_includes_too_deep_are_refused(job):
    for level in range(2000):
        (job.parent / f"i{level}.inp").write_text(f"*INCLUDE, INPUT=i{level + 1}.inp\n")
    edit(job, lambda t: "*INCLUDE, INPUT=i0.inp\n" + t)
    with pytest.raises(fi.ExportError, match="goes deeper"):
        fi.read(job, units="SI")


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("STIF", lambda t: t[:-9], "truncated"),
        ("STIF", lambda t: "".join(t.splitlines(True)[:-1]), "nothing on the diagonal of node 24, DoF 3"),
        ("STIF", lambda t: t + t.splitlines(True)[-1], "twice"),
        ("STIF", lambda t: t.replace("1,1, 1,1,", "1,11, 1,1,", 1), "DoF 11"),
        ("STIF", lambda t: t.replace("1,1, 1,1,", "1,1, 1,1, nan\n1,1, 1,1,", 1), "not a finite"),
        ("STIF", lambda t: t.replace("1,1, 1,1,", "0,1, 0,1, 1.0e3\n1,1, 1,1,", 1), "node 0"),
        ("STIF", lambda t: t.replace("1,1, 1,1,", "1,1, x,1,", 1), "node, dof, node, dof, value"),
        ("MASS", lambda t: "1 1 1.0\n2 2 1.0\n", "different formats"),
        ("MASS", lambda t: re.sub(r"\d\.\d+e", "0.0e", t), "density"),
    ],
)
def test_damaged_matrices_are_refused(job, name, change, words):
    edit(job.with_name(f"job_{name}1.mtx"), change)
    with pytest.raises(fi.ExportError, match=words):
        fi.read(job, units="SI")


def test_a_mass_matrix_cut_at_a_line_warns(job):
    edit(job.with_name("job_MASS1.mtx"), lambda t: "".join(line for line in t.splitlines(True) if "24," not in line))
    with pytest.warns(fi.ExportWarning, match="3 displacements have no mass, first node 24"):
        fi.read(job, units="SI")


def test_rows_without_labels_need_labels_in_order(tmp_path):
    path = write_abaqus_job(tmp_path / "job", BLOCK, "COORDINATE")
    edit(path, lambda t: re.sub(r"\n +24,", "\n 25,", t).replace("\n24,", "\n25,"))
    with pytest.raises(fi.ExportError, match="FORMAT=LABELS"):
        fi.read(path, units="SI")


def test_missing_files_name_the_cure(job):
    job.with_name("job_MASS1.mtx").unlink()
    with pytest.raises(fi.MissingFileError, match=r"job_MASS1\.mtx is not beside.*MATRIX GENERATE"):
        fi.read(job, units="SI")
    matrix = job.with_name("job_STIF1.mtx")
    job.unlink()
    with pytest.raises(fi.MissingFileError, match=r"job\.inp is not beside"):
        fi.read(matrix, mass=matrix, units="SI")


def test_a_deck_alone_is_told_what_belongs_to_it(tmp_path):
    (tmp_path / "job.inp").write_text(abaqus_deck(BLOCK))
    with pytest.raises(fi.MissingFileError, match=r"MATRIXSTORAGE.*MATRIX OUTPUT"):
        fi.read(tmp_path / "job.inp", units="SI")


def substructure_text(body, labels, n_modes):
    """A reduced body as Abaqus writes a substructure: nodes in the order of `labels`, modes as internal nodes."""
    nodes = list(labels) + list(range(-1, -n_modes - 1, -1))
    lines = ["**", f"*USER ELEMENT,NODES={len(nodes):10d},LINEAR", "** ELEMENT NODES"]
    lines += ["** " + ", ".join(map(str, nodes[at : at + 6])) + "," for at in range(0, len(nodes), 6)]
    lines += ["1,2,3,4,5,6"] + ([f"{len(labels) + 1}, 1"] if n_modes else [])
    for kind, matrix in (("STIFFNESS", body.K), ("MASS", body.M)):
        lines.append(f"*MATRIX,TYPE={kind}")
        for row in range(len(matrix)):
            values = [f"{value: .15E}" for value in matrix[row, : row + 1]]
            lines += [", ".join(values[at : at + 4]) for at in range(0, len(values), 4)]
    return "\n".join(lines) + "\n"


BEAM = euler_beam(0.2, 4, 7e10, 2.7e10, 2700.0, 1e-4, 1e-9, 2e-9)


@pytest.fixture
def substructure(tmp_path):
    body = fi.reduce(fi.FEModel.from_arrays(**BEAM.arrays), {"root": "ROOT", "tip": "TIP"}, 3e4)
    path = tmp_path / "sub.mtx"
    path.write_text(substructure_text(body, [1, 5], len(body.frequencies)))
    (tmp_path / "beam.inp").write_text(abaqus_deck(replace(BEAM, node_sets={}), parts=False))
    return body, path


def test_substructure_becomes_a_reduced_body(substructure):
    body, path = substructure
    read = fi.read(path, units="SI", interfaces={"root": 1, "tip": 5}, deck=path.with_name("beam.inp"))
    assert isinstance(read, fi.ReducedBody)
    np.testing.assert_allclose(read.K, body.K, rtol=1e-13, atol=1e-14 * body.K.max())
    np.testing.assert_allclose(read.M, body.M, rtol=1e-13, atol=1e-14 * body.M.max())
    assert read.is_free
    assert read.mass == pytest.approx(2700 * 1e-4 * 0.2, rel=1e-9)
    positions = {1: (0, 0, 0), 5: (200.0, 0, 0)}
    turned = fi.read_abaqus_substructure(
        path, {"tip": 5, "root": 1}, units="SI", positions={1: (0, 0, 0), 5: (0.2, 0, 0)}
    )
    assert turned.coordinates[:6] == tuple(f"tip.{d}" for d in ("x", "y", "z", "rx", "ry", "rz"))
    np.testing.assert_allclose(frequencies(turned.K, turned.M)[6:], frequencies(body.K, body.M)[6:], rtol=1e-9)
    with pytest.raises(fi.ExportError, match=r"fi\.read\(path.*interfaces=.*fi\.read_abaqus_substructure"):
        fi.read(path, units="SI")
    # The same numbers as if in mm, t, s: lengths of the file are mm there.
    length = np.r_[np.tile([1e-3, 1e-3, 1e-3, 1, 1, 1], 2), np.ones(len(body.frequencies))]
    scaled = replace(body, K=body.K * np.outer(length, length) * 1e3, M=body.M * np.outer(length, length) * 1e3)
    path.write_text(substructure_text(scaled, [1, 5], len(body.frequencies)))
    mm = fi.read_abaqus_substructure(path, {"root": 1, "tip": 5}, units="mm-t-s", positions=positions)
    np.testing.assert_allclose(frequencies(mm.K, mm.M)[6:], frequencies(body.K, body.M)[6:], rtol=1e-9)
    assert mm.mass == pytest.approx(body.mass, rel=1e-9)
    np.testing.assert_allclose(mm.inertia, body.inertia, rtol=1e-6, atol=1e-9 * body.inertia.max())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t[: t.index("*MATRIX,TYPE=MASS")], "no mass matrix"),
        (lambda t: t[: t.rindex("\n", 0, -1) + 1], "numbers are announced"),
        (lambda t: re.sub(r"NODES= +\d+", "NODES= 999999", t), "announces 999999 nodes"),
        (lambda t: t.replace("1,2,3,4,5,6", "1,2,3,4,5"), r"DoF \[6\] are not retained|announced"),
        (lambda t: t.replace("1,2,3,4,5,6", "1,2,3,4,5,11"), "DoF 11 of node 1"),
        (lambda t: t.replace("** 1, 5,", "** 1, 7,"), "interface 'tip' is node 5"),
        (lambda t: t.replace("*USER", "*LOSER"), "no substructure"),
    ],
)
def test_damaged_substructures_are_refused(substructure, change, words):
    _, path = substructure
    edit(path, change)
    with pytest.raises((fi.ExportError, fi.InterfaceError), match=words):
        fi.read_abaqus_substructure(path, {"root": 1, "tip": 5}, units="SI", deck=path.with_name("beam.inp"))


def test_a_retained_node_that_is_no_interface_is_refused(substructure):
    _, path = substructure
    with pytest.raises(fi.InterfaceError, match="node 5 is retained and is no interface"):
        fi.read_abaqus_substructure(path, {"root": 1}, units="SI", deck=path.with_name("beam.inp"))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_damage_never_gives_another_exception(tmp_path, layout):
    path = write_abaqus_job(tmp_path / "job", BLOCK, layout)
    assert_damage_is_answered(path.parent, lambda: fi.read(path, units="SI"), range(120))


def test_damage_of_a_substructure_never_gives_another_exception(substructure):
    _, path = substructure
    assert_damage_is_answered(
        path.parent,
        lambda: fi.read_abaqus_substructure(path, {"root": 1, "tip": 5}, units="SI", deck=path.with_name("beam.inp")),
        range(100),
    )


@pytest.mark.parametrize(
    "lines",
    [
        "12,3, 45,1,  1.5e+00\n7,1, 7,1, -2.0e-01\n",
        "12 3 45 1 1.5e+00\n7 1 7 1 -2.0e-01\n",
        "12,  3, 45,1, 1.5e+00\n7,1, 7,1, -2.0e-01\n",
        "12 , 3, 45,1, 1.5\n7, 1, 7, 1, -2.0e-01\n",
    ],
)
def test_separators_and_blanks_do_not_matter(lines):
    table = _parsed_table(LongText(lines.encode()), "x.mtx")
    assert table.is_labelled
    np.testing.assert_array_equal(table.rows, [1203, 701])
    np.testing.assert_array_equal(table.columns, [4501, 701])
    np.testing.assert_array_equal(table.values, [1.5, -0.2])

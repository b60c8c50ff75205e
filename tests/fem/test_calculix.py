"""The CalculiX reader against ccx itself, against matrices of our own, and against damage."""

import gzip
import re
import shutil

import numpy as np
import pytest
from calculix_files import deck_text, write_export
from own_fe import brick_block, frequencies
from reader_checks import assert_damage_is_answered

import fem_import as fi

BLOCK = brick_block((3, 1, 2), (0.03, 0.01, 0.02))


@pytest.fixture(scope="module")
def export(tmp_path_factory):
    return write_export(tmp_path_factory.mktemp("export"), BLOCK)


@pytest.fixture
def copy(export, tmp_path):
    """A copy of the export to damage."""
    for file in export.parent.iterdir():
        shutil.copy(file, tmp_path)
    return tmp_path / export.name


def edit(path, suffix, change):
    file = path.with_suffix(suffix)
    file.write_text(change(file.read_text()))


def test_reads_the_matrices_nodes_and_sets(export):
    part = fi.read_calculix(export)
    np.testing.assert_allclose(part.K.toarray(), BLOCK.K.toarray(), rtol=1e-13, atol=1e-4)
    np.testing.assert_allclose(part.M.toarray(), BLOCK.M.toarray(), rtol=1e-13, atol=1e-20)
    np.testing.assert_array_equal(part.dofs, BLOCK.dofs)
    np.testing.assert_allclose(part.positions, BLOCK.positions, rtol=1e-15)
    np.testing.assert_array_equal(part.node_sets["LEFT"], BLOCK.node_sets["LEFT"])
    assert part.digits == 14
    assert part.C is None


@pytest.mark.parametrize("name", ["job.inp", "job.sti", "job", "job.dof"])
def test_any_file_of_the_job_names_it(export, name):
    assert len(fi.read(export.parent / name).dofs) == len(BLOCK.dofs)


def test_gzipped_files(copy):
    for suffix in (".inp", ".sti", ".mas", ".dof"):
        file = copy.with_suffix(suffix)
        (copy.parent / (file.name + ".gz")).write_bytes(gzip.compress(file.read_bytes()))
        file.unlink()
    assert abs(fi.read_calculix(copy).K - fi.FEModel.from_arrays(**BLOCK.arrays).K).max() < 1e-3
    cut = copy.parent / "job.sti.gz"
    cut.write_bytes(cut.read_bytes()[:-200])
    with pytest.raises(fi.ExportError, match=r"job\.sti\.gz cannot be read.*truncated"):
        fi.read_calculix(copy)


def test_units(export):
    part, scaled = fi.read_calculix(export), fi.read_calculix(export, units="mm-t-s")
    np.testing.assert_allclose(scaled.positions, part.positions * 1e-3)
    np.testing.assert_allclose(scaled.K.toarray(), part.K.toarray() * 1e3)
    np.testing.assert_allclose(scaled.M.toarray(), part.M.toarray() * 1e3)


def test_an_export_of_real_ccx_has_its_own_frequencies_mass_and_centre(run_ccx, tmp_path):
    deck = tmp_path / "block.inp"
    deck.write_text(deck_text(BLOCK))
    run_ccx(deck)
    part = fi.read_calculix(deck)
    own = tmp_path / "modes.inp"
    own.write_text(deck_text(BLOCK, solver="ARPACK", n_modes=12))
    run_ccx(own)
    of_ccx = [
        float(line.split()[3])
        for line in own.with_suffix(".dat").read_text().splitlines()
        if re.match(r"\s+\d+(\s+-?0\.\d+E[+-]\d+){4}\s*$", line)
    ]
    np.testing.assert_allclose(frequencies(part.K, part.M)[6:12], of_ccx[6:12], rtol=2e-5)  # what ccx asks of ARPACK
    report = part.report()
    assert report.is_free
    assert report.mass == pytest.approx(7850 * 0.03 * 0.01 * 0.02, rel=1e-12)
    np.testing.assert_allclose(report.centre_of_mass, [0.015, 0.005, 0.01], rtol=1e-9)


@pytest.mark.parametrize("rotation_node", [", ROT NODE=902", ""])
def test_rigid_body_of_real_ccx_turns_about_its_reference_node(run_ccx, tmp_path, rotation_node):
    nodes = "*NODE\n901, 0.05, 0.004, 0.012\n902, 0.05, 0.004, 0.012\n"
    deck = tmp_path / "rigid.inp"
    deck.write_text(deck_text(BLOCK, extra=f"{nodes}*RIGID BODY, NSET=RIGHT, REF NODE=901{rotation_node}\n"))
    run_ccx(deck)
    part = fi.read_calculix(deck)
    assert sorted(part.dofs[part.dofs[:, 0] == 901, 1]) == [1, 2, 3, 4, 5, 6]
    report = part.report()
    assert report.is_free
    assert report.mass == pytest.approx(7850 * 0.03 * 0.01 * 0.02, rel=1e-12)
    np.testing.assert_allclose(report.centre_of_mass, [0.015, 0.005, 0.01], rtol=1e-9)
    # Our own rigid tie of the same nodes to the same point.
    body = fi.reduce(part, {"tip": [901]}, 3e5)
    free = fi.FEModel.from_arrays(**BLOCK.arrays)
    ours = fi.reduce(free, {"tip": fi.Interface("RIGHT", position=(0.05, 0.004, 0.012))}, 3e5)
    assert body.mass == pytest.approx(ours.mass, rel=1e-9)


def test_leaf_spring_gives_the_frequencies_and_mass_of_ccx(leaf_spring, leaf_spring_file, validated):
    reference = leaf_spring_file.with_name("free_eig.dat").read_text().split("P A R T I C I P A T I O N")[0]
    of_ccx = [float(line.split()[3]) for line in reference.splitlines() if re.match(r"\s+\d+ +-?0\.\d+E", line)]
    body = fi.reduce(leaf_spring, {"base": "IF_BASE", "tip": "IF_TIP"}, 9000.0, tie="average")
    full = fi.mode_check(leaf_spring, body, n_modes=14).full
    validated(
        "leaf spring of 15048 DoF, free: 14 elastic frequencies of the imported matrices",
        "CalculiX 2.20, its own eigensolution",
        of_ccx[6:20],
        full,
        rtol=2e-7,
        against="other programs",
        unit="Hz",
    )
    assert leaf_spring.report().mass == pytest.approx(0.22464, rel=1e-9)
    assert leaf_spring.report().is_free


DECK = """** a comment
*Heading
 of no interest
*NODE, NSET=aLL,
  SYSTEM=R
1, 0., 0., 0.
** between
2, 1.0D0,,
*node
 3, 0, 1e0, 0
*Node Print, NSET=ALL
U
*NSET, NSET=Tip, GENERATE
1, 3, 2
*NSET, NSET=both, UNSORTED
tip, 2
*NSET,nset=TIP
2
"""


def test_deck_grammar(tmp_path):
    from fem_import.readers.calculix_deck import read_deck

    path = tmp_path / "job.inp"
    path.write_text(DECK)
    deck = read_deck(path)
    np.testing.assert_array_equal(deck.node_ids, [1, 2, 3])
    np.testing.assert_array_equal(deck.positions, np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    assert {name: list(nodes) for name, nodes in deck.node_sets.items()} == {
        "aLL": [1, 2],
        "Tip": [1, 2, 3],
        "both": [1, 2, 3],
    }


def test_include_is_followed_relative_to_the_deck(copy):
    folder = copy.parent / "mesh"
    folder.mkdir()
    mesh, step = copy.read_text().split("*MATERIAL")
    (folder / "mesh.inp").write_text("*INCLUDE, INPUT=nodes.inp\n")
    (folder / "nodes.inp").write_text(mesh)
    copy.write_text('*INCLUDE,INPUT="mesh/mesh.inp"\n*MATERIAL' + step)
    assert "LEFT" in fi.read_calculix(copy).node_sets
    (folder / "nodes.inp").write_text("*INCLUDE,INPUT=../job.inp\n")
    with pytest.raises(fi.ExportError, match="circle"):
        fi.read_calculix(copy)
    (folder / "nodes.inp").unlink()
    with pytest.raises(fi.MissingFileError, match=r"mesh\.inp, line 1.*'nodes\.inp'"):
        fi.read_calculix(copy)


@pytest.mark.parametrize(
    ("suffix", "change", "words"),
    [
        (".sti", lambda t: t[:-30], "truncated"),
        (".sti", lambda t: "".join(t.splitlines(True)[:-1]), "no diagonal entry in row"),
        (".mas", lambda t: "".join(t.splitlines(True)[:50] + t.splitlines(True)[51:]), "diagonal|one pattern"),
        (".mas", lambda t: re.sub(r"\S+\n", "nan\n", t, count=1), "not a finite number"),
        (".sti", lambda t: t + "9999 9999  1.0000000000000e+00\n", "row 9999"),
        (".sti", lambda t: t + "2 1  1.0000000000000e+00\n", "below the diagonal"),
        (".sti", lambda t: t + t.splitlines(True)[-1], "twice"),
        (".sti", lambda t: t.replace("1 1 ", "1 x ", 1), "could not convert|row column value"),
        (".sti", lambda t: "", "empty"),
        (".mas", lambda t: re.sub(r"\d\.\d+e[+-]\d+", "0.0000000000000e+00", t), "density"),
        (".dof", lambda t: t + t.splitlines(True)[0], "expands shells"),
        (".dof", lambda t: t.replace("1.1\n", "1.4\n", 1), "1..3"),
        (".dof", lambda t: t.replace("1.1\n", "11\n", 1), "node.direction"),
        (".dof", lambda t: re.sub(r"^1\.", "77777.", t, flags=re.M), "77777, which the deck does not define"),
        (".dof", lambda t: "".join(t.splitlines(True)[:-1]), "has an entry at row"),
        (".inp", lambda t: t.replace("*NODE,NSET=NALL\n", "*NODE,NSET=NALL\n1, 0, 0, 0\n"), "defined 2 times"),
        (".inp", lambda t: t.replace("*NODE", "*NOD"), "no nodes"),
        (".inp", lambda t: "*PART,NAME=A\n" + t, "Abaqus"),
        (".inp", lambda t: t.replace("LEFT\n", "LEFT\n5555,\n"), "5555"),
        (".inp", lambda t: t.replace("LEFT\n", "LEFT\nRIHGT,\n"), "neither a node label nor a set"),
        (".inp", lambda t: t.replace("1, 0.0", "1, nan", 1), "not finite"),
        (".inp", lambda t: t.replace("1, 0.0", "1, zero", 1), "label, x, y, z"),
    ],
)
def test_damage_is_refused_in_words(copy, suffix, change, words):
    edit(copy, suffix, change)
    with pytest.raises(fi.ExportError, match=words):
        fi.read_calculix(copy)


@pytest.mark.parametrize(
    ("suffix", "words"), [(".mas", "never formed the mass"), (".sti", "MATRIXSTORAGE"), (".inp", "node")]
)
def test_missing_files_name_the_cure(copy, suffix, words):
    copy.with_suffix(suffix).unlink()
    with pytest.raises(fi.MissingFileError, match=words):
        fi.read_calculix(copy.with_suffix(".dof"))


def test_unknown_units_and_keywords_name_the_nearest(export):
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'mm-t-s'"):
        fi.read_calculix(export, units="mm-ts")
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'units'"):
        fi.read(export, unit="SI")
    with pytest.raises(fi.ExportError, match="no reader knows"):
        fi.read(__file__)


def test_few_digits_warn_at_the_users_line(tmp_path):
    path = write_export(tmp_path / "short", BLOCK, digits=8)
    with pytest.warns(fi.ExportWarning, match="8 digits") as caught:
        part = fi.read(path)
    assert caught[0].filename == __file__
    assert any("8 digits" in finding for finding in part.report().findings)


def test_damage_never_gives_another_exception(copy):
    assert_damage_is_answered(copy.parent, lambda: fi.read_calculix(copy), range(200))


def test_shell_elements_are_named(copy):
    edit(copy, ".inp", lambda t: t.replace("TYPE=C3D8", "TYPE=S8R"))
    edit(copy, ".dof", lambda t: t.replace("2.1\n", "1.1\n", 1))
    with pytest.raises(fi.ExportError, match="S8R"):
        fi.read_calculix(copy)

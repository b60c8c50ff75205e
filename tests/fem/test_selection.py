"""Interfaces picked by where their nodes are, and averages weighted by area."""

import numpy as np
import pytest
from own_fe import brick_block

import fem_import as fi

BLOCK = brick_block((6, 4, 4), (0.06, 0.04, 0.04))


@pytest.fixture(scope="module")
def block():
    return fi.FEModel.from_arrays(**BLOCK.arrays)


def where(part, labels):
    return part.positions[np.searchsorted(part.node_ids, labels)]


def test_a_plane_is_the_face(block):
    face = fi.Plane(point=(0.06, 0, 0), normal=(-2, 0, 0)).nodes(block)
    np.testing.assert_array_equal(face, BLOCK.node_sets["RIGHT"])
    both = fi.Plane((0.055, 0, 0), (1, 0, 0), thickness=0.0101).nodes(block)
    np.testing.assert_array_equal(np.unique(where(block, both)[:, 0].round(6)), [0.05, 0.06])


def test_a_box_may_be_open(block):
    found = where(block, fi.Box((0.02, -np.inf, 0.01), (0.03, np.inf, 0.02)).nodes(block))
    assert len(found) == 2 * 5 * 2
    assert set(np.round(found[:, 0], 6)) == {0.02, 0.03}


def test_a_bolt_circle_is_a_cylinder_with_a_bore(block):
    centre = BLOCK.positions.mean(axis=0)
    ring = fi.Cylinder(centre, axis=(3, 0, 0), radius=0.0145, inner_radius=0.0095, start=0.02, end=0.04)
    found = where(block, ring.nodes(block))
    radii = np.linalg.norm(found[:, 1:] - centre[1:], axis=1)
    assert set(np.round(radii, 6)) == {0.01, round(0.01 * np.sqrt(2), 6)}
    np.testing.assert_allclose(found[:, 0], 0.06 - 0.01 * np.isclose(found[:, 0], 0.05), atol=1e-12)


def test_regions_combine(block):
    face, low = fi.Plane((0.06, 0, 0), (1, 0, 0)), fi.Box((0, 0, 0), (1, 1, 0.02))
    every, both, rest = face.nodes(block), (face & low).nodes(block), (face - low).nodes(block)
    assert (len(every), len(both), len(rest)) == (25, 15, 10)
    np.testing.assert_array_equal(np.sort(np.concatenate([both, rest])), every)
    two = (face | fi.Plane((0, 0, 0), (1, 0, 0))).nodes(block)
    assert len(two) == 50


def test_a_region_makes_the_interface_its_nodes_make(block):
    ends = {"base": fi.Plane((0, 0, 0), (1, 0, 0)), "tip": fi.Interface(fi.Plane((0.06, 0, 0), (1, 0, 0)))}
    by_place = fi.reduce(block, ends, 60e3)
    by_set = fi.reduce(block, {"base": "LEFT", "tip": "RIGHT"}, 60e3)
    np.testing.assert_array_equal(by_place.K, by_set.K)
    np.testing.assert_array_equal(by_place.interfaces["tip"].node_ids, BLOCK.node_sets["RIGHT"])


@pytest.mark.parametrize(
    ("region", "words"),
    [
        (
            fi.Plane((0.1, 0, 0), (1, 0, 0)),
            r"Interface 'tip': No node of arrays lies in Plane.*is 0.04 m outside.*in m",
        ),
        (fi.Box((60, 0, 0), (61, 40, 40)), r"No node .* the part's size is 0\.08"),
    ],
)
def test_an_empty_region_says_how_far_off_it_is(block, region, words):
    with pytest.raises(fi.InterfaceError, match=words):
        fi.reduce(block, {"base": "LEFT", "tip": region}, 60e3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fi.Box((1, 0, 0), (0, 1, 1)), "lies above upper"),
        (lambda: fi.Box((np.nan, 0, 0), (0, 1, 1)), "Box: lower must be three numbers"),
        (lambda: fi.Plane((0, 0, np.inf), (1, 0, 0)), "Plane: point must be three finite numbers"),
        (lambda: fi.Plane((0, 0, 0), (0, 0, 0)), "Plane: normal must not be zero"),
        (lambda: fi.Plane((0, 0, 0), (1, 0, 0), thickness=-1), "not negative; got -1"),
        (lambda: fi.Cylinder((0, 0, 0), (0, 0, 1), 0.01, 0.02), "leave nothing between them"),
        (lambda: fi.Cylinder((0, 0, 0), (0, 0, 1), 0.01, start=1.0, end=0.0), "start 1.0 must not lie beyond end"),
        (lambda: fi.Cylinder((0, 0, 0), "z", 0.01), "axis must be three finite numbers"),
    ],
)
def test_regions_that_are_none(make, words):
    with pytest.raises(fi.InterfaceError, match=words):
        make()


def test_area_weights_average_over_the_area():
    """A face with a mesh ten times finer on one side: the frame follows the area's mean, not the nodes'."""
    y = np.array([0.0, 0.001, 0.002, 0.003, 0.01])
    z = np.array([0.0, 0.004, 0.01])
    x = np.array([0.0, 0.01])
    grid = np.array([(a, b, c) for a in x for b in y for c in z])
    label = 1 + np.arange(len(grid)).reshape(2, 5, 3)
    faces = [
        triangle
        for i in range(4)
        for j in range(2)
        for triangle in (
            (label[1, i, j], label[1, i + 1, j], label[1, i + 1, j + 1]),
            (label[1, i, j], label[1, i + 1, j + 1], label[1, i, j + 1]),
        )
    ]
    stiff = np.diag(np.full(3 * len(grid), 2.0)) + 1e-3
    part = fi.FEModel.from_arrays(stiff, np.eye(len(stiff)), grid, 3, node_sets={"END": label[1].ravel()}, skin=faces)
    from fem_import.interfaces import tie_interfaces

    tied = tie_interfaces(part, {"end": fi.Interface("END", tie="average", weights="area")}, "rigid")[0]
    np.testing.assert_allclose(tied.position, [0.01, 0.005, 0.005], atol=1e-15)
    nodes = part.positions[np.searchsorted(part.node_ids, part.dofs[tied.rows, 0])]
    # u_x = y varies linearly: its mean over the square is that at the centre, its slope the rotation -rz.
    field = np.where(part.dofs[tied.rows, 1] == 1, nodes[:, 1], 0.0)
    motion = tied.matrix @ field
    assert motion[0] == pytest.approx(0.005, abs=1e-12)
    plain = tie_interfaces(part, {"end": fi.Interface("END", tie="average")}, "rigid")[0]
    assert plain.position[1] == pytest.approx(0.0032)


def test_area_weights_need_faces(block):
    with pytest.raises(fi.InterfaceError, match=r"needs the faces of the mesh.*skin="):
        fi.reduce(block, {"end": fi.Interface("LEFT", tie="average", weights="area")}, 60e3)
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'area'"):
        fi.reduce(block, {"end": fi.Interface("LEFT", tie="average", weights="areas")}, 60e3)
    skinned = fi.FEModel.from_arrays(**BLOCK.arrays, skin=[BLOCK.node_sets["RIGHT"][:3]])
    with pytest.raises(fi.InterfaceError, match="no face of the mesh has all its corners"):
        fi.reduce(skinned, {"end": fi.Interface("LEFT", tie="average", weights="area")}, 60e3)

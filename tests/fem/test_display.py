"""The skin of a part: closed, moving with the reduced coordinates, kept by save and load."""

import numpy as np
import pytest

import fem_import as fi
from fem_import.display import skin_of_solids


def test_skin_of_two_hexahedra_is_the_outside_of_the_block():
    # two unit cubes side by side, labels 1..12 with x fastest
    cube = np.array([1, 2, 5, 4, 7, 8, 11, 10])
    skin = skin_of_solids([np.array([cube, cube + 1])])
    assert len(skin) == 2 * 10  # ten outer squares, two triangles each
    points = np.array([(x, y, z) for z in range(2) for y in range(2) for x in range(3)], dtype=float)
    corners = points[skin - 1]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert areas.sum() == pytest.approx(10.0)
    # closed and outward: the divergence theorem gives the volume
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(2.0)


def test_skin_of_the_flexure_moves_as_a_rigid_body(flexure_body, tmp_path):
    display = flexure_body.display
    edges = np.sort(
        np.vstack([display.triangles[:, [0, 1]], display.triangles[:, [1, 2]], display.triangles[:, [2, 0]]]), axis=1
    )
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()  # a closed surface without cracks: every edge has two triangles
    motion = flexure_body.rigid_body_motion
    moved = (display.basis @ motion).reshape(-1, 3, 6)
    np.testing.assert_allclose(moved[:, :, :3], np.broadcast_to(np.eye(3), (len(moved), 3, 3)), atol=1e-7)
    np.testing.assert_allclose(moved[:, :, 5], np.cross([0, 0, 1.0], display.points), atol=1e-7)
    flexure_body.save(tmp_path / "body.npz")
    loaded = fi.ReducedBody.load(tmp_path / "body.npz").display
    np.testing.assert_array_equal(loaded.basis, display.basis)
    np.testing.assert_array_equal(loaded.triangles, display.triangles)


def test_a_skin_that_names_unknown_nodes_is_refused():
    with pytest.raises(fi.ExportError, match="skin names node 9"):
        fi.FEModel.from_arrays(np.eye(9), np.eye(9), np.eye(3), 3, skin=[[1, 2, 9]])
    with pytest.raises(fi.ExportError, match="three node labels"):
        fi.FEModel.from_arrays(np.eye(9), np.eye(9), np.eye(3), 3, skin=[[1, 2]])

"""Interfaces: what they resolve to and what they refuse."""

import numpy as np
import pytest
from own_fe import brick_block, euler_beam

import fem_import as fi

BLOCK = brick_block((4, 2, 2), (0.04, 0.012, 0.02))


@pytest.fixture(scope="module")
def part():
    return fi.FEModel.from_arrays(**BLOCK.arrays)


def test_a_frame_sits_at_the_mean_of_its_nodes_or_where_asked(part):
    body = fi.reduce(part, {"base": "LEFT", "tip": fi.Interface("RIGHT", position=(0.1, 0, 0))}, 1e5)
    base, tip = body.interfaces["base"], body.interfaces["tip"]
    np.testing.assert_allclose(base.position, [0, 0.006, 0.01], atol=1e-15)
    assert base.radius == pytest.approx(np.hypot(0.006, 0.01))
    np.testing.assert_array_equal(tip.position, [0.1, 0, 0])
    assert tip.radius == pytest.approx(np.linalg.norm([0.06, 0.012, 0.02]))
    np.testing.assert_array_equal(base.node_ids, BLOCK.node_sets["LEFT"])
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'base'"):
        body.interfaces["bass"]


def test_moving_a_frame_moves_its_stiffness_as_a_rigid_lever(part):
    here = fi.reduce(part, {"base": "LEFT", "tip": "RIGHT"}, 1e5)
    there = fi.reduce(part, {"base": "LEFT", "tip": fi.Interface("RIGHT", position=(0.1, 0.0, 0.0))}, 1e5)
    lever = np.eye(12)
    lever[6:9, 9:] = np.cross(np.eye(3), here.interfaces["tip"].position - np.array([0.1, 0, 0]))
    for axis in range(3):
        lever[6:9, 9 + axis] = np.cross(np.eye(3)[axis], here.interfaces["tip"].position - [0.1, 0, 0])
    moved = lever.T @ here.K[:12, :12] @ lever
    np.testing.assert_allclose(there.K[:12, :12], moved, atol=1e-8 * np.max(abs(moved)))


def test_weights_move_an_average():
    """An average that all but ignores a node does not feel it: compare with the set without that node."""
    part = fi.FEModel.from_arrays(**BLOCK.arrays)
    nodes = BLOCK.node_sets["RIGHT"]
    at = BLOCK.positions[nodes[1:] - 1].mean(axis=0)
    weights = np.where(np.arange(len(nodes)) == 0, 1e-12, 2.0)
    some = fi.reduce(part, {"tip": fi.Interface(nodes[1:], position=at)}, 1e5, tie="average")
    most = fi.reduce(part, {"tip": fi.Interface(nodes, position=at, weights=weights)}, 1e5, tie="average")
    np.testing.assert_allclose(most.frequencies, some.frequencies, rtol=1e-6)


def test_one_beam_node_carries_a_rigid_interface():
    beam = euler_beam(1.0, 6, 2e11, 8e10, 7850.0, 1e-2, 1e-5, 2e-5)
    body = fi.reduce(fi.FEModel.from_arrays(**beam.arrays), {"root": "ROOT", "tip": "TIP"}, 1e4)
    # Cantilever of the textbook: k = 3 E I / L^3 and E I / L relations at the tip.
    stiffness = body.K[6:12, 6:12]
    np.testing.assert_allclose(np.diag(stiffness)[[0, 1, 3, 5]], [2e9, 12 * 2e6, 8e10 * 2e-5, 4 * 2e6], rtol=1e-9)
    with pytest.raises(fi.InterfaceError, match=r"a single node.*at least three"):
        fi.reduce(fi.FEModel.from_arrays(**beam.arrays), {"tip": "TIP"}, 1e4, tie="average")


EDGE = [int(node) for node in BLOCK.node_sets["LEFT"][:3]]


@pytest.mark.parametrize(
    ("interfaces", "words"),
    [
        ({"tip": [1]}, "'tip' is a single node without rotations"),
        ({"tip": [1, 2]}, "two nodes"),
        ({"tip": EDGE}, "3 nodes on one line"),
        ({"tip": []}, "'tip'"),
        ({"tip": [1, 1, 2]}, "node 1 more than once"),
        ({"tip": [1, 2, 9999]}, "node 9999"),
        ({"tip": [1.5, 2, 3]}, "whole-number labels"),
        ({"tip": fi.Interface("LEFT", position=(1, 2))}, "three finite numbers"),
        ({"tip": fi.Interface("LEFT", weights=np.ones(9))}, "weights belong to tie='average'"),
        ({"tip": fi.Interface("LEFT", tie="average", weights=[1, 2])}, "9 positive numbers"),
        ({"a.b": "LEFT"}, "without dots"),
        ({"a": "LEFT", "b": BLOCK.node_sets["LEFT"][4:]}, "belongs to the interfaces 'a' and 'b'"),
        ({}, "at least one"),
    ],
)
def test_bad_interfaces_are_refused_in_words(part, interfaces, words):
    with pytest.raises(fi.InterfaceError, match=words):
        fi.reduce(part, interfaces, 1e4)


def test_unknown_sets_and_ties_name_the_nearest(part):
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'LEFT'"):
        fi.reduce(part, {"base": "LEFFT"}, 1e4)
    with pytest.raises(fi.UnknownNameError, match="Did you mean 'rigid'"):
        fi.reduce(part, {"base": fi.Interface("LEFT", tie="rigit")}, 1e4)


def test_constrained_nodes_are_refused():
    kept = np.flatnonzero(~((BLOCK.dofs[:, 0] == BLOCK.node_sets["LEFT"][0]) & (BLOCK.dofs[:, 1] == 2)))
    part = fi.FEModel.from_arrays(
        BLOCK.K[kept][:, kept], BLOCK.M[kept][:, kept], BLOCK.positions, BLOCK.dofs[kept], node_sets=BLOCK.node_sets
    )
    with pytest.raises(fi.InterfaceError, match=r"node 1 has only the DoF \[1, 3\] left.*constrained away"):
        fi.reduce(part, {"base": "LEFT"}, 1e4)

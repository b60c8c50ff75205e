"""What model.check() tells a newcomer, in words."""

import math

import numpy as np
import pytest
from test_bad_input import two_interfaces

import ibsdyn as ibs

SMALL = (1e-4, 1e-4, 1e-4, 0, 0, 0)


def mirror_on(stiffness, **more):
    model = ibs.Model("m")
    model.fixation("ground")
    model.rigid_body("mirror", mass=0.3, cog=(0, 0, 0.05), inertia=SMALL)
    model.connection(
        "flexure",
        "ground",
        "mirror",
        **{"position1": (0, 0, 0.05), "stiffness": stiffness, "zeta": 0.01, **more},
    )
    return model


def test_a_good_model_has_no_findings():
    assert mirror_on((1e6, 1e6, 1e6, 100, 100, 100)).check() == []


@pytest.mark.parametrize(
    ("stiffness", "words"),
    [
        ((1e6, 1e6, 1e6, 100, 100, 0), "mirror is free to rotate about z"),
        ((0, 1e6, 1e6, 100, 100, 100), "mirror is free to move along x"),
        ((0, 1e6, 1e6, 0, 100, 0), "to move along x, to rotate about x and to rotate about z"),
        ((0,) * 6, "mirror is free in all six directions"),
    ],
)
def test_free_directions(stiffness, words):
    assert any(words in finding for finding in mirror_on(stiffness).check())


def test_a_hinge_away_from_the_cog_is_described_by_its_line():
    model = mirror_on((1e6, 1e6, 1e6, 100, 100, 0), position1=(0.2, 0, 0.05))
    assert any("rotate about z through (0.2, 0, 0.05) m" in finding for finding in model.check())
    tilted = np.array([[1, 0, 0], [0, math.sqrt(0.5), -math.sqrt(0.5)], [0, math.sqrt(0.5), math.sqrt(0.5)]])
    model = mirror_on((1e6, 0, 1e6, 100, 100, 100), axes=tilted)
    assert any("move along (0, 0.7071, 0.7071)" in finding for finding in model.check())


def test_nothing_holds_on():
    model = ibs.Model("free")
    model.rigid_body("a", mass=1.0, cog=(0, 0, 0), inertia=SMALL)
    model.rigid_body("b", mass=1.0, cog=(0, 0, 0.1), inertia=SMALL)
    model.connection("k", "a", "b", position1=(0, 0, 0.05), stiffness=(1e5,) * 3 + (100,) * 3, zeta=0.01)
    assert any("a and b are free in all six directions" in finding for finding in model.check())


def test_one_dimensional_model_and_unconnected_items():
    model = ibs.Model("concept", axis="rz")
    model.fixation("frame")
    model.rigid_body("mirror", inertia=1e-4)
    model.rigid_body("lost", inertia=1e-4)
    model.connection("flexure", "frame", "mirror", stiffness=0.0, zeta=0.01)
    found = "\n".join(model.check())
    assert "mirror is free to rotate about z" in found
    assert "lost is not connected to anything" in found
    model.fixation("spare")
    assert any("spare holds nothing" in finding for finding in model.check())


def test_units():
    millimetres = mirror_on((1e6, 1e6, 1e6, 100, 100, 100), position1=(0, 0, 50.1))
    assert any("millimetres" in finding for finding in millimetres.check())
    rotational = mirror_on((1e3, 1e3, 1e3, 1e6, 1e6, 1e6))
    assert any("N·m/rad" in finding for finding in rotational.check())
    model = mirror_on((1e6, 1e6, 1e6, 100, 100, 100))
    model.rigid_body("plate", mass=0.3, cog=(0, 0, 0), inertia=(120, 120, 120, 0, 0, 0))
    assert any("kg mm²" in finding and "plate" in finding for finding in model.check())


def test_damping():
    assert any("infinite at the resonances" in f for f in mirror_on((1e6,) * 3 + (100,) * 3, zeta=0.0).check())
    with pytest.warns(ibs.ModelWarning):
        model = mirror_on((1e6,) * 3 + (100,) * 3, zeta=2.0)
    assert any("percentage" in f for f in model.check())


def test_interfaces():
    model = ibs.Model("m")
    model.fixation("ground")
    model.flexible_body("flexure", two_interfaces(), zeta=0.01)
    assert any("flexure is not connected" in f for f in model.check())
    model.connection("near", "ground", "flexure.base", stiffness=(1e6,) * 3 + (1e3,) * 3)
    assert any("nothing is connected to flexure.tip" in f for f in model.check())
    model.rigid_body("mirror", mass=0.3, cog=(0.1, 0, 0), inertia=SMALL)
    model.connection("far", "flexure.tip", "mirror", position1=(0.1, 0, 0.5), stiffness=(1e6,) * 3 + (1e3,) * 3)
    assert any("far acts 500 mm away from interface flexure.tip" in f for f in model.check())
    with_damping = ibs.Model("c")
    with_damping.fixation("ground")
    with_damping.flexible_body("flexure", two_interfaces(C=np.zeros((12, 12))), zeta=0.01)
    assert any("brought a damping matrix" in f for f in with_damping.check())

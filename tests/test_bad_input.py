"""Every mistake gets an error of ours that names the item, shows the value, and leaves the model as it was."""

import math

import numpy as np
import pytest

import fem_import as fi
import ibsdyn as ibs

SIX = (1e6, 1e6, 1e6, 1e3, 1e3, 1e3)
ROUND = (1e-3, 1e-3, 1e-3, 0, 0, 0)


@pytest.fixture
def model():
    m = ibs.Model("m")
    m.fixation("ground", position=(0, 0, 0))
    m.rigid_body("mirror", mass=0.3, cog=(0, 0, 0.1), inertia=ROUND)
    m.rigid_body("frame", mass=3.0, cog=(0, 0, 0.05), inertia=ROUND)
    m.flexible_body("flexure", two_interfaces(), zeta=0.01)
    m.connection("mount", "ground", "frame", position1=(0, 0, 0), stiffness=SIX, zeta=0.01)
    return m


def two_interfaces(C=None):
    """A massive beam element between two frames, from the textbook stiffness of a rod in all six directions."""
    k = np.diag([1e6, 1e5, 1e5, 1e3, 1e3, 1e3])
    lever = np.eye(6)
    lever[1, 5], lever[2, 4] = 0.05, -0.05  # both ends carried to the middle of 0.1 m along x
    a, b = lever, lever.copy()
    b[1, 5], b[2, 4] = -0.05, 0.05
    rows = np.hstack([-a, b])
    M = np.diag([0.1, 0.1, 0.1, 1e-4, 1e-4, 1e-4] * 2)
    return fi.ReducedBody.from_arrays(M, rows.T @ k @ rows, interfaces={"base": (0, 0, 0), "tip": (0.1, 0, 0)}, C=C)


BODY = {"name": "b", "mass": 1.0, "cog": (0, 0, 0), "inertia": ROUND}
BODIES = [
    ({"mass": -1.0}, "mass must be above 0 kg, got -1"),
    ({"mass": 0.0}, "above 0"),
    ({"mass": math.nan}, "finite"),
    ({"mass": math.inf}, "finite"),
    ({"mass": 10**400}, "too large"),
    ({"mass": "heavy"}, "heavy"),
    ({"mass": True}, "True"),
    ({"mass": None}, "mass= "),
    ({"mass": 1j}, "1j"),
    ({"cog": (0, 0)}, "3 numbers"),
    ({"cog": (0, 0, math.nan)}, "nan"),
    ({"cog": (0, 0, math.inf)}, "finite"),
    ({"cog": "abc"}, "abc"),
    ({"cog": None}, "cog="),
    ({"inertia": (1, 1, 1)}, "6 numbers"),
    ({"inertia": (1, 1, 3, 0, 0, 0)}, "above the sum"),
    ({"inertia": (1, 1, -1, 0, 0, 0)}, "positive definite"),
    ({"inertia": (0, 0, 0, 0, 0, 0)}, "positive definite"),
    ({"inertia": (1, 1, 1, 2, 0, 0)}, "positive definite"),
    ({"inertia": (1, 1, 1, math.nan, 0, 0)}, "nan"),
    ({"inertia": (1, 1, math.inf, 0, 0, 0)}, "finite"),
    ({"inertia": 5.0}, "6 numbers"),
    ({"inertia": None}, "inertia="),
    ({"products": "cad"}, "products='cad'"),
    ({"name": "mirror"}, "taken"),
    ({"name": "mount"}, "taken"),
    ({"name": ""}, "non-empty"),
    ({"name": "a.b"}, "no dot"),
    ({"name": 3}, "3"),
]


@pytest.mark.parametrize(("wrong", "words"), BODIES)
def test_rigid_bodies(model, wrong, words):
    refused(model, lambda: model.rigid_body(**{**BODY, **wrong}), words)


CONNECTION = {"name": "c", "item1": "frame", "item2": "mirror", "position1": (0, 0, 0.08), "stiffness": SIX}
CONNECTIONS = [
    ({"item1": "mirror"}, "itself"),
    ({"item1": "flexure.tip", "item2": "flexure.tip"}, "itself"),
    ({"item2": "mirrror"}, "Did you mean 'mirror'"),
    ({"item2": "flexure"}, "'flexure.base', 'flexure.tip'"),
    ({"item2": "flexure.top"}, "Did you mean 'tip'"),
    ({"item2": "mirror.tip"}, "not in the model"),
    ({"item2": None}, "None"),
    ({"stiffness": SIX[:5]}, "6 numbers"),
    ({"stiffness": None}, "stiffness= is missing"),
    ({"stiffness": 1e5}, "6 numbers"),
    ({"stiffness": (*SIX[:5], math.nan)}, "nan"),
    ({"stiffness": (*SIX[:5], -1.0)}, "kzz must not be negative, got -1"),
    ({"stiffness": (10**400, *SIX[1:])}, "too large"),
    ({"stiffness": (-math.inf, *SIX[1:])}, "kx must not be negative"),
    ({"stiffness": ("stiff", *SIX[1:])}, "stiff"),
    ({"zeta": -0.01}, "zeta must not be below 0, got -0.01"),
    ({"zeta": math.nan}, "finite"),
    ({"zeta": (0.1, 0.1)}, "one number"),
    ({"axes": np.eye(2)}, "3x3"),
    ({"axes": 2 * np.eye(3)}, "orthogonal"),
    ({"axes": np.eye(3) + 0.01}, "misses the identity"),
    ({"axes": np.diag([1, 1, -1])}, "right-handed"),
    ({"axes": np.full((3, 3), math.nan)}, "3x3"),
    ({"axes": "global"}, "global"),
    ({"damping": (1, 1, 1)}, "6 numbers"),
    ({"damping": (1, 1, 1, 1, 1, math.inf)}, "czz must be finite"),
    ({"damping": (1, 1, 1, 1, 1, -1)}, "czz must not be below"),
    ({"elastic_centre": (0, 0)}, "elastic_centre"),
    ({"position1": (0, math.nan, 0)}, "position1"),
    ({"position1": None}, "position1= or position2="),
    ({"name": "mount"}, "taken"),
    ({"name": "frame"}, "taken"),
]


@pytest.mark.parametrize(("wrong", "words"), CONNECTIONS)
def test_connections(model, wrong, words):
    refused(model, lambda: model.connection(**{**CONNECTION, **wrong}), words)


def test_two_fixations_are_not_connected(model):
    model.fixation("wall", position=(1, 0, 0))
    refused(
        model,
        lambda: model.connection("c", "ground", "wall", position1=(0, 0, 0), stiffness=SIX),
        "nothing could move",
    )


def test_flexible_bodies(model):
    refused(model, lambda: model.flexible_body("f2", "flexure.npz"), "fem_import.reduce")
    refused(model, lambda: model.flexible_body("f2", two_interfaces(), zeta=-1), "zeta")
    refused(model, lambda: model.flexible_body("mirror", two_interfaces()), "taken")


def test_reduced_matrices():
    good = two_interfaces()
    frames = {"base": (0, 0, 0), "tip": (0.1, 0, 0)}
    tilted = good.K.copy()
    tilted[0, 1] += 1e5
    for K, words in (
        (tilted, "symmetric"),
        (good.K * np.nan, "finite|NaN|nan"),
        (good.K[:6, :6], "shape|size|12"),
    ):
        with pytest.raises(ValueError, match=words):
            fi.ReducedBody.from_arrays(good.M, K, interfaces=frames)


def test_names_of_signals(model):
    system = model.linearize()
    force, sensor = ibs.Force("mirror", "z"), ibs.Sensor("mirror", "z")
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'mirror'"):
        system.frf(ibs.Force("miror", "z"), sensor, [1.0])
    with pytest.raises(ibs.UnknownNameError, match=r"Did you mean 'flexure\.tip'"):
        system.frf(force, ibs.Sensor("flexure.tipp", "z"), [1.0])
    with pytest.raises(ibs.UnknownNameError, match="relative_to"):
        system.frf(force, ibs.Sensor("mirror", "z", relative_to="floor"), [1.0])
    with pytest.raises(ibs.ModelError, match="not a fixation"):
        system.frf(ibs.BaseMotion("mirror", "z"), sensor, [1.0])
    with pytest.raises(ibs.ModelError, match="use BaseMotion"):
        system.frf(ibs.Force("ground", "z"), sensor, [1.0])
    with pytest.raises(ibs.ModelError, match="inputs"):
        system.frf(sensor, sensor, [1.0])
    with pytest.raises(ibs.ModelError, match="outputs"):
        system.frf(force, [], [1.0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ibs.Force("m", "rx"), "Torque"),
        (lambda: ibs.Force("m", "up"), "not known"),
        (lambda: ibs.Force("m", (0, 0, 0)), "not zero"),
        (lambda: ibs.Force("m", (0, 1)), "3 numbers"),
        (lambda: ibs.Force("", "x"), "name"),
        (lambda: ibs.Torque("m", "z"), "Force"),
        (lambda: ibs.Torque("m", (0, 0, 0)), "not zero"),
        (lambda: ibs.Sensor("m", "-z"), r"\(0, 0, -1\)"),
        (lambda: ibs.Sensor("m", "z", quantity="jerk"), "jerk"),
        (lambda: ibs.Sensor("m", "z", position=(0, 0)), "position"),
        (lambda: ibs.Sensor("m", "z", name=""), "name"),
        (lambda: ibs.Sensor("m", "z", quanity="velocity"), "Did you mean 'quantity'"),
        (lambda: ibs.BaseMotion("g", "zz"), "Did you mean 'z'"),
        (lambda: ibs.Model(""), "name"),
        (lambda: ibs.Model("m", axis="q"), "axis 'q'"),
        (lambda: ibs.Model("m", axes="x"), "Did you mean 'axis'"),
    ],
)
def test_signals_and_models(make, words):
    with pytest.raises(ibs.IbsdynError, match=words) as caught:
        make()
    assert isinstance(caught.value, (ValueError, TypeError))


def test_one_dimensional_models_want_one_number():
    model = ibs.Model("1-D", axis="rz")
    model.fixation("frame")
    refused(model, lambda: model.rigid_body("m", mass=1.0), "needs inertia= ")
    refused(model, lambda: model.rigid_body("m", inertia=(1, 1, 1, 0, 0, 0)), "one number")
    refused(model, lambda: model.rigid_body("m", inertia=1.0, cog=(0, 0, 0)), "no cog")
    refused(model, lambda: model.flexible_body("f", two_interfaces()), "3-D")
    model.rigid_body("m", inertia=1.0)
    refused(model, lambda: model.connection("k", "frame", "m", stiffness=SIX), "one number")
    refused(model, lambda: model.connection("k", "frame", "m", position1=(0, 0, 0), stiffness=1.0), "no position1")
    refused(model, lambda: model.connection("k", "frame", "m", stiffness=-1.0), "negative")
    model.connection("k", "frame", "m", stiffness=1.0)
    with pytest.raises(ibs.ModelError, match="1-D along rz"):
        model.linearize().frf(ibs.Torque("m", "rx"), ibs.Sensor("m", "rz"), [1.0])
    with pytest.raises(ibs.ModelError, match="no positions"):
        model.linearize().frf(ibs.Torque("m", "rz"), ibs.Sensor("m", "rz", position=(0, 0, 0)), [1.0])


def test_an_empty_model_is_told():
    model = ibs.Model("nothing")
    for add in (lambda: None, lambda: model.fixation("ground")):
        add()
        with pytest.raises(ibs.ModelError, match="empty"):
            model.linearize()
        assert any("empty" in finding for finding in model.check())


def test_replacing(model):
    refused(model, lambda: model.replace_with_flexible("ground", two_interfaces()), "fixation")
    refused(model, lambda: model.replace_with_flexible("flexure", two_interfaces()), "flexible already")
    refused(model, lambda: model.replace_with_flexible("mirr", two_interfaces()), "Did you mean 'mirror'")
    refused(model, lambda: model.replace_with_flexible("frame", None), "ReducedBody")
    refused(
        model,
        lambda: model.replace_with_flexible("frame", two_interfaces(), interfaces={"mount": "side"}),
        "no interface 'side'",
    )
    refused(
        model,
        lambda: model.replace_with_flexible("frame", two_interfaces(), interfaces={"mont": "tip"}),
        "Did you mean 'mount'",
    )
    # both ends of the connection are nearest to the same interface
    refused(model, lambda: model.replace_with_flexible("mount", two_interfaces()), "tell them apart")


def test_removing(model):
    refused(model, lambda: model.remove("frame"), "'mount'")
    refused(model, lambda: model.remove("mout"), "Did you mean 'mount'")
    model.remove("mount")
    model.remove("frame")
    assert "frame" not in model.items


def test_unknown_keywords_answer_with_the_nearest(model):
    for call, words in (
        (lambda: model.rigid_body("b", mas=1.0), "Did you mean 'mass'"),
        (lambda: model.connection("c", "frame", "mirror", stifness=SIX), "Did you mean 'stiffness'"),
        (lambda: model.fixation("g2", pos=(0, 0, 0)), "Did you mean 'position'"),
        (lambda: model.linearize(flexibel="x"), "Did you mean 'flexible'"),
        (lambda: model.linearize(flexible="floating"), "Did you mean 'floating-frame'"),
    ):
        refused(model, call, words)


def test_point_mass_and_thin_plate_inertias():
    model = ibs.Model("edge")
    model.rigid_body("plate", mass=1.0, cog=(0, 0, 0), inertia=(0.1234, 0.2345, 0.3580, 0, 0, 0))  # rounded by CAD
    with pytest.raises(ibs.ModelError, match="above the sum"):
        model.rigid_body("impossible", mass=1.0, cog=(0, 0, 0), inertia=(0.1234, 0.2345, 0.37, 0, 0, 0))


def test_products_of_inertia_of_a_cad_program():
    tensor = ibs.Model("t").rigid_body("b", mass=1.0, cog=(0, 0, 0), inertia=(2, 3, 4, -0.5, 0.2, 0.1))
    integral = ibs.Model("i").rigid_body(
        "b", mass=1.0, cog=(0, 0, 0), inertia=(2, 3, 4, 0.5, -0.2, -0.1), products="integral"
    )
    assert tensor.inertia == integral.inertia


def refused(model, call, words):
    before = (dict(model.items), dict(model.connections))
    with pytest.raises(ibs.IbsdynError, match=words) as caught:
        call()
    assert isinstance(caught.value, ValueError)
    assert (dict(model.items), dict(model.connections)) == before

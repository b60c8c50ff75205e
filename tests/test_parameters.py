"""Parameters by address: what they are called, what changing one does, what is refused."""

import math

import numpy as np
import pytest
from analytic import RandomAssembly

import ibsdyn as ibs


def module():
    model = ibs.Model("module")
    model.fixation("platform", position=(0, 0, 0.01))
    model.rigid_body("mirror", mass=0.25, cog=(0, 0, 0.08), inertia=(1e-4, 1.2e-4, 2e-4, 1e-6, 2e-6, 3e-6))
    model.connection(
        "mount",
        "platform",
        "mirror",
        position1=(0.01, 0, 0.05),
        stiffness=(1e6, 2e6, 3e6, math.inf, 2e3, 0),
        damping=(1, 2, 3, 4, 5, 6),
        zeta=0.01,
    )
    return model


def concept(axis):
    model = ibs.Model("concept", axis=axis)
    model.fixation("frame")
    model.rigid_body("mirror", **{"inertia" if axis == "rz" else "mass": 2e-4})
    model.connection("flexure", "frame", "mirror", stiffness=500.0, zeta=0.01)
    return model


def test_every_number_of_the_table_has_an_address():
    values = module().parameters()
    assert list(values)[:13] == [
        *(f"platform.position.{d}" for d in "xyz"),
        "mirror.mass",
        *(f"mirror.cog.{d}" for d in "xyz"),
        *(f"mirror.inertia.I{d}" for d in ("xx", "yy", "zz", "xy", "xz", "yz")),
    ]
    assert list(values)[13:] == [
        *(f"mount.{k}" for k in ("kx", "ky", "kz", "kxx", "kyy", "kzz", "cx", "cy", "cz", "cxx", "cyy", "czz", "zeta")),
        *(f"mount.position{i}.{d}" for i in (1, 2) for d in "xyz"),
    ]
    assert values["mirror.inertia.Ixz"] == 2e-6
    assert values["mount.kxx"] == math.inf
    assert values["mount.czz"] == 6.0
    assert list(concept("rz").parameters()) == ["mirror.inertia", "flexure.stiffness", "flexure.zeta"]
    assert list(concept("x").parameters()) == ["mirror.mass", "flexure.stiffness", "flexure.zeta"]


def test_a_changed_model_is_the_one_typed_with_those_numbers():
    model = module()
    new = {address: 1.1 * value if value else 0.001 for address, value in model.parameters().items()}
    changed = model.with_parameters(new)
    typed = ibs.Model("module")
    typed.fixation("platform", position=(0.001, 0.001, 0.011))
    typed.rigid_body(
        "mirror",
        mass=0.275,
        cog=(0.001, 0.001, 0.088),
        inertia=1.1 * np.array((1e-4, 1.2e-4, 2e-4, 1e-6, 2e-6, 3e-6)),
    )
    typed.connection(
        "mount",
        "platform",
        "mirror",
        position1=(0.011, 0.001, 0.055),
        stiffness=(1.1e6, 2.2e6, 3.3e6, math.inf, 2.2e3, 0.001),
        damping=1.1 * np.arange(1, 7),
        zeta=0.011,
    )
    for address, value in typed.parameters().items():
        assert changed.parameters()[address] == pytest.approx(value, rel=1e-15), address
    assert model.parameters() == module().parameters()  # the first one stays as it was
    np.testing.assert_allclose(
        changed.linearize().modes().frequencies, typed.linearize().modes().frequencies, rtol=1e-12
    )


@pytest.mark.parametrize(("axis", "body"), [("rz", "mirror.inertia"), ("x", "mirror.mass")])
def test_one_dimensional_models_too(axis, body):
    changed = concept(axis).with_parameters({body: 8e-4, "flexure.stiffness": 800.0, "flexure.zeta": 0.02})
    assert changed.linearize().modes().frequencies[0] == pytest.approx(math.sqrt(800.0 / 8e-4) / (2 * math.pi))
    assert changed.linearize().modes().damping_ratios[0] == pytest.approx(0.02)


def test_its_own_values_change_nothing():
    model = RandomAssembly(3, damper=True).model(ibs)
    same = model.with_parameters(model.parameters())
    assert dict(same.items) == dict(model.items)
    assert dict(same.connections) == dict(model.connections)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"miror.mass": 1.0}, r"no parameter 'miror.mass'.*Did you mean 'mirror'"),
        ({"mirror.mas": 1.0}, r"Did you mean 'mirror.mass'"),
        ({"mount.stiffness": 1.0}, r"no parameter 'mount.stiffness'"),
        ({"mount.cog.x": 1.0}, r"no parameter"),
        ({"mirror": 1.0}, r"no parameter"),
        ({3: 1.0}, r"no parameter"),
        ({"mirror.mass": -1.0}, r"mirror.*mass must be above 0"),
        ({"mirror.mass": "heavy"}, r"mirror.mass must be one number \[kg\]"),
        ({"mirror.inertia.Ixx": 1.0}, r"no body has the inertia"),
        ({"mount.kx": -1.0}, r"kx must not be negative"),
        ({"mount.kx": math.nan}, r"stiffness"),
        ({"mount.zeta": -0.1}, r"zeta must not be below 0"),
        ({"mount.position1.x": math.inf}, r"position1 must be finite"),
        ([("mirror.mass", 1.0)], r"expects a dict"),
    ],
)
def test_refusals(values, words):
    with pytest.raises(ibs.ModelError, match=words):
        module().with_parameters(values)

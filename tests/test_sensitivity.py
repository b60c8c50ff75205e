"""Exact sensitivities against central differences of the model's own numbers, and against closed forms."""

import numpy as np
import pytest
from analytic import RandomAssembly

import ibsdyn as ibs

FREQUENCIES = np.geomspace(5.0, 3000.0, 25)


def signals(names):
    inputs = [
        ibs.Force(names[1], "x"),
        ibs.Force(names[2], (1, 2, 3), position=(0.1, 0.2, 0.3)),
        ibs.Torque(names[0], "ry"),
    ]
    outputs = [
        ibs.Sensor(names[2], "z"),
        ibs.Sensor(names[1], "rx", quantity="displacement"),
        ibs.Sensor(names[0], (1, 1, 0), position=(0.1, 0.1, 0), quantity="velocity"),
        ibs.Sensor(names[0], "z", relative_to=names[1], quantity="displacement"),
        ibs.CombinedSensor(
            "sag", [(2.0, ibs.Sensor(names[0], "z")), (-0.5, ibs.Sensor(names[1], "x", position=(0, 0.1, 0)))], "m/s²"
        ),
    ]
    return inputs, outputs


def base_signals(fixation, body):
    return (
        [ibs.BaseMotion(fixation, "rx"), ibs.BaseMotion(fixation, "y", quantity="displacement")],
        [ibs.Sensor(body, "x", relative_to=fixation), ibs.Sensor(fixation, "z")],
    )


def ratios():
    random = RandomAssembly(1, count=3, zeta=(0.005, 0.05))
    inputs, outputs = signals(random.names)
    moved, seen = base_signals("ground", "b0")
    return random.model(ibs), inputs + moved, outputs + seen


def dampers():
    random = RandomAssembly(2, count=3, damper=True, zeta=0.02)
    model = random.model(ibs)
    model.connection("plain", "ground", "b1", position1=(0.1, 0, 0), stiffness=(1e5,) * 3 + (1e3,) * 3, zeta=0.03)
    inputs, outputs = signals(random.names)
    moved, seen = base_signals("ground", "b0")
    return model, inputs + moved, outputs + seen


def free():
    random = RandomAssembly(4, count=3, zeta=(0.005, 0.05), fixed=False)
    return random.model(ibs), *signals(random.names)


def two_fixations():
    random = RandomAssembly(5, count=3, zeta=(0.005, 0.05))
    model = random.model(ibs)
    model.fixation("wall", position=(0.3, 0.1, 0))
    model.connection(
        "extra", "wall", "b2", position1=(0.2, 0.1, 0.1), stiffness=(1e6, 2e6, 3e6, 1e3, 1e4, 1e5), zeta=0.03
    )
    inputs, outputs = signals(random.names)
    moved, seen = base_signals("wall", "b2")
    return model, [*inputs, *moved, ibs.Stroke("extra", "y")], outputs + seen


def hinge(**loss):
    random = RandomAssembly(6, count=3, zeta=(0.005, 0.05))
    model = random.model(ibs)
    inertia = (0.02, 0.02, 0.03, 1e-3, 2e-3, 1e-3)
    model.rigid_body("arm", mass=2.0, cog=(0.1, 0.2, 0.3), inertia=inertia)
    inf = np.inf
    model.connection("hinge", "b2", "arm", position1=(0.2, 0.1, 0.1), stiffness=(inf, inf, inf, inf, 1e4, inf), **loss)
    inputs, outputs = signals(random.names)
    return model, [*inputs, ibs.Force("arm", "z"), ibs.Stroke("hinge", "ry")], [*outputs, ibs.Sensor("arm", "y")]


def locked():
    return hinge(zeta=0.02)


def locked_with_dampers():
    return hinge(damping=(1.0, 1.0, 1.0, 1.0, 3.0, 1.0), zeta=0.01)


def concept():
    model = ibs.Model("two stages", axis="x")
    model.fixation("base")
    model.rigid_body("lower", mass=2.0)
    model.rigid_body("upper", mass=1.0)
    model.connection("soft", "base", "lower", stiffness=2e4, zeta=0.02)
    model.connection("stiff", "lower", "upper", stiffness=1e5, damping=20.0, zeta=0.01)
    return (
        model,
        [ibs.Force("upper", "x"), ibs.BaseMotion("base", "x"), ibs.Stroke("stiff", "x")],
        [ibs.Sensor("upper", "x"), ibs.Sensor("lower", "x", relative_to="base", quantity="displacement")],
    )


MODELS = [ratios, dampers, free, two_fixations, locked, locked_with_dampers, concept]


def step_of(address, value):
    """A step of every kind of number at which truncation and rounding of a central difference are both small."""
    if any(word in address for word in (".cog.", ".position", ".elastic_centre")):
        return 1e-6
    return 1e-4 * abs(value) or 1e-6


def sides(model, address):
    value = model.parameters()[address]
    step = step_of(address, value)
    above, below = (model.with_parameters({address: value + sign * step}).linearize() for sign in (1, -1))
    return above, below, step


@pytest.mark.parametrize("make", MODELS)
def test_responses_against_differences(make):
    model, inputs, outputs = make()
    found = ibs.response_sensitivities(model, inputs, outputs, FREQUENCIES)
    parameters = model.parameters()
    compared = 0
    # Every third parameter: all kinds come by in one model or another.
    for address in found.parameters[:: 1 if len(found.parameters) < 30 else 3]:
        above, below, step = sides(model, address)
        difference = above.frf(inputs, outputs, FREQUENCIES).response - below.frf(inputs, outputs, FREQUENCIES).response
        difference /= 2 * step
        size = np.abs(difference).max(axis=2) + 1e-6 * np.abs(found.response.response).max(axis=2) / (
            100 * step
        )  # what differences see of nothing
        error = np.abs(found.derivative(address) - difference).max(axis=2)
        assert np.all(error <= 3e-4 * size), (address, parameters[address], (error / size).max())
        compared += np.any(np.abs(difference) > 0)
    assert compared > 3


@pytest.mark.parametrize("make", MODELS)
def test_frequencies_and_ratios_against_differences(make):
    model, *_ = make()
    system = model.linearize()
    elastic = np.flatnonzero(~system.modes().rigid)
    quantities = [kind(mode + 1) for kind in (ibs.ModeFrequency, ibs.ModeDamping) for mode in range(len(elastic))]
    found = ibs.sensitivities(model, quantities)
    np.testing.assert_allclose(
        found.values,
        np.r_[system.modes().frequencies[elastic], system.modes().damping_ratios[elastic]],
        rtol=1e-12,
    )
    for address in found.parameters[:: 1 if len(found.parameters) < 30 else 2]:
        above, below, step = sides(model, address)
        difference = (
            np.concatenate([[q.evaluate(above) for q in quantities]]) - [q.evaluate(below) for q in quantities]
        ) / (2 * step)
        own = found.derivatives[:, found.parameters.index(address)]
        floor = 1e-8 * found.values / step
        assert np.all(np.abs(own - difference) <= 1e-4 * np.abs(difference) + floor), address


def test_one_degree_of_freedom_in_closed_form():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=2.0)
    model.connection("k", "wall", "m", stiffness=800.0, zeta=0.02)
    f = np.sqrt(800.0 / 2.0) / (2 * np.pi)
    peak = ibs.PeakResponse(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"), (0.1, 50.0))
    static = ibs.ResponseAt(ibs.Force("m", "x"), ibs.Sensor("m", "x", quantity="displacement"), 0.0)
    left_behind = ibs.ResponseAt(
        ibs.BaseMotion("wall", "x"), ibs.Sensor("m", "x", quantity="displacement", relative_to="wall"), 0.0
    )
    found = ibs.sensitivities(model, [ibs.ModeFrequency(1), ibs.ModeDamping(1), peak, static, left_behind])
    assert found.parameters == ("m.mass", "k.stiffness", "k.zeta")
    np.testing.assert_allclose(found.derivatives[0], [-f / 4.0, f / 1600.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(found.derivatives[1], [0.0, 0.0, 1.0], atol=1e-15)
    # 1 / (2 k zeta sqrt(1 - zeta²))
    z, k = 0.02, 800.0
    height = 1 / (2 * k * z * np.sqrt(1 - z * z))
    slope = height * (-1 / z + z / (1 - z * z))
    np.testing.assert_allclose(found.derivatives[2], [0.0, -height / k, slope], rtol=1e-6, atol=1e-6 * height)
    np.testing.assert_allclose(found.derivatives[3], [0.0, -1 / k**2, 0.0], rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(found.derivatives[4], [1 / k, -2.0 / k**2, 0.0], rtol=1e-6, atol=1e-11)
    assert found.relative(0) == pytest.approx({"m.mass": -0.5, "k.stiffness": 0.5, "k.zeta": 0.0}, abs=1e-12)


def test_rms_against_differences():
    model, *_ = dampers()
    shaker = ibs.Disturbance("floor", ibs.BaseMotion("ground", "x"), ([1.0, 2000.0], [1e-4, 1e-6]))
    fan = ibs.Tone("fan", ibs.Force("b1", "z"), amplitude=0.3, frequency=48.0)
    pair = ibs.CorrelatedDisturbance(
        "cables",
        [ibs.Force("b0", "x"), ibs.Force("b2", "y")],
        [ibs.PSD([2.0, 500.0], [1e-2, 1e-2], "N")] * 2,
        correlation=[[1.0, 0.5j], [-0.5j, 1.0]],
    )
    rms = ibs.RmsResponse(ibs.Sensor("b2", "z"), [shaker, fan, pair], (2.0, 1500.0))
    found = ibs.sensitivities(model, rms)
    for address in found.parameters[::6]:
        above, below, step = sides(model, address)
        difference = (rms.evaluate(above) - rms.evaluate(below)) / (2 * step)
        assert found.derivative(0, address) == pytest.approx(difference, rel=1e-3, abs=1e-8 * found.values[0] / step)


def symmetric(zeta=0.02):
    """A disc on a square of four equal mounts: x and y, rx and ry share their frequencies."""
    model = ibs.Model("disc")
    model.fixation("floor")
    model.rigid_body("disc", mass=2.0, cog=(0, 0, 0.1), inertia=(0.01, 0.01, 0.02, 0, 0, 0))
    for i, (x, y) in enumerate([(0.1, 0), (0, 0.1), (-0.1, 0), (0, -0.1)]):
        model.connection(
            f"mount {i}", "floor", "disc", position1=(x, y, 0.05), stiffness=(2e5, 2e5, 6e5, 0, 0, 0), zeta=zeta
        )
    return model


def test_repeated_frequencies_split_as_the_projected_change_says():
    model = symmetric()
    quantities = [ibs.ModeFrequency(mode) for mode in (1, 2)]
    found = ibs.sensitivities(model, quantities)
    assert any("modes 1 and 2 share one frequency" in remark for remark in found.remarks)
    system = model.linearize()
    assert np.ptp(system.modes().frequencies[:2]) < 1e-6
    for address in ("disc.cog.x", "disc.inertia.Ixx", "mount 0.kx", "mount 0.kz", "disc.mass", "mount 1.position1.z"):
        value = model.parameters()[address]
        step = step_of(address, value)
        above = model.with_parameters({address: value + step}).linearize()
        one_sided = [(q.evaluate(above) - v) / step for q, v in zip(quantities, found.values, strict=True)]
        own = found.derivatives[:, found.parameters.index(address)]
        assert own[0] <= own[1]
        np.testing.assert_allclose(own, one_sided, rtol=2e-3, atol=1e-9 * found.values[0] / step)


def test_responses_are_smooth_where_frequencies_repeat():
    model = symmetric()
    inputs = [ibs.Force("disc", (1, 0.3, 0.2), position=(0.05, 0.02, 0.1)), ibs.BaseMotion("floor", "x")]
    outputs = ibs.Sensor("disc", (0.1, 1, 0.4), position=(0.02, 0.04, 0.2))
    frequencies = np.linspace(5, 300, 40)
    found = ibs.response_sensitivities(model, inputs, outputs, frequencies)
    for address in ("disc.cog.x", "disc.inertia.Ixy", "mount 0.kx", "mount 0.kz", "mount 1.position1.x"):
        above, below, step = sides(model, address)
        difference = above.frf(inputs, outputs, frequencies).response - below.frf(inputs, outputs, frequencies).response
        difference /= 2 * step
        error = np.abs(found.derivative(address) - difference).max()
        assert error <= 2e-3 * np.abs(difference).max(), address


def test_a_ratio_that_strain_energy_leaves_open_is_told():
    model = symmetric()
    model = model.with_parameters({"mount 0.zeta": 0.1})
    with pytest.warns(ibs.ModelWarning, match="share one frequency"):
        found = ibs.sensitivities(model, ibs.ModeDamping(1))
    assert any("depends on which combinations" in remark for remark in found.remarks)


def test_what_has_no_derivative_is_left_out_or_refused():
    model, *_ = locked()
    found = ibs.sensitivities(model, ibs.ModeFrequency(1))
    assert {f"hinge.{k}" for k in ("kx", "ky", "kz", "kxx", "kzz")} == set(found.without)
    with pytest.raises(ibs.AnalysisError, match=r"hinge.kx is inf"):
        ibs.sensitivities(model, ibs.ModeFrequency(1), ["hinge.kx"])
    with pytest.raises(ibs.UnknownNameError, match=r"hinge.kx is inf"):
        found.derivative(0, "hinge.kx")
    with pytest.raises(ibs.UnknownNameError, match=r"Did you mean 'arm.mass'"):
        ibs.sensitivities(model, ibs.ModeFrequency(1), ["arm.mas"])
    with pytest.raises(ibs.ModelError, match="quantities must be as"):
        ibs.sensitivities(model, "first mode")
    slider = ibs.Model("slider", axis="x")
    slider.fixation("wall")
    for name in ("a", "b"):
        slider.rigid_body(name, mass=1.0)
    slider.connection("spring", "a", "b", stiffness=100.0)
    slider.connection("guide", "wall", "a", stiffness=0.0)
    assert "rigid-body motion" in ibs.sensitivities(slider, ibs.ModeFrequency(1)).without["guide.stiffness"]


def test_locks_that_repeat_each_other_cannot_be_moved_one_by_one():
    inf = np.inf
    model = ibs.Model("door")
    model.fixation("frame")
    model.rigid_body("door", mass=5.0, cog=(0.4, 0, 0.5), inertia=(0.5, 0.9, 0.4, 0, 0, 0))
    for name, z in (("lower", 0.1), ("upper", 0.9)):
        model.connection(name, "frame", "door", position1=(0, 0, z), stiffness=(inf, inf, inf, inf, inf, 0))
    model.connection("closer", "frame", "door", position1=(0, 0, 1.0), stiffness=(0, 0, 0, 0, 0, 30.0), zeta=0.1)
    found = ibs.sensitivities(model, ibs.ModeFrequency(1))
    assert "contradict" in found.without["lower.position1.x"]
    # Along the axis of the hinges nothing changes, and the door turns about it with I + m a².
    assert found.derivative(0, "lower.position1.z") == pytest.approx(0.0, abs=1e-9)
    about = 0.4 + 5.0 * 0.4**2
    assert found.derivative(0, "door.cog.x") == pytest.approx(-found.values[0] * 5.0 * 0.4 / about, rel=1e-9)


def test_other_quantities_are_differentiated_by_differences():
    class Mass:
        name, unit = "moving mass", "kg"

        def evaluate(self, system):
            return float(system.M[0, 0])

    model, *_ = concept()
    found = ibs.sensitivities(model, Mass(), ["lower.mass", "soft.stiffness"])
    np.testing.assert_allclose(found.derivatives, [[1.0, 0.0]], atol=1e-9)
    assert found.remarks == ("moving mass: by central differences.",)


def test_table_and_tornado_chart():
    model, inputs, outputs = ratios()
    found = ibs.sensitivities(model, [ibs.ModeFrequency(1), ibs.ResponseAt(inputs[0], outputs[0], 20.0)])
    text = str(found)
    strongest = next(iter(found.effects(0)))
    assert text.splitlines()[1].split("  ")[1] == strongest
    effect = found.effects("frequency of mode 1")[strongest]
    step = found.steps[found.parameters.index(strongest)]
    assert effect == pytest.approx(found.derivative(0, strongest) * step)
    axes = found.plot(0, parameters=5)
    widths = [bar.get_width() for bar in axes.containers[0]]
    np.testing.assert_allclose(widths, list(found.effects(0).values())[:5])
    assert axes.get_xlabel() == "change of frequency of mode 1 [Hz]"
    with pytest.raises(ibs.UnknownNameError):
        found.plot("frequency of mode 9")

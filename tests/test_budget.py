"""Budgets against closed forms, a Monte Carlo in time, hand integration and hand decompositions."""

import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import scipy.integrate
import scipy.signal
from analytic import RandomAssembly
from hypothesis import given, settings
from hypothesis import strategies as st

import fem_import as fi
import ibsdyn as ibs
from ibsdyn.resonance_grid import poles, resonance_grid


def oscillator(frequency=50.0, zeta=0.01, mass=2.0):
    model = ibs.Model("oscillator", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=mass)
    model.connection("k", "wall", "m", stiffness=mass * (2 * np.pi * frequency) ** 2, zeta=zeta)
    return model.linearize()


def chain(m=(2.0, 0.5), k=(8e4, 3e4), zeta=(0.02, 0.005)):
    model = ibs.Model("chain", axis="x")
    model.fixation("wall")
    model.rigid_body("a", mass=m[0])
    model.rigid_body("b", mass=m[1])
    model.connection("lower", "wall", "a", stiffness=k[0], zeta=zeta[0])
    model.connection("upper", "a", "b", stiffness=k[1], zeta=zeta[1])
    return model.linearize()


WIDE = (1e-4, 1e7)
STRETCH = ibs.Sensor("m", "x", quantity="displacement", relative_to="wall", name="stretch")


@pytest.mark.filterwarnings("ignore:connection 'k'. zeta:ibsdyn.ModelWarning")
@pytest.mark.parametrize("zeta", [1e-6, 1e-3, 0.01, 0.3, 1.0, 3.0])
def test_white_force_on_one_dof(zeta, validated):
    """sigma² = S / (8 zeta m² omega³) for a one-sided S in N²/Hz."""
    system = oscillator(zeta=zeta)
    force = ibs.Disturbance("noise", ibs.Force("m", "x"), ibs.PSD.white(3.0, WIDE, "N"))
    rms = ibs.RmsResponse(STRETCH, force).evaluate(system)
    expected, source = math.sqrt(3.0 / (8 * zeta * 4.0 * (2 * np.pi * 50) ** 3)), "σ² = S / (8 ζ m² ω³)"
    what = f"RMS stretch, white force, zeta {zeta:g}"
    validated(what, source, expected, rms, rtol=2e-5, against="closed forms", unit="m")


@pytest.mark.parametrize("zeta", [1e-5, 0.005, 0.1])
def test_miles(zeta, validated):
    """Stretch under white base acceleration, and absolute acceleration, g RMS² = pi f Q S / 2 (1 + 4 zeta²)."""
    f, S = 50.0, 0.7
    system = oscillator(f, zeta)
    base = ibs.Disturbance("shaker", ibs.BaseMotion("wall", "x"), ibs.PSD.white(S, WIDE))
    budget = ibs.vibration_budget(system, [STRETCH, ibs.Sensor("m", "x", name="acceleration")], base)
    Q, w = 1 / (2 * zeta), 2 * np.pi * f
    stretch, what = math.sqrt(math.pi / 2 * f * Q * S) / w**2, f"RMS stretch, white base acceleration, zeta {zeta:g}"
    validated(what, "Miles", stretch, budget.rms[0], rtol=1e-5, against="closed forms", unit="m")
    assert budget.rms[0] == pytest.approx(math.sqrt(budget.cumulative_power[0, -1]), rel=1e-9)
    # With a damper the mass follows high frequencies: 4 zeta² f_n² / f² above resonance, gone beyond the band.
    assert budget.rms[1] == pytest.approx(math.sqrt(math.pi / 2 * f * Q * S * (1 + 4 * zeta**2)), rel=2e-5)


def test_two_dof_force_against_the_lyapunov_equation(validated):
    """White force: the stationary covariance solves A P + P A^T + B B^T S/2 = 0 (scipy, hand-made A)."""
    system = chain()
    M, K = np.diag([2.0, 0.5]), np.array([[11e4, -3e4], [-3e4, 3e4]])
    np.testing.assert_allclose(system.M, M)
    np.testing.assert_allclose(system.K, K)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, system.C)]])
    B = np.array([[0, 0], [0, 0], [0.5, 0], [0, 2.0]])
    S = np.array([[2.0, 0.4], [0.4, 0.3]])
    P = scipy.linalg.solve_continuous_lyapunov(A, -B @ S @ B.T / 2)
    correlated = ibs.CorrelatedDisturbance(
        "pair",
        [ibs.Force("a", "x"), ibs.Force("b", "x")],
        [ibs.PSD.white(2.0, WIDE, "N"), ibs.PSD.white(0.3, WIDE, "N")],
        correlation=[[1, 0.4 / math.sqrt(0.6)], [0.4 / math.sqrt(0.6), 1]],
    )
    outputs = [
        ibs.Sensor("a", "x", quantity="displacement"),
        ibs.Sensor("b", "x", quantity="displacement"),
        ibs.Sensor("b", "x", quantity="velocity"),
        ibs.Sensor("b", "x", quantity="displacement", relative_to="a"),
    ]
    power = ibs.vibration_budget(system, outputs, correlated).power
    validated(
        "mean squares of two masses under two correlated white forces",
        "Lyapunov equation, SciPy, A and B by hand",
        [P[0, 0], P[1, 1], P[3, 3], P[0, 0] + P[1, 1] - 2 * P[0, 1]],
        power,
        rtol=2e-5,
        against="calculations by hand",
        unit="m², (m/s)²",
    )


def test_monte_carlo_in_time(validated):
    """Filtered noise integrated in time by scipy: the RMS lies within the scatter of the sample."""
    rng = np.random.default_rng(5)
    system = chain()
    rate, n = 2000.0, 400_000
    psd = ibs.PSD([5, 20, 60, 300], [1e-3, 4e-2, 4e-2, 1e-4])
    # A signal with this PSD by random phases and amplitudes on the lines of one long period.
    lines = np.fft.rfftfreq(n, 1 / rate)
    spectrum = np.sqrt(psd.at(lines) * rate * n / 2) * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines)))
    base = np.fft.irfft(spectrum / math.sqrt(2), n)
    M, K, C = system.M, system.K, system.C
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    B = np.array([[0.0], [0.0], [-1.0], [-1.0]])  # relative coordinates: every mass feels -a
    _, y, _ = scipy.signal.lsim((A, B, np.eye(4), np.zeros((4, 1))), base, np.arange(n) / rate)
    steady = y[20_000:, 1]
    blocks = np.mean(steady.reshape(20, -1) ** 2, axis=1)
    disturbance = ibs.Disturbance("floor", ibs.BaseMotion("wall", "x"), psd)
    sensor = ibs.Sensor("b", "x", quantity="displacement", relative_to="wall")
    power = ibs.RmsResponse(sensor, disturbance).evaluate(system) ** 2
    scatter = blocks.std(ddof=1) / math.sqrt(20)
    assert scatter < 0.05 * power
    validated(
        "mean square of a chain under shaped base noise",
        "SciPy's lsim, 190 s; allowed: three times its scatter",
        power,
        blocks.mean(),
        atol=3.0 * scatter,
        against="runs in time",
        unit="m²",
    )


def three_d():
    model = ibs.Model("box")
    model.fixation("floor", position=(0, 0, 0))
    model.rigid_body("box", mass=12.0, cog=(0, 0, 0.15), inertia=(0.12, 0.12, 0.08, 0, 0, 0))
    model.rigid_body("mirror", mass=0.3, cog=(0.02, 0, 0.3), inertia=(2e-4, 2e-4, 3e-4, 0, 0, 0))
    for i, (x, y) in enumerate([(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)]):
        model.connection(
            f"mount{i}", "floor", "box", position1=(x, y, 0.05), stiffness=(2e5, 2e5, 6e5, 0, 0, 0), zeta=0.05
        )
    model.connection(
        "flexure", "box", "mirror", position1=(0, 0, 0.28), stiffness=(1e6, 1e6, 1e7, 100, 1e3, 1e3), zeta=0.002
    )
    return model.linearize()


TILT = ibs.Sensor("mirror", "rx", quantity="displacement", name="tilt")
TOP = ibs.Sensor("mirror", "y", position=(0, 0, 0.32), quantity="displacement", name="top", relative_to="floor")


def test_hand_integration_of_the_frf():
    """A brute-force trapezium over a million lines of the product of FRFs, in cumulative power too."""
    system = three_d()
    floor = ibs.BaseMotion("floor", "y")
    psd = ibs.PSD([2, 30, 30, 400], [1e-4, 1e-3, 2e-4, 1e-6])  # a step at 30 Hz
    budget = ibs.vibration_budget(system, [TILT, TOP], ibs.Disturbance("floor", floor, psd))
    lines = np.unique(np.r_[np.linspace(2, 400, 200_000), 30 - 1e-9, 30])
    S = abs(system.frf(floor, [TILT, TOP], lines).response[:, 0]) ** 2 * psd.at(lines)
    running = scipy.integrate.cumulative_trapezoid(S, lines, axis=1, initial=0)
    np.testing.assert_allclose(budget.power, running[:, -1], rtol=1e-5)
    for o in range(2):
        at = np.interp(budget.frequencies, lines, running[o])
        np.testing.assert_allclose(budget.cumulative_power[o], at, atol=2e-5 * running[o, -1])
    np.testing.assert_allclose(budget.psd[0], np.interp(budget.frequencies, lines, S[0]), rtol=2e-2)


def test_shares_add_up_and_sources_add_in_power():
    system = three_d()
    floor = ibs.Disturbance("floor", ibs.BaseMotion("floor", "y"), ibs.floor_vibration("VC-C"))
    air = ibs.Disturbance("air", ibs.Force("box", (0, 1, 1), position=(0.1, 0, 0.3)), ([1, 400], [1e-4, 1e-6]))
    fan = ibs.Tone("fan", ibs.Force("box", "y", position=(0, 0, 0.3)), amplitude=0.02, frequency=48.0)
    budget = ibs.vibration_budget(system, [TILT, TOP], [floor, air, fan])
    for row, sensor in enumerate((TILT, TOP)):
        alone = ibs.RmsResponse(sensor, [floor, air, fan], budget.band).evaluate(system)
        assert alone == pytest.approx(budget.rms[row], rel=1e-12)
    for output in (0, "top"):
        for by in ("source", "mode", "component", "part"):
            for source in (None, "floor", "air", "fan"):
                assert sum(budget.shares(by, output, source).values()) == pytest.approx(1, abs=1e-8)
    alone = [ibs.vibration_budget(system, TOP, d, band=budget.band).power[0] for d in (floor, air, fan)]
    np.testing.assert_allclose(budget.source_power[1], alone, rtol=1e-6)
    amplitude = abs(system.frf(fan.input, TOP, [48.0]).response[0, 0, 0]) * 0.02
    assert alone[2] == pytest.approx(amplitude**2 / 2, rel=1e-10)
    step = budget.source_cumulative[1, 2]
    assert set(np.round(step / alone[2], 12)) == {0.0, 1.0}
    assert budget.frequencies[np.argmax(step > 0)] == pytest.approx(48, rel=0.05)


def test_parts_are_the_unit_load_theorem():
    """Every spring's share by hand: static force under a unit load times actual deformation, one line of frequency."""
    system = three_d()
    source = ibs.BaseMotion("floor", "y", quantity="acceleration")
    f = 37.0
    budget = ibs.vibration_budget(system, TOP, ibs.Tone("tone", source, 1.0, f))
    n = len(system.coordinates)
    y = abs(system.frf(source, TOP, [f]).response[0, 0, 0])
    w = 2 * np.pi * f
    follow = np.zeros((n, 6))
    base = np.zeros(6)
    base[1] = -1 / w**2
    for start, cog in ((0, (0, 0, 0.15)), (6, (0.02, 0, 0.3))):
        follow[start + 1, 1] = 1.0
        del cog  # a translation moves all of it alike
    D = system.K - w**2 * system.M + 1j * w * system.C
    relative = np.linalg.solve(D, w**2 * system.M @ follow @ base)  # what is left behind
    row = system.sensors([TOP])[0][0]
    virtual = np.linalg.solve(system.K, row)

    def strain(motion, cog_lever_pairs, k):
        return sum(sign * (motion[p : p + 3] + np.cross(motion[p + 3 : p + 6], r)) for sign, p, r in cog_lever_pairs), k

    shares = {}
    for i, (x, z) in enumerate([(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)]):
        ends = [(1, 0, np.array([x, z, 0.05]) - [0, 0, 0.15])]
        (v, _), (d, _) = strain(virtual, ends, None), strain(relative, ends, None)
        for axis, (name, k) in enumerate((("kx", 2e5), ("ky", 2e5), ("kz", 6e5))):
            shares[f"mount{i}.{name}"] = k * v[axis] * d[axis]
    ends = [(1, 6, np.array([0, 0, 0.28]) - [0.02, 0, 0.3]), (-1, 0, np.array([0, 0, 0.28]) - [0, 0, 0.15])]
    (v, _), (d, _) = strain(virtual, ends, None), strain(relative, ends, None)
    for axis, (name, k) in enumerate((("kx", 1e6), ("ky", 1e6), ("kz", 1e7))):
        shares[f"flexure.{name}"] = k * v[axis] * d[axis]
    for axis, (name, k) in enumerate((("kxx", 100), ("kyy", 1e3), ("kzz", 1e3))):
        shares[f"flexure.{name}"] = (
            k * (virtual[9 + axis] - virtual[3 + axis]) * (relative[9 + axis] - relative[3 + axis])
        )
    whole = row @ relative
    assert abs(whole) == pytest.approx(y, rel=1e-9)
    assert sum(shares.values()) == pytest.approx(whole, rel=1e-9)
    got = budget.shares("part")
    for name, term in shares.items():
        assert got[name] == pytest.approx((term * whole.conjugate()).real / y**2, abs=1e-9), name
    assert got["carried by the base"] == 0.0
    assert budget.shares("mode")["carried by the base"] == 0.0


def test_absolute_motion_counts_what_the_base_carries():
    """Far below resonance all of an absolute motion is the base's own; a stiffer spring takes no part."""
    system = oscillator(frequency=500.0)
    floor = ibs.Disturbance("floor", ibs.BaseMotion("wall", "x"), ibs.PSD.white(1.0, (1.0, 5.0)))
    shares = ibs.vibration_budget(system, ibs.Sensor("m", "x"), floor).shares("part")
    assert shares["carried by the base"] == pytest.approx(1.0, abs=1e-4)
    assert shares["k"] == pytest.approx(0.0, abs=1e-4)


def test_correlation():
    """Two equal forces: in step they make four times the power of one, opposed nothing, independent twice."""
    system = three_d()
    inputs = [ibs.Force("box", "y", position=(0, 0, 0.3), name=n) for n in ("one", "two")]
    psd = ibs.PSD.white(1e-3, (5, 300), "N")
    single = ibs.vibration_budget(system, TOP, ibs.Disturbance("d", inputs[0], psd)).power[0]
    for value, factor in ((1, 4), (0, 2), (-1, 0), (0.5j, 2)):
        gamma = [[1, value], [np.conj(value), 1]]
        pair = ibs.CorrelatedDisturbance("pair", inputs, psd, correlation=gamma)
        assert ibs.vibration_budget(system, TOP, pair).power[0] == pytest.approx(factor * single, abs=1e-9 * single)


def test_delay_between_two_feet_enters_with_the_right_sign():
    """The second force late by tau: S_21 = S exp(-i omega tau), and G S G^H is S |G1 + G2 exp(-i omega tau)|²."""
    system = three_d()
    inputs = [ibs.Force("box", "y", position=(0, 0, 0.3)), ibs.Force("mirror", "y", position=(0, 0, 0.3))]
    f = np.linspace(5, 60, 2000)
    late = np.exp(-2j * np.pi * f * 0.004)
    spectra = np.array([[np.ones_like(f), late.conj()], [late, np.ones_like(f)]]) * 1e-3
    pair = ibs.CorrelatedDisturbance.from_cross_spectra("feet", inputs, f, spectra)
    budget = ibs.vibration_budget(system, TOP, pair)
    G = system.frf(inputs, TOP, budget.frequencies).response[0]
    expected = abs(G[0] + G[1] * np.exp(-2j * np.pi * budget.frequencies * 0.004)) ** 2 * 1e-3
    np.testing.assert_allclose(budget.psd[0], expected, rtol=2e-3, atol=1e-4 * expected.max())
    wrong = abs(G[0] + G[1] * np.exp(2j * np.pi * budget.frequencies * 0.004)) ** 2 * 1e-3
    assert np.abs(budget.psd[0] / wrong - 1).max() > 0.1


def test_impossible_correlations_are_refused():
    inputs = [ibs.Force("m", "x", name=n) for n in "abc"]
    psd = ibs.PSD.white(1.0, (1, 10), "N")
    for gamma, words in (
        ([[1, 0.9, 0.9], [0.9, 1, -0.9], [0.9, -0.9, 1]], "eigenvalue"),
        ([[1, 1j, 0], [1j, 1, 0], [0, 0, 1]], "Hermitian"),
        ([[2, 0, 0], [0, 1, 0], [0, 0, 1]], "diagonal"),
        ([[1, 0], [0, 1]], r"\(3, 3\)"),
    ):
        with pytest.raises(ibs.ModelError, match=words):
            ibs.CorrelatedDisturbance("d", inputs, psd, correlation=gamma)
    with pytest.raises(ibs.ModelError, match="3 inputs and 2 PSDs"):
        ibs.CorrelatedDisturbance("d", inputs, [psd, psd])


def test_an_undamped_mode_is_refused_only_where_it_takes_part():
    system = oscillator(zeta=0.0)
    inside = ibs.Disturbance("noise", ibs.Force("m", "x"), ibs.PSD.white(1.0, (1, 100), "N"))
    with pytest.raises(ibs.AnalysisError, match=r"mode 1 \(50 Hz\) has no damping"):
        ibs.vibration_budget(system, STRETCH, inside)
    with pytest.raises(ibs.AnalysisError, match="the RMS is infinite"):
        ibs.RmsResponse(STRETCH, inside).evaluate(system)
    below = ibs.Disturbance("noise", ibs.Force("m", "x"), ibs.PSD.white(1.0, (1, 20), "N"))
    f, w0 = np.linspace(1, 20, 4001), 2 * np.pi * 50
    expected = scipy.integrate.simpson(1 / (2.0 * (w0**2 - (2 * np.pi * f) ** 2)) ** 2, x=f)
    assert ibs.vibration_budget(system, STRETCH, below).power[0] == pytest.approx(expected, rel=1e-9)
    model = ibs.Model("two ways")
    model.fixation("wall", position=(0, 0, 0))
    model.rigid_body("m", mass=1.0, cog=(0, 0, 0), inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    for name, k, zeta in (("across", (0, 4e4, 0, 0, 0, 0), 0.0), ("along", (1e5, 0, 1e5, 10, 10, 10), 0.01)):
        model.connection(name, "wall", "m", position1=(0, 0, 0), stiffness=k, zeta=zeta)
    along = ibs.Disturbance("noise", ibs.Force("m", "x"), ibs.PSD.white(1.0, (1, 100), "N"))
    rms = ibs.RmsResponse(ibs.Sensor("m", "x"), along).evaluate(model.linearize())
    assert rms == pytest.approx(ibs.vibration_budget(model.linearize(), ibs.Sensor("m", "x"), along).rms[0])
    assert rms > 0


def test_dampers_and_complex_stiffness():
    """Explicit dampers couple modes; the grid takes its poles from the first-order form."""
    model = ibs.Model("damped", axis="x")
    model.fixation("wall")
    model.rigid_body("a", mass=2.0)
    model.rigid_body("b", mass=0.5)
    model.connection("lower", "wall", "a", stiffness=8e4, damping=0.3)
    model.connection("upper", "a", "b", stiffness=3e4, zeta=0.001)
    system = model.linearize()
    force = ibs.Force("a", "x")
    sensor = ibs.Sensor("b", "x", quantity="displacement")
    noise = ibs.Disturbance("noise", force, ibs.PSD.white(1.0, (1, 200), "N"))
    f = np.linspace(1, 200, 1_000_001)
    for hysteretic in (False, True):
        budget = ibs.vibration_budget(system, sensor, noise, hysteretic=hysteretic)
        S = abs(system.frf(force, sensor, f, hysteretic=hysteretic).response[0, 0]) ** 2
        assert budget.power[0] == pytest.approx(scipy.integrate.simpson(S, x=f), rel=1e-6)
        assert sum(budget.shares("part").values()) == pytest.approx(1, abs=1e-8)


def test_a_free_body_has_rigid_body_motion_among_its_parts():
    model = ibs.Model("dumbbell", axis="x")
    model.rigid_body("a", mass=1.0)
    model.rigid_body("b", mass=3.0)
    model.connection("s", "a", "b", stiffness=1e4, zeta=0.01)
    noise = ibs.Disturbance("noise", ibs.Force("a", "x"), ibs.PSD.white(1.0, (0.01, 0.1), "N"))
    budget = ibs.vibration_budget(model.linearize(), ibs.Sensor("a", "x"), noise)
    assert budget.rms[0] == pytest.approx(math.sqrt(0.09) / 4, rel=1e-4)
    assert budget.shares("part")["rigid-body motion"] == pytest.approx(1.0, abs=1e-2)


def test_grid_integrates_what_is_known():
    """Power laws, and a Lorentzian of any width, in total and up to every node."""
    poles_ = np.array([40 + 1e-5j, 41 + 0.1j, 300 + 30j])
    grid = resonance_grid(poles_, (0.01, 1e4), [7.0, 7.0000001])
    f = grid.frequencies
    assert (np.diff(f) > 0).all()
    assert f[0] > 0.01
    assert f[-1] < 1e4
    for p in poles_:

        def known(x, p=p):
            return (np.arctan((x - p.real) / p.imag)) / p.imag

        values = 1 / ((f - p.real) ** 2 + p.imag**2)
        total = known(1e4) - known(0.01)
        assert grid.integral(values) == pytest.approx(total, rel=1e-8)
        np.testing.assert_allclose(grid.cumulative(values[None])[0], known(f) - known(0.01), atol=1e-8 * total)
    assert grid.integral(f**-3.7) == pytest.approx((0.01**-2.7 - 1e4**-2.7) / 2.7, rel=1e-8)
    system = three_d()
    found = poles(system)
    modes = system.modes()
    np.testing.assert_allclose(np.sort(abs(found)), modes.frequencies, rtol=1e-9)
    np.testing.assert_allclose((found.imag / abs(found))[np.argsort(abs(found))], modes.damping_ratios, rtol=1e-6)


def test_budget_prints_and_draws_what_it_says():
    system = three_d()
    floor = ibs.Disturbance("floor", ibs.BaseMotion("floor", "y"), ibs.floor_vibration("VC-C"))
    fan = ibs.Tone("fan", ibs.Force("box", "y"), amplitude=0.2, frequency=48.0)
    budget = ibs.vibration_budget(system, [TILT, TOP], [floor, fan])
    text = str(budget)
    for words in ("RMS = one sigma", "tilt:", "rad RMS", "by source: floor", "mode 1 (", "flexure.kxx"):
        assert words in text, words
    axes = budget.plot(limit={"tilt": 1e-6})
    assert axes.shape == (2, 2)
    assert "NOT MET" in axes[0, 0].get_title()
    assert "MET" not in axes[0, 1].get_title()
    assert axes[0, 0].get_ylabel() == "PSD, one-sided [rad²/Hz]"
    assert axes[1, 0].get_ylabel() == "cumulative RMS (1σ) [µrad]"
    total = axes[1, 0].lines[2]
    assert total.get_label() == "total"
    assert total.get_ydata()[-1] == pytest.approx(1e6 * budget.rms[0])
    assert axes[1, 0].lines[3].get_ydata()[0] == pytest.approx(1.0)
    with pytest.raises(ValueError, match=r"\(2, 2\)"):
        budget.plot(axes=axes[:1])
    plt.close("all")
    bars = budget.plot_shares("component", most=3)
    drawn = {t.get_text(): bar.get_width() for t, bar in zip(bars.get_yticklabels(), bars.patches, strict=True)}
    assert len(drawn) == 3
    assert drawn["flexure"] == pytest.approx(100 * budget.shares("part")["flexure.kxx"], abs=1.0)
    for name, width in drawn.items():
        parts = [share for part, share in budget.shares("part").items() if part.split(".")[0] == name]
        assert width == pytest.approx(100 * sum(parts))
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'tilt'"):
        budget.shares("mode", "tild")
    with pytest.raises(ibs.AnalysisError, match="Did you mean 'part'"):
        budget.shares("parts")
    with pytest.raises(ibs.UnknownNameError, match="floor"):
        budget.shares("part", 0, "flor")


def test_a_band_beside_all_disturbances_is_refused():
    floor = ibs.Disturbance("floor", ibs.BaseMotion("wall", "x"), ibs.floor_vibration("VC-C"))
    with pytest.raises(ibs.AnalysisError, match="'VC-C' 1 to 80 Hz"):
        ibs.vibration_budget(oscillator(), STRETCH, floor, band=(100, 200))
    with pytest.raises(ibs.AnalysisError, match="rising"):
        ibs.vibration_budget(oscillator(), STRETCH, floor, band=(20, 10))
    with pytest.raises(ibs.ModelError, match="2 disturbances are called 'floor'"):
        ibs.vibration_budget(oscillator(), STRETCH, [floor, floor])
    with pytest.raises(ibs.ModelError, match="takes N"):
        ibs.Disturbance("x", ibs.Force("m", "x"), ibs.floor_vibration("VC-C"))


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_random_assemblies_against_a_fine_grid(seed, damper):
    random = RandomAssembly(seed, count=4, zeta=(0.001, 0.03), damper=damper, k=(4, 7))
    system = random.model(ibs).linearize()
    floor = ibs.Disturbance("floor", ibs.BaseMotion("ground", "y"), ibs.PSD.white(1.0, (1, 200)))
    pair = ibs.CorrelatedDisturbance(
        "pair",
        [ibs.Force("b0", "x"), ibs.Torque("b1", "ry")],
        [ibs.PSD.white(2.0, (1, 200), "N"), ibs.PSD.white(0.1, (1, 200), "N·m")],
        correlation=[[1, 0.5j], [-0.5j, 1]],
    )
    outputs = [ibs.Sensor("b2", "z"), ibs.Sensor("b3", "rx", quantity="displacement", relative_to="b1")]
    budget = ibs.vibration_budget(system, outputs, [floor, pair])
    f = np.linspace(1, 200, 100_001)
    S = system.frf(floor.input, outputs, f).magnitude[:, 0] ** 2
    np.testing.assert_allclose(budget.source_power[:, 0], scipy.integrate.simpson(S, x=f, axis=1), rtol=1e-7)
    for by in ("source", "mode", "component", "part"):
        for source in (None, "floor", "pair"):
            assert sum(budget.shares(by, 1, source).values()) == pytest.approx(1, abs=1e-9)


def test_flexible_body_locks_two_fixations_and_a_stroke():
    """A hybrid on two bases: shares by name, the flexible body as one part, locked directions none at all."""
    part = fi.read_calculix(Path(__file__).parents[1] / "examples" / "mirror_flexure" / "flexure.inp")
    body = fi.reduce(part, {"base": "BASE", "tip": "TIP"}, max_frequency=7000.0)
    base, tip = (np.array(body.interfaces[i].position) for i in ("base", "tip"))
    model = ibs.Model("hybrid")
    model.fixation("platform", position=(0, 0, 0))
    model.fixation("ceiling", position=(0, 0, 0.2))
    model.flexible_body("flexure", body, zeta=0.005)
    model.rigid_body("mirror", mass=0.3, cog=tip + [0.01, 0.005, 0], inertia=(1.5e-4, 1.2e-4, 1e-4, 0, 0, 0))
    model.connection(
        "mount", "platform", "flexure.base", position1=base, stiffness=(math.inf, 3e8, 2e8, 1e5, 2e5, 1e5), zeta=0.01
    )
    model.connection("glue", "flexure.tip", "mirror", position2=tip, stiffness=(1e8, 2e8, 1e8, 2e4, 1e4, math.inf))
    model.connection("stay", "ceiling", "mirror", tip, stiffness=(2e4, 0, 1e4, 0, 0, 0), zeta=0.02)
    system = model.linearize()
    band = (5.0, 900.0)
    floor = ibs.Disturbance("floor", ibs.BaseMotion("platform", "z"), ibs.PSD.white(1e-4, band))
    roof = ibs.Disturbance("roof", ibs.BaseMotion("ceiling", "z"), ibs.PSD.white(1e-4, band))
    piezo = ibs.Disturbance("piezo", ibs.Stroke("stay", "z"), ibs.PSD.white(1e-18, band, "m"))
    tilt = ibs.Sensor("mirror", "ry", quantity="displacement", relative_to="platform", name="tilt")
    budget = ibs.vibration_budget(system, tilt, [floor, roof, piezo])
    shares = budget.shares("part")
    wanted = {"flexure", "mount.ky", "mount.kz", "mount.kxx", "mount.kyy", "mount.kzz", "glue.kx", "glue.ky", "glue.kz"}
    wanted |= {"glue.kxx", "glue.kyy", "stay.kx", "stay.kz", "carried by the base"}
    assert set(shares) == wanted
    for by in ("source", "mode", "component", "part"):
        for source in (None, "floor", "roof", "piezo"):
            assert sum(budget.shares(by, 0, source).values()) == pytest.approx(1, abs=1e-8)
    f = np.unique(np.r_[np.linspace(*band, 300_001)])
    for d, cause in enumerate((floor, roof, piezo)):
        S = system.frf(cause.input, tilt, f).magnitude[0, 0] ** 2 * cause.psd.values[0]
        assert budget.source_power[0, d] == pytest.approx(scipy.integrate.simpson(S, x=f), rel=1e-6)


def test_a_tone_beside_the_band_counts_nothing():
    noise = ibs.Disturbance("noise", ibs.Force("m", "x"), ibs.PSD.white(1.0, (1, 100), "N"))
    tone = ibs.Tone("tone", ibs.Force("m", "x"), amplitude=1.0, frequency=300.0)
    budget = ibs.vibration_budget(oscillator(), STRETCH, [noise, tone], band=(10, 60))
    assert budget.source_power[0, 1] == 0.0
    assert budget.shares("mode", 0, "tone") == {"mode 1 (50 Hz)": 0.0, "carried by the base": 0.0}
    alone = ibs.vibration_budget(oscillator(), STRETCH, tone)
    assert alone.band == (150, 600)
    assert alone.source_power[0, 0] > 0
    assert alone.plot()[0, 0].get_title().startswith("stretch")
    plt.close("all")


def test_an_undamped_mode_of_a_free_system_is_refused_by_its_own_name():
    model = ibs.Model("free", axis="x")
    model.rigid_body("a", mass=1.0)
    model.rigid_body("b", mass=1.0)
    model.connection("spring", "a", "b", stiffness=2e4)
    noise = ibs.Disturbance("noise", ibs.Force("a", "x"), ([1.0, 100.0], [1.0, 1.0]))
    with pytest.raises(ibs.AnalysisError, match=r"mode 2 \(31.83 Hz\) has no damping"):
        ibs.vibration_budget(model.linearize(), ibs.Sensor("b", "x"), noise)

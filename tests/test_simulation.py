"""Nonlinear runs of rigid bodies: against the linear system, closed forms and hand-written equations of motion."""

import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import ibsdyn as ibs
from ibsdyn.engine import TurningDamping
from ibsdyn.generalized_alpha import derivatives, frequency_error
from ibsdyn.simulation import _steps_per_sample, _task

RATE = 1000.0


def chain(zeta=0.02, damping=None):
    """Three bodies in a row whose springs couple all directions."""
    model = ibs.Model("chain")
    model.fixation("base")
    before = "base"
    for i in range(3):
        model.rigid_body(
            f"b{i}", mass=1.0 + i, cog=(0.02 * i, 0.01, 0.1 * (i + 1)), inertia=(0.01, 0.012, 0.008, 0.001, 0, 0.0005)
        )
        model.connection(
            f"s{i}",
            before,
            f"b{i}",
            position1=(0.01 * i, 0, 0.1 * i + 0.05),
            stiffness=(1e6, 2e6, 3e6, 4e3, 5e3, 3e3),
            zeta=zeta,
            damping=damping,
        )
        before = f"b{i}"
    return model


SENSORS = [
    ibs.Sensor("b2", "x", position=(0.1, 0.2, 0.3)),
    ibs.Sensor("b2", "ry", quantity="velocity"),
    ibs.Sensor("b1", (1, 1, 2), quantity="displacement", relative_to="b2"),
    ibs.Sensor("b0", "rz", relative_to="base"),
]


def assert_close_channels(got, expected, share):
    """Channel by channel, as a share of the channel's peak."""
    peak = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(got / peak, expected / peak, atol=share)


def warped(lines, step):
    """The frequency at which the linear model has what the integrator shows."""
    return np.tan(np.pi * lines * step) / (np.pi * step)


def default_step(model, excitations, sensors, rate=RATE):
    task = _task(excitations, sensors, None, None)
    return 1.0 / (rate * _steps_per_sample(model.linearize(), task, None))


def frf_errors(model, source, amplitude, sensors, lines=None, rate=RATE, **options):
    """Largest difference between the run's FRFs and the linear ones, as a share of each one's peak."""
    lines = ibs.band_lines(2, 150, 1) if lines is None else lines
    sine = ibs.multisine(lines, amplitude, sample_rate=rate)
    record = model.simulate({source: sine}, sensors, **options)
    step = default_step(model, {source: sine}, sensors, rate)
    spectra = np.fft.rfft(record.signals, axis=1)[:, sine.line_numbers]
    expected = model.linearize().frf(source, sensors, warped(sine.lines, step)).response[:, 0]
    return np.abs(spectra[1:] / spectra[0] - expected).max(axis=1) / np.abs(expected).max(axis=1)


@pytest.mark.parametrize(
    ("source", "amplitude"),
    [
        (ibs.BaseMotion("base", "x"), 1e-4),
        (ibs.BaseMotion("base", "ry"), 1e-4),
        (ibs.BaseMotion("base", (0, 1, 1), "velocity"), 1e-7),
        (ibs.BaseMotion("base", "z", "displacement"), 1e-10),
        (ibs.Force("b1", (1, 2, 3), position=(0.05, 0, 0.1)), 1e-4),
        (ibs.Torque("b2", "rz"), 1e-5),
        (ibs.Stroke("s1", "x"), 1e-10),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_small_excitation_gives_the_linear_frf_from_the_first_period_on(source, amplitude, validated):
    validated(
        f"FRFs out of a nonlinear run, small {source.name}",
        "the linear model's FRFs, at the frequencies as the step shifts them",
        0.0,
        frf_errors(chain(), source, amplitude, SENSORS).max(),
        atol=2e-4,
        against="runs in time",
        unit="of the peak",
    )


def test_explicit_dampers_and_several_periods():
    model = chain(damping=(300, 200, 400, 1, 2, 1))
    source = ibs.BaseMotion("base", "rx")
    errors = frf_errors(model, source, 1e-4, SENSORS)
    assert errors.max() < 2e-4
    sine = ibs.multisine(ibs.band_lines(2, 150, 2), 1e-4, sample_rate=RATE, periods=3)
    record = model.simulate({source: sine}, SENSORS)
    assert record.n_samples == 3 * sine.n_samples
    assert record.period == sine.n_samples
    first, last = record.signals[:, : sine.n_samples], record.signals[:, -sine.n_samples :]
    assert_close_channels(first, last, 1e-4)


def test_one_of_two_fixations_moves():
    """Then the base strains the machine, and the other fixation stays where it is."""
    model = chain()
    model.fixation("wall", position=(0.3, 0, 0.3))
    model.connection("strut", "wall", "b2", position1=(0.2, 0, 0.3), stiffness=(2e5,) * 3 + (1e3,) * 3, zeta=0.03)
    sensors = [*SENSORS[:2], ibs.Sensor("wall", "x", quantity="displacement", name="wall")]
    source = ibs.BaseMotion("base", "rz", "displacement")
    assert frf_errors(model, source, 1e-9, sensors[:2]).max() < 2e-4
    sine = ibs.multisine([5.0, 20.0], 1e-6, sample_rate=RATE)
    both = {source: sine, ibs.BaseMotion("wall", "y"): sine.scaled(100.0)}
    record = model.simulate(both, sensors, start="rest")
    np.testing.assert_allclose(record["wall"], 0.0, atol=1e-15)


def test_the_deviation_from_the_linear_frf_grows_with_the_amplitude():
    source = ibs.BaseMotion("base", "ry")
    errors = [frf_errors(chain(), source, a, SENSORS[:1]).max() for a in (1e-3, 1.0, 10.0)]
    assert errors[0] < 2e-4
    assert errors[1] > 5 * errors[0]
    assert errors[2] > 2 * errors[1]


def test_several_inputs_superpose_and_the_record_names_them():
    lines = ibs.band_lines(2, 100, 2)
    both = {
        ibs.BaseMotion("base", "x"): ibs.multisine(lines, 1e-4, sample_rate=RATE, seed=1),
        ibs.Force("b2", "y"): ibs.multisine(lines, 1e-4, sample_rate=RATE, seed=2),
        ibs.BaseMotion("base", "rz"): ibs.multisine(lines, 1e-4, sample_rate=RATE, seed=3),
    }
    model = chain()
    record = model.simulate(both, SENSORS)
    assert record.names == tuple(s.name for s in (*both, *SENSORS))
    assert record.units[:4] == ("m/s²", "N", "rad/s²", "m/s²")
    assert record.sample_rate == RATE
    sines = list(both.values())
    for sine, channel in zip(sines, record.signals, strict=False):
        np.testing.assert_array_equal(channel, sine.samples)
    alone = sum(model.simulate({source: sine}, SENSORS).signals[1:] for source, sine in both.items())
    assert_close_channels(record.signals[3:], alone, 2e-4)
    step = default_step(model, both, SENSORS)
    expected = model.linearize().frf(list(both), SENSORS, warped(sines[0].lines, step)).response
    spectra = np.fft.rfft(record.signals, axis=1)[:, sines[0].line_numbers]
    got = np.einsum("oif,if->of", expected, spectra[:3])
    assert_close_channels(spectra[3:], got, 2e-4)


def test_the_steady_start_is_the_integrators_own_steady_state():
    """The discrete transfer, not its approximation by tan: no transient beyond the nonlinearity is left."""
    step = 1e-4
    omega = 2 * np.pi * np.array([3.0, 47.0, 160.0])
    velocity, acceleration = derivatives(omega, step)
    tangent = 2 / step * np.tan(omega * step / 2)
    np.testing.assert_allclose(velocity, 1j * tangent, rtol=1e-5)
    np.testing.assert_allclose(acceleration, -(tangent**2), rtol=1e-4)
    assert np.all(np.abs(acceleration + omega**2) / omega**2 < 3 * frequency_error(omega / (2 * np.pi), step))


@pytest.mark.parametrize(("axis", "item"), [("rz", 5), ("x", 0)])
def test_one_dimensional_models(axis, item):
    rotation = axis == "rz"
    model = ibs.Model("concept", axis=axis)
    model.fixation("frame")
    inertia, k, c = 2e-4, 5.0, 3e-3
    model.rigid_body("mirror", **({"inertia": inertia} if rotation else {"mass": inertia}))
    model.connection("flexure", "frame", "mirror", stiffness=k, damping=c)
    time = np.arange(600) / RATE
    push = np.sin(2 * np.pi * 17 * time) * np.exp(-4 * time)
    shake = 3.0 * np.sin(2 * np.pi * 11 * time) ** 2
    load = ibs.Torque("mirror", axis) if rotation else ibs.Force("mirror", axis)
    moved = ibs.BaseMotion("frame", axis)
    sensors = [
        ibs.Sensor("mirror", axis, quantity="displacement", relative_to="frame"),
        ibs.Sensor("mirror", axis, quantity="velocity", relative_to="frame"),
        ibs.Sensor("mirror", axis),
        ibs.Sensor("frame", axis, name="base"),
    ]
    record = model.simulate([(load, push), (moved, shake)], sensors, sample_rate=RATE, steps_per_sample=40)

    def rate(t, y):
        force = np.sin(2 * np.pi * 17 * t) * np.exp(-4 * t)
        return [y[1], (force - k * y[0] - c * y[1]) / inertia - 3.0 * np.sin(2 * np.pi * 11 * t) ** 2]

    exact = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-10, atol=1e-14, max_step=1e-3)
    for got, expected in zip(record.signals[2:4], exact.y, strict=True):
        np.testing.assert_allclose(got, expected, atol=2e-4 * np.abs(expected).max())
    absolute = np.array([rate(t, y)[1] for t, y in zip(time, exact.y.T, strict=True)]) + shake
    np.testing.assert_allclose(record.signals[4], absolute, atol=1e-3 * np.abs(absolute).max())
    np.testing.assert_allclose(record["base"], shake, atol=1e-3 * shake.max())


PENDULUM = {"mass": 2.0, "lever": 0.1, "spring": 3.0, "gravity": 9.81}


def pendulum(axis, stiff, lock_rotations):
    """A bob that hangs from a soft hinge at the origin, inertia about the hinge's axis, direction of gravity."""
    i = "xyz".index(axis[1])
    down = -np.eye(3)[(i + 2) % 3]
    inertia = np.array([0.010, 0.011, 0.012])
    model = ibs.Model("pendulum")
    model.fixation("ground")
    model.rigid_body("bob", mass=PENDULUM["mass"], cog=PENDULUM["lever"] * down, inertia=(*inertia, 0, 0, 0))
    stiffness = [stiff] * 3 + [lock_rotations] * 3
    stiffness[3 + i] = PENDULUM["spring"]
    model.connection("hinge", "ground", "bob", position1=(0, 0, 0), stiffness=stiffness)
    return model, inertia[i], PENDULUM["gravity"] * down, i


def swing(t):
    return 4.0 * np.sin(np.pi * t / 0.3) ** 2 if t < 0.3 else 0.0


@pytest.mark.parametrize("axis", ["rx", "ry", "rz"])
def test_a_body_on_a_hinge_swings_over_a_radian_as_the_pendulum_equation_says(axis):
    model, inertia, gravity, i = pendulum(axis, np.inf, np.inf)
    m, length, k, g = PENDULUM.values()
    time = np.arange(1500) / RATE
    across = "xyz"[(i + 1) % 3]
    sensors = [
        ibs.Sensor("bob", axis, quantity="displacement"),
        ibs.Sensor("bob", axis, quantity="velocity"),
        ibs.Sensor("bob", across, quantity="displacement"),
        ibs.Sensor("bob", across, quantity="acceleration"),
        ibs.Sensor("bob", "xyz"[(i + 2) % 3], quantity="acceleration", name="along gravity"),
    ]
    record = model.simulate(
        {ibs.Torque("bob", axis): [swing(t) for t in time]},
        sensors,
        sample_rate=RATE,
        gravity=gravity,
        steps_per_sample=10,
    )
    whole = inertia + m * length**2

    def rate(t, y):
        return [y[1], (swing(t) - k * y[0] - m * g * length * np.sin(y[0])) / whole]

    exact = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-10, atol=1e-12, max_step=0.01)
    angle, speed = exact.y
    change = np.array([rate(t, y)[1] for t, y in zip(time, exact.y.T, strict=True)])
    assert angle.max() > 1.0
    np.testing.assert_allclose(record.signals[1], angle, atol=3e-5)
    np.testing.assert_allclose(record.signals[2], speed, atol=3e-4)
    np.testing.assert_allclose(record.signals[3], length * np.sin(angle), atol=3e-6)
    scale = length * speed.max() ** 2
    expected = length * (change * np.cos(angle) - speed**2 * np.sin(angle))
    np.testing.assert_allclose(record.signals[4], expected, atol=3e-3 * scale)
    expected = length * (change * np.sin(angle) + speed**2 * np.cos(angle))
    np.testing.assert_allclose(record["along gravity"], expected, atol=3e-3 * scale)
    energy = 0.5 * whole * record.signals[2] ** 2 + 0.5 * k * record.signals[1] ** 2
    energy += m * g * length * (1 - np.cos(record.signals[1]))
    after = energy[time >= 0.3]
    np.testing.assert_allclose(after, after[0], rtol=1e-4)  # conserved once nothing pushes any more


@pytest.mark.parametrize("axis", ["rx", "ry", "rz"])
def test_ratios_damp_a_hinge_and_not_the_swing_itself(axis):
    """On stiff springs and with a ratio: the hinge's damper 2 zeta sqrt(k I) by hand, nothing else brakes."""
    zeta = 0.02
    model, inertia, gravity, _ = pendulum(axis, 1e8, 1e5)
    hinge = model.connections["hinge"]
    model.remove("hinge")
    model.connection("hinge", "ground", "bob", position1=(0, 0, 0), stiffness=hinge.stiffness, zeta=zeta)
    m, length, k, g = PENDULUM.values()
    whole = inertia + m * length**2
    time = np.arange(1500) / RATE
    record = model.simulate(
        {ibs.Torque("bob", axis): [swing(t) for t in time]},
        ibs.Sensor("bob", axis, quantity="displacement"),
        sample_rate=RATE,
        gravity=gravity,
        steps_per_sample=4,
    )

    def rate(t, y):
        resisted = 2 * zeta * np.sqrt(k * whole) * y[1] + k * y[0] + m * g * length * np.sin(y[0])
        return [y[1], (swing(t) - resisted) / whole]

    exact = solve_ivp(rate, (0, time[-1]), [0, 0], t_eval=time, rtol=1e-10, atol=1e-12, max_step=0.01)
    assert exact.y[0].max() > 1.0
    np.testing.assert_allclose(record.signals[1], exact.y[0], atol=2e-4)


@pytest.mark.parametrize("zeta", [0.0, 0.02])
@pytest.mark.parametrize("axis", ["rx", "ry", "rz", "skew"])
def test_a_swing_on_a_hinge_of_springs_stays_in_its_plane(axis, zeta):
    """A push across of a millionth leaves a motion across of about its static share, however the hinge lies."""
    turn = np.eye(3) if axis != "skew" else Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix()
    i = "xyz".index(axis[1]) if axis != "skew" else 0
    hinge, across, down = turn[:, i], turn[:, (i + 1) % 3], -turn[:, (i + 2) % 3]
    model = ibs.Model("pendulum")
    model.fixation("ground")
    model.rigid_body("bob", mass=2.0, cog=0.1 * down, inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    rotations = np.full(3, 1e3)
    rotations[i] = 3.0
    model.connection(
        "hinge", "ground", "bob", position1=(0, 0, 0), stiffness=(*[1e6] * 3, *rotations), axes=turn, zeta=zeta
    )
    push = np.array([swing(t) for t in np.arange(1000) / RATE])
    quantities = [ibs.Sensor("bob", d, quantity="displacement") for d in ("x", "y", "z", "rx", "ry", "rz")]
    record = model.simulate(
        {ibs.Torque("bob", hinge): push, ibs.Torque("bob", across): 1e-6 * push},
        quantities,
        sample_rate=RATE,
        gravity=9.81 * down,
        steps_per_sample=4,
    )
    turned = record.signals[-3:]
    assert np.abs(hinge @ turned).max() > 1.0
    assert np.abs(across @ turned).max() < 2e-6
    assert np.abs(down @ turned).max() < 2e-6


def test_a_stroke_in_a_soft_hinge_goes_where_the_linear_system_says():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix()
    model = ibs.Model("hinge")
    model.fixation("ground")
    model.rigid_body("box", mass=2.0, cog=(0.05, 0, 0.1), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    stiffness = (1e6, 2e6, 3e6, 5.0, 1e3, 2e3)
    model.connection("hinge", "ground", "box", position1=(0, 0, 0), stiffness=stiffness, axes=turn, zeta=0.05)
    for direction, size in (("x", 1e-8), ("y", 1e-8), ("rx", 1e-7), ("rz", 1e-7)):
        assert frf_errors(model, ibs.Stroke("hinge", direction), size, [ibs.Sensor("box", "y")]).max() < 3e-4


def test_ratios_do_not_brake_what_turns_with_its_base():
    """A body on a table that has come to turn steadily: out along its spring by m Omega² r / (k - m Omega²)."""
    model = ibs.Model("turntable")
    centre = np.array([0.3, -0.1, 0.2])
    model.fixation("table", position=centre)
    at = centre + [0.1, 0, 0.05]
    model.rigid_body("box", mass=1.0, cog=at, inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    model.connection("mount", "table", "box", position1=at, stiffness=(1e5,) * 3 + (1e2,) * 3, zeta=0.02)
    time = np.arange(1500) / RATE
    share = np.clip(time, 0, 1)
    speed = 10.0 * share**2 * (3 - 2 * share)
    turned = 10.0 * np.where(time < 1, share**3 - share**4 / 2, 0.5 + time - 1)
    sensors = [ibs.Sensor("box", d, quantity="displacement") for d in "xy"]
    record = model.simulate(
        {ibs.BaseMotion("table", "rz", "velocity"): speed}, sensors, sample_rate=RATE, steps_per_sample=4
    )
    place = record.signals[1:] + [[0.1], [0.0]]
    out = np.array([np.cos(turned), np.sin(turned)])
    radial = (place * out).sum(axis=0)
    across = place[1] * out[0] - place[0] * out[1]
    stretch = 1.0 * 10.0**2 * 0.1 / (1e5 - 100.0)
    np.testing.assert_allclose(radial[-300:].mean() - 0.1, stretch, rtol=0.01)
    assert abs(across[-300:].mean()) < 0.02 * stretch


def test_turning_damping_is_that_of_the_linear_system_and_blind_to_rigid_motion():
    model = chain()
    system, assembly = model.linearize(), model.assembly()
    turning = TurningDamping(assembly, system.damping_forces())
    rows = np.concatenate([np.arange(6) + assembly.places[name].start for name in assembly.items])
    expected = system.modal_damping()[np.ix_(rows, rows)]
    np.testing.assert_allclose(turning.matrix(np.zeros((4, 6))), expected, atol=1e-9 * np.abs(expected).max())
    frames = np.array([assembly.frames[name] for name in assembly.items])
    angles, rates, small = np.array([0.5, -0.7, 0.9]), np.array([0.3, 0.2, -0.4]), 1e-6
    before, after = (Rotation.from_euler("XYZ", a).as_matrix() for a in (angles, angles + small * rates))
    turned = np.hstack([frames @ before.T - frames + [0.1, 0.2, 0.3], np.tile(angles, (4, 1))])
    velocity = np.hstack([frames @ (after - before).T / small, np.tile(rates, (4, 1))]).ravel()
    damping = turning.matrix(turned)
    assert np.abs(damping @ velocity).max() < 1e-5 * np.abs(damping).max() * np.abs(velocity).max()


def test_a_soft_suspension_in_a_large_rotation():
    """A bob on springs in its hinge: three equations by hand, spring force along global axes at the hinge point."""
    stiff = 2e4
    model, inertia, gravity, _ = pendulum("rz", stiff, 1e5)
    m, length, k, _ = PENDULUM.values()
    time = np.arange(1000) / RATE
    sensors = [ibs.Sensor("bob", d, quantity="displacement") for d in ("x", "y", "rz")]
    record = model.simulate(
        {ibs.Torque("bob", "rz"): [swing(t) for t in time]},
        sensors,
        sample_rate=RATE,
        gravity=gravity,
        steps_per_sample=20,
    )
    down = gravity / np.linalg.norm(gravity)
    plane = down[:2]

    def rate(t, s):
        x, v, angle, spin = s[:2], s[2:4], s[4], s[5]
        arm = -length * (np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ plane)
        force = -stiff * (length * plane + x + arm)  # the hinge point from the origin
        torque = swing(t) - k * angle + arm[0] * force[1] - arm[1] * force[0]
        return np.r_[v, force / m + gravity[:2], spin, torque / inertia]

    start = np.r_[m * gravity[:2] / stiff, np.zeros(4)]
    exact = solve_ivp(rate, (0, time[-1]), start, t_eval=time, rtol=1e-9, atol=1e-12, max_step=1e-3)
    np.testing.assert_allclose(record.signals[1:3], exact.y[:2], atol=1e-3 * np.abs(exact.y[:2]).max())
    np.testing.assert_allclose(record.signals[3], exact.y[4], atol=1e-3 * np.abs(exact.y[4]).max())


def test_energy_is_conserved_without_damping():
    model = chain(zeta=0.0)
    system = model.linearize()
    directions = ("x", "y", "z", "rx", "ry", "rz")
    sensors = [
        ibs.Sensor(f"b{i}", d, quantity=q) for q in ("displacement", "velocity") for i in range(3) for d in directions
    ]
    time = np.arange(1000) / RATE
    pulse = 1e-2 * np.where(time < 0.02, np.sin(np.pi * time / 0.02) ** 2, 0.0)
    force = ibs.Force("b2", (1, 2, 3), position=(0.1, 0, 0.3))
    record = model.simulate({force: pulse}, sensors, sample_rate=RATE, steps_per_sample=40)
    position, velocity = record.signals[1:19], record.signals[19:]
    energy = 0.5 * np.einsum("it,ij,jt->t", velocity, system.M, velocity)
    energy += 0.5 * np.einsum("it,ij,jt->t", position, system.K, position)
    after = energy[time > 0.021]
    assert after[0] > 0
    np.testing.assert_allclose(after, after[0], rtol=2e-3)


def test_a_free_decay_has_the_ratio_asked_for():
    zeta = 0.013
    model = ibs.Model("one mode")
    model.fixation("ground")
    model.rigid_body("box", mass=2.0, cog=(0, 0, 0), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    model.connection("mount", "ground", "box", position1=(0, 0, 0), stiffness=(8e4,) * 3 + (1e3,) * 3, zeta=zeta)
    time = np.arange(1500) / RATE
    pulse = np.where(time < 0.01, np.sin(np.pi * time / 0.01) ** 2, 0.0)
    record = model.simulate(
        {ibs.Force("box", "z"): pulse}, ibs.Sensor("box", "z", quantity="displacement"), sample_rate=RATE
    )
    signal = record.signals[1]
    peaks = np.flatnonzero((signal[1:-1] > signal[:-2]) & (signal[1:-1] >= signal[2:])) + 1
    # parabola through three samples: the height and place of a peak between samples
    left, top, right = signal[peaks - 1], signal[peaks], signal[peaks + 1]
    heights = top + (left - right) ** 2 / (16 * top - 8 * (left + right))
    decrement = np.log(heights[2] / heights[-2]) / (len(heights) - 4)
    assert decrement / np.sqrt(4 * np.pi**2 + decrement**2) == pytest.approx(zeta, rel=5e-3)


def test_sag_under_gravity_and_the_motion_about_it():
    model = ibs.Model("sag")
    model.fixation("ground")
    model.rigid_body("box", mass=3.0, cog=(0, 0, 0.1), inertia=(0.01, 0.01, 0.01, 0, 0, 0))
    k = 2e5
    model.connection("mount", "ground", "box", position1=(0, 0, 0.1), stiffness=(k,) * 3 + (1e3,) * 3, zeta=0.02)
    sine = ibs.multisine([5.0, 20.0], 1e-2, sample_rate=500)
    sensors = [ibs.Sensor("box", d, quantity="displacement") for d in "xyz"] + [ibs.Sensor("box", "z")]
    gravity = np.array([1.0, -2.0, -9.81])
    source = ibs.BaseMotion("ground", "z")
    sagged = model.simulate({source: sine}, sensors, gravity=gravity)
    weightless = model.simulate({source: sine}, sensors)
    sag = 3.0 * gravity / k
    np.testing.assert_allclose((sagged.signals - weightless.signals)[1:4].T, np.tile(sag, (100, 1)), rtol=1e-3)
    np.testing.assert_allclose(sagged.signals[4], weightless.signals[4], atol=1e-5)
    lone = ibs.Model("lone", axis="z")
    lone.fixation("ground")
    lone.rigid_body("box", mass=3.0)
    lone.connection("mount", "ground", "box", stiffness=k)
    record = lone.simulate(
        {ibs.Force("box", "z"): np.zeros(10)},
        ibs.Sensor("box", "z", quantity="displacement"),
        sample_rate=100,
        gravity=(0, 0, -9.81),
    )
    np.testing.assert_allclose(record.signals[1], -3.0 * 9.81 / k, rtol=1e-9)


def test_a_prescribed_rotation_turns_about_the_fixation():
    """A body that follows its base through 1.2 rad: its points go round in circles about the fixation's position."""
    centre = np.array([0.05, -0.02, 0.0])
    model = ibs.Model("turntable")
    model.fixation("table", position=centre)
    model.rigid_body("box", mass=0.5, cog=centre + [0.1, 0, 0.02], inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    model.rigid_body("moth", mass=1e-6, cog=centre, inertia=(1e-12,) * 3 + (0,) * 3)  # something has to be free
    model.connection("glue", "table", "box", position1=centre + [0.1, 0, 0], stiffness=(np.inf,) * 6)
    model.connection("leg", "box", "moth", position1=centre, stiffness=(1.0,) * 3 + (1e-6,) * 3, zeta=0.1)
    time = np.arange(500) / RATE
    angle = 1.2 * np.sin(np.pi * time) ** 3
    point = centre + [0.2, 0.1, 0.05]
    sensors = [ibs.Sensor("box", d, position=point, quantity="displacement") for d in "xyz"]
    sensors += [
        ibs.Sensor("box", "rz", quantity="displacement"),
        ibs.Sensor("table", "rz", name="speed", quantity="velocity"),
    ]
    record = model.simulate({ibs.BaseMotion("table", "rz", "displacement"): angle}, sensors, sample_rate=RATE)
    arm = 0.2 * np.stack([np.cos(angle) - 1, np.sin(angle)]) + 0.1 * np.stack([-np.sin(angle), np.cos(angle) - 1])
    np.testing.assert_allclose(record.signals[1:3], arm, atol=1e-9)
    np.testing.assert_allclose(record.signals[3], 0.0, atol=1e-9)
    np.testing.assert_allclose(record.signals[4], angle, atol=1e-9)
    expected = 1.2 * 3 * np.pi * np.sin(np.pi * time) ** 2 * np.cos(np.pi * time)
    np.testing.assert_allclose(record["speed"], expected, atol=2e-3)


def test_a_stroke_moves_what_is_free_and_pushes_what_is_blocked():
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])
    k = np.array([4e6, 1e6, 2e6, 3e3, 2e3, 1e3])
    model = ibs.Model("stage")
    model.fixation("frame")
    model.rigid_body("stage", mass=1.5, cog=(0, 0, 0), inertia=(2e-3, 2e-3, 2e-3, 0, 0, 0))
    model.connection("piezo", "frame", "stage", position1=(0, 0, 0), stiffness=k, axes=turn, zeta=0.05)
    stroke = ibs.Stroke("piezo", "x")
    assert stroke.unit == "m"
    sensors = [ibs.Sensor("stage", d, quantity="displacement") for d in "xyz"]
    free = model.linearize().frf(stroke, sensors, [1e-3]).response[:, 0, 0]
    np.testing.assert_allclose(free, turn[:, 0], atol=1e-6)
    f = np.array([50.0, 200.0])
    along = model.linearize().frf(stroke, ibs.Sensor("stage", turn[:, 0], quantity="displacement"), f).response[0, 0]
    w, natural = 2 * np.pi * f, np.sqrt(k[0] / 1.5)
    np.testing.assert_allclose(along, natural**2 / (natural**2 - w**2 + 2j * 0.05 * natural * w), rtol=1e-9)
    lagging = model.linearize().frf(
        stroke, ibs.Sensor("stage", turn[:, 0], quantity="displacement"), f, hysteretic=True
    )
    complex_k = k[0] * (1 + 2j * 0.05)
    np.testing.assert_allclose(lagging.response[0, 0], complex_k / (complex_k - 1.5 * w**2), rtol=1e-9)
    # a second stack of the same stiffness holds against it: half the stroke is left
    model.fixation("wall", position=(0, 0, 0.1))
    model.connection("stop", "wall", "stage", position1=(0, 0, 0), stiffness=k, axes=turn, zeta=0.05)
    time = np.arange(400) / RATE
    ramp = 1e-6 * np.clip(np.sin(np.pi * time / 0.8), 0, None) ** 2
    record = model.simulate({stroke: ramp}, sensors, sample_rate=RATE)
    np.testing.assert_allclose(record.signals[1:], 0.5 * turn[:, :1] * ramp, atol=2e-3 * 1e-6)
    lever = ibs.Stroke("piezo", "rz")
    turned = model.simulate({lever: ramp}, ibs.Sensor("stage", "rz", quantity="displacement"), sample_rate=RATE)
    np.testing.assert_allclose(turned.signals[1], 0.5 * ramp, atol=2e-3 * 1e-6)


def test_strokes_that_cannot_be():
    model = ibs.Model("m")
    model.fixation("frame")
    model.rigid_body("stage", mass=1.0, cog=(0, 0, 0), inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    model.connection("piezo", "frame", "stage", position1=(0, 0, 0), stiffness=(1e6, np.inf, 0, 1e3, 1e3, 1e3))
    system = model.linearize()
    sensor = ibs.Sensor("stage", "x")
    for direction, words in (("y", "locked"), ("z", "free")):
        with pytest.raises(ibs.ModelError, match=words):
            system.frf(ibs.Stroke("piezo", direction), sensor, [1.0])
    with pytest.raises(ibs.UnknownNameError, match="Did you mean 'piezo'"):
        system.frf(ibs.Stroke("pieso", "x"), sensor, [1.0])
    with pytest.raises(ibs.ModelError, match="connection's axes"):
        ibs.Stroke("piezo", (1, 0, 0))


def test_locked_directions_move_together():
    """A hinge of infinite stiffness in five directions against the linear system, which eliminates them."""
    model = ibs.Model("hinge")
    model.fixation("base")
    model.rigid_body("arm", mass=1.0, cog=(0.1, 0, 0), inertia=(1e-3, 2e-3, 2e-3, 0, 0, 0))
    model.rigid_body("tip", mass=0.5, cog=(0.25, 0.02, 0), inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    turn = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    model.connection("mount", "base", "arm", position1=(0, 0, 0), stiffness=(2e5,) * 3 + (2e3,) * 3, zeta=0.02)
    model.connection(
        "hinge",
        "arm",
        "tip",
        position1=(0.2, 0, 0),
        stiffness=(np.inf, np.inf, np.inf, np.inf, np.inf, 50.0),
        axes=turn,
        zeta=0.02,
    )
    sensors = [ibs.Sensor("tip", "y"), ibs.Sensor("tip", "rz"), ibs.Sensor("arm", "ry")]
    lines = ibs.band_lines(2, 100, 2)
    assert frf_errors(model, ibs.BaseMotion("base", "y"), 1e-4, sensors[:2], lines).max() < 3e-4
    assert frf_errors(model, ibs.Force("tip", "z"), 1e-4, [sensors[2]], lines).max() < 3e-4


def test_the_default_step_follows_the_band_and_the_damping():
    sine = {ibs.BaseMotion("base", "x"): ibs.multisine([10.0, 40.0], 1e-4, sample_rate=RATE)}
    fast = {ibs.BaseMotion("base", "x"): ibs.multisine([10.0, 240.0], 1e-4, sample_rate=RATE)}
    damped, light = chain(zeta=0.1), chain(zeta=0.001)
    assert default_step(damped, fast, SENSORS) < default_step(damped, sine, SENSORS)
    assert default_step(light, sine, SENSORS) < default_step(damped, sine, SENSORS)
    assert frequency_error(240.0, default_step(damped, fast, SENSORS)) <= 2.5e-4
    with pytest.warns(ibs.SimulationWarning, match=r"coarse.*steps_per_sample=\d+ is enough"):
        light.simulate(fast, SENSORS, steps_per_sample=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        damped.simulate(fast, SENSORS)


def test_runs_that_diverge_or_stall_raise():
    model = chain()
    sine = ibs.multisine(ibs.band_lines(2, 100, 2), 1e4, sample_rate=RATE)
    with pytest.raises(ibs.SimulationError, match=r"smaller amplitude"):
        model.simulate({ibs.BaseMotion("base", "ry"): sine}, SENSORS)
    loose = ibs.Model("loose")
    loose.rigid_body("box", mass=1.0, cog=(0, 0, 0), inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    with pytest.raises(ibs.SimulationError, match=r"diverges: at .* s a coordinate has reached .* nothing holds"):
        loose.simulate({ibs.Force("box", "x"): np.full(1000, 1e6)}, ibs.Sensor("box", "x"), sample_rate=RATE)
    with pytest.raises(ibs.SimulationError, match="falls"):
        loose.simulate(
            {ibs.Force("box", "x"): np.zeros(9)}, ibs.Sensor("box", "x"), sample_rate=RATE, gravity=(0, 0, -9.81)
        )
    tiny = ibs.multisine(ibs.band_lines(2, 100, 2), 1e-13, sample_rate=RATE)
    with pytest.raises(ibs.SimulationError, match="lost in the rounding"):
        model.simulate({ibs.BaseMotion("base", "x"): tiny}, SENSORS)


def test_an_undamped_mode_on_an_excited_line_has_no_steady_state():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    model.rigid_body("box", mass=1.0)
    model.connection("spring", "wall", "box", stiffness=(2 * np.pi * 10) ** 2)
    source = ibs.Force("box", "x")
    pushed = ibs.Excitation(1.0 + np.sin(2 * np.pi * np.arange(100) / 100), 1000.0, 1, True, "pushed", _circular=True)
    loose = ibs.Model("loose", axis="x")
    loose.rigid_body("box", mass=1.0)
    with pytest.raises(ibs.SimulationError, match="mean"):
        loose.simulate({source: pushed}, ibs.Sensor("box", "x"))
    record = loose.simulate({source: pushed}, ibs.Sensor("box", "x"), start="rest")
    np.testing.assert_allclose(record.signals[1], pushed.samples, rtol=1e-6, atol=1e-6)


def test_complex_samples_are_refused():
    with pytest.raises(ibs.ExcitationError, match="must be real numbers"):
        chain().simulate({ibs.Force("b1", "x"): 1j * np.ones(9)}, SENSORS, sample_rate=RATE)


def test_what_does_not_fit_is_refused_in_words():
    model = chain()
    sine = ibs.multisine([10.0], 1e-4, sample_rate=RATE)
    base = ibs.BaseMotion("base", "x")
    for words, error, call in (
        ("dict", ibs.ModelError, lambda: model.simulate(sine, SENSORS)),
        ("Force, Torque", ibs.ModelError, lambda: model.simulate({SENSORS[0]: sine}, SENSORS)),
        ("Did you mean 'b2'", ibs.UnknownNameError, lambda: model.simulate({base: sine}, ibs.Sensor("b22", "x"))),
        ("not a fixation", ibs.ModelError, lambda: model.simulate({ibs.BaseMotion("b1", "x"): sine}, SENSORS)),
        ("sample_rate=", ibs.ExcitationError, lambda: model.simulate({base: np.zeros(9)}, SENSORS)),
        ("append zeros", ibs.ExcitationError, lambda: model.simulate({base: np.zeros(9)}, SENSORS, 1.0, 100.0)),
        ("no period", ibs.ExcitationError, lambda: model.simulate({base: np.zeros(9)}, SENSORS, None, 9.0, "steady")),
        ("whole number", ibs.ExcitationError, lambda: model.simulate({base: sine}, SENSORS, duration=0.10037)),
        ("sample 1 is nan", ibs.ExcitationError, lambda: model.simulate({base: [0, np.nan]}, SENSORS, None, 9.0)),
        ("not known", ibs.ModelError, lambda: model.simulate({base: sine}, SENSORS, start="stedy")),
        ("not known", ibs.ModelError, lambda: model.simulate({base: sine}, SENSORS, flexible="rigid")),
        ("Did you mean", ibs.UnknownKeywordError, lambda: model.simulate({base: sine}, SENSORS, durration=1.0)),
        ("called", ibs.ModelError, lambda: model.simulate({base: sine}, SENSORS[:1] * 2)),
    ):
        with pytest.raises(error, match=words):
            call()
    doubled = chain()
    for name in ("again", "once more"):
        doubled.connection(name, "b0", "b1", position1=(0, 0, 0.1), stiffness=(np.inf,) * 6)
    with pytest.raises(ibs.SimulationError, match="6 locked directions"):
        doubled.simulate({base: sine}, SENSORS)


def test_a_periodic_acceleration_with_a_mean_is_told():
    model = chain()
    pushed = ibs.Excitation(1e-3 * np.arange(100), 1000.0, 1, True, "saw", _circular=True)
    with pytest.warns(ibs.SimulationWarning, match="mean of 0.0495"):
        model.simulate({ibs.BaseMotion("base", "x"): pushed}, SENSORS)

"""The experiment: platform, orientations, the whole campaign on the model and from files, and what it proves."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ibsdyn as ibs

PIEZOS = [(0.05, 0.0), (-0.025, 0.0433), (-0.025, -0.0433)]
ORIENTATIONS = [ibs.Orientation("A", up="z"), ibs.Orientation("B", up="x"), ibs.Orientation("C", up="y")]
RATE, STEPS = 512.0, 8
LINES = ibs.band_lines(20, 200, 0.4)

# The integrator's shift of frequencies is known, and the model is compared where it puts it (step=).
pytestmark = pytest.mark.filterwarnings("ignore:.*the step of .* is coarse:ibsdyn.errors.SimulationWarning")


def _module(softer=1.0):
    """A mirror on a soft hinge (42 Hz about x) on a stage; three bodies with the platform."""
    model = ibs.Model("module")
    model.fixation("platform", position=(0, 0, 0))
    model.rigid_body("stage", mass=0.6, cog=(0.0, 0.005, 0.02), inertia=(3e-4, 4e-4, 5e-4, 0, 0, 0))
    model.rigid_body("mirror", mass=0.3, cog=(0.01, 0.0, 0.07), inertia=(1.5e-4, 1.2e-4, 1.8e-4, 0, 0, 0))
    model.connection(
        "mount", "platform", "stage", position1=(0, 0, 0.01), stiffness=(4e6, 4e6, 8e6, 4e3, 4e3, 4e3), zeta=0.02
    )
    hinge = (1e6, 8e5, 2e6, 20 * softer, 100 * softer, 60 * softer)
    model.connection("hinge", "stage", "mirror", position1=(0, 0, 0.05), stiffness=hinge, zeta=0.01)
    return model


def _campaign(noise=0.0, gravity=0.0, outputs=None, **changes):
    given = {
        "platform": ibs.PiezoPlatform("platform", PIEZOS),
        "orientations": ORIENTATIONS,
        "inputs": ibs.bracket("platform", (0, 0, -0.02), 0.05, noise_density=noise),
        "outputs": outputs or ibs.Accelerometer("Y1", "mirror", (0.03, 0, 0.08), "y", noise_density=noise),
        "gravity": gravity,
    }
    return ibs.Campaign(**(given | changes))


# --- platform and orientations ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", ["z", "rx", "ry"])
def test_strokes_move_the_plate_along_one_axis_only(motion):
    platform = ibs.PiezoPlatform("platform", PIEZOS)
    strokes = platform.strokes(motion)
    plate = platform.motion(strokes)
    assert np.abs(strokes).max() == pytest.approx(1.0)
    assert np.flatnonzero(np.abs(plate) > 1e-12).tolist() == [["x", "y", "z", "rx", "ry", "rz"].index(motion)]
    # the plate's surface rises at each piezo by its stroke: u_z of u + theta x r
    for (x, y), stroke in zip(PIEZOS, strokes, strict=True):
        assert (plate[:3] + np.cross(plate[3:], (x, y, 0)))[2] == pytest.approx(stroke)


@pytest.mark.parametrize(("up", "axis"), [("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1))])
def test_the_axis_that_is_up_moves_with_z_and_gravity_points_against_it(up, axis):
    orientation = ibs.Orientation("A", up=up)
    np.testing.assert_allclose(orientation.base_motion([0, 0, 1, 0, 0, 0]), [*axis, 0, 0, 0])
    np.testing.assert_allclose(orientation.base_motion([0, 0, 0, 0, 0, 1]), [0, 0, 0, *axis])
    np.testing.assert_allclose(orientation.in_module((0, 0, -9.81)), -9.81 * np.array(axis))
    assert Rotation.from_matrix(orientation.rotation).magnitude() == pytest.approx(0 if up == "z" else 2 * np.pi / 3)


def test_a_fixation_off_the_middle_is_carried_along_by_a_tilt():
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    orientation = ibs.Orientation("A", rotation=turn, offset=(0.1, 0, 0.02))
    motion = orientation.base_motion([0, 0, 0, 0, 1e-3, 0])
    np.testing.assert_allclose(turn.T @ motion[:3], 1e-3 * np.cross((0, 1, 0), (0.1, 0, 0.02)), atol=1e-15)
    np.testing.assert_allclose(turn.T @ motion[3:], (0, 1e-3, 0), atol=1e-15)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ibs.PiezoPlatform("p", [(0, 0), (0.1, 0.1), (0.2, 0.2)]), "stand on one line"),
        (lambda: ibs.PiezoPlatform("p", PIEZOS[:2]), r"three places \(x, y\)"),
        (lambda: ibs.PiezoPlatform("p", PIEZOS, stroke=0.0), "stroke must be above 0"),
        (lambda: ibs.PiezoPlatform("p", PIEZOS).strokes("rz"), r"does not move in 'rz'.*Did you mean"),
        (lambda: ibs.Orientation("A"), r"give up= .* or rotation="),
        (lambda: ibs.Orientation("A", up="rx"), r"up='rx' is not known"),
        (lambda: ibs.Orientation("A", rotation=np.diag([1, 1, -1])), "right-handed"),
        (lambda: _campaign(orientations=[ORIENTATIONS[0]] * 2), r"different names, got \['A', 'A'\]"),
        (lambda: _campaign(outputs=ibs.Accelerometer("U1", "mirror", (0, 0, 0), "x")), "different names"),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(ibs.ModelError, match=words):
        make()


# --- the campaign ----------------------------------------------------------------------------------------------------


def test_nine_runs_and_as_many_again_for_a_moved_accelerometer():
    assert [run.name for run in _campaign().runs] == [f"{o} {m}" for o in "ABC" for m in ("z", "rx", "ry")]
    two = [ibs.Accelerometer(name, "mirror", (0, 0, 0.08), "x") for name in ("Y1", "Y2")]
    assert len(_campaign(outputs=two).runs) == 9
    moved = _campaign(outputs=two, one_at_a_time=True).runs
    assert len(moved) == 18
    assert moved[9].name == "A z, Y2"
    assert [one.name for one in moved[9].outputs] == ["Y2"]


def test_one_orientation_is_not_enough_for_six_inputs():
    with pytest.warns(ibs.ModelWarning, match="move the module in 3 of its six directions") as seen:
        _campaign(orientations=ORIENTATIONS[0])
    assert seen[0].filename == __file__


def test_what_a_campaign_cannot_use_is_refused():
    campaign, sine = _campaign(), ibs.multisine([20.0], 1.0, sample_rate=200)
    for call in (lambda: campaign.simulate(None, sine), lambda: campaign.model_frf("module", [10.0])):
        with pytest.raises(ibs.ModelError, match=r"model must be an ibs\.Model"):
            call()
    with pytest.raises(ibs.ModelError, match="seed must be a whole number"):
        campaign.simulate(_module(), sine, seed="a")
    for paths in (None, {}):
        with pytest.raises(ibs.RecordError, match="paths must be a dict"):
            campaign.read(paths)
    with pytest.raises(ibs.RecordError, match="one at a time"):
        campaign.reconstruction.motion([])
    with pytest.raises(ibs.AnalysisError, match="must be numbers"):
        campaign.model_frf(_module(), "a")
    with pytest.raises(ibs.AnalysisError, match="at 0 Hz accelerometers show nothing"):
        campaign.model_frf(_module(), [0.0, 10.0])


def test_the_model_is_asked_for_what_the_campaign_needs():
    model = ibs.Model("other")
    model.fixation("frame", position=(0, 0, 0))
    with pytest.raises(ibs.ModelError, match="'platform', which stands on the platform, is no fixation"):
        _campaign().model_frf(model, [10.0])


def test_more_stroke_than_the_piezos_have_is_said():
    campaign = _campaign(platform=ibs.PiezoPlatform("platform", PIEZOS, stroke=15e-6))
    sine = ibs.multisine([10.0], 0.1, RATE)
    # 0.1 m/s² at 10 Hz is 25.3 µm of amplitude
    with pytest.warns(ibs.ModelWarning, match=r"needs a stroke of 50.7 µm, the piezos have 15 µm"):
        campaign.simulate(_module(), sine, steps_per_sample=1)


def test_the_linear_prediction_is_that_of_the_six_motions_on_the_bracket():
    campaign, model, frequencies = _campaign(), _module(), np.array([10.0, 42.0, 300.0])
    motions = [ibs.BaseMotion("platform", d) for d in ("x", "y", "z", "rx", "ry", "rz")]
    in_motions = model.linearize().frf(motions, campaign.outputs[0].sensor, frequencies)
    way = ibs.MotionReconstruction(campaign.inputs, at=(0, 0, 0))
    predicted = campaign.model_frf(model, frequencies)
    np.testing.assert_allclose(predicted.response, way.to_accelerometers(in_motions).response, rtol=1e-9)
    assert predicted.inputs == ("U1", "U2", "U3", "U4", "U5", "U6")


def test_the_integrators_shift_of_a_resonance_can_be_in_the_prediction():
    campaign, model, step = _campaign(), _module(), 2e-3
    peak = model.linearize().modes().frequencies[0]
    frequencies = np.linspace(0.9 * peak, peak, 2001)
    shifted = np.abs(campaign.model_frf(model, frequencies, step=step).response[0, 0])
    # the trapezoidal rule lowers a frequency by (omega h)^2 / 12
    expected = peak * (1 - (2 * np.pi * peak * step) ** 2 / 12)
    assert frequencies[shifted.argmax()] == pytest.approx(expected, rel=2e-3)
    with pytest.raises(ibs.AnalysisError, match="below 250 Hz, not 300 Hz"):
        campaign.model_frf(model, [300.0], step=step)


def test_gravity_follows_the_orientation():
    campaign = _campaign(
        gravity=9.81,
        inputs=ibs.bracket("platform", (0, 0, -0.02), 0.05, dc_coupled=True),
    )
    sine = ibs.multisine([64.0], 1e-3, RATE)
    records = campaign.simulate(_module(), sine, steps_per_sample=1)
    for record, run in zip(records, campaign.runs, strict=True):
        up = {"A": "z", "B": "x", "C": "y"}[run.orientation.name]
        expected = [9.81 if one.direction == up else 0.0 for one in campaign.inputs]
        np.testing.assert_allclose(record.signals[:6].mean(axis=1), expected, atol=1e-6)


@cache
def _records(amplitude, noise):
    campaign = _campaign(noise=noise)
    excitation = ibs.multisine(LINES, amplitude, RATE, periods=2, seed=1)
    return campaign, campaign.simulate(_module(), excitation, seed=4, steps_per_sample=STEPS)


def _inside(campaign, records, model):
    """(6,) share of lines of each response whose 99 % region holds the model."""
    estimate = ibs.estimate_frf(records, campaign.input_names, campaign.output_names, frequencies=LINES)
    predicted = campaign.model_frf(model, estimate.frequencies, step=1 / (RATE * STEPS))
    return (np.abs(predicted.response - estimate.response) <= estimate.radius(0.99))[0].mean(axis=1)


def test_small_noisy_campaign_holds_the_model_in_its_regions_and_a_wrong_stiffness_does_not():
    campaign, records = _records(0.1, 1e-3)
    assert [record.names for record in records] == [("U1", "U2", "U3", "U4", "U5", "U6", "Y1")] * 9
    assert [record.title for record in records] == [run.name for run in campaign.runs]
    right = _inside(campaign, records, _module())
    assert right.mean() >= 0.97
    assert right.min() >= 0.97
    # the four responses that are not buried in noise; 5 % in stiffness is 2.5 % in frequency
    wrong = _inside(campaign, records, _module(softer=0.95))
    assert wrong[:4].max() < 0.65


@pytest.mark.filterwarnings("ignore:.*no wider than:ibsdyn.errors.RecordWarning")  # distorted peaks look narrow
def test_nonlinearity_leaves_the_regions_at_the_same_signal_to_noise_ratio():
    small = _inside(*_records(0.1, 1e-3), _module())
    # larger still, the scatter of the distortions widens the regions themselves
    large = _inside(*_records(4.0, 4e-2), _module())
    assert large.mean() < small.mean() - 0.15
    assert large.min() < 0.5


def test_the_same_seed_gives_the_same_records_and_every_run_its_own_noise():
    campaign = _campaign(noise=1e-3)
    sine = ibs.multisine([64.0], 1e-3, RATE, periods=50)
    one, again, other = (campaign.simulate(_module(), sine, seed=s, steps_per_sample=1) for s in (1, 1, 2))
    np.testing.assert_array_equal(one[0].signals, again[0].signals)
    assert not np.array_equal(one[0].signals, other[0].signals)
    noise = [record["U1"] - record["U1"].mean() for record in one[1:3]]  # U1 rests in both
    assert abs(np.corrcoef(noise)[0, 1]) < 0.2
    two = campaign.simulate(_module(), ibs.multisine([64.0], 1e-3, RATE).realisations(2), steps_per_sample=1)
    assert [record.title for record in two[8:10]] == ["C ry, realisation 1", "A z, realisation 2"]


def test_measured_files_go_the_same_way(tmp_path):
    campaign, records = _records(0.1, 1e-3)
    table = [ibs.Channel(name, column, "mV", sensitivity="50 mV/g") for column, name in enumerate(records[0].names)]
    paths = {}
    for run, record in zip(campaign.runs, records, strict=True):
        volts = record.signals * 50 / 9.80665
        paths[run.name] = tmp_path / f"{run.name}.npz"
        np.savez(paths[run.name], data=volts, fs=RATE)
    measured = campaign.read(paths, table, period=records[0].period)
    for one, other in zip(measured, records, strict=True):
        assert (one.names, one.units, one.title, one.period) == (other.names, other.units, other.title, other.period)
        np.testing.assert_allclose(one.signals, other.signals, rtol=1e-12)
    with pytest.raises(ibs.RecordError, match=r"no run 'D z'. Did you mean"):
        campaign.read({"D z": paths["A z"]}, table)
    with pytest.raises(ibs.RecordError, match="channel 'U1' is in 'V'"):
        campaign.read(paths, [ibs.Channel(c.name, c.column, "mV") for c in table])
    with pytest.raises(ibs.UnknownNameError, match="no channel 'Y1'"):
        campaign.read(paths, table[:6])


def test_an_estimate_keeps_its_region_in_the_basis_of_six_motions():
    campaign, records = _records(0.1, 1e-3)
    on_sensors = ibs.estimate_frf(records, campaign.input_names, campaign.output_names, frequencies=LINES)
    turned = campaign.reconstruction.to_motion(on_sensors)
    # the same from records of the six motions, which the bracket's six channels are worth
    way = campaign.reconstruction
    moved = [
        ibs.TimeRecord(
            np.vstack([way.motion(record).signals, record["Y1"]]),
            [*way.motion_names, "Y1"],
            [*way.motion(record).units, "m/s²"],
            record.sample_rate,
            period=record.period,
        )
        for record in records
    ]
    direct = ibs.estimate_frf(moved, way.motion_names, "Y1", frequencies=LINES)
    np.testing.assert_allclose(turned.response, direct.response, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(turned.radius(0.99), direct.radius(0.99), rtol=1e-6)
    np.testing.assert_allclose(turned.noise_level, direct.noise_level, rtol=1e-6)
    np.testing.assert_allclose(turned.distortion_level, direct.distortion_level, rtol=1e-4, atol=1e-9)

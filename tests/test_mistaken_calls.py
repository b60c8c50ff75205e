"""Analyses that are called with what they cannot be given say so in our words."""

import numpy as np
import pytest

import ibsdyn as ibs

FORCE, MOTION = ibs.Force("m", "x"), ibs.Sensor("m", "x")
MODEL = ibs.Model("model", axis="x")
MODEL.fixation("wall")
MODEL.rigid_body("m", mass=2.0)
MODEL.connection("k", "wall", "m", stiffness=800.0, zeta=0.02)
SYSTEM = MODEL.linearize()
NOISE = ibs.Disturbance("noise", FORCE, ([1, 20], [1, 1]))
FREQUENCY = ibs.ModeFrequency(1)
SPREAD = ibs.Tolerance("m.mass", sigma=0.1)
MEASURED = ibs.MeasuredFrequencies(3.2, 0.1)
RESPONSE = SYSTEM.frf(FORCE, MOTION, [1.0, 2.0, 3.0])


@pytest.fixture(scope="module")
def results():
    return ibs.Study(MODEL, ibs.monte_carlo(MODEL, SPREAD, 3), FREQUENCY).run(workers=1)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ibs.vibration_budget(MODEL, MOTION, NOISE), r"vibration_budget takes a linear system.*got Model\("),
        (lambda: ibs.transient_response(MODEL, {FORCE: [1, 2]}, MOTION), "takes a linear system"),
        (lambda: FREQUENCY.evaluate(MODEL), r"the quantity 'frequency of mode 1' takes a linear system"),
        (lambda: ibs.ModeDamping(1).evaluate(None), "takes a linear system"),
        (lambda: ibs.ResponseAt(FORCE, MOTION, 1.0).evaluate(3), "takes a linear system"),
        (lambda: ibs.PeakResponse(FORCE, MOTION, (1, 5)).evaluate(MODEL), "takes a linear system"),
        (lambda: ibs.Requirement("stiff", FREQUENCY, 3.0, ">=").check(MODEL), "'stiff' takes a linear system"),
        (lambda: ibs.vibration_budget(SYSTEM, MOTION, NOISE).plot(limit="small"), "limit must be one number"),
        (lambda: ibs.vibration_budget(SYSTEM, MOTION, NOISE).plot(limit=-1.0), "limit must be above 0"),
        (lambda: ibs.vibration_budget(SYSTEM, MOTION, NOISE).shares(bye="part"), "Did you mean 'by'"),
        (lambda: ibs.CorrelatedDisturbance("c", [FORCE], [([1, 2], [1, 1])], "all"), "numbers, got 'all'"),
        (lambda: ibs.shock_response_spectrum([1, 2, 3]), r"ibs\.TimeRecord"),
        (lambda: ibs.Study(SYSTEM, ibs.monte_carlo(MODEL, SPREAD, 3)), r"Study takes an ibs\.Model, got LinearSystem"),
        (lambda: ibs.monte_carlo(SYSTEM, SPREAD, 3), r"takes an ibs\.Model"),
        (lambda: ibs.one_at_a_time(None, {"m.mass": [1]}), r"takes an ibs\.Model"),
        (lambda: ibs.sensitivities(SYSTEM, FREQUENCY), r"sensitivities takes an ibs\.Model"),
        (lambda: ibs.fit(None, ["m.mass"], MEASURED), r"fit takes an ibs\.Model"),
        (lambda: ibs.fit(MODEL, ["m.mass"], MEASURED, {"m.mass": 5.0}), "bounds of m.mass must be 2 numbers"),
        (lambda: ibs.fit(MODEL, ["m.mass"], MEASURED, [1.0, 5.0]), "bounds must be a dict"),
        (lambda: ibs.MeasuredFrequencies([1, 2], 0.1, modes=5), "modes must be 2 different"),
        (lambda: ibs.MeasuredFrequencies(1, 0.1, shapes="up", sensors=MOTION), "shapes must be"),
        (lambda: ibs.MeasuredResponse(None, FORCE, MOTION), r"ibs\.FrequencyResponse"),
        (lambda: ibs.MeasuredResponse(RESPONSE, FORCE, MOTION, sigma=[1, 2]), r"shape \(1, 1, 3\)"),
        (lambda: ibs.MeasuredResponse(RESPONSE, FORCE, MOTION, sigma="1 %"), "sigma must be numbers"),
        (lambda: ibs.MeasuredResponse(RESPONSE, FORCE, MOTION, sigma=1.0, band=5), "band must be 2 numbers"),
    ],
)
def test_arguments(call, words):
    with pytest.raises(ibs.IbsdynError, match=words):
        call()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda results, _: results.model(99), "variants 0 to 2, got 99"),
        (lambda results, _: results.parameters("first"), "variants 0 to 2, got 'first'"),
        (lambda results, _: results.percentiles(0, [150]), "0 to 100"),
        (lambda results, _: results.percentiles(0, None), "0 to 100"),
        (lambda results, _: results.odds("high"), "between 0 and 1"),
        (lambda results, folder: results.study.run(results=folder / "absent" / "r.jsonl"), "No such file"),
        (lambda results, _: results.study.run(results=5), "path of a file, got 5"),
    ],
)
def test_results(results, tmp_path, call, words):
    with pytest.raises(ibs.IbsdynError, match=words):
        call(results, tmp_path)
    assert np.isfinite(results.percentiles(0)).all()

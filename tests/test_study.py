"""Studies: which variants, the same numbers from every executor, failures told, kills survived."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats

import ibsdyn as ibs
from ibsdyn.fingerprint import fingerprint
from ibsdyn.study_file import StudyFile, VariantResult

ROOT = Path(__file__).parents[1]
STIFFNESS, MASS, SIGMA = 8000.0, 2.0, 0.05
F1 = ibs.ModeFrequency(1)


def oscillator():
    model = ibs.Model("oscillator", axis="x")
    model.fixation("wall")
    model.rigid_body("m", mass=MASS)
    model.connection("k", "wall", "m", stiffness=STIFFNESS, zeta=0.02)
    return model


def frequency(stiffness, mass=MASS):
    return np.sqrt(stiffness / mass) / (2 * np.pi)


def scatter(count=60, seed=1, make=ibs.monte_carlo):
    return make(oscillator(), ibs.Tolerance("k.stiffness", sigma=SIGMA, relative=True), count, seed=seed)


# -- samples


def test_draws_follow_their_distributions():
    model = oscillator()
    tolerances = [
        ibs.Tolerance("k.stiffness", sigma=SIGMA, relative=True),
        ibs.Tolerance("m.mass", plus_minus=0.1),
    ]
    samples = ibs.monte_carlo(model, tolerances, 4000, seed=5)
    k, m = samples.values.T
    assert scipy.stats.kstest(k, scipy.stats.norm(STIFFNESS, SIGMA * STIFFNESS).cdf).pvalue > 0.01
    assert scipy.stats.kstest(m, scipy.stats.uniform(MASS - 0.1, 0.2).cdf).pvalue > 0.01
    assert abs(np.corrcoef(k, m)[0, 1]) < 0.05
    again = ibs.monte_carlo(model, tolerances, 4000, seed=5)
    np.testing.assert_array_equal(samples.values, again.values)
    assert not np.array_equal(samples.values, ibs.monte_carlo(model, tolerances, 4000, seed=6).values)


def test_a_latin_hypercube_has_one_draw_in_every_slice():
    samples = scatter(50, make=ibs.latin_hypercube)
    slices = np.floor(50 * scipy.stats.norm(STIFFNESS, SIGMA * STIFFNESS).cdf(samples.values[:, 0]))
    assert sorted(slices) == list(range(50))


def test_a_batch_shares_one_draw():
    model = oscillator()
    model.connection("k2", "wall", "m", stiffness=1000.0)
    samples = ibs.monte_carlo(model, ibs.Tolerance(["k.stiffness", "k2.stiffness"], plus_minus=0.1, relative=True), 9)
    np.testing.assert_allclose(samples.values[:, 0] / STIFFNESS, samples.values[:, 1] / 1000.0)


def test_grids_and_lists():
    model = oscillator()
    grid = ibs.full_factorial({"k.stiffness": [1.0, 2.0], "m.mass": [3.0, 4.0, 5.0]})
    assert grid.values.tolist() == [[1, 3], [1, 4], [1, 5], [2, 3], [2, 4], [2, 5]]
    single = ibs.one_at_a_time(model, {"k.stiffness": [1.0, np.inf], "m.mass": [3.0]})
    assert single.values.tolist() == [[1, MASS], [np.inf, MASS], [STIFFNESS, 3]]
    listed = ibs.variants(model, [{"m.mass": 3.0}, {"k.stiffness": 1.0}, {}])
    assert [listed.parameters(i) for i in range(3)] == [
        {"m.mass": 3.0, "k.stiffness": STIFFNESS},
        {"m.mass": MASS, "k.stiffness": 1.0},
        {"m.mass": MASS, "k.stiffness": STIFFNESS},
    ]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: ibs.Tolerance("m.mass"), "either sigma"),
        (lambda m: ibs.Tolerance("m.mass", sigma=1, plus_minus=1), "either sigma"),
        (lambda m: ibs.Tolerance("m.mass", sigma=-1), "above 0"),
        (lambda m: ibs.Tolerance("m.mass", sgima=1), "sigma"),
        (lambda m: ibs.monte_carlo(m, ibs.Tolerance("m.mas", sigma=1), 5), "Did you mean 'm.mass'"),
        (lambda m: ibs.monte_carlo(m, [ibs.Tolerance("m.mass", sigma=1)] * 2, 5), "twice"),
        (lambda m: ibs.monte_carlo(m, "m.mass", 5), "ibs.Tolerance"),
        (lambda m: ibs.monte_carlo(m, ibs.Tolerance("m.mass", sigma=1), 0), "whole number"),
        (lambda m: ibs.monte_carlo(m, ibs.Tolerance("m.mass", sigma=1), 5, seed=-1), "seed"),
        (lambda m: ibs.full_factorial({}), "levels"),
        (lambda m: ibs.full_factorial({"m.mass": []}), "no level"),
        (lambda m: ibs.full_factorial({"m.mass": ["a"]}), "one number"),
        (lambda m: ibs.variants(m, []), "list of dicts"),
        (lambda m: ibs.Study(m, ibs.full_factorial({"k.zta": [1]}), F1), "Did you mean 'k.zeta'"),
        (lambda m: ibs.Study(m, ibs.full_factorial({"k.zeta": [1]})), "neither a quantity nor a requirement"),
        (lambda m: ibs.Study(m, ibs.full_factorial({"k.zeta": [1]}), [F1, F1]), "two quantities"),
        (lambda m: ibs.Study(m, [{"k.zeta": 1}], F1), "samples must come from"),
        (lambda m: ibs.Study(m, scatter(), F1).run(workers=0), "workers"),
        (lambda m: ibs.Study(m, scatter(), F1).run(executor=4), "executor"),
    ],
)
def test_refusals(call, words):
    with pytest.raises(ibs.ModelError, match=words):
        call(oscillator())


# -- results


def test_values_are_those_of_each_model():
    samples = ibs.full_factorial({"k.stiffness": [2e3, 8e3], "m.mass": [1.0, 4.0]})
    results = ibs.Study(oscillator(), samples, [F1, ibs.ModeDamping(1)]).run(workers=1)
    expected = [frequency(k, m) for k in (2e3, 8e3) for m in (1.0, 4.0)]
    np.testing.assert_allclose(results["frequency of mode 1"], expected, rtol=1e-12)
    np.testing.assert_allclose(results["damping ratio of mode 1"], 0.02)
    np.testing.assert_allclose(results.nominal, [frequency(STIFFNESS), 0.02])
    assert results.model(1).parameters()["m.mass"] == 4.0
    with pytest.raises(ibs.UnknownNameError, match="Did you mean"):
        results["frequency of mode 2"]
    with pytest.raises(ibs.AnalysisError, match="random"):
        results.odds()


def test_odds_and_percentiles_of_a_known_distribution():
    limit = frequency(STIFFNESS * (1 - SIGMA))  # one sigma below: met by 84.13 %
    requirement = ibs.Requirement("stiff enough", F1, limit, ">=")
    inside = 0
    for seed in range(40):
        results = ibs.Study(oscillator(), scatter(100, seed), requirements=requirement).run(workers=1)
        (odds,) = results.odds(0.9)
        assert odds.share == odds.met / 100
        inside += odds.lower <= scipy.stats.norm.cdf(1) <= odds.upper
    assert inside >= 33  # 90 % at least; 33 of 40 or fewer of a true 90 % come with a probability of 2 %
    expected = frequency(STIFFNESS * (1 + SIGMA * scipy.stats.norm.ppf([0.05, 0.5, 0.95])))
    many = ibs.Study(oscillator(), scatter(400, make=ibs.latin_hypercube), F1).run(workers=1)
    np.testing.assert_allclose(many.percentiles(0), expected, rtol=1e-3)
    assert many.rank_correlations()["k.stiffness"] == pytest.approx(1.0)


def test_requirements_of_the_model_are_held_against_every_variant():
    model = oscillator()
    model.add_requirement(ibs.Requirement("stiff enough", F1, 9.0, ">="))
    results = ibs.Study(model, scatter(20)).run(workers=1)
    assert results.quantities == ("frequency of mode 1",)
    (odds,) = results.odds()
    assert odds.met == np.sum(results.values >= 9.0)
    assert "stiff enough: met by" in str(results)


def test_a_failed_variant_is_told_and_loses_no_other():
    samples = ibs.variants(oscillator(), [{"m.mass": 1.0}, {"m.mass": -1.0}, {"k.stiffness": 0.0}, {"m.mass": 4.0}])
    results = ibs.Study(oscillator(), samples, [F1, ibs.ModeDamping(1)]).run(workers=1)
    np.testing.assert_allclose(results.values[[0, 3], 0], frequency(STIFFNESS, np.array([1.0, 4.0])))
    assert np.isnan(results.values[[1, 2]]).all()
    first, second = results.failed
    assert first.variant == 1
    assert first.parameters["m.mass"] == -1.0
    assert "mass must be above 0" in str(first)
    assert set(second.reasons) == {"frequency of mode 1", "damping ratio of mode 1"}
    assert "2 variants failed" in str(results)
    assert "mass must be above 0" in results.study.evaluate(1).failures[""]


# -- executors


def three_mounts():
    model = ibs.Model("plate")
    model.fixation("floor")
    model.rigid_body("plate", mass=8.0, cog=(0, 0, 0.1), inertia=(0.06, 0.08, 0.1, 0, 0, 0))
    for i, (x, y) in enumerate([(0.1, 0), (-0.1, 0.1), (-0.1, -0.1)]):
        model.connection(
            f"mount {i}", "floor", "plate", position1=(x, y, 0), stiffness=(2e5, 2e5, 6e5, 0, 0, 0), zeta=0.03
        )
    return model


def plate_study(count=24):
    model = three_mounts()
    tolerances = [ibs.Tolerance(f"mount {i}.kz", sigma=0.1, relative=True) for i in range(3)]
    peak = ibs.PeakResponse(ibs.BaseMotion("floor", "x"), ibs.Sensor("plate", "x"), (1, 300), name="peak")
    return ibs.Study(model, ibs.monte_carlo(model, tolerances, count, seed=2), [F1, peak])


def test_every_executor_gives_the_same_numbers():
    study = plate_study()
    alone = study.run(workers=1).values
    np.testing.assert_array_equal(study.run(workers=2).values, alone)
    with ThreadPoolExecutor(2) as threads:
        np.testing.assert_array_equal(study.run(executor=threads).values, alone)
    with ProcessPoolExecutor(2) as processes:
        np.testing.assert_array_equal(study.run(executor=processes).values, alone)


def test_a_dask_cluster_gives_the_same_numbers():
    distributed = pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
    study = plate_study()
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as cluster,
        distributed.Client(cluster) as client,
    ):
        results = study.run(executor=client.get_executor())
    np.testing.assert_array_equal(results.values, study.run(workers=1).values)


SCRIPT = """
import sys
import ibsdyn as ibs

class Twice:  # a quantity of the user's own, defined in the script
    name, unit = "twice the frequency", "Hz"
    def evaluate(self, system):
        {work}
        return 2 * float(system.modes().frequencies[0])

model = ibs.Model("oscillator", axis="x")
model.fixation("wall")
model.rigid_body("m", mass=2.0)
model.connection("k", "wall", "m", stiffness=8000.0, zeta=0.02)
samples = ibs.monte_carlo(model, ibs.Tolerance("k.stiffness", sigma=0.05, relative=True), {count}, seed=1)
results = ibs.Study(model, samples, Twice()).run(workers={workers}, results={path!r}, progress=False)
print(results.values.sum().hex(), file=open({out!r}, "w"))
"""


def script(folder, count, workers, work="pass"):
    path = folder / "study.py"
    values = {"count": count, "workers": workers, "work": work}
    path.write_text(
        textwrap.dedent(SCRIPT.format(path=str(folder / "results.jsonl"), out=str(folder / "sum"), **values))
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return [sys.executable, str(path)], environment


def test_a_script_without_a_guard_works_with_processes(tmp_path):
    command, environment = script(tmp_path, 40, 2)
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    expected = 2 * frequency(scatter(40).values[:, 0])
    assert float.fromhex((tmp_path / "sum").read_text()) == pytest.approx(expected.sum(), rel=1e-12)


# -- results files


def finished(path):
    """Variants that the file holds for certain, read without ibsdyn."""
    held = []
    for line in path.read_bytes().split(b"\n"):
        try:
            held += [entry["variant"] for entry in json.loads(line).get("variants", [])]
        except ValueError:
            continue
    return held


def test_kills_lose_no_finished_variant(tmp_path):
    """Kill -9 at random moments, start again, until it is done: every variant that was on disk stays."""
    command, environment = script(tmp_path, 60, 1, work="import time; time.sleep(0.01)")
    path = tmp_path / "results.jsonl"
    rng = np.random.default_rng(0)
    before: list[int] = []
    kills = 0
    for _ in range(30):
        process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE)
        # The start of Python is not what is tried: the clock runs from the file's growth on.
        size = path.stat().st_size if path.exists() else 0
        while process.poll() is None and (not path.exists() or path.stat().st_size == size):
            time.sleep(0.005)
        if kills < 3:
            time.sleep(rng.uniform(0, 0.15))
            if process.poll() is None:
                os.kill(process.pid, signal.SIGKILL)
                kills += 1
        _, words = process.communicate(timeout=120)
        held = finished(path)
        assert set(before) <= set(held)
        assert len(held) == len(set(held)), "calculated twice although it was on disk"
        before = held
        if process.returncode == 0:
            break
        assert process.returncode == -signal.SIGKILL, words.decode()
    assert kills == 3
    assert sorted(before) == list(range(60))
    expected = 2 * frequency(scatter(60).values[:, 0])
    assert float.fromhex((tmp_path / "sum").read_text()) == pytest.approx(expected.sum(), rel=1e-12)


@pytest.mark.parametrize("cut", [1, 5, 40, 200, 10_000])
def test_a_torn_file_goes_on(tmp_path, cut):
    path = tmp_path / "results.jsonl"
    study = ibs.Study(oscillator(), scatter(30), F1)
    whole = study.run(workers=1, results=path).values
    content = path.read_bytes()
    path.write_bytes(content[: max(len(content) - cut, 20)])
    np.testing.assert_array_equal(study.run(workers=1, results=path).values, whole)
    # And once more, with nothing left to calculate.
    size = path.stat().st_size
    np.testing.assert_array_equal(study.run(workers=1, results=path).values, whole)
    assert path.stat().st_size == size


@pytest.mark.parametrize(
    "damaged",
    [
        {"variants": 5},
        {"variants": [3, {"variant": 1}]},
        {"variants": [{"variant": 1, "values": [1.0, 2.0], "failures": {}}]},
        {"variants": [{"variant": 1, "values": ["ten"], "failures": {}}]},
        {"variants": [{"variant": "1", "values": [1.0], "failures": {}}]},
        {"variants": [{"variant": 1, "values": [1.0], "failures": None}]},
    ],
)
def test_damaged_lines_are_calculated_again(tmp_path, damaged):
    path = tmp_path / "results.jsonl"
    study = ibs.Study(oscillator(), scatter(3), F1)
    whole = study.run(workers=1, results=path).values
    head = path.read_bytes().split(b"\n")[0]
    path.write_bytes(head + b"\n" + json.dumps(damaged).encode() + b"\n")
    np.testing.assert_array_equal(study.run(workers=1, results=path).values, whole)
    path.write_bytes(b'{"format": "ibsdyn study 1"}\n')
    with pytest.raises(ibs.StudyError, match="no results file"):
        study.run(workers=1, results=path)


def test_failures_come_back_from_the_file(tmp_path):
    path = tmp_path / "results.jsonl"
    samples = ibs.variants(oscillator(), [{"m.mass": 1.0}, {"m.mass": -1.0}])
    study = ibs.Study(oscillator(), samples, F1)
    first, second = (study.run(workers=1, results=path) for _ in range(2))
    assert second.failed == first.failed
    np.testing.assert_array_equal(second.values, first.values)


def test_a_file_of_another_study_is_refused_and_stays(tmp_path):
    path = tmp_path / "results.jsonl"
    ibs.Study(oscillator(), scatter(5), F1).run(workers=1, results=path)
    content = path.read_bytes()
    heavier = oscillator().with_parameters({"m.mass": 3.0})
    others = [
        ibs.Study(oscillator(), scatter(5, seed=9), F1),
        ibs.Study(oscillator(), scatter(5), ibs.ModeDamping(1)),
        ibs.Study(heavier, scatter(5), F1),
    ]
    for other in others:
        with pytest.raises(ibs.StudyError, match="another study"):
            other.run(workers=1, results=path)
    notes = tmp_path / "notes.txt"
    notes.write_text("shopping list")
    with pytest.raises(ibs.StudyError, match="no results file"):
        others[0].run(workers=1, results=notes)
    assert notes.read_text() == "shopping list"
    assert path.read_bytes() == content


def test_what_is_added_can_be_read_at_once(tmp_path):
    path = tmp_path / "results.jsonl"
    writer = StudyFile(path, "abc", "study", 2)
    writer.add([VariantResult(3, (1.5, None), {"second": "why"})])
    assert StudyFile(path, "abc", "study", 2).finished == {3: VariantResult(3, (1.5, None), {"second": "why"})}


def test_fingerprints_tell_contents_apart(tmp_path):
    model = three_mounts()
    assert fingerprint(model) == fingerprint(three_mounts())
    seen = {fingerprint(model)}
    for address, value in model.parameters().items():
        seen.add(fingerprint(model.with_parameters({address: value * (1 + 1e-15) if value else 1e-300})))
    assert len(seen) == 1 + len(model.parameters())
    assert fingerprint("ab", "c") != fingerprint("a", "bc")
    assert fingerprint([1.0, 2.0], 3.0) != fingerprint([1.0], [2.0, 3.0])
    assert fingerprint(np.zeros((2, 3))) != fingerprint(np.zeros((3, 2)))
    shaking = [
        ibs.Disturbance("floor", ibs.BaseMotion("floor", "x"), (np.arange(1, 5000.0), np.full(4999, level)))
        for level in (1e-6, 1.0000001e-6)
    ]
    assert fingerprint(shaking[0]) != fingerprint(shaking[1])
    code = f"import sys; sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / 'tests')!r}]\n" + (
        "from test_study import three_mounts\nfrom ibsdyn.fingerprint import fingerprint\n"
        "open(sys.argv[1], 'w').write(fingerprint(three_mounts()))"
    )
    target = tmp_path / "fingerprint"
    subprocess.run([sys.executable, "-c", code, str(target)], check=True, timeout=120)
    assert target.read_text() == fingerprint(model)


# -- figures


def test_a_limit_far_away_does_not_hide_the_bars():
    near, far = ibs.Requirement("near", F1, 9.5, ">="), ibs.Requirement("far", F1, 500.0)
    (panel,) = ibs.Study(oscillator(), scatter(50), requirements=[near, far]).run(workers=1).plot()
    low, high = panel.get_xlim()
    assert low < 9.5 < high < 100
    assert any("far: <= 500, met by 100 % (far to the right)" in t.get_text() for t in panel.get_legend().get_texts())


def test_a_quantity_that_no_variant_has_leaves_the_others_their_odds():
    results = ibs.Study(oscillator(), scatter(20), requirements=[ibs.Requirement("first", F1, 9.5, ">=")]).run(
        workers=1
    )
    lost = replace(results, values=np.full_like(results.values, np.nan))
    (odds,) = lost.odds()
    assert (odds.met, odds.calculated, odds.lower, odds.upper) == (0, 0, 0.0, 1.0)
    assert np.isnan(odds.share)
    assert "first: no variant was calculated" in str(lost)
    lost.plot()


def test_figures():
    requirement = ibs.Requirement("stiff enough", F1, 9.5, ">=")
    results = ibs.Study(oscillator(), scatter(50), [ibs.ModeDamping(1)], requirement).run(workers=1)
    axes = results.plot()
    assert axes.shape == (2,)
    assert axes[1].get_xlabel() == "frequency of mode 1 [Hz]"
    assert sum(patch.get_height() for patch in axes[1].patches) == 50
    assert any("stiff enough: >= 9.5, met by" in text.get_text() for text in axes[1].get_legend().get_texts())
    sweep = ibs.one_at_a_time(oscillator(), {"m.mass": [1.0, 2.0, 4.0], "k.stiffness": [1e3, 2e3]})
    axes = ibs.Study(oscillator(), sweep, F1).run(workers=1).plot("frequency of mode 1")
    assert axes.shape == (1, 2)
    x, y = axes[0, 0].lines[0].get_data()
    np.testing.assert_allclose(y, frequency(STIFFNESS, np.asarray(x)))
    assert axes[0, 0].get_xlabel() == "m.mass"


@pytest.mark.parametrize(("limit", "drawn"), [(9.5, True), (1e4, False), (1e-4, False)])
def test_a_limit_far_off_does_not_press_the_bars_of_a_scatter_into_one(limit, drawn):
    results = ibs.Study(oscillator(), scatter(50), [], ibs.Requirement("limit", F1, limit, ">=")).run(workers=1)
    (panel,) = results.plot()
    lower, upper = panel.get_xlim()
    assert np.ptp(results.values[:, 0]) > 0.15 * (upper - lower)
    assert (lower <= limit <= upper) == drawn
    assert ("far to the" in panel.get_legend().get_texts()[-1].get_text()) != drawn


def test_levels_of_one_parameter_are_points_of_a_curve():
    sweep = ibs.full_factorial({"m.mass": [4.0, 1.0, 2.0]})
    axes = ibs.Study(oscillator(), sweep, F1).run(workers=1).plot("frequency of mode 1")
    line = axes.ravel()[0].lines[0]
    assert line.get_linestyle() == "-"
    assert line.get_xdata().tolist() == [1.0, 2.0, 4.0]

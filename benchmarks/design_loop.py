"""Speed of the design loop on the hybrid mirror module: `python benchmarks/design_loop.py --help`.

One variant: change parameters, linearise, 20 modes with damping ratios, 6 x 6 responses at 1000 frequencies. Rivals
take turns with ibsdyn, so that what else runs on the machine meets all of them; ratios are of medians.
"""

from __future__ import annotations

import os

# One thread of BLAS each: what is compared is the work, and two processes must not share cores with threads of both.
os.environ["OMP_NUM_THREADS"] = os.environ["MKL_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

from by_hand import ByHand
from mirror_module import flexure, hybrid

import ibsdyn as ibs

FREQUENCIES = np.geomspace(20.0, 2000.0, 1000)
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
INPUTS = [ibs.BaseMotion("platform", d) for d in DIRECTIONS]
OUTPUTS = [ibs.Sensor("mirror", d) for d in DIRECTIONS]
MODES = 20
VARIED = ("mirror.mass", "mirror.cog.x", "mirror.inertia.Izz", "base screws.kzz", "tip screws.kyy")


class Loop:
    """One variant after the other, by ibsdyn and by hand."""

    def __init__(self, model: ibs.Model) -> None:
        self.model = model
        known = model.parameters()
        self.nominal = np.array([known[address] for address in VARIED])
        body = model.items["flexure"]
        assert isinstance(body, ibs.FlexibleBody)
        frames = tuple(np.array(body.reduced.interfaces[name].position) for name in ("base", "tip"))
        screws = [model.connections[f"{key} screws"] for key in ("base", "tip")]
        self.by_hand = ByHand(body.reduced, (frames[0], frames[1]), (screws[0].zeta, body.zeta, screws[1].zeta))
        mirror = model.items["mirror"]
        assert isinstance(mirror, ibs.RigidBody)
        self.parameters: dict[str, Any] = {
            "mass": mirror.mass,
            "cog": np.array(mirror.cog),
            "inertia": list(mirror.inertia[:3]),
            **{key: list(screw.stiffness) for key, screw in zip(("base", "tip"), screws, strict=True)},
            **{
                f"{key} centre": 0.5 * np.add(screw.position1, screw.position2)
                for key, screw in zip(("base", "tip"), screws, strict=True)
            },
        }

    def values(self, number: int) -> np.ndarray:
        """Return the parameters of a variant: all within 1 %."""
        return self.nominal * (1 + 0.01 * np.random.default_rng(number).uniform(-1, 1, len(VARIED)))

    def ibsdyn(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return frequencies, ratios and responses of a variant."""
        system = self.model.with_parameters(dict(zip(VARIED, self.values(number).tolist(), strict=True))).linearize()
        modes = system.modes()
        response = system.frf(INPUTS, OUTPUTS, FREQUENCIES).response
        return modes.frequencies[:MODES], modes.damping_ratios[:MODES], response

    def exudyn(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the same from Exudyn and scipy by hand."""
        return self._by_hand(self.by_hand.exudyn, number)

    def numpy(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the same from numpy and scipy by hand."""
        return self._by_hand(self.by_hand.numpy, number)

    def _by_hand(self, assemble: Callable[..., Any], number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        mass, x, izz, kzz, kyy = self.values(number).tolist()
        p = dict(self.parameters)
        p["mass"] = mass
        p["cog"] = np.array([x, *p["cog"][1:]])
        p["inertia"] = [*p["inertia"][:2], izz]
        p["base"], p["tip"] = [*p["base"][:5], kzz], [*p["tip"][:4], kyy, p["tip"][5]]
        M, K = assemble(p)
        frequencies, ratios, response = self.by_hand.modes_and_responses(M, K, p, FREQUENCIES)
        return frequencies[:MODES], ratios[:MODES], response


def take_turns(rivals: dict[str, Callable[[int], Any]], rounds: int) -> dict[str, float]:
    """Return the median seconds of each rival, which run one after the other in every round."""
    seconds: dict[str, list[float]] = {name: [] for name in rivals}
    for number in range(rounds):
        for name, rival in rivals.items():
            start = time.perf_counter()
            rival(number)
            seconds[name].append(time.perf_counter() - start)
    return {name: float(np.median(own)) for name, own in seconds.items()}


def loop(model: ibs.Model, rounds: int) -> None:
    """Print variants per second, and how far the three agree."""
    variants = Loop(model)
    rivals: dict[str, Callable[[int], Any]] = {
        "ibsdyn": variants.ibsdyn,
        "Exudyn and scipy by hand": variants.exudyn,
        "numpy and scipy by hand": variants.numpy,
    }
    ours = variants.ibsdyn(0)
    for name, rival in rivals.items():
        for own, other in zip(ours, rival(0), strict=True):
            worst = np.abs(own - other).max() / np.abs(own).max()
            assert worst < 1e-6, f"{name} calculates something else: {worst:.2g}"
    seconds = take_turns(rivals, rounds)
    print("design loop: parameters -> linear system -> 20 modes -> 6 x 6 responses at 1000 frequencies")
    for name, own in seconds.items():
        print(f"  {name:26} {1 / own:8.0f} variants/s   {own / seconds['ibsdyn']:.2f} of ibsdyn's time")


def sensitivities(model: ibs.Model, rounds: int) -> None:
    """Print the time of all sensitivities, exact and by central differences."""
    quantities: list[ibs.Quantity] = [ibs.ModeFrequency(mode) for mode in range(1, MODES + 1)]
    quantities += [ibs.ModeDamping(mode) for mode in range(1, MODES + 1)]
    found = ibs.sensitivities(model, quantities)
    steps = {
        a: 1e-6 if u == "m" else s / 100
        for a, u, s in zip(found.parameters, found.parameter_units, found.steps, strict=True)
    }
    values = model.parameters()

    def differences(evaluate: Callable[[ibs.LinearSystem], np.ndarray]) -> np.ndarray:
        derivatives = []
        for address, step in steps.items():
            above, below = (
                evaluate(model.with_parameters({address: values[address] + sign * step}).linearize())
                for sign in (1, -1)
            )
            derivatives.append((above - below) / (2 * step))
        return np.array(derivatives)

    def frequencies_and_ratios(system: ibs.LinearSystem) -> np.ndarray:
        modes = system.modes()
        return np.concatenate([modes.frequencies[:MODES], modes.damping_ratios[:MODES]])

    def responses(system: ibs.LinearSystem) -> np.ndarray:
        return system.frf(INPUTS, OUTPUTS, FREQUENCIES).response

    def alike(exact: np.ndarray, by_differences: np.ndarray) -> bool:
        size = np.abs(by_differences).max(axis=0)
        return bool((np.abs(exact - by_differences) <= 1e-3 * np.abs(by_differences) + 1e-3 * size).all())

    assert alike(found.derivatives.T, differences(frequencies_and_ratios)), "sensitivities differ from differences"
    random = ibs.Disturbance("floor", INPUTS[1], ([20.0, 2000.0], [1e-2, 1e-2]))
    results: list[ibs.Quantity] = [
        ibs.ModeFrequency(1),
        ibs.PeakResponse(INPUTS[1], OUTPUTS[5], (20.0, 2000.0)),
        ibs.RmsResponse(OUTPUTS[5], random, (20.0, 2000.0)),
    ]

    def values_of(system: ibs.LinearSystem) -> np.ndarray:
        return np.array([quantity.evaluate(system) for quantity in results])

    assert alike(ibs.sensitivities(model, results).derivatives.T, differences(values_of)), "another peak or RMS"
    cases = {
        "a frequency, a peak and an RMS": (
            lambda _: ibs.sensitivities(model, results),
            lambda _: differences(values_of),
        ),
        "frequencies and ratios of 20 modes": (
            lambda _: ibs.sensitivities(model, quantities),
            lambda _: differences(frequencies_and_ratios),
        ),
        "6 x 6 responses at 1000 frequencies": (
            lambda _: ibs.response_sensitivities(model, INPUTS, OUTPUTS, FREQUENCIES),
            lambda _: differences(responses),
        ),
    }
    print(f"sensitivities to {len(steps)} parameters, exact against central differences")
    for name, (exact, by_differences) in cases.items():
        seconds = take_turns({"exact": exact, "differences": by_differences}, rounds)
        ratio = seconds["differences"] / seconds["exact"]
        print(f"  {name:36} {1e3 * seconds['exact']:7.1f} ms, differences take {ratio:.1f} times as long")


def monte_carlo(model: ibs.Model, count: int) -> None:
    """Print the time of a Monte Carlo with one and with two processes."""
    tolerances = [ibs.Tolerance(address, sigma=0.01, relative=True) for address in VARIED]
    peak = ibs.PeakResponse(INPUTS[1], OUTPUTS[5], (20.0, 2000.0), name="peak")
    study = ibs.Study(model, ibs.monte_carlo(model, tolerances, count, seed=1), [ibs.ModeFrequency(1), peak])
    warm = ibs.Study(model, ibs.monte_carlo(model, tolerances, 8, seed=2), [ibs.ModeFrequency(1), peak])
    seconds, values = {}, []
    for workers in (1, 2):
        warm.run(workers=workers, progress=False)  # starting Python twice is no part of the work
        start = time.perf_counter()
        values.append(study.run(workers=workers, progress=False).values)
        seconds[workers] = time.perf_counter() - start
    assert np.array_equal(*values), "the number of workers changes the results"
    print(f"Monte Carlo, {count} variants: frequency of mode 1 and the peak of one response")
    print(f"  one worker {seconds[1]:.1f} s, two {seconds[2]:.1f} s: {seconds[1] / seconds[2]:.2f} times as fast")


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=200, help="variants of the design loop")
    parser.add_argument("--variants", type=int, default=10_000, help="of the Monte Carlo; 0 leaves it out")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", ibs.ModelWarning)  # modes above the reduction's cut-off, of no interest here
    model = hybrid(flexure())
    loop(model, chosen.rounds)
    sensitivities(model, max(chosen.rounds // 20, 3))
    if chosen.variants:
        monte_carlo(model, chosen.variants)


if __name__ == "__main__":
    main()

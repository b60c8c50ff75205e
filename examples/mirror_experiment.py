"""The mirror module of the first example on its test bench: is it as the model says?

The module stands on a plate that three piezos move in z, Rx and Ry. It is mounted in three orientations, so that the
nine runs move it in all six directions; six accelerometers on a cube under the plate see that motion, one on the edge
of the mirror sees what comes out. All this happens on the hybrid model here, with the noise of real accelerometers; the
records of the real bench go the same way by `campaign.read(...)`.

    campaign       nine runs -> records
    estimate       records -> six responses Y1/U1 ... Y1/U6 with their 99 % regions
    compare        does the model lie in the regions?
    amplitudes     how far may the bench shake until the module is no longer linear?

Run `python examples/mirror_experiment.py [folder]`: it prints the comparison and writes two figures into the folder (by
default `output` beside this file).
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from mirror_flexure import MM
from mirror_module import DISC_DIAMETER, DISC_THICKNESS, FLEXURE, PLATE, flexure, hybrid, rigid_bodies

import ibsdyn as ibs

# --- bench -----------------------------------------------------------------------------------------------------------

RADIUS = 0.060  # m: circle on which the piezos stand
ANGLES = np.radians([0.0, 120.0, 240.0])
PIEZO_STROKE = 30e-6  # m
CUBE = 0.040  # m: edge of the cube that carries the six input accelerometers
CUBE_POSITION = np.array([-0.035, 0.0, 0.0])  # m: under the plate
NOISE = 5e-5  # m/s²/√Hz: 5 µg/√Hz, a good piezo-electric accelerometer
RANGE = 50.0  # m/s²
# The regions hold noise and distortion, not calibration: 0.2 % of cross-axis sensitivity in each of the seven leaves
# 75 % of the lines in them instead of 99 %. The six must be calibrated together.
CROSS_AXIS = 0.0

# Face of the cube (from its middle) and direction of each input accelerometer.
INPUTS = {
    "U1": ((0, 0, 1), "x"),
    "U2": ((0, 0, -1), "x"),
    "U3": ((0, 1, 0), "z"),
    "U4": ((0, -1, 0), "z"),
    "U5": ((1, 0, 0), "y"),
    "U6": ((-1, 0, 0), "y"),
}

# --- excitation ------------------------------------------------------------------------------------------------------

RATE = 2048.0  # Hz
LINES = ibs.band_lines(20.0, 800.0, 0.5)  # Hz: two and more in the width of the first resonance, 2 zeta f = 1.1 Hz
LEVEL = 0.02  # m/s² per line
CORNER = 60.0  # Hz: below it the stroke of a line stays the same
STEPS_PER_SAMPLE = 8
AMPLITUDES = (1.0, 100.0, 300.0)  # times the level of the campaign, up to 6 m/s² per line


def campaign(cross_axis: float = CROSS_AXIS) -> ibs.Campaign:
    """Nine runs: x, y and z of the module up, the plate moving in z, Rx and Ry."""
    top = FLEXURE.height * MM + PLATE[0] + DISC_THICKNESS
    edge = (top, 0.9 * DISC_DIAMETER / 2, 0.0)
    sheet = {"noise_density": NOISE, "range": RANGE, "cross_axis": cross_axis}
    return ibs.Campaign(
        platform=ibs.PiezoPlatform(
            "platform", RADIUS * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]), stroke=PIEZO_STROKE
        ),
        orientations=[ibs.Orientation("A", up="x"), ibs.Orientation("B", up="y"), ibs.Orientation("C", up="z")],
        inputs=[
            ibs.Accelerometer(name, "platform", CUBE_POSITION + CUBE / 2 * np.array(face), direction, **sheet)
            for name, (face, direction) in INPUTS.items()
        ],
        outputs=ibs.Accelerometer("Y1", "mirror", edge, "x", **sheet),
    )


def excitation(every: int = 1) -> ibs.Multisine:
    """A random-phase multisine of every so many lines, weak at low frequencies where piezos run out of stroke."""
    return ibs.multisine(LINES[::every], lambda f: LEVEL * np.minimum(1.0, (f / CORNER) ** 2), RATE, seed=1)


def measure(bench: ibs.Campaign, model: ibs.Model, seed: int = 0) -> ibs.FrfEstimate:
    """Make all nine runs and estimate the responses of the mirror to the six input accelerometers."""
    with warnings.catch_warnings():
        # The step shifts resonances by up to 0.7 %; predict() puts the same shift into the prediction.
        warnings.simplefilter("ignore", ibs.SimulationWarning)
        # Small deflections of the FE part are meant here; its floating frame would take five times as long.
        records = bench.simulate(
            model, excitation(), seed=seed, flexible="small-deflection", steps_per_sample=STEPS_PER_SAMPLE
        )
    return ibs.estimate_frf(records, bench.input_names, bench.output_names, frequencies=LINES)


def predict(bench: ibs.Campaign, model: ibs.Model) -> ibs.FrequencyResponse:
    """Return the linear model's responses to the same accelerometers."""
    return bench.model_frf(model, LINES, step=1 / (RATE * STEPS_PER_SAMPLE))


def over_amplitude(bench: ibs.Campaign, model: ibs.Model) -> list[ibs.FrequencyResponse]:
    """Return the response of the mirror about z to the plate turning about z, the more nonlinear the larger it is.

    One run, perfect sensors: what differs is the module. A run starts in the linear steady state, from which the
    nonlinear one is reached in the first period; the second one counts.
    """
    run = next(run for run in bench.runs if run.name == "A ry")  # with x up, the plate's Ry is the module's Rz
    sine = excitation(every=2)
    places = np.round(sine.lines / sine.base_frequency).astype(int)
    sensor = ibs.Sensor("mirror", "rz")
    responses = []
    for times in AMPLITUDES:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ibs.SimulationWarning)  # all runs have the same step
            record = model.simulate(
                bench.base_motions(run, sine.scaled(times)),
                sensor,
                duration=2 * sine.duration,
                gravity=run.gravity,
                steps_per_sample=STEPS_PER_SAMPLE,
            )
        turned, moved = np.fft.rfft(record.signals[:, sine.n_samples :])[:, places]
        responses.append(
            ibs.FrequencyResponse(
                sine.lines, (moved / turned)[None, None], (sensor.name,), record.names[:1], ("rad/s²",), ("rad/s²",)
            )
        )
    return responses


def departures(responses: Sequence[ibs.FrequencyResponse]) -> list[float]:
    """Return how far each response is from that of the smallest amplitude, in shares of its peak."""
    first = responses[0]
    return [float(np.abs(one.response - first.response).max() / first.magnitude.max()) for one in responses]


def draw(comparison: ibs.Comparison, responses: Sequence[ibs.FrequencyResponse], folder: Path) -> list[Path]:
    """Write Y1/U6 with its region over the model, and the responses over amplitude; return the paths."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    regions = comparison.select("Y1", "U6").plot()[0, 0].figure
    regions.suptitle("Mirror module on its bench: nine runs, six inputs, one output")

    amplitudes, grid = plt.subplots(
        3, 1, sharex=True, squeeze=False, figsize=(9, 8), height_ratios=[3, 1.5, 2], layout="constrained"
    )
    first, departure = responses[0], grid[2, 0]
    for times, one in zip(AMPLITUDES, responses, strict=True):
        one.plot(grid[:2], label=f"{times * LEVEL:.3g} m/s² per line")
        if one is not first:
            change = np.abs(one.response - first.response)[0, 0] / first.magnitude.max()
            departure.semilogy(one.frequencies, change, color=grid[0, 0].lines[-1].get_color(), linewidth=1.0)
    grid[0, 0].set_title("plate turns about z → mirror turns about z", fontsize="medium")
    grid[1, 0].set_xlabel("")
    departure.set_xlabel("frequency [Hz]")
    departure.set_ylabel("away from the\nsmallest amplitude\n[share of the peak]")
    departure.grid(True, which="both", alpha=0.25, linewidth=0.5)
    amplitudes.suptitle("The same module, shaken harder: distortion at the resonance and at three times its frequency")

    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "mirror_experiment_regions.png", folder / "mirror_experiment_amplitude.png"]
    for drawn, path in zip((regions, amplitudes), paths, strict=True):
        drawn.savefig(path, dpi=120)
        plt.close(drawn)
    return paths


def main(folder: Path) -> None:
    bench, model = campaign(), hybrid(flexure())
    print(f"{bench}\n{bench.reconstruction}")
    estimate = measure(bench, model)
    comparison = ibs.compare(predict(bench, model), estimate)
    print(f"\n{estimate}\n{comparison}\n")
    # The leaf springs as rigid-body connections: what grows with amplitude here is the geometry of the mechanism.
    responses = over_amplitude(bench, rigid_bodies())
    for times, departure in zip(AMPLITUDES, departures(responses), strict=True):
        print(
            f"{times * LEVEL:5.3g} m/s² per line: {100 * departure:6.3f} % of the peak away from the smallest amplitude"
        )
    for path in draw(comparison, responses, folder):
        print(f"figure: {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "output")

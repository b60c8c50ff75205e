"""The experiment as bookkeeping: a module on a shaker in several orientations, run on the model or on the bench."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.fft

from ibsdyn.accelerometers import UNIT, Accelerometer, accelerometer_record, checked_accelerometers, motion_sensors
from ibsdyn.axes import DIRECTIONS, Array
from ibsdyn.components import Fixation, Point
from ibsdyn.engine import FlexibleMapping
from ibsdyn.errors import AnalysisError, ModelError, ModelWarning, RecordError, known_keywords, nearest, warn_user
from ibsdyn.excitation import Excitation
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.generalized_alpha import linear_frequency
from ibsdyn.model import Model
from ibsdyn.motion_reconstruction import MotionReconstruction
from ibsdyn.piezo_platform import PLATE_MOTIONS, Orientation, PiezoPlatform
from ibsdyn.records.channel_table import Channels
from ibsdyn.records.read import read_record
from ibsdyn.signals import BaseMotion
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import checked_seed, number

# Components of a motion below this share of the largest are rounding of the rotation matrix.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Run:
    """One run of a campaign.

    Attributes
    ----------
    name : orientation and motion, as "A z"; the output accelerometer too where it is moved between runs.
    orientation : how the module is mounted.
    motion : of the plate: "z", "rx" or "ry".
    base_motion : (6,) motion of the fixation, global axes, for a unit stroke of the piezo that moves most.
    gravity : (3,) as the module has it in this orientation, global axes [m/s²].
    outputs : the output accelerometers in this run.
    """

    name: str
    orientation: Orientation
    motion: str
    base_motion: tuple[float, ...]
    gravity: Point
    outputs: tuple[Accelerometer, ...]


@dataclass(frozen=True, init=False)
class Campaign:
    """All runs of an experiment: each orientation of the module, each motion of the platform.

    Parameters
    ----------
    platform : the shaker.
    orientations : one or several, of different names. Three with different axes up move the module in all its six
        directions; with three motions each they make nine runs.
    inputs : six accelerometers or more on one item, the inputs U of the responses.
    outputs : accelerometers on the module, the outputs Y.
    one_at_a_time : a single output accelerometer is moved to the place of each of ``outputs`` in turn, and all runs
        are made for each place.
    gravity : [m/s²], along the plate's -z; 0 leaves it out.

    Raises
    ------
    ModelError : names that repeat.
    AnalysisError : a motion that the inputs do not see.

    Warns
    -----
    ModelWarning : inputs that hardly see a motion, or orientations that do not move the module in all six directions.
    """

    platform: PiezoPlatform
    orientations: tuple[Orientation, ...]
    inputs: tuple[Accelerometer, ...]
    outputs: tuple[Accelerometer, ...]
    one_at_a_time: bool
    gravity: float

    @known_keywords
    def __init__(
        self,
        platform: PiezoPlatform,
        orientations: Orientation | Sequence[Orientation],
        inputs: Sequence[Accelerometer],
        outputs: Accelerometer | Sequence[Accelerometer],
        one_at_a_time: bool = False,
        gravity: float = 9.81,
    ) -> None:
        if not isinstance(platform, PiezoPlatform):
            raise ModelError(f"Campaign: platform must be an ibs.PiezoPlatform, got {platform!r}.")
        mounted = tuple(orientations) if isinstance(orientations, (list, tuple)) else (orientations,)
        for one in mounted:
            if not isinstance(one, Orientation):
                raise ModelError(f"Campaign: orientations must be ibs.Orientation, got {one!r}.")
        names = [one.name for one in mounted]
        if not names or len(set(names)) < len(names):
            raise ModelError(f"Campaign: orientations must have different names, got {names}.")
        moved, read = checked_accelerometers(inputs), checked_accelerometers(outputs)
        checked_accelerometers([*moved, *read])
        fields = {
            "platform": platform,
            "orientations": mounted,
            "inputs": moved,
            "outputs": read,
            "one_at_a_time": one_at_a_time,
            "gravity": number(gravity, "Campaign: gravity", "m/s²", minimum=0.0),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is its constructor
        self._warn_of_directions_at_rest()

    def __repr__(self) -> str:
        """Name the runs and the accelerometers."""
        return (
            f"Campaign({len(self.runs)} runs {self.runs[0].name!r} ... {self.runs[-1].name!r}; inputs "
            f"{', '.join(self.input_names)}; outputs {', '.join(self.output_names)})"
        )

    @property
    def input_names(self) -> tuple[str, ...]:
        """Channels of the inputs, for ``estimate_frf``."""
        return tuple(one.name for one in self.inputs)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Channels of the outputs, for ``estimate_frf``."""
        return tuple(one.name for one in self.outputs)

    @cached_property
    def reconstruction(self) -> MotionReconstruction:
        """The way from the input accelerometers to the six accelerations of their item."""
        return MotionReconstruction(self.inputs)

    @property
    def runs(self) -> tuple[Run, ...]:
        """The runs in order: place of the output accelerometer, orientation, motion z, rx, ry."""
        places = [(one,) for one in self.outputs] if self.one_at_a_time else [self.outputs]
        return tuple(
            Run(
                name=f"{orientation.name} {motion}" + (f", {outputs[0].name}" if self.one_at_a_time else ""),
                orientation=orientation,
                motion=motion,
                base_motion=self._base_motion(orientation, motion),
                gravity=self._gravity(orientation),
                outputs=outputs,
            )
            for outputs in places
            for orientation in self.orientations
            for motion in PLATE_MOTIONS
        )

    @known_keywords
    def simulate(
        self,
        model: Model,
        excitations: Excitation | Sequence[Excitation],
        seed: int = 0,
        flexible: FlexibleMapping = "floating-frame",
        steps_per_sample: int | None = None,
        progress: bool = True,
    ) -> list[TimeRecord]:
        """Return the records of all runs, made on the nonlinear model.

        Parameters
        ----------
        model : has the platform's fixation and the items that the accelerometers sit on.
        excitations : acceleration of the piezo that moves most [m/s²]; several are realisations, and all runs are made
            with each in turn.
        seed : of the accelerometers' noise; each run draws its own.
        flexible, steps_per_sample, progress : as of ``Model.simulate``.

        Returns
        -------
        One TimeRecord a run with the channels of the inputs, then of the outputs, in m/s², called after the run.

        Raises
        ------
        ModelError : the model has no such fixation; what ``Model.simulate`` refuses.

        Warns
        -----
        ModelWarning : a run that needs more stroke than the piezos have.
        RecordWarning : a channel that its accelerometer's range clips.
        """
        listed = tuple(excitations) if isinstance(excitations, (list, tuple)) else (excitations,)
        for excitation in listed:
            if not isinstance(excitation, Excitation):
                raise ModelError(f"Campaign.simulate: excitations must be as from ibs.multisine, got {excitation!r}.")
            self._warn_of_stroke(excitation)
        self._check(model)
        drawn = checked_seed(seed)
        records = []
        for repeat, excitation in enumerate(listed):
            for place, run in enumerate(self.runs):
                accelerometers = [*self.inputs, *run.outputs]
                motion = model.simulate(
                    self.base_motions(run, excitation),
                    motion_sensors(accelerometers),
                    gravity=run.gravity,
                    flexible=flexible,
                    steps_per_sample=steps_per_sample,
                    progress=progress,
                )
                title = run.name if len(listed) == 1 else f"{run.name}, realisation {repeat + 1}"
                records.append(
                    accelerometer_record(
                        replace(motion, title=title), accelerometers, run.gravity, seed=(drawn, repeat, place)
                    )
                )
        return records

    @known_keywords
    def read(
        self,
        paths: Mapping[str, str | os.PathLike[str]],
        channels: Channels | None = None,
        sample_rate: float | None = None,
        time: str | int | bool | None = None,
        period: int | None = None,
    ) -> list[TimeRecord]:
        """Return the records of measured runs, with the channels that ``simulate`` gives.

        Parameters
        ----------
        paths : {name of the run: file}, for all runs or some of them.
        channels, sample_rate, time, period : as of ``read_record``; further channels in the table are left out.

        Raises
        ------
        RecordError : a run that is unknown, a channel that is missing or not in m/s², runs of different sample rate.
        """
        known = {run.name: run for run in self.runs}
        if not isinstance(paths, Mapping) or not paths:
            raise RecordError(f"paths must be a dict {{name of the run: file}} of one or more, got {paths!r}.")
        records = []
        for name, path in paths.items():
            if name not in known:
                raise RecordError(f"the campaign has no run {name!r}. {nearest(str(name), known)}")
            record = read_record(path, channels, sample_rate, time, period, title=name)
            wanted = [*self.input_names, *(one.name for one in known[name].outputs)]
            chosen = record.select(wanted)
            for channel, unit in zip(chosen.names, chosen.units, strict=True):
                if unit != UNIT:
                    raise RecordError(
                        f"run {name!r}: channel {channel!r} is in {unit!r}; an accelerometer's is in {UNIT}. Give its "
                        "sensitivity in the channel table."
                    )
            records.append(chosen)
        rates = {record.title: record.sample_rate for record in records}
        if len(set(rates.values())) > 1:
            raise RecordError(f"the runs have different sample rates: {rates}; resample them to one.")
        return records

    @known_keywords
    def model_frf(
        self, model: Model, frequencies: Sequence[float] | Array, step: float | None = None
    ) -> FrequencyResponse:
        """Return what the linear model predicts for the responses of the outputs to the input accelerometers' readings.

        Parameters
        ----------
        model : has the platform's fixation and the items that the accelerometers sit on.
        frequencies : (n_freq,) [Hz], such as ``estimate.frequencies``.
        step : of the integrator [s], for comparison with a simulated campaign whose regions are narrower than the
            integrator's shift of resonances; its shift is then in the prediction too.

        Returns
        -------
        FrequencyResponse (n_out, n_inputs, n_freq), of perfect accelerometers without gravity.

        Raises
        ------
        ModelError : the model lacks the fixation or an item.
        AnalysisError : frequencies that are none, or 0 Hz, where accelerometers show nothing.

        Notes
        -----
        G = Y U^-1, with Y and U the responses of outputs and inputs to the six motions of the fixation. The integrator
        shows at f what the linear model has at tan(pi f step) / (pi step).
        """
        self._check(model)
        try:
            asked = np.atleast_1d(np.asarray(frequencies, dtype=np.float64))
        except (TypeError, ValueError):
            raise AnalysisError(f"frequencies must be numbers [Hz], got {frequencies!r}.") from None
        if (asked == 0.0).any():
            raise AnalysisError(
                "frequencies: at 0 Hz accelerometers show nothing, and a response between them is none; begin above it."
            )
        at = asked if step is None else _shown_by_integrator(asked, number(step, "step", "s", above=0.0))
        motions = [BaseMotion(self.platform.fixation, direction) for direction in DIRECTIONS]
        sensors = [one.sensor for one in (*self.inputs, *self.outputs)]
        both = model.linearize().frf(motions, sensors, at)
        count = len(self.inputs)
        U, Y = both.response[:count].transpose(2, 0, 1), both.response[count:].transpose(2, 0, 1)
        return FrequencyResponse(
            frequencies=asked,
            response=(Y @ np.linalg.pinv(U)).transpose(1, 2, 0),
            outputs=self.output_names,
            inputs=self.input_names,
            output_units=both.output_units[count:],
            input_units=both.output_units[:count],
        )

    def base_motions(self, run: Run, excitation: Excitation) -> list[tuple[BaseMotion, Excitation]]:
        """Return what moves the model's fixation in a run, for ``Model.simulate``."""
        largest = max(abs(component) for component in run.base_motion)
        return [
            (BaseMotion(self.platform.fixation, direction), excitation.scaled(component))
            for direction, component in zip(DIRECTIONS, run.base_motion, strict=True)
            if abs(component) > _ROUNDING * largest
        ]

    def _base_motion(self, orientation: Orientation, motion: str) -> tuple[float, ...]:
        plate = self.platform.motion(self.platform.strokes(motion))
        return tuple(float(component) for component in orientation.base_motion(plate))

    def _gravity(self, orientation: Orientation) -> Point:
        x, y, z = (float(component) for component in orientation.in_module((0.0, 0.0, -self.gravity)))
        return x, y, z

    def _check(self, model: Model) -> Fixation:
        if not isinstance(model, Model):
            raise ModelError(f"Campaign: model must be an ibs.Model, got {model!r}.")
        item = model.items.get(self.platform.fixation)
        if not isinstance(item, Fixation):
            known = [name for name, one in model.items.items() if isinstance(one, Fixation)]
            raise ModelError(
                f"{model.name}: {self.platform.fixation!r}, which stands on the platform, is no fixation of it. "
                f"{nearest(self.platform.fixation, known)}"
            )
        return item

    def _warn_of_directions_at_rest(self) -> None:
        moved = np.array([run.base_motion for run in self.runs])
        # Rotations and translations compared by what they do at the inputs.
        readings = self.reconstruction.matrix @ moved.T
        rank = int(np.linalg.matrix_rank(readings, tol=1e-6 * float(np.linalg.norm(readings, 2))))
        if rank < 6:
            warn_user(
                f"the {len(self.orientations)} orientations move the module in {rank} of its six directions; responses "
                "to six inputs need all of them. Mount it with x, y and z up in turn.",
                ModelWarning,
            )

    def _warn_of_stroke(self, excitation: Excitation) -> None:
        if not excitation.is_periodic:
            return
        lines = np.asarray(scipy.fft.rfft(excitation.samples))
        omega = 2 * np.pi * excitation.resolution * np.arange(len(lines))
        lines[0] = 0.0
        lines[1:] /= -(omega[1:] ** 2)
        needed = float(np.ptp(scipy.fft.irfft(lines, excitation.n_samples)))
        if needed > self.platform.stroke:
            warn_user(
                f"{excitation.name} needs a stroke of {1e6 * needed:.3g} µm, the piezos have "
                f"{1e6 * self.platform.stroke:.3g} µm; the simulation goes on, a bench would not. Lower the "
                "amplitude at low frequencies: stroke grows with 1/f².",
                ModelWarning,
            )


def _shown_by_integrator(frequencies: Array, step: float) -> Array:
    if (frequencies * step >= 0.5).any():
        raise AnalysisError(
            f"a step of {step:g} s shows frequencies below {0.5 / step:g} Hz, not {frequencies.max():g} Hz."
        )
    return linear_frequency(frequencies, step)

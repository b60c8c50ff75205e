"""The nonlinear model integrated in time by Exudyn's generalised-alpha method with a constant step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii  # noqa: N813  # Exudyn's own abbreviation
import numpy as np

from ibsdyn.assembly import Assembly, Joint
from ibsdyn.axes import Array, is_rotation, rotate_six
from ibsdyn.components import FlexibleBody, Inertia1D, RigidBody
from ibsdyn.engine.translation import FlexibleMapping, Translation, checked_mapping, silent, spring_frame
from ibsdyn.engine.turning_damping import TurningDamping
from ibsdyn.errors import SimulationError
from ibsdyn.generalized_alpha import SPECTRAL_RADIUS
from ibsdyn.signals import Force, Stroke, Torque, load_column

# Newton's iteration in a step ends at this share of the step's first residual: looser, the errors of a large rotation
# add up (1e-5 gave 1e-4 rad in three swings). It also ends at an unbalanced force that the caller derives from
# rounding: with Exudyn's fixed one small motions halve the step in silence, or pass for no motion at all.
RELATIVE_TOLERANCE = 1e-9
# How often a run is looked after.
REPORTS = 200
# Dense factors of more coordinates than this cost more than sparse ones.
SPARSE_SIZE = 50
# Damping follows bodies that have turned by this [rad] since it last did: of what it brakes wrongly no more is left.
# Whether they have is looked at every so many steps until they do, then in each.
TURN, LOOK = 1e-3, 8
# A coordinate beyond this [m, rad] is a run that diverges; no machine of this toolbox is a kilometre long.
BLOW_UP = 1e3

# What sets a parameter of an Exudyn item (its first argument), the parameter's name, and its values over the steps.
Setter = tuple[Callable[[int, str, Any], Any], int, str, Any]


@dataclass(frozen=True, eq=False)
class BaseDrive:
    """The displacement of one coordinate of a fixation over the steps.

    Attributes
    ----------
    fixation, coordinate : its name, and which of its coordinates (in a 1-D model 0).
    values : (n,) at the steps 0, 1, ... [m or rad]; after the last one it begins again.
    """

    fixation: str
    coordinate: int
    values: Array


@dataclass(frozen=True, eq=False)
class LoadDrive:
    """A force, a torque or a stroke over the steps.

    Attributes
    ----------
    signal : where it acts.
    values : (n,) at the steps 0, 1, ... [its unit]; after the last one it begins again.
    """

    signal: Force | Torque | Stroke
    values: Array


@dataclass(frozen=True, eq=False)
class StartState:
    """Displacements, velocities and accelerations of all coordinates of an assembly at step 0, each (N,)."""

    displacement: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class TimeIntegration:
    """A model that is ready to run.

    Attributes
    ----------
    assembly : coordinates and joints.
    flexible : how flexible bodies are represented.
    damping : (N, N) viscous matrix over all coordinates, beyond the explicit dampers.
    turning_damping : the same as a function of where rigid bodies have turned; None where it stays as it is.
    gravity : (3,) acceleration of gravity [m/s²].
    drives : what moves it.
    recorded : items whose coordinates are kept, and up to which derivative: a rigid body, a fixation, a flexible body;
        an interface in small deflection.
    """

    assembly: Assembly
    flexible: FlexibleMapping
    damping: Array
    turning_damping: TurningDamping | None
    gravity: Array
    drives: Sequence[BaseDrive | LoadDrive]
    recorded: Mapping[str, int]

    def run(
        self,
        start: StartState,
        step: float,
        steps_per_sample: int,
        n_samples: int,
        tolerance: float,
        report: Callable[[int], None],
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Integrate, from the static equilibrium under gravity displaced by a start state.

        Parameters
        ----------
        step : [s].
        steps_per_sample, n_samples : the first sample is the start state itself.
        tolerance : unbalanced force that a step may leave [N, N·m].
        report : called now and then with the number of steps made.

        Returns
        -------
        First, by recorded item (orders, n_samples, n): its coordinates and as many time derivatives as asked for. Six
        (x, y, z and the angles of R = Rx Ry Rz) of what is rigid; of a flexible body in small deflection those of its
        reduced matrices; in a floating frame position and Euler parameters of the frame and deformations, all minus
        their values in the undeformed state.
        Second, by item (3,): how far it turned from its undeformed state about x, y and z at most, as far as was looked
        [rad]. Of a flexible body the interface or the frame that turned most.

        Raises
        ------
        ModelError : a flexible body that cannot have a floating frame.
        SimulationError : the run stalls or diverges.
        EngineError : Exudyn refuses the model.
        """
        checked_mapping(self.flexible)
        with silent():
            run = _Run(self)
            run.set_start(start)
            run.integrate(step, steps_per_sample, n_samples, tolerance, report)
            return {name: run.coordinates(name, n_samples) for name in self.recorded}, run.turned()


class _Run:
    """One Exudyn system, from its translation to the coordinates that come out."""

    def __init__(self, task: TimeIntegration) -> None:
        self.task = task
        self.assembly = task.assembly
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        points = [
            (drive.signal.item, self._point(drive.signal))
            for drive in task.drives
            if isinstance(drive, LoadDrive) and drive.signal.item not in self.assembly.sensor_points
        ]
        self.system = Translation(self.assembly, self.mbs, task.flexible, points)
        self.setters = self._hold_fixations()
        for joint in self.assembly.joints:
            if joint.locks.size:
                self._add_lock(joint)
        self.follow_turning = self._add_damping()
        self._add_gravity()
        self.setters += [self._setter(drive) for drive in task.drives if isinstance(drive, LoadDrive)]
        self.sensors: dict[int, list[int]] = {}
        for name, order in task.recorded.items():
            for node in self._nodes_of(name):
                self._add_sensors(node, order)
        self.mbs.Assemble()
        if self.follow_turning is not None:
            self.rigid_rows = self.system.rigid_rows()
        turning = [] if self.assembly.axis is not None else self.system.rotation_rows()
        self.turning = [name for name, _ in turning]
        self.turning_rows = np.array([rows for _, rows in turning], dtype=int).reshape(-1, 3)
        self.largest_turns = np.zeros((len(turning), 3))

    def _point(self, signal: Force | Torque | Stroke) -> Array:
        if isinstance(signal, Force) and signal.position is not None:
            return np.array(signal.position)
        return self.assembly.frames.get(signal.item, np.zeros(3))

    # -- what acts besides springs

    def _hold_fixations(self) -> list[Setter]:
        """Hold the fixations; return what moves the coordinates that are driven."""
        setters: list[Setter] = []
        if not self.assembly.fixations:
            return setters
        ground = self.mbs.AddNode(eii.NodePointGround())
        size = len(self.assembly.directions)
        for fixation in self.assembly.fixations:
            node = self.system.nodes[fixation.name]
            markers = [self.mbs.AddMarker(eii.MarkerNodeCoordinates(nodeNumber=n)) for n in (ground, node)]
            position = np.r_[np.array(fixation.position), np.zeros(3)] if size == 6 else np.zeros(1)
            moving = {
                drive.coordinate: drive.values
                for drive in self.task.drives
                if isinstance(drive, BaseDrive) and drive.fixation == fixation.name
            }
            # One constraint of many coordinates is several times cheaper than one each. It holds positions, which round
            # at the size of the model: what stands still may, and what moves about zero; the others have constraints
            # of displacements.
            held = [k for k in range(size) if k not in moving]
            if held:
                self._constrain(markers, held, position)
            for length in dict.fromkeys(len(values) for values in moving.values()):
                together = [k for k in moving if position[k] == 0.0 and len(moving[k]) == length]
                if together:
                    rows = np.column_stack([moving.pop(k) for k in together])
                    constraint = self._constrain(markers, together, position)
                    setters.append((self.mbs.SetObjectParameter, constraint, "offset", rows))
            for k, values in moving.items():
                alone = eii.ObjectConnectorCoordinate(
                    markerNumbers=[self.system.coordinate_marker(n, c) for n, c in ((ground, 0), (node, k))]
                )
                setters.append((self.mbs.SetObjectParameter, self.mbs.AddObject(alone), "offset", _numbers(values)))
        return setters

    def _constrain(self, markers: list[int], coordinates: list[int], position: Array) -> int:
        """Hold some coordinates of the second marker at their position."""
        scaling = np.eye(len(position))[coordinates]
        return int(
            self.mbs.AddObject(
                eii.ObjectConnectorCoordinateVector(
                    markerNumbers=markers, scalingMarker1=scaling, offset=position[coordinates]
                )
            )
        )

    def _add_lock(self, joint: Joint) -> None:
        markers = self.system.joint_markers(joint)
        if self.assembly.axis is not None:
            self.mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=markers))
            return
        axes = joint.connection.axes_matrix
        self.mbs.AddObject(
            eii.ObjectJointGeneric(
                markerNumbers=markers,
                constrainedAxes=[int(locked) for locked in joint.connection.locked],
                rotationMarker0=axes,
                rotationMarker1=axes,
            )
        )

    def _add_damping(self) -> Callable[[float], bool] | None:
        """Add the damping of the ratios; return what lets it follow bodies that turn."""
        if not self.task.damping.any():
            return None
        nodes, from_nodes = self.system.from_nodes(list(self.assembly.items))
        dampers = self.mbs.AddObject(
            eii.ObjectGenericODE2(nodeNumbers=nodes, dampingMatrix=from_nodes.T @ self.task.damping @ from_nodes)
        )
        turning = self.task.turning_damping
        if turning is None:
            return None
        last = np.zeros((len(nodes), 3))

        def follow(step: float) -> bool:
            """Bring the damping to where the bodies will be at the end of the step, if they have turned."""
            nonlocal last
            now = np.asarray(self.mbs.systemData.GetODE2Coordinates())[self.rigid_rows]
            if np.abs(now[:, 3:] - last).max() < TURN:
                return False
            ahead = now + step * np.asarray(self.mbs.systemData.GetODE2Coordinates_t())[self.rigid_rows]
            self.mbs.SetObjectParameter(dampers, "dampingMatrix", turning.matrix(ahead))
            last = now[:, 3:]
            return True

        return follow

    def _add_gravity(self) -> None:
        gravity = self.task.gravity
        if not gravity.any():
            return
        for body in self.assembly.bodies:
            if isinstance(body, Inertia1D):
                assert self.assembly.axis is not None
                if not is_rotation(self.assembly.axis):
                    marker = self.system.coordinate_marker(self.system.nodes[body.name], 0)
                    pull = body.inertia * gravity["xyz".index(self.assembly.axis)]
                    self.mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=pull))
            elif isinstance(body, FlexibleBody) and self.task.flexible == "small-deflection":
                reduced = body.reduced
                vector = reduced.M @ reduced.rigid_body_motion[:, :3] @ gravity
                nodes, from_nodes = self.system.from_nodes([body.name])
                weight = from_nodes[self.assembly.places[body.name]].T @ vector
                self.mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, forceVector=weight))
            elif isinstance(body, (RigidBody, FlexibleBody)):
                mass = self.mbs.AddMarker(eii.MarkerBodyMass(bodyNumber=self.system.objects[body.name]))
                self.mbs.AddLoad(eii.LoadMassProportional(markerNumber=mass, loadVector=gravity))

    # -- drives

    def _setter(self, drive: LoadDrive) -> Setter:
        """Return what sets a load to its values."""
        set_object, set_load = self.mbs.SetObjectParameter, self.mbs.SetLoadParameter
        signal = drive.signal
        if isinstance(signal, Stroke):
            spring = self.system.springs[signal.item]
            if self.assembly.axis is not None:
                return set_object, spring, "offset", _numbers(drive.values)
            joint = next(joint for joint in self.assembly.joints if joint.name == signal.item)
            offset = rotate_six(spring_frame(joint)).T @ signal.six_vector(joint)
            return set_object, spring, "offset", np.outer(drive.values, offset)
        if self.assembly.axis is not None:
            marker = self.system.coordinate_marker(self.system.nodes[signal.item], 0)
            load = self.mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=0.0))
            return set_load, load, "load", _numbers(drive.values)
        watched = self.assembly.sensor_points.get(signal.item)
        body = self.assembly.items.get(signal.item if watched is None else watched[0])
        if isinstance(body, FlexibleBody):
            return self._whole_body_load(body, signal, drive.values)
        marker = self.system.marker(signal.item, self._point(signal))
        kind = eii.LoadForceVector if isinstance(signal, Force) else eii.LoadTorqueVector
        load = self.mbs.AddLoad(kind(markerNumber=marker))
        return set_load, load, "loadVector", np.outer(drive.values, signal.vector)

    def _whole_body_load(self, body: FlexibleBody, signal: Force | Torque, values: Array) -> Setter:
        """A load on all of a flexible body's mass or on a sensor point: an object of its own that has only forces.

        It is linear: in a floating frame it keeps the body's undeformed directions while the body turns.
        """
        nodes, from_nodes = self.system.from_nodes([body.name])
        forces = from_nodes.T @ load_column(signal, self.assembly)
        item = self.mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, forceVector=np.zeros(len(forces))))
        return self.mbs.SetObjectParameter, item, "forceVector", _Scaled(values, forces)

    # -- start

    def set_start(self, start: StartState) -> None:
        """Set the initial values: static equilibrium plus a small displacement, velocities, accelerations."""
        data, initial = self.mbs.systemData, exu.ConfigurationType.Initial
        to_raw = self.system.to_raw()
        displacement, velocity, acceleration = (
            to_raw @ part for part in (start.displacement, start.velocity, start.acceleration)
        )
        if self.task.gravity.any():
            displacement = displacement + self._static_equilibrium()
        for rows in self.system.euler_parameter_rows():
            self._normalise(rows, displacement, velocity, acceleration)
        data.SetODE2Coordinates(displacement.tolist(), initial)
        data.SetODE2Coordinates_t(velocity.tolist(), initial)
        data.SetODE2Coordinates_tt(acceleration.tolist(), initial)

    def _static_equilibrium(self) -> Array:
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.staticSolver.verboseMode = 0
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        try:
            done = self.mbs.SolveStatic(settings)
        except (exu.ExudynError, RuntimeError, ValueError, SystemError) as error:
            raise SimulationError(f"no static equilibrium under gravity {self.task.gravity} m/s²: {error}") from error
        found = np.array(self.mbs.systemData.GetODE2Coordinates())
        if not done or not np.isfinite(found).all() or np.abs(found).max(initial=0.0) > BLOW_UP:
            raise SimulationError(
                f"no static equilibrium under gravity {self.task.gravity.tolist()} m/s²: does a connection carry every "
                "body in every direction, and stiffly enough?"
            )
        return found

    @staticmethod
    def _normalise(rows: Sequence[int], displacement: Array, velocity: Array, acceleration: Array) -> None:
        """Give Euler parameters unit length and the derivatives that keep it."""
        first, rest = rows[0], list(rows[1:])
        vector = displacement[rest]
        scalar = np.sqrt(1.0 - vector @ vector)
        displacement[first] = -(vector @ vector) / (1.0 + scalar)  # scalar - 1 without cancellation
        velocity[first] = -(vector @ velocity[rest]) / scalar
        spin = velocity[rest] @ velocity[rest] + velocity[first] ** 2
        acceleration[first] = -(vector @ acceleration[rest] + spin) / scalar

    # -- run

    def integrate(
        self, step: float, steps_per_sample: int, n_samples: int, tolerance: float, report: Callable[[int], None]
    ) -> None:
        """Make all steps; raise where Exudyn does not."""
        n_steps = steps_per_sample * (n_samples - 1)
        if n_steps == 0:
            raise SimulationError("the run has one sample only; ask for a longer duration.")
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.numberOfSteps = n_steps
        integration.endTime = n_steps * step
        integration.adaptiveStep = False
        integration.newton.relativeTolerance = RELATIVE_TOLERANCE
        integration.newton.absoluteTolerance = tolerance
        integration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
        integration.generalizedAlpha.computeInitialAccelerations = False  # they are the start state's
        integration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = steps_per_sample * step
        if self.mbs.systemData.ODE2Size() > SPARSE_SIZE:
            settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        made = 0
        setters = [(*setter, len(setter[-1])) for setter in self.setters]
        every = max(1, n_steps // REPORTS)
        trouble: list[BaseException] = []
        follow, look = self.follow_turning, LOOK

        def before_step(mbs: Any, time: float) -> bool:
            nonlocal made, look
            try:
                if follow is not None and made % look == 0 and follow(step):
                    look = 1
                made += 1
                for set_parameter, item, parameter, values, length in setters:
                    set_parameter(item, parameter, values[made % length])
                if made % every == 0:
                    self._look_after(made, step, time)
                    report(made)
            except BaseException as error:  # Exudyn would turn it, Ctrl-C too, into an error of its own
                trouble.append(error)
                return False
            return True

        self.mbs.SetPreStepUserFunction(before_step)
        failure = ""
        try:
            if not self.mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha):
                failure = "the solver gave up"
        except (exu.ExudynError, RuntimeError, ValueError, SystemError) as error:
            failure = str(error).strip().splitlines()[0] if str(error).strip() else "the solver gave up"
        if trouble:
            raise trouble[0]
        if failure or made != n_steps:
            raise SimulationError(
                f"the run stopped at {made * step:.6g} s of {n_steps * step:.6g} s, in step {made} of {n_steps}: "
                f"Newton's iteration found no equilibrium there ({failure or 'steps are missing'}). Likely causes: an "
                "excitation that is far too large for the model, a rotation near 90° about y, a mechanism without "
                "stiffness, or a step that is too long; try a smaller amplitude or more steps_per_sample."
            )

    def _look_after(self, made: int, step: float, time: float) -> None:
        if abs(time - made * step) > 0.5 * step:
            raise SimulationError(
                f"Exudyn changed the step: it is at {time:.9g} s where step {made} ends at {made * step:.9g} s; please "
                "report the model."
            )
        coordinates = np.asarray(self.mbs.systemData.GetODE2Coordinates())
        largest = np.abs(coordinates).max(initial=0.0)
        if not largest < BLOW_UP:
            raise SimulationError(
                f"the run diverges: at {time:.6g} s a coordinate has reached {largest:.3g} m or rad. Likely causes: an "
                "excitation that is far too large, a body that nothing holds, a step that is too long for the "
                "stiffness; try a smaller amplitude or more steps_per_sample."
            )
        np.maximum(self.largest_turns, np.abs(coordinates[self.turning_rows]), out=self.largest_turns)

    def turned(self) -> dict[str, Array]:
        """Return how far items turned; see ``TimeIntegration.run``."""
        furthest: dict[str, Array] = {}
        for name, turns in zip(self.turning, self.largest_turns, strict=True):
            # Euler parameters are half the angles.
            angles = 2.0 * turns if name in self.system.floating_nodes else turns
            furthest[name] = np.maximum(furthest.get(name, 0.0), angles)
        return furthest

    # -- what comes out

    def _nodes_of(self, name: str) -> list[int]:
        return [self.system.nodes[name]] if "." in name else self.system.item_nodes(name)

    def _add_sensors(self, node: int, order: int) -> None:
        kinds = (
            exu.OutputVariableType.Coordinates,
            exu.OutputVariableType.Coordinates_t,
            exu.OutputVariableType.Coordinates_tt,
        )
        kept = self.sensors.setdefault(node, [])
        for kind in kinds[len(kept) : order + 1]:
            sensor = eii.SensorNode(nodeNumber=node, outputVariableType=kind, storeInternal=True, writeToFile=False)
            kept.append(self.mbs.AddSensor(sensor))

    def coordinates(self, name: str, n_samples: int) -> Array:
        """Return an item's coordinates; see ``TimeIntegration.run``."""
        order = self.task.recorded[name]
        stored = np.concatenate([self._stored(node, order, n_samples) for node in self._nodes_of(name)], axis=2)
        if not np.isfinite(stored).all():
            first = int(np.flatnonzero(~np.isfinite(stored).all(axis=(0, 2)))[0])
            raise SimulationError(f"the run gave values that are not finite from sample {first} on, at {name!r}.")
        return stored

    def _stored(self, node: int, order: int, n_samples: int) -> Array:
        kept = (np.asarray(self.mbs.GetSensorStoredData(sensor), dtype=float) for sensor in self.sensors[node])
        stored = np.stack([values[:, 1:] for values in kept][: order + 1])
        if stored.shape[1] != n_samples:
            raise SimulationError(
                f"Exudyn kept {stored.shape[1]} samples where {n_samples} were asked for; please report the model."
            )
        return stored


def _numbers(values: Array) -> memoryview:
    # A memory view gives Python's own floats, several times faster than an array gives NumPy's.
    return memoryview(np.ascontiguousarray(values, dtype=float).data)


@dataclass(frozen=True, eq=False)
class _Scaled:
    """A vector times a factor at each step, made when it is asked for: all of them would fill the memory."""

    factors: Array
    vector: Array

    def __len__(self) -> int:
        return len(self.factors)

    def __getitem__(self, step: int) -> Array:
        scaled: Array = self.factors[step] * self.vector
        return scaled

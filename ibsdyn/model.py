"""The bookkeeping: a list of components that becomes a linear system."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeVar

from fem_import import ReducedBody
from ibsdyn.assembly import Assembly
from ibsdyn.axes import DIRECTIONS, is_rotation
from ibsdyn.components import (
    Connection,
    Fixation,
    FlexibleBody,
    Inertia1D,
    Item,
    Point,
    RigidBody,
    checked_axes,
    damping_values,
    scalar_damping,
    scalar_stiffness,
    stiffness_values,
)
from ibsdyn.disturbances import AnyDisturbance, checked_disturbances
from ibsdyn.engine import FlexibleMapping
from ibsdyn.errors import ModelError, UnknownNameError, known_keywords, nearest, warn_user
from ibsdyn.linear_system import LinearSystem, linearize
from ibsdyn.model_check import HIGH_ZETA, findings, high_zeta_words, signal_findings
from ibsdyn.model_table import component_table
from ibsdyn.parameters import changed_components, model_parameters
from ibsdyn.replacement import replaced_connections
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.signals import Input, Output, checked_inputs, checked_outputs
from ibsdyn.simulation import Excitations, simulate
from ibsdyn.time_record import TimeRecord
from ibsdyn.validation import checked_names, number, point, valid_name

_Entry = TypeVar("_Entry", Input, Output, AnyDisturbance, Requirement)


class Model:
    """A machine as a list of fixations, bodies and connections, with what acts on it, is measured and required.

    Two models are equal if all that is in them is, in the same order; a model can change and has no hash.

    Parameters
    ----------
    name : what results and reports call it.
    axis : None for a 3-D model; one of x, y, z, rx, ry, rz for a 1-D concept along that direction.

    Raises
    ------
    ModelError : no name, or an axis that is none of the six.
    """

    @known_keywords
    def __init__(self, name: str, axis: str | None = None) -> None:
        if not isinstance(name, str) or not name.strip():
            raise ModelError(f"the model's name must be a non-empty text, got {name!r}.")
        if axis is not None and axis not in DIRECTIONS:
            raise ModelError(f"model {name!r}: axis {axis!r} is not known. {nearest(str(axis), DIRECTIONS)}")
        self.name = name
        self.axis = axis
        self._items: dict[str, Item] = {}
        self._connections: dict[str, Connection] = {}
        self._inputs: dict[str, Input] = {}
        self._sensors: dict[str, Output] = {}
        self._disturbances: dict[str, AnyDisturbance] = {}
        self._requirements: dict[str, Requirement] = {}

    # -- what is in it

    @property
    def items(self) -> Mapping[str, Item]:
        """Fixations and bodies by name, in the order in which they were added."""
        return MappingProxyType(self._items)

    @property
    def connections(self) -> Mapping[str, Connection]:
        """Connections by name, in the order in which they were added."""
        return MappingProxyType(self._connections)

    @property
    def inputs(self) -> Mapping[str, Input]:
        """Forces, torques and motions of fixations by name, in the order in which they were added."""
        return MappingProxyType(self._inputs)

    @property
    def sensors(self) -> Mapping[str, Output]:
        """Sensors by name, in the order in which they were added."""
        return MappingProxyType(self._sensors)

    @property
    def disturbances(self) -> Mapping[str, AnyDisturbance]:
        """Disturbances by name, in the order in which they were added."""
        return MappingProxyType(self._disturbances)

    @property
    def requirements(self) -> Mapping[str, Requirement]:
        """Requirements by name, in the order in which they were added."""
        return MappingProxyType(self._requirements)

    def __repr__(self) -> str:
        """Name the model and count its components."""
        kind = "3-D" if self.axis is None else f"1-D along {self.axis}"
        return f"Model({self.name!r}, {kind}, {len(self._items)} items, {len(self._connections)} connections)"

    def __str__(self) -> str:
        """Return the table of components with units."""
        return component_table(self.name, self.axis, self._items, self._connections)

    def copy(self, name: str | None = None) -> Model:
        """Return a model of its own with the same components, optionally under another name."""
        twin = Model(self.name if name is None else name, self.axis)
        twin._items = copy.copy(self._items)
        twin._connections = copy.copy(self._connections)
        for own, copied in zip(self._registries(), twin._registries(), strict=True):
            copied.update(own)
        return twin

    def __eq__(self, other: object) -> bool:
        """Tell whether another model has the same name, axis and content in the same order, to the last digit."""
        if not isinstance(other, Model):
            return NotImplemented
        if (self.name, self.axis) != (other.name, other.axis):
            return False
        return all(
            list(own.items()) == list(others.items()) for own, others in zip(self._parts(), other._parts(), strict=True)
        )

    __hash__ = None  # type: ignore[assignment]  # how Python says that what can change has no hash

    # -- as a file

    @classmethod
    @known_keywords
    def from_toml(cls, path: str | os.PathLike[str], allow_outside: bool = False) -> Model:
        """Read a model file.

        Parameters
        ----------
        path : of the TOML file; docs/model_file.md says what can stand in it.
        allow_outside : let its paths lead out of its folder; only for files that you trust.

        Raises
        ------
        MissingFileError : it is not there.
        ModelFileError : what is wrong with it; the message has file, table and key.
        """
        from ibsdyn.model_files import read_model  # here: the reader needs this class

        return read_model(path, allow_outside)

    @known_keywords
    def to_toml(self, path: str | os.PathLike[str]) -> None:
        """Write the model as a file that ``from_toml`` reads back to an equal model, whole or not at all.

        Parameters
        ----------
        path : of the TOML file. Where there is a model file already, its comments, parameters and expressions stay
            wherever the model still has their values. Flexible bodies are written beside it as .npz, named by their
            content, unless the file has an export that is still theirs.

        Raises
        ------
        ModelFileError : the file cannot be written, or a requirement has a quantity of the user's own.

        Warns
        -----
        ModelWarning : comments and expressions of the file that was there could not be kept.
        """
        from ibsdyn.model_files import write_model  # here: the writer needs this class

        write_model(self, path)

    @known_keywords
    def add_table(self, path: str | os.PathLike[str], kind: str | None = None) -> None:
        """Add the components of a CSV file or spreadsheet: a row each, columns by name, units in brackets.

        Parameters
        ----------
        path : .csv (or other text with commas, semicolons or tabs), or .xlsx with all its sheets;
            docs/model_file.md lists the columns.
        kind : "fixation", "rigid_body", "flexible_body" or "connection", where neither a column ``kind`` nor the
            name of the sheet says it; by default told by the columns.

        Raises
        ------
        MissingFileError : it is not there.
        ModelFileError : what is wrong in which line; the model stays as it was.
        ExtraMissingError : a spreadsheet, and openpyxl is not installed.

        Warns
        -----
        ModelWarning : a text that is not UTF-8.
        """
        from ibsdyn.model_files.component_tables import with_table  # here: the reader needs this class

        grown = with_table(self, path, kind)
        self._items, self._connections = grown._items, grown._connections

    # -- components

    @known_keywords
    def fixation(self, name: str, position: Sequence[float] = (0.0, 0.0, 0.0)) -> Fixation:
        """Add a fixation, still unless an analysis moves it.

        Parameters
        ----------
        name : its name; no dots.
        position : (3,) centre of rotation, global axes [m].

        Raises
        ------
        ModelError : a name that is taken or none, a wrong position.
        """
        fixation = Fixation.of(name, position)
        self._require_new(fixation.name)
        self._items[fixation.name] = fixation
        return fixation

    @known_keywords
    def rigid_body(
        self,
        name: str,
        mass: float | None = None,
        cog: Sequence[float] | None = None,
        inertia: Sequence[float] | float | None = None,
        products: str = "tensor",
    ) -> RigidBody | Inertia1D:
        """Add a rigid body.

        Parameters
        ----------
        name : its name; no dots.
        mass : [kg].
        cog : (3,) centre of gravity, global axes [m].
        inertia : Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the CoG, global axes [kg m²]. In a 1-D model one number:
            ``mass`` on a translation axis, ``inertia`` on a rotation axis.
        products : "tensor" if Ixy = -integral(x y dm) (the element of the tensor), "integral" if the CAD program
            prints +integral(x y dm).

        Raises
        ------
        ModelError : a name that is taken, a missing, wrong or impossible value.
        """
        body: RigidBody | Inertia1D
        if self.axis is None:
            body = RigidBody.of(name, mass, cog, inertia, products)
        else:
            if cog is not None:
                raise ModelError(f"rigid body {name!r}: a 1-D model along {self.axis} has no cog; leave it out.")
            body = Inertia1D.of(name, mass, inertia, self.axis)
        self._require_new(body.name)
        self._items[body.name] = body
        return body

    @known_keywords
    def flexible_body(self, name: str, reduced: ReducedBody, zeta: float = 0.0) -> FlexibleBody:
        """Add a flexible body; connect to its interfaces as ``"name.interface"``.

        Parameters
        ----------
        name : its name; no dots.
        reduced : from ``fem_import.reduce``; its positions are in the model's global frame.
        zeta : relative damping ratio; an exported damping matrix replaces it.

        Raises
        ------
        ModelError : a name that is taken, something that is no reduced body, a negative ratio, a 1-D model.
        """
        body = FlexibleBody.of(name, reduced, zeta)
        if self.axis is not None:
            raise ModelError(
                f"flexible body {name!r}: the model is 1-D along {self.axis}; flexible bodies need a 3-D model, "
                "ibs.Model(name) without axis."
            )
        self._require_new(body.name)
        _warn_zeta(body.zeta, f"flexible body {body.name!r}")
        self._items[body.name] = body
        return body

    @known_keywords
    def connection(
        self,
        name: str,
        item1: str,
        item2: str,
        position1: Sequence[float] | None = None,
        position2: Sequence[float] | None = None,
        stiffness: Sequence[float] | float | None = None,
        zeta: float = 0.0,
        axes: Sequence[Sequence[float]] | None = None,
        damping: Sequence[float] | float | None = None,
        elastic_centre: Sequence[float] | None = None,
    ) -> Connection:
        """Add a spring/damper between two items.

        Parameters
        ----------
        name : its name; no dots.
        item1, item2 : a body, a fixation, or an interface of a flexible body as ``"flexure.tip"``.
        position1, position2 : (3,) interface position on each, global axes [m]. An interface's own frame is its
            default; one that is missing is taken from the other end.
        stiffness : kx, ky, kz [N/m], kxx, kyy, kzz [N·m/rad] along ``axes`` at the elastic centre; ``math.inf``
            locks a direction, 0 leaves it free. One number in a 1-D model.
        zeta : relative damping ratio; the connection's loss factor is 2 zeta.
        axes : 3x3 rotation whose columns are the local axes; global axes if None.
        damping : cx, cy, cz [N·s/m], cxx, cyy, czz [N·m·s/rad] explicit dampers, in place of zeta.
        elastic_centre : (3,) where the stiffness is diagonal [m]; half way between the positions if None.

        Raises
        ------
        UnknownNameError : an item that is not in the model.
        ModelError : any other value that cannot be right.
        """
        what = f"connection {valid_name(name, 'connection')!r}"
        self._require_new(name)
        ends = (self._end(item1, f"{what}: item1"), self._end(item2, f"{what}: item2"))
        if ends[0] == ends[1]:
            raise ModelError(f"{what}: it connects {ends[0]!r} to itself; name two different items.")
        if all(isinstance(self._items.get(end), Fixation) for end in ends):
            raise ModelError(f"{what}: both {ends[0]!r} and {ends[1]!r} are fixations; nothing could move.")
        if stiffness is None:
            raise ModelError(f"{what}: stiffness= is missing.")
        ratio = number(zeta, f"{what}: zeta", "", minimum=0.0)
        if self.axis is None:
            positions = self._positions(ends, (position1, position2), what)
            connection = Connection(
                name,
                *ends,
                *positions,
                stiffness=stiffness_values(stiffness, what),
                zeta=ratio,
                axes=checked_axes(axes, what),
                damping=None if damping is None else damping_values(damping, what),
                elastic_centre=None if elastic_centre is None else point(elastic_centre, f"{what}: elastic_centre"),
            )
        else:
            placed = (position1, position2, axes, elastic_centre)
            for value, label in zip(placed, ("position1", "position2", "axes", "elastic_centre"), strict=True):
                if value is not None:
                    raise ModelError(f"{what}: a 1-D model along {self.axis} has no {label}; leave it out.")
            unit = "N·m/rad" if is_rotation(self.axis) else "N/m"
            connection = Connection(
                name,
                *ends,
                None,
                None,
                stiffness=scalar_stiffness(stiffness, what, unit),
                zeta=ratio,
                damping=None if damping is None else scalar_damping(damping, what),
            )
        _warn_zeta(ratio, what)
        self._connections[name] = connection
        return connection

    # -- what acts on it, what is measured, what is required

    @known_keywords
    def add_input(self, signal: Input) -> Input:
        """Register a Force, Torque or BaseMotion under its name, for the model file, budgets and reports.

        Parameters
        ----------
        signal : the input; that its item exists is checked when it is used, and by ``check()``.

        Raises
        ------
        ModelError : no input, or a name that is taken.
        """
        (checked,) = checked_inputs(signal)
        return self._register(self._inputs, checked)

    @known_keywords
    def add_sensor(self, sensor: Output) -> Output:
        """Register a sensor under its name, for the model file, budgets and reports.

        Parameters
        ----------
        sensor : Sensor or CombinedSensor; that its item exists is checked when it is used, and by ``check()``.

        Raises
        ------
        ModelError : no sensor, or a name that is taken.
        """
        (checked,) = checked_outputs(sensor)
        return self._register(self._sensors, checked)

    @known_keywords
    def add_disturbance(self, disturbance: AnyDisturbance) -> AnyDisturbance:
        """Register a disturbance under its name, for the model file, budgets and reports.

        Parameters
        ----------
        disturbance : Disturbance, CorrelatedDisturbance or Tone.

        Raises
        ------
        ModelError : no disturbance, or a name that is taken.
        """
        (checked,) = checked_disturbances(disturbance)
        return self._register(self._disturbances, checked)

    @known_keywords
    def add_requirement(self, requirement: Requirement) -> Requirement:
        """Register a requirement under its name; ``check_requirements()`` tells whether it is met.

        Parameters
        ----------
        requirement : an ``ibs.Requirement``.

        Raises
        ------
        ModelError : no requirement, or a name that is taken.
        """
        if not isinstance(requirement, Requirement):
            raise ModelError(f"add_requirement takes an ibs.Requirement, got {requirement!r}.")
        return self._register(self._requirements, requirement)

    def remove(self, name: str) -> None:
        """Take a component, an input, a sensor, a disturbance or a requirement out of the model.

        Raises
        ------
        UnknownNameError : it is not in the model.
        ModelError : connections still hold on to it.
        """
        for registry in (self._connections, *self._registries()):
            if name in registry:
                del registry[name]
                return
        if name not in self._items:
            known = [*self._names(), *self._registered_names()]
            raise UnknownNameError(f"remove: {name!r} is not in the model. {nearest(str(name), known)}")
        holding = [c.name for c in self._connections.values() if name in (_body(c.item1), _body(c.item2))]
        if holding:
            raise ModelError(
                f"remove: {name!r} is still connected by {', '.join(map(repr, holding))}; remove those first."
            )
        del self._items[name]

    @known_keywords
    def replace_with_flexible(
        self,
        name: str,
        reduced: ReducedBody,
        zeta: float | None = None,
        parts: Sequence[str] | None = None,
        interfaces: Mapping[str, str] | None = None,
    ) -> FlexibleBody:
        """Put a flexible body in the place of a rigid body, of a connection, or of several of them.

        Connections of the bodies that are replaced keep their names, positions and values and hold on to the
        interface nearest to their position. A connection that is replaced itself leaves the interface locked to what
        it was connected to, by a new connection named as in ``flexure-base``.

        Parameters
        ----------
        name : the rigid body or the connection that is replaced; with ``parts`` the name of the flexible body.
        reduced : from ``fem_import.reduce``.
        zeta : relative damping ratio; by default that of the connection replaced, else 0.
        parts : all bodies and connections that the flexible body stands for; connections between them vanish.
        interfaces : which interface takes what: by name of the connection that holds on, or of the item that is
            locked to it; the nearest one for all that are not named.

        Raises
        ------
        UnknownNameError : nothing of that name in the model.
        ModelError : no reduced body, no such interface, or one that is not told apart; the model stays as it was.
        """
        if self.axis is not None:
            raise ModelError(f"replace_with_flexible: the model is 1-D along {self.axis}; it needs a 3-D model.")
        what = f"replace_with_flexible {name!r}"
        replaced = checked_names([name] if parts is None else parts, f"{what}: parts")
        if interfaces is not None and not isinstance(interfaces, Mapping):
            raise ModelError(
                f"{what}: interfaces must be a dict {{connection or item: interface}}, got {interfaces!r}."
            )
        for part in replaced:
            if part not in self._items and part not in self._connections:
                raise UnknownNameError(f"{what}: {part!r} is not in the model. {nearest(part, self._names())}")
            if part in self._items and not isinstance(self._items[part], RigidBody):
                kind = "a fixation" if isinstance(self._items[part], Fixation) else "flexible already"
                raise ModelError(f"{what}: {part!r} is {kind}; it takes rigid bodies and connections.")
        bodies = {part for part in replaced if part in self._items}
        named = [part for part in replaced if part in self._connections]
        if not bodies and len(named) != 1:
            raise ModelError(f"{what}: parts {named} are connections only; name the bodies between them too.")
        if name not in replaced:
            self._require_new(name)
        if zeta is None:
            zeta = 0.0 if bodies else self._connections[named[0]].zeta
        body = FlexibleBody.of(name, reduced, zeta)
        connections = replaced_connections(body, bodies, named, self._connections, interfaces or {})
        for tie in connections.keys() - self._connections.keys():
            self._require_new(tie)
        _warn_zeta(body.zeta, f"flexible body {name!r}")
        for part in named:
            if self._connections[part].damping is not None:
                warn_user(f"{what}: the explicit damping of connection {part!r} goes with it; give zeta= for the part.")
        # Nothing has been touched so far; from here nothing can fail.
        items: dict[str, Item] = {}
        for key, item in self._items.items():
            items[name if key in bodies else key] = body if key in bodies else item
        self._items = items | {name: body}
        self._connections = connections
        return body

    # -- parameters

    def parameters(self) -> dict[str, float]:
        """Return every number of the components by address, as ``{"mirror.mass": 0.25, "mount.kx": 1e6, ...}``, SI."""
        known = model_parameters(self._items, self._connections, self.axis)
        return {address: parameter.value for address, parameter in known.items()}

    def with_parameters(self, values: Mapping[str, float]) -> Model:
        """Return a model of its own in which some numbers are others.

        Parameters
        ----------
        values : new values by address, as ``{"mirror.mass": 0.3, "mount.position1.x": 0.01}``, SI; ``parameters()``
            lists the addresses.

        Raises
        ------
        UnknownNameError : an address that the model does not have.
        ModelError : a value that the component cannot have.
        """
        twin = self.copy()
        twin._items, twin._connections = changed_components(self._items, self._connections, self.axis, values)
        return twin

    # -- analyses

    def check(self) -> list[str]:
        """Return in words what looks wrong or is worth knowing; raises nothing, empty if all is well."""
        found = findings(self.axis, self._items, self._connections)
        if any(not isinstance(item, Fixation) for item in self._items.values()):
            found += signal_findings(self.assembly(), self._inputs, self._sensors, self._disturbances)
        return found

    def check_requirements(self) -> tuple[RequirementResult, ...]:
        """Return for every requirement whether the model meets it, in the order in which they were added.

        Raises
        ------
        ModelError : an empty model, or a requirement on something that the model does not have.
        """
        if not self._requirements:
            return ()
        system = self.linearize()
        return tuple(requirement.check(system) for requirement in self._requirements.values())

    @known_keywords
    def linearize(self, flexible: FlexibleMapping = "small-deflection") -> LinearSystem:
        """Return the linear system about the undeformed state, out of Exudyn's Jacobians.

        Parameters
        ----------
        flexible : how Exudyn represents flexible bodies: "small-deflection", or "floating-frame" as large motions
            need it; linearised the two agree.

        Raises
        ------
        ModelError : an empty model, or locks that contradict each other.
        EngineError : Exudyn refuses the model.
        AnalysisError : an unstable part.
        """
        return linearize(self.assembly(), flexible)

    @known_keywords
    def simulate(
        self,
        excitations: Excitations,
        sensors: Output | Sequence[Output],
        duration: float | None = None,
        sample_rate: float | None = None,
        start: str | None = None,
        gravity: Sequence[float] | None = None,
        flexible: FlexibleMapping = "floating-frame",
        steps_per_sample: int | None = None,
        progress: bool = True,
    ) -> TimeRecord:
        """Return the record of a nonlinear run in Exudyn: the excitations' channels, then the sensors'.

        Parameters
        ----------
        excitations : {input: excitation} or pairs of them. Input: Force, Torque, Stroke or BaseMotion. Excitation: as
            from ``multisine``, or plain samples (n,) at ``sample_rate``; its unit is that of the input.
        sensors : one or several.
        duration : [s]; by default that of the excitations with all their periods.
        sample_rate : of the record [Hz]; by default the highest of the excitations.
        start : "steady", in the linear steady state of a periodic excitation (the default for such), or "rest": bodies
            at rest relative to their base.
        gravity : (gx, gy, gz) [m/s²]; the run then starts about the static equilibrium under it.
        flexible : "floating-frame" (large rigid motion) or "small-deflection" (faster, the reduced matrices as they
            are) for flexible bodies.
        steps_per_sample : of the integrator. By default enough to shift the highest excited frequency by less than
            0.025 % and the modes in band by less than 1 % of their damping ratio.
        progress : show a progress bar where there is a terminal.

        Raises
        ------
        ModelError : an input or sensor that the model does not have.
        ExcitationError : a signal that does not fit the run.
        SimulationError : no equilibrium, a run that stalls or diverges, locks that repeat each other.

        Warns
        -----
        SimulationWarning : steps that are too coarse; a periodic base acceleration with a mean; flexible bodies that
            turn further than small deflection, or damping ratios beside them, allow.

        Notes
        -----
        Sensors show motion along global directions: displacement of a point from where it is undeformed (the sag under
        gravity is part of it), the rotation vector of a body, angular velocity and acceleration; relative_to subtracts
        the motion of the other item at the same point. Forces keep their global direction and act on their point as it
        moves. A fixation turns by R = Rx Ry Rz. Damping ratios act as in the linear system; what they brake turns along
        with rigid bodies, but not in models with flexible bodies, where explicit dampers do. The integrator
        (generalised-alpha) shows at f what the linear model has at
        tan(pi f h)/(pi h), h being the step.
        """
        return simulate(
            self.assembly(),
            self.name,
            excitations,
            sensors,
            duration,
            sample_rate,
            start,
            gravity,
            flexible,
            steps_per_sample,
            progress,
        )

    def assembly(self) -> Assembly:
        """Return the coordinates and joints of the model as it stands.

        Raises
        ------
        ModelError : no body in it.
        """
        if not any(not isinstance(item, Fixation) for item in self._items.values()):
            raise ModelError(f"model {self.name!r} is empty: add at least one rigid or flexible body.")
        return Assembly(self._items, self._connections, self.axis)

    # -- bookkeeping

    def _names(self) -> list[str]:
        return [*self._items, *self._connections]

    def _registries(self) -> tuple[dict[str, Any], ...]:
        return self._inputs, self._sensors, self._disturbances, self._requirements

    def _parts(self) -> tuple[dict[str, Any], ...]:
        return self._items, self._connections, *self._registries()

    def _registered_names(self) -> list[str]:
        return [name for registry in self._registries() for name in registry]

    def _register(self, registry: dict[str, _Entry], entry: _Entry) -> _Entry:
        self._require_new(entry.name)
        registry[entry.name] = entry
        return entry

    def _addresses(self) -> list[str]:
        addresses: list[str] = []
        for name, item in self._items.items():
            if isinstance(item, FlexibleBody):
                addresses += [f"{name}.{interface}" for interface in item.reduced.interfaces]
            else:
                addresses.append(name)
        return addresses

    def _require_new(self, name: str) -> None:
        if name in self._items or name in self._connections:
            raise ModelError(f"the name {name!r} is taken; every component of model {self.name!r} needs its own.")
        if any(name in registry for registry in self._registries()):
            raise ModelError(
                f"the name {name!r} is taken; inputs, sensors, disturbances and requirements of model {self.name!r} "
                "need names of their own, by name= where they are made."
            )

    def _end(self, item: object, what: str) -> str:
        if not isinstance(item, str):
            raise ModelError(f"{what} must be the name of an item, as 'mirror' or 'flexure.tip', got {item!r}.")
        body = self._items.get(_body(item))
        if isinstance(body, FlexibleBody):
            if "." not in item:
                known = ", ".join(repr(f"{item}.{interface}") for interface in body.reduced.interfaces)
                raise ModelError(f"{what}: {item!r} is a flexible body; connect to one of its interfaces: {known}.")
            body.interface(item.split(".", 1)[1])
            return item
        if item not in self._items:
            raise UnknownNameError(f"{what}: {item!r} is not in the model. {nearest(item, self._addresses())}")
        return item

    def _positions(
        self, ends: Sequence[str], given: Sequence[Sequence[float] | None], what: str
    ) -> tuple[Point, Point]:
        found: list[Point | None] = []
        for i, (end, value) in enumerate(zip(ends, given, strict=True), 1):
            if value is not None:
                found.append(point(value, f"{what}: position{i}"))
            else:
                found.append(self._frame(end) if "." in end else None)
        first = found[0] if found[0] is not None else found[1]
        second = found[1] if found[1] is not None else found[0]
        if first is None or second is None:
            raise ModelError(
                f"{what}: give position1= or position2= [m], where it meets {ends[0]!r} and {ends[1]!r}; one is "
                "enough where both are the same."
            )
        return first, second

    def _frame(self, address: str) -> Point:
        body, interface = address.split(".", 1)
        item = self._items[body]
        assert isinstance(item, FlexibleBody)
        x, y, z = (float(v) for v in item.reduced.interfaces[interface].position)
        return x, y, z


def _body(address: str) -> str:
    return address.split(".", 1)[0]


def _warn_zeta(zeta: float, what: str) -> None:
    if zeta > HIGH_ZETA:
        warn_user(f"{what}: {high_zeta_words(zeta)}")

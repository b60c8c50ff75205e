"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.errors import (
    AnalysisError,
    EngineError,
    ExcitationError,
    IbsdynError,
    ModelError,
    ModelWarning,
    RecordError,
    RecordWarning,
    SimulationError,
    SimulationWarning,
    UnknownKeywordError,
    UnknownNameError,
)
from ibsdyn.excitation import Excitation, burst_random, random_noise, swept_sine
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.multisine import Multisine, band_lines, multisine, orthogonal_multisines
from ibsdyn.requirements import required_stiffness
from ibsdyn.signals import BaseMotion, Force, Sensor, Stroke, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord

__all__ = [
    "AnalysisError",
    "BaseMotion",
    "Connection",
    "EngineError",
    "Excitation",
    "ExcitationError",
    "Fixation",
    "FlexibleBody",
    "Force",
    "FrequencyResponse",
    "IbsdynError",
    "Inertia1D",
    "LinearSystem",
    "Model",
    "ModelError",
    "ModelWarning",
    "Modes",
    "Multisine",
    "RecordError",
    "RecordWarning",
    "RigidBody",
    "Sensor",
    "SimulationError",
    "SimulationWarning",
    "StateSpace",
    "Stroke",
    "TimeRecord",
    "Torque",
    "UnknownKeywordError",
    "UnknownNameError",
    "band_lines",
    "burst_random",
    "multisine",
    "orthogonal_multisines",
    "random_noise",
    "required_stiffness",
    "swept_sine",
]

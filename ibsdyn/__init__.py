"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.budget import VibrationBudget, vibration_budget
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.disturbances import CorrelatedDisturbance, Disturbance, Tone
from ibsdyn.errors import (
    AnalysisError,
    EngineError,
    ExpressionError,
    ExtraMissingError,
    IbsdynError,
    MissingFileError,
    ModelError,
    ModelFileError,
    ModelWarning,
    RecordError,
    RecordWarning,
    UnknownKeywordError,
    UnknownNameError,
)
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.psd import PSD
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt, RmsResponse
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.requirements import required_stiffness
from ibsdyn.signals import BaseMotion, Force, Sensor, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord
from ibsdyn.vibration_environments import floor_vibration, launch_vibration

__all__ = [
    "PSD",
    "AnalysisError",
    "BaseMotion",
    "Connection",
    "CorrelatedDisturbance",
    "Disturbance",
    "EngineError",
    "ExpressionError",
    "ExtraMissingError",
    "Fixation",
    "FlexibleBody",
    "Force",
    "FrequencyResponse",
    "IbsdynError",
    "Inertia1D",
    "LinearSystem",
    "MissingFileError",
    "ModeDamping",
    "ModeFrequency",
    "Model",
    "ModelError",
    "ModelFileError",
    "ModelWarning",
    "Modes",
    "PeakResponse",
    "Quantity",
    "RecordError",
    "RecordWarning",
    "Requirement",
    "RequirementResult",
    "ResponseAt",
    "RigidBody",
    "RmsResponse",
    "Sensor",
    "StateSpace",
    "TimeRecord",
    "Tone",
    "Torque",
    "UnknownKeywordError",
    "UnknownNameError",
    "VibrationBudget",
    "floor_vibration",
    "launch_vibration",
    "required_stiffness",
    "vibration_budget",
]

"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
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
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.requirements import required_stiffness
from ibsdyn.signals import BaseMotion, Force, Sensor, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord

__all__ = [
    "AnalysisError",
    "BaseMotion",
    "Connection",
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
    "Sensor",
    "StateSpace",
    "TimeRecord",
    "Torque",
    "UnknownKeywordError",
    "UnknownNameError",
    "required_stiffness",
]

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
    StudyError,
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
from ibsdyn.sampling import Samples, Tolerance, full_factorial, latin_hypercube, monte_carlo, one_at_a_time, variants
from ibsdyn.sensitivity import response_sensitivities, sensitivities
from ibsdyn.sensitivity_results import ResponseSensitivities, Sensitivities
from ibsdyn.signals import BaseMotion, Force, Sensor, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.study import Study
from ibsdyn.study_results import FailedVariant, Odds, StudyResults
from ibsdyn.time_record import TimeRecord

__all__ = [
    "AnalysisError",
    "BaseMotion",
    "Connection",
    "EngineError",
    "ExpressionError",
    "ExtraMissingError",
    "FailedVariant",
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
    "Odds",
    "PeakResponse",
    "Quantity",
    "RecordError",
    "RecordWarning",
    "Requirement",
    "RequirementResult",
    "ResponseAt",
    "ResponseSensitivities",
    "RigidBody",
    "Samples",
    "Sensitivities",
    "Sensor",
    "StateSpace",
    "Study",
    "StudyError",
    "StudyResults",
    "TimeRecord",
    "Tolerance",
    "Torque",
    "UnknownKeywordError",
    "UnknownNameError",
    "full_factorial",
    "latin_hypercube",
    "monte_carlo",
    "one_at_a_time",
    "required_stiffness",
    "response_sensitivities",
    "sensitivities",
    "variants",
]

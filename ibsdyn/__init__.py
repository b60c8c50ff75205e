"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.comparison import Comparison, compare
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.errors import (
    AnalysisError,
    EngineError,
    ExpressionError,
    ExtraMissingError,
    HistoryError,
    HistoryWarning,
    IbsdynError,
    MissingFileError,
    ModelError,
    ModelFileError,
    ModelWarning,
    RecordError,
    RecordWarning,
    ReportError,
    UnknownKeywordError,
    UnknownNameError,
)
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification import DetectionLines, FrfEstimate, estimate_frf
from ibsdyn.history import Difference, History, Revision
from ibsdyn.linear_system import LinearSystem
from ibsdyn.modal_estimation import ModalEstimate, estimate_modes
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt
from ibsdyn.report import report
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.requirements import required_stiffness
from ibsdyn.signals import BaseMotion, Force, Sensor, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord

__all__ = [
    "Difference",
    "History",
    "HistoryError",
    "HistoryWarning",
    "ReportError",
    "Revision",
    "report",
    "AnalysisError",
    "BaseMotion",
    "Comparison",
    "Connection",
    "DetectionLines",
    "EngineError",
    "ExpressionError",
    "ExtraMissingError",
    "Fixation",
    "FlexibleBody",
    "Force",
    "FrequencyResponse",
    "FrfEstimate",
    "IbsdynError",
    "Inertia1D",
    "LinearSystem",
    "MissingFileError",
    "ModalEstimate",
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
    "compare",
    "estimate_frf",
    "estimate_modes",
    "required_stiffness",
]

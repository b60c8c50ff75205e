"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.accelerometers import Accelerometer, accelerometer_record, bracket, motion_sensors
from ibsdyn.budget import VibrationBudget, vibration_budget
from ibsdyn.comparison import Comparison, compare
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.disturbances import CorrelatedDisturbance, Disturbance, Tone
from ibsdyn.errors import (
    AnalysisError,
    EngineError,
    ExcitationError,
    ExpressionError,
    ExtraMissingError,
    HistoryError,
    HistoryWarning,
    IbsdynError,
    MissingFileError,
    MissingRecordError,
    ModelError,
    ModelFileError,
    ModelWarning,
    RecordError,
    RecordWarning,
    ReportError,
    SimulationError,
    SimulationWarning,
    UnknownKeywordError,
    UnknownNameError,
)
from ibsdyn.excitation import Excitation, burst_random, random_noise, swept_sine
from ibsdyn.experiment import Campaign, Run
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.history import Difference, History, Revision
from ibsdyn.identification import DetectionLines, FrfEstimate, estimate_frf
from ibsdyn.linear_system import LinearSystem
from ibsdyn.modal_estimation import ModalEstimate, estimate_modes
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.motion_reconstruction import MotionReconstruction
from ibsdyn.multisine import Multisine, band_lines, multisine, orthogonal_multisines
from ibsdyn.piezo_platform import Orientation, PiezoPlatform
from ibsdyn.psd import PSD
from ibsdyn.quantities import ModeDamping, ModeFrequency, PeakResponse, Quantity, ResponseAt, RmsResponse
from ibsdyn.records.channel_table import Channel
from ibsdyn.records.read import read_record
from ibsdyn.reporting import report
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.requirements import required_stiffness
from ibsdyn.signals import BaseMotion, Force, Sensor, Stroke, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord
from ibsdyn.vibration_environments import floor_vibration, launch_vibration

__all__ = [
    "PSD",
    "Accelerometer",
    "AnalysisError",
    "BaseMotion",
    "Campaign",
    "Channel",
    "Comparison",
    "Connection",
    "CorrelatedDisturbance",
    "DetectionLines",
    "Difference",
    "Disturbance",
    "EngineError",
    "Excitation",
    "ExcitationError",
    "ExpressionError",
    "ExtraMissingError",
    "Fixation",
    "FlexibleBody",
    "Force",
    "FrequencyResponse",
    "FrfEstimate",
    "History",
    "HistoryError",
    "HistoryWarning",
    "IbsdynError",
    "Inertia1D",
    "LinearSystem",
    "MissingFileError",
    "MissingRecordError",
    "ModalEstimate",
    "ModeDamping",
    "ModeFrequency",
    "Model",
    "ModelError",
    "ModelFileError",
    "ModelWarning",
    "Modes",
    "MotionReconstruction",
    "Multisine",
    "Orientation",
    "PeakResponse",
    "PiezoPlatform",
    "Quantity",
    "RecordError",
    "RecordWarning",
    "ReportError",
    "Requirement",
    "RequirementResult",
    "ResponseAt",
    "Revision",
    "RigidBody",
    "RmsResponse",
    "Run",
    "Sensor",
    "SimulationError",
    "SimulationWarning",
    "StateSpace",
    "Stroke",
    "TimeRecord",
    "Tone",
    "Torque",
    "UnknownKeywordError",
    "UnknownNameError",
    "VibrationBudget",
    "accelerometer_record",
    "band_lines",
    "bracket",
    "burst_random",
    "compare",
    "estimate_frf",
    "estimate_modes",
    "floor_vibration",
    "launch_vibration",
    "motion_sensors",
    "multisine",
    "orthogonal_multisines",
    "random_noise",
    "read_record",
    "report",
    "required_stiffness",
    "swept_sine",
    "vibration_budget",
]

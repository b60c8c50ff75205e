"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.accelerometers import Accelerometer, accelerometer_record, bracket, motion_sensors
from ibsdyn.comparison import Comparison, compare
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.errors import (
    AnalysisError,
    EngineError,
    IbsdynError,
    MissingRecordError,
    ModelError,
    ModelWarning,
    RecordError,
    RecordWarning,
    UnknownKeywordError,
    UnknownNameError,
)
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification import DetectionLines, FrfEstimate, estimate_frf
from ibsdyn.linear_system import LinearSystem
from ibsdyn.model import Model
from ibsdyn.modes import Modes
from ibsdyn.motion_reconstruction import MotionReconstruction
from ibsdyn.records.channel_table import Channel
from ibsdyn.records.read import read_record
from ibsdyn.requirements import required_stiffness
from ibsdyn.signals import BaseMotion, Force, Sensor, Torque
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord

__all__ = [
    "Accelerometer",
    "AnalysisError",
    "BaseMotion",
    "Channel",
    "Comparison",
    "Connection",
    "DetectionLines",
    "EngineError",
    "Fixation",
    "FlexibleBody",
    "Force",
    "FrequencyResponse",
    "FrfEstimate",
    "IbsdynError",
    "Inertia1D",
    "LinearSystem",
    "MissingRecordError",
    "Model",
    "ModelError",
    "ModelWarning",
    "Modes",
    "MotionReconstruction",
    "RecordError",
    "RecordWarning",
    "RigidBody",
    "Sensor",
    "StateSpace",
    "TimeRecord",
    "Torque",
    "UnknownKeywordError",
    "UnknownNameError",
    "accelerometer_record",
    "bracket",
    "compare",
    "estimate_frf",
    "motion_sensors",
    "read_record",
    "required_stiffness",
]

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
    IbsdynError,
    InterchangeError,
    MissingFileError,
    MissingRecordError,
    ModelError,
    ModelFileError,
    ModelWarning,
    RecordError,
    RecordWarning,
    SimulationError,
    SimulationWarning,
    UnknownKeywordError,
    UnknownNameError,
)
from ibsdyn.excitation import Excitation, burst_random, random_noise, swept_sine
from ibsdyn.experiment import Campaign, Run
from ibsdyn.flexures import (
    FlexureStiffness,
    cross_flexure,
    cross_flexure_rotation,
    guide_shortening,
    leaf_spring,
    notch_hinge,
    parallel_guide,
)
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.identification import DetectionLines, FrfEstimate, estimate_frf
from ibsdyn.interchange import read_frf, write_frf, write_matrices, write_modes
from ibsdyn.linear_system import LinearSystem
from ibsdyn.mirror_optics import BeamPath, FlatMirror
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
from ibsdyn.records.write import write_record
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.signals import BaseMotion, CombinedSensor, Force, Sensor, Stroke, Torque
from ibsdyn.sizing import (
    StiffnessShares,
    distribute_stiffness,
    mirror_deflection,
    required_frequency,
    required_stiffness,
)
from ibsdyn.state_space import StateSpace
from ibsdyn.time_record import TimeRecord
from ibsdyn.vibration_environments import floor_vibration, launch_vibration

__all__ = [
    "PSD",
    "Accelerometer",
    "AnalysisError",
    "BaseMotion",
    "BeamPath",
    "Campaign",
    "Channel",
    "CombinedSensor",
    "Comparison",
    "Connection",
    "CorrelatedDisturbance",
    "DetectionLines",
    "Disturbance",
    "EngineError",
    "Excitation",
    "ExcitationError",
    "ExpressionError",
    "ExtraMissingError",
    "Fixation",
    "FlatMirror",
    "FlexibleBody",
    "FlexureStiffness",
    "Force",
    "FrequencyResponse",
    "FrfEstimate",
    "IbsdynError",
    "Inertia1D",
    "InterchangeError",
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
    "Requirement",
    "RequirementResult",
    "ResponseAt",
    "RigidBody",
    "RmsResponse",
    "Run",
    "Sensor",
    "SimulationError",
    "SimulationWarning",
    "StateSpace",
    "StiffnessShares",
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
    "cross_flexure",
    "cross_flexure_rotation",
    "distribute_stiffness",
    "estimate_frf",
    "estimate_modes",
    "floor_vibration",
    "guide_shortening",
    "launch_vibration",
    "leaf_spring",
    "mirror_deflection",
    "motion_sensors",
    "multisine",
    "notch_hinge",
    "orthogonal_multisines",
    "parallel_guide",
    "random_noise",
    "read_frf",
    "read_record",
    "required_frequency",
    "required_stiffness",
    "swept_sine",
    "vibration_budget",
    "write_frf",
    "write_matrices",
    "write_modes",
    "write_record",
]

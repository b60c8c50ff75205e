"""Dynamics of precision machines by bookkeeping: components in, modes and frequency responses out."""

from ibsdyn.accelerometers import Accelerometer, accelerometer_record, bracket, motion_sensors
from ibsdyn.budget import VibrationBudget, vibration_budget
from ibsdyn.comparison import Comparison, compare
from ibsdyn.components import Connection, Fixation, FlexibleBody, Inertia1D, RigidBody
from ibsdyn.cross_check import CrossCheck, cross_check
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
    InterchangeError,
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
    StudyError,
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
from ibsdyn.history import Difference, History, Revision
from ibsdyn.identification import DetectionLines, FrfEstimate, estimate_frf
from ibsdyn.interchange import read_frf, write_frf, write_matrices, write_modes
from ibsdyn.linear_system import LinearSystem
from ibsdyn.measured import MeasuredFrequencies, MeasuredResponse
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
from ibsdyn.reporting import report
from ibsdyn.requirement import Requirement, RequirementResult
from ibsdyn.sampling import Samples, Tolerance, full_factorial, latin_hypercube, monte_carlo, one_at_a_time, variants
from ibsdyn.sensitivity import response_sensitivities, sensitivities
from ibsdyn.sensitivity_results import ResponseSensitivities, Sensitivities
from ibsdyn.shock import ShockSpectrum, half_sine, shock_response_spectrum, transient_response
from ibsdyn.signals import BaseMotion, CombinedSensor, Force, Sensor, Stroke, Torque
from ibsdyn.sizing import (
    StiffnessShares,
    distribute_stiffness,
    mirror_deflection,
    required_frequency,
    required_stiffness,
)
from ibsdyn.state_space import StateSpace
from ibsdyn.study import Study
from ibsdyn.study_results import FailedVariant, Odds, StudyResults
from ibsdyn.time_record import TimeRecord
from ibsdyn.updating import Fit, fit
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
    "CrossCheck",
    "DetectionLines",
    "Difference",
    "Disturbance",
    "EngineError",
    "Excitation",
    "ExcitationError",
    "ExpressionError",
    "ExtraMissingError",
    "FailedVariant",
    "Fit",
    "Fixation",
    "FlatMirror",
    "FlexibleBody",
    "FlexureStiffness",
    "Force",
    "FrequencyResponse",
    "FrfEstimate",
    "History",
    "HistoryError",
    "HistoryWarning",
    "IbsdynError",
    "Inertia1D",
    "InterchangeError",
    "LinearSystem",
    "MeasuredFrequencies",
    "MeasuredResponse",
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
    "Odds",
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
    "ResponseSensitivities",
    "Revision",
    "RigidBody",
    "RmsResponse",
    "Run",
    "Samples",
    "Sensitivities",
    "Sensor",
    "ShockSpectrum",
    "SimulationError",
    "SimulationWarning",
    "StateSpace",
    "StiffnessShares",
    "Stroke",
    "Study",
    "StudyError",
    "StudyResults",
    "TimeRecord",
    "Tolerance",
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
    "cross_check",
    "cross_flexure",
    "cross_flexure_rotation",
    "distribute_stiffness",
    "estimate_frf",
    "estimate_modes",
    "fit",
    "floor_vibration",
    "full_factorial",
    "guide_shortening",
    "half_sine",
    "latin_hypercube",
    "launch_vibration",
    "leaf_spring",
    "mirror_deflection",
    "monte_carlo",
    "motion_sensors",
    "multisine",
    "notch_hinge",
    "one_at_a_time",
    "orthogonal_multisines",
    "parallel_guide",
    "random_noise",
    "read_frf",
    "read_record",
    "report",
    "required_frequency",
    "required_stiffness",
    "response_sensitivities",
    "sensitivities",
    "shock_response_spectrum",
    "swept_sine",
    "transient_response",
    "variants",
    "vibration_budget",
    "write_frf",
    "write_matrices",
    "write_modes",
    "write_record",
]

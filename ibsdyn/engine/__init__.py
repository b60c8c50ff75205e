"""The multibody engine: a model translated to Exudyn, linearised or integrated in time; the only importer of Exudyn."""

import os

# Exudyn reads a settings file from the user's home on import unless told otherwise.
os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")

from ibsdyn.engine.linearization import FullMatrices, linearized_matrices
from ibsdyn.engine.time_integration import BaseDrive, LoadDrive, StartState, TimeIntegration
from ibsdyn.engine.translation import FlexibleMapping, checked_mapping
from ibsdyn.engine.turning_damping import TurningDamping

__all__ = [
    "BaseDrive",
    "FlexibleMapping",
    "FullMatrices",
    "LoadDrive",
    "StartState",
    "TimeIntegration",
    "TurningDamping",
    "checked_mapping",
    "linearized_matrices",
]

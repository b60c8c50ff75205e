"""An FEA export in, a reduced body out.

part = fi.read("flexure.inp")
print(part.report())
body = fi.reduce(part, interfaces={"base": "BASE", "tip": "TIP"}, max_frequency=2000.0)
"""

from fem_import.display import DisplayMesh
from fem_import.effective_mass import EffectiveMasses, effective_masses
from fem_import.errors import (
    ExportError,
    ExportWarning,
    FemImportError,
    InterfaceError,
    MissingFileError,
    ReductionError,
    UnknownKeywordError,
    UnknownNameError,
)
from fem_import.export_report import ExportReport
from fem_import.fe_model import FEModel
from fem_import.inertia_integrals import InertiaIntegrals
from fem_import.interfaces import Interface
from fem_import.mode_check import ModeCheck, mode_check
from fem_import.readers import (
    read,
    read_abaqus,
    read_abaqus_substructure,
    read_ansys,
    read_ansys_substructure,
    read_calculix,
    read_matlab,
    read_matrix_market,
    read_nastran,
    read_nastran_superelement,
    read_npz,
)
from fem_import.reduced_body import InterfaceFrame, ReducedBody, SensorPoint
from fem_import.reduction import reduce
from fem_import.selection import Box, Cylinder, Plane
from fem_import.tie_comparison import TieComparison, compare_ties

__all__ = [
    "Box",
    "Cylinder",
    "DisplayMesh",
    "EffectiveMasses",
    "ExportError",
    "ExportReport",
    "ExportWarning",
    "FEModel",
    "FemImportError",
    "InertiaIntegrals",
    "Interface",
    "InterfaceError",
    "InterfaceFrame",
    "MissingFileError",
    "ModeCheck",
    "Plane",
    "ReducedBody",
    "ReductionError",
    "SensorPoint",
    "TieComparison",
    "UnknownKeywordError",
    "UnknownNameError",
    "compare_ties",
    "effective_masses",
    "mode_check",
    "read",
    "read_abaqus",
    "read_abaqus_substructure",
    "read_ansys",
    "read_ansys_substructure",
    "read_calculix",
    "read_matlab",
    "read_matrix_market",
    "read_nastran",
    "read_nastran_superelement",
    "read_npz",
    "reduce",
]

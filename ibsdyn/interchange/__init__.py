"""Results out to other programs, and frequency responses in from them."""

from ibsdyn.interchange.frf_files import read_frf, write_frf
from ibsdyn.interchange.matlab import write_matrices
from ibsdyn.interchange.mode_files import write_modes

__all__ = ["read_frf", "write_frf", "write_matrices", "write_modes"]

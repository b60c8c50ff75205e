"""Frequency responses out of records, with the region in which the true response lies."""

from ibsdyn.identification.estimation import estimate_frf
from ibsdyn.identification.frf_estimate import DetectionLines, FrfEstimate

__all__ = ["DetectionLines", "FrfEstimate", "estimate_frf"]

"""MATLAB's .mat files (version 5): matrices of a linear system, state space, frequency responses."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from fem_import.whole_file import whole_file
from ibsdyn.errors import InterchangeError, known_keywords
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.linear_system import LinearSystem
from ibsdyn.signals import Input, Output


@known_keywords
def write_matrices(
    system: LinearSystem,
    path: str | os.PathLike[str],
    inputs: Input | Sequence[Input] | None = None,
    outputs: Output | Sequence[Output] | None = None,
) -> None:
    """Write M, C, K of a linear system for MATLAB, and its state space for some inputs and outputs.

    Parameters
    ----------
    system : from ``model.linearize()``.
    path : ending in .mat. It gets M, C, K, M_base, C_base, K_base, and cell arrays coordinates, base_coordinates; with
        inputs and outputs a struct ss of A, B, C, D, StateName, InputName, OutputName, InputUnit, OutputUnit:
        ``sys = ss(s.ss.A, s.ss.B, s.ss.C, s.ss.D, 'InputName', s.ss.InputName)`` after ``s = load(...)``.
    inputs, outputs : of the state space; both or neither.

    Raises
    ------
    InterchangeError : another ending, or inputs without outputs.
    ModelError, AnalysisError : as ``system.to_state_space``.
    OSError : the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".mat":
        raise InterchangeError(f"{target.name}: matrices are written for MATLAB; let the path end in .mat.")
    if (inputs is None) != (outputs is None):
        raise InterchangeError("write_matrices: give inputs= and outputs= for a state space, or neither.")
    content: dict[str, Any] = {name: getattr(system, name) for name in ("M", "C", "K", "M_base", "C_base", "K_base")}
    content |= {name: _cells(getattr(system, name)) for name in ("coordinates", "base_coordinates")}
    if inputs is not None and outputs is not None:
        space = system.to_state_space(inputs, outputs)
        content["ss"] = {
            **{name: getattr(space, name) for name in "ABCD"},
            "StateName": _cells(space.states),
            "InputName": _cells(space.inputs),
            "OutputName": _cells(space.outputs),
            "InputUnit": _cells(space.input_units),
            "OutputUnit": _cells(space.output_units),
        }
    with whole_file(target) as temporary:
        scipy.io.savemat(temporary, content)


def write_frf_mat(response: FrequencyResponse, path: Path) -> None:
    """Write H (n_out, n_in, n_freq), frequencies [Hz], names and units: ``frd(s.H, 2*pi*s.frequencies)``."""
    content = {
        "H": response.response,
        "frequencies": response.frequencies,
        "outputs": _cells(response.outputs),
        "inputs": _cells(response.inputs),
        "output_units": _cells(response.output_units),
        "input_units": _cells(response.input_units),
    }
    scipy.io.savemat(path, content)


def _cells(texts: Sequence[str]) -> np.ndarray:
    cells = np.empty((len(texts), 1), dtype=object)
    cells[:, 0] = texts
    return cells

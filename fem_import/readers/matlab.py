"""MATLAB .mat files with matrices and tables by agreed names, COMSOL's among them."""

from __future__ import annotations

import importlib
import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError, UnknownKeywordError, nearest_known, refuse_unknown_names
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.readers.matlab_5 import parse_matlab_5
from fem_import.readers.named_arrays import MATRICES, SET_PREFIX, TABLES, model_of_arrays
from fem_import.readers.packed_file import read_bytes

PathLike: TypeAlias = "str | os.PathLike[str]"

HDF5 = b"\x89HDF\r\n\x1a\n"
_HDF5_AT = (0, 512)  # MATLAB puts a text of 512 bytes in front
_HARMLESS = 1 << 30
_RATIO = 200
# What h5py raises for a damaged file is not documented and comes from many places.
_DAMAGED = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, MemoryError, RuntimeError, OSError)


@known_keywords(UnknownKeywordError)
def read_matlab(
    path: PathLike,
    *,
    units: str | None = None,
    names: Mapping[str, str] | None = None,
    dofs: PathLike | None = None,
) -> FEModel:
    """Read matrices that MATLAB saved, version 5 to 7, or 7.3 with the extra ibsdyn[matlab].

    Parameters
    ----------
    path : the .mat with the variables K, M and, if wanted, C (or, as COMSOL's mphmatrix has them, K, E and D),
        sparse or full; positions (n_nodes, 3), or nodes (n_nodes, 4: label, x, y, z); dofs (n, 2: node label,
        direction 1..6; left out where every node has 3 or 6 DoF); node_ids (n_nodes, 1); set_<name> (labels).
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required.
    names : {agreed name: name in the file} where the file has others, such as {"M": "Mass"}.
    dofs : a CSV with node,direction,x,y,z (see read_matrix_market), where the file holds matrices only.

    Returns
    -------
    FEModel : SI.

    Raises
    ------
    ExportError, MissingFileError, UnknownNameError : what is wrong, where, how to mend it; ImportError where
        h5py is not installed.
    """
    source = Path(path)
    agreed = (*TABLES, *(name for group in MATRICES.values() for name in group))
    refuse_unknown_names("names", names or {}, agreed)
    content = read_bytes(source)
    spelled = {name: name for name in agreed} | dict(names or {})
    if any(content[at : at + len(HDF5)] == HDF5 for at in _HDF5_AT):
        found = _read_hdf5(content, source.name, spelled)
    else:
        found = parse_matlab_5(content, source.name, max(_HARMLESS, _RATIO * len(content)))
    arrays = {name: found[theirs] for name, theirs in spelled.items() if found.get(theirs) is not None}
    for name, theirs in (names or {}).items():
        if found.get(theirs) is None:
            readable = [variable for variable, value in found.items() if value is not None]
            raise ExportError(
                f"{source.name} has no matrix {theirs!r} (names={{{name!r}: {theirs!r}}})."
                f"{nearest_known(theirs, readable)} "
                "Fields of a struct must be saved as variables of their own."
            )
    sets = {
        name[len(SET_PREFIX) :]: np.asarray(nodes).ravel()
        for name, nodes in found.items()
        if name.startswith(SET_PREFIX) and nodes is not None
    }
    others = [name for name in found if name not in spelled.values() and not name.startswith(SET_PREFIX)]
    return model_of_arrays(arrays, units, f"MATLAB {source.name}", None if dofs is None else Path(dofs), sets, others)


def is_matlab(head: bytes) -> bool:
    """Whether a file starts as a MATLAB file of version 5 or 7.3."""
    return head.startswith(b"MATLAB ") or any(head[at : at + len(HDF5)] == HDF5 for at in _HDF5_AT)


def _read_hdf5(content: bytes, name: str, spelled: Mapping[str, str]) -> dict[str, Any]:
    try:
        h5py: Any = importlib.import_module("h5py")
    except ImportError:
        raise ImportError(
            f'{name} is a MATLAB file of version 7.3, which needs h5py: pip install "ibsdyn[matlab]". '
            "Or save it in MATLAB with save(..., '-v7')."
        ) from None
    limit = max(_HARMLESS, _RATIO * len(content))
    found: dict[str, Any] = {}
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            for key in file:
                if key in spelled.values() or key.startswith(SET_PREFIX):
                    found[key] = _hdf5_variable(file[key], h5py.Dataset, limit, f"{name}, {key}")
                elif not key.startswith("#"):  # MATLAB's own
                    found[key] = None
    except _DAMAGED as error:
        if isinstance(error, ExportError):
            raise
        raise ExportError(f"{name} cannot be read as a MATLAB file ({error}); damaged? Save it again.") from None
    return found


def _hdf5_variable(item: Any, dataset: type, limit: int, what: str) -> Any:
    """Return an array, or a sparse matrix: a group with data, ir, jc and the number of rows as attribute."""
    if isinstance(item, dataset):
        return _hdf5_array(item, limit, what).T  # MATLAB stores by columns
    if "MATLAB_sparse" not in item.attrs or "jc" not in item:
        raise ExportError(f"{what} is neither an array nor a sparse matrix.")
    n_rows = int(item.attrs["MATLAB_sparse"])
    pointers = _hdf5_array(item["jc"], limit, what).ravel().astype(np.int64)
    empty = "data" not in item
    data = np.empty(0) if empty else _hdf5_array(item["data"], limit, what).ravel()
    rows = np.empty(0, np.int64) if empty else _hdf5_array(item["ir"], limit, what).ravel().astype(np.int64)
    if data.dtype.names:
        raise ExportError(f"{what} is complex. Structural damping cannot be imported as a matrix.")
    if n_rows != len(pointers) - 1:
        raise ExportError(f"{what} is {n_rows} x {len(pointers) - 1}; the matrix must be square.")
    matrix = sparse.csc_array((data, rows, pointers), shape=(n_rows, n_rows))
    matrix.check_format(full_check=True)
    return matrix


def _hdf5_array(item: Any, limit: int, what: str) -> NDArray[Any]:
    if item.size * item.dtype.itemsize > limit:
        raise ExportError(f"{what} declares shape {item.shape}, far more than the file holds. Damaged?")
    return np.asarray(item[()])

"""NumPy's .npz with matrices and tables by agreed names; nothing in it is ever unpickled."""

from __future__ import annotations

import io
import math
import os
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any, TypeAlias

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError, UnknownKeywordError
from fem_import.fe_model import FEModel
from fem_import.keywords import known_keywords
from fem_import.readers.named_arrays import MATRICES, SET_PREFIX, model_of_arrays
from fem_import.readers.packed_file import read_bytes

PathLike: TypeAlias = "str | os.PathLike[str]"

_HARMLESS = 1 << 30  # bytes that any file may unpack to; a dense matrix of zeros packs very well
_RATIO = 200
_SPARSE_PARTS = (("data", "indices", "indptr"), ("data", "row", "col"))


@known_keywords(UnknownKeywordError)
def read_npz(path: PathLike, *, units: str | None = None, dofs: PathLike | None = None) -> FEModel:
    """Read matrices that Python saved with `numpy.savez`.

    Parameters
    ----------
    path : the .npz with K, M and, if wanted, C. Each either dense (n, n) or sparse as K_data, K_indices,
        K_indptr (CSR) or K_data, K_row, K_col. Besides: positions (n_nodes, 3), dofs (n, 2: node label,
        direction 1..6; left out where every node has 3 or 6), node_ids (n_nodes,), set_<name> (labels).
    units : of the model: "SI", "mm-t-s", "mm-kg-s", "in-lbf-s". Required.
    dofs : a CSV with node,direction,x,y,z (see read_matrix_market), where the file holds matrices only.

    Returns
    -------
    FEModel : SI.

    Raises
    ------
    ExportError, MissingFileError, UnknownNameError : what is wrong, where, how to mend it.
    """
    source = Path(path)
    arrays: dict[str, Any] = dict(_read_arrays(source))
    if "format" in arrays and "M" in arrays and "interface_names" in arrays:
        raise ExportError(f"{source.name} is a saved ReducedBody. Load it by fi.ReducedBody.load.")
    for names in MATRICES.values():
        for name in names:
            matrix = _sparse_of_parts(arrays, name, source.name)
            if matrix is not None:
                arrays[name] = matrix
    sets = {name[len(SET_PREFIX) :]: found.ravel() for name, found in arrays.items() if name.startswith(SET_PREFIX)}
    return model_of_arrays(arrays, units, f"NPZ {source.name}", None if dofs is None else Path(dofs), sets)


def _sparse_of_parts(arrays: dict[str, Any], name: str, source: str) -> Any:
    for parts in _SPARSE_PARTS:
        keys = [f"{name}_{part}" for part in parts]
        if not all(key in arrays for key in keys):
            continue
        data, first, second = (arrays[key].ravel() for key in keys)
        if data.dtype.kind not in "fiu" or first.dtype.kind not in "iu" or second.dtype.kind not in "iu":
            raise ExportError(f"{source}: {', '.join(keys)} must be values and whole numbers.")
        try:
            if parts[2] == "col":
                size = int(max(first.max(initial=-1), second.max(initial=-1))) + 1
                # Its DoF table tells whether that is the size; an absurd index must not be allocated for.
                if size > 64 * len(data) + 1:
                    raise ExportError(f"{source}: {name} has {len(data)} entries and an index {size - 1}. Damaged?")
                return sparse.coo_array((data, (first, second)), shape=(size, size))
            matrix = sparse.csr_array((data, first, second), shape=(len(second) - 1, len(second) - 1))
            matrix.check_format(full_check=True)
            return matrix
        except (ValueError, IndexError, OverflowError) as error:
            raise ExportError(f"{source}: {', '.join(keys)} make no matrix ({error}).") from None
    return None


def _read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    content = read_bytes(path)
    arrays: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > max(_HARMLESS, _RATIO * len(content)):
                raise ExportError(
                    f"{path.name} unpacks to more than {_RATIO} times its size. Save it unpacked (savez)."
                )
            for member in members:
                if member.filename.endswith(".npy"):
                    with archive.open(member) as stream:
                        arrays[member.filename[:-4]] = _read_array(
                            stream, member.file_size, f"{path.name}, {member.filename}"
                        )
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError, ValueError) as error:
        if isinstance(error, ExportError):
            raise
        raise ExportError(
            f"{path.name} cannot be read as .npz ({error}); damaged or truncated? Save it again."
        ) from None
    return arrays


def _read_array(stream: IO[bytes], size: int, what: str) -> NDArray[Any]:
    """Read one .npy, whose declared size must be the size it has: nothing is allocated on its word."""
    version = npy_format.read_magic(stream)
    read_header = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
    shape, fortran, dtype = read_header(stream)
    if dtype.hasobject:
        raise ExportError(f"{what} holds Python objects, which are never loaded. Save plain arrays of numbers.")
    declared = math.prod(shape) * dtype.itemsize
    if declared > size or min(shape, default=0) < 0:
        raise ExportError(f"{what} declares shape {shape} of {dtype} and holds {size} bytes: truncated or damaged.")
    data = stream.read()
    if len(data) != declared:
        raise ExportError(f"{what} declares {declared} bytes and holds {len(data)}: truncated or damaged.")
    return np.frombuffer(data, dtype=dtype).reshape(shape, order="F" if fortran else "C")

"""MATLAB's files of version 5 to 7: numbers and sparse matrices. Ours, as scipy's reader crashes on damaged files."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_import.errors import ExportError

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_SPARSE_CLASS, _NUMBER_CLASSES = 5, range(6, 16)
_COMPLEX = 0x0800


def parse_matlab_5(content: bytes, name: str, limit: int) -> dict[str, Any]:
    """Return arrays and sparse matrices by name, None for cells, texts and structs. Raises ExportError.

    limit: bytes that packed variables may unpack to. Format: MathWorks, "MAT-File Format", level 5.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:_HEADER])
    if order is None:
        raise ExportError(f"{name} is no MATLAB file of version 5 to 7. Save it with save(..., '-v7').")
    found: dict[str, Any] = {}
    for kind, data in _elements(content[_HEADER:], order, name):
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            try:
                unpacked = unpacker.decompress(data, limit)
            except zlib.error as error:
                raise ExportError(f"{name} cannot be unpacked ({error}): damaged. Save it again.") from None
            if not unpacker.eof:
                raise ExportError(f"{name}: a packed variable is cut, or unpacks to more than {limit} bytes.")
            inner = list(_elements(unpacked, order, name))
        else:
            inner = [(kind, data)]
        for inner_kind, inner_data in inner:
            if inner_kind == _MATRIX and inner_data:
                variable, value = _variable(inner_data, order, name)
                found[variable] = value
    return found


def _elements(data: bytes, order: str, name: str) -> Iterator[tuple[int, bytes]]:
    """Yield kind and content of each element; short ones share a word with their tag."""
    at = 0
    while at + 8 <= len(data):
        first, second = (int(word) for word in np.frombuffer(data[at : at + 8], order + "u4"))
        if first >> 16:
            kind, length, start, step = first & 0xFFFF, first >> 16, at + 4, 8
        else:
            kind, length, start = first, second, at + 8
            step = 8 + length + (0 if kind == _COMPRESSED else -length % 8)
        if start + length > len(data) or (first >> 16 and length > 4):
            raise ExportError(f"{name}: an element announces {length} bytes and has fewer: truncated or damaged.")
        yield kind, data[start : start + length]
        at += step


def _variable(data: bytes, order: str, name: str) -> tuple[str, Any]:
    parts = list(_elements(data, order, name))
    if len(parts) < 3 or len(parts[0][1]) < 8 or len(parts[1][1]) % 4:
        raise ExportError(f"{name}: a variable has no name and size: damaged. Save it again.")
    flags = int(np.frombuffer(parts[0][1][:4], order + "u4")[0])
    shape = tuple(int(size) for size in np.frombuffer(parts[1][1], order + "i4"))
    variable = parts[2][1].decode("latin-1")
    array_class = flags & 0xFF
    if array_class != _SPARSE_CLASS and array_class not in _NUMBER_CLASSES:
        return variable, None
    arrays = [_numbers(kind, content, order, f"{name}, {variable}") for kind, content in parts[3:]]
    if len(arrays) < (3 if array_class == _SPARSE_CLASS else 1) or len(shape) < 2 or min(shape) < 0:
        raise ExportError(f"{name}, {variable}: its data are missing: truncated or damaged.")
    if flags & _COMPLEX:
        if np.any(arrays[-1]):
            raise ExportError(f"{name}, {variable} is complex, which cannot be imported.")
        arrays.pop()
    if array_class in _NUMBER_CLASSES:
        if not arrays or arrays[0].size != math.prod(shape):
            raise ExportError(f"{name}, {variable}: {shape} is announced and other data are there: damaged.")
        return variable, arrays[0].reshape(shape, order="F")
    if len(arrays) < 3 or shape[0] != shape[1] or len(arrays[1]) != shape[1] + 1:
        raise ExportError(f"{name}, {variable} is no square sparse matrix ({shape}).")
    rows, pointers, values = arrays[:3]
    n_entries = int(pointers[-1])
    if not 0 <= n_entries <= min(len(rows), len(values)):
        raise ExportError(f"{name}, {variable}: {n_entries} entries are announced and {len(values)} are there.")
    try:
        matrix = sparse.csc_array(
            (values[:n_entries].astype(np.float64), rows[:n_entries].astype(np.int64), pointers.astype(np.int64)),
            shape=(shape[0], shape[1]),
        )
        matrix.check_format(full_check=True)
    except (ValueError, OverflowError) as error:
        raise ExportError(f"{name}, {variable} is no sparse matrix ({error}): damaged.") from None
    return variable, matrix


def _numbers(kind: int, content: bytes, order: str, what: str) -> NDArray[Any]:
    code = _KINDS.get(kind)
    if code is None or len(content) % int(code[1]):
        raise ExportError(f"{what}: data of kind {kind} with {len(content)} bytes are no numbers: damaged.")
    return np.frombuffer(content, order + code)

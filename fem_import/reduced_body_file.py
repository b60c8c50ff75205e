"""The file of a reduced body: one .npz, never pickled, with a checksum over its content."""

from __future__ import annotations

import hashlib
import os
import zipfile
import zlib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_import.display import DisplayMesh
from fem_import.errors import ExportError, FemImportError, MissingFileError
from fem_import.inertia_integrals import InertiaIntegrals
from fem_import.interfaces import TIES, check_interface_name
from fem_import.names import NamedItems
from fem_import.reduced_body import InterfaceFrame, ReducedBody, SensorPoint
from fem_import.whole_file import whole_file

_FORMAT = "fem_import.ReducedBody"
_VERSION = 2
_PLAIN = (
    "M",
    "K",
    "frequencies",
    "max_frequency",
    "mass",
    "centre_of_mass",
    "inertia",
    "is_free",
    "source",
    "solver",
    "method",
)
_INTEGRALS = tuple(item.name for item in fields(InertiaIntegrals))
_DISPLAY = tuple(item.name for item in fields(DisplayMesh))


def write_body(body: ReducedBody, path: str | os.PathLike[str], with_basis: bool = False) -> None:
    """Write whole or not at all: no half-written file can stay."""
    arrays = _arrays(body, with_basis)
    header = {
        "format": np.array(_FORMAT),
        "version": np.array(_VERSION),
        "checksum": np.array(_checksum(arrays)),
    }
    with whole_file(Path(path)) as temporary, temporary.open("wb") as stream:
        # mypy: savez declares its allow_pickle keyword, which no array of ours is named.
        np.savez(stream, **header, **arrays)  # type: ignore[arg-type]


def body_checksum(body: ReducedBody) -> str:
    """Return the SHA-256 of what is written of a body without its basis."""
    return _checksum(_arrays(body, with_basis=False))


def _arrays(body: ReducedBody, with_basis: bool) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {name: np.asarray(getattr(body, name)) for name in _PLAIN}
    arrays["findings"] = np.array(body.findings, dtype=str)
    optional = {"C": body.C, "dynamic_compliance": body.dynamic_compliance, "basis": body.basis if with_basis else None}
    arrays |= {name: array for name, array in optional.items() if array is not None}
    frames = list(body.interfaces.values())
    arrays["interface_names"] = np.array([frame.name for frame in frames])
    arrays["interface_ties"] = np.array([frame.tie for frame in frames])
    arrays["interface_positions"] = np.array([frame.position for frame in frames])
    arrays["interface_radii"] = np.array([frame.radius for frame in frames])
    for index, frame in enumerate(frames):
        arrays[f"interface_nodes_{index}"] = frame.node_ids
    arrays["sensor_names"] = np.array(list(body.sensors), dtype=str)
    for index, sensor in enumerate(body.sensors.values()):
        arrays[f"sensor_position_{index}"] = sensor.position
        arrays[f"sensor_motion_{index}"] = sensor.motion
        arrays[f"sensor_nodes_{index}"] = sensor.node_ids
    if body.inertia_integrals is not None:
        for name in _INTEGRALS:
            arrays[f"integral_{name}"] = np.asarray(getattr(body.inertia_integrals, name))
    if body.display is not None:
        for name in _DISPLAY:
            arrays[f"display_{name}"] = getattr(body.display, name)
    return arrays


def read_body(path: str | os.PathLike[str]) -> ReducedBody:
    """Read and check a file of `write_body`."""
    source = Path(path)
    if not source.is_file():
        raise MissingFileError(f"{source} does not exist.")
    try:
        # np.load leaves a file open that it cannot read, unless it is given an open one.
        with source.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (
        OSError,
        ValueError,
        KeyError,
        EOFError,
        TypeError,
        AttributeError,
        SyntaxError,
        NotImplementedError,
    ) as error:
        raise _damaged(source, error) from None
    except (zipfile.BadZipFile, zlib.error, MemoryError, OverflowError) as error:
        raise _damaged(source, error) from None
    if str(arrays.pop("format", None)) != _FORMAT:
        raise ExportError(f"{source} is not a saved ReducedBody.")
    version = arrays.pop("version", None)
    if version is None or version.shape != () or version != _VERSION:
        raise ExportError(f"{source} is of version {version}; this program reads version {_VERSION}. Reduce again.")
    if str(arrays.pop("checksum", None)) != _checksum(arrays):
        raise ExportError(f"{source} does not match its own checksum: changed or damaged. Reduce the part again.")
    try:
        return _body(arrays)
    except FemImportError:
        raise
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise _damaged(source, error) from None


def _damaged(source: Path, error: BaseException) -> ExportError:
    return ExportError(f"{source} is damaged or no saved ReducedBody ({type(error).__name__}: {error}). Reduce again.")


def _body(arrays: dict[str, NDArray[Any]]) -> ReducedBody:
    frames = {}
    for index, name in enumerate(map(str, arrays["interface_names"])):
        check_interface_name(name)
        tie = str(arrays["interface_ties"][index])
        if tie not in TIES:
            raise ExportError(f"Interface {name!r} has the unknown tie {tie!r}.")
        frames[name] = InterfaceFrame(
            name=name,
            position=arrays["interface_positions"][index],
            radius=float(arrays["interface_radii"][index]),
            tie=tie,
            node_ids=arrays[f"interface_nodes_{index}"],
        )
    sensors = {}
    for index, name in enumerate(map(str, arrays["sensor_names"])):
        check_interface_name(name)
        sensors[name] = SensorPoint(
            name=name,
            position=arrays[f"sensor_position_{index}"],
            motion=arrays[f"sensor_motion_{index}"],
            node_ids=arrays[f"sensor_nodes_{index}"],
        )
    integrals = None
    if f"integral_{_INTEGRALS[0]}" in arrays:
        values: dict[str, Any] = {name: arrays[f"integral_{name}"] for name in _INTEGRALS}
        values["mass"] = float(values["mass"])
        integrals = InertiaIntegrals(**values)
    display = None
    if f"display_{_DISPLAY[0]}" in arrays:
        display = DisplayMesh(**{name: arrays[f"display_{name}"] for name in _DISPLAY})
    return ReducedBody(
        M=arrays["M"],
        K=arrays["K"],
        C=arrays.get("C"),
        interfaces=NamedItems("interface", frames),
        frequencies=arrays["frequencies"],
        max_frequency=float(arrays["max_frequency"]),
        mass=float(arrays["mass"]),
        centre_of_mass=arrays["centre_of_mass"],
        inertia=arrays["inertia"],
        is_free=bool(arrays["is_free"]),
        source=str(arrays["source"]),
        solver=str(arrays["solver"]),
        inertia_integrals=integrals,
        display=display,
        basis=arrays.get("basis"),
        sensors=NamedItems("sensor point", sensors),
        dynamic_compliance=arrays.get("dynamic_compliance"),
        method=str(arrays["method"]),
        findings=tuple(map(str, arrays["findings"])),
    )


def _checksum(arrays: dict[str, NDArray[Any]]) -> str:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {np.shape(arrays[name])} ".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()

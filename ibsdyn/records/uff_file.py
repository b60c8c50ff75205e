"""Universal files (UFF), data set 58, by pyuff (extra ``uff``)."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ibsdyn.errors import ExtraMissingError, RecordError
from ibsdyn.records.columns import Columns, different
from ibsdyn.records.sampling import rate_of_time, whole_rate

_TIME_RESPONSE, _TIME_AXIS = 1, 17
_EVEN = 1
_KINDS = {0: "general", 1: "time response", 2: "auto spectrum", 3: "cross spectrum", 4: "FRF", 6: "coherence"}
_DIRECTIONS = {1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}
_DIRECTIONS |= {4: "+RX", -4: "-RX", 5: "+RY", -5: "-RY", 6: "+RZ", -6: "-RZ"}
_NOTHING = ("", "NONE")


def read_uff(path: Path) -> Columns:
    """Return the time responses of a universal file; a column is called by its entity, node and direction.

    Raises
    ------
    ExtraMissingError : pyuff is not installed.
    RecordError : damaged, or without time responses in data sets 58.
    """
    try:
        pyuff: Any = importlib.import_module("pyuff")
    except ImportError:
        raise ExtraMissingError(
            f'{path.name} is a universal file, which needs pyuff: pip install "ibsdyn[uff]".'
        ) from None
    try:
        file = pyuff.UFF(str(path))
        types = [int(kind) for kind in file.get_set_types()]
        sets = [file.read_sets(place) for place, kind in enumerate(types) if kind == 58]
    except Exception as error:  # pyuff raises bare Exceptions for whatever is wrong
        raise RecordError(f"{path.name} cannot be read as a universal file ({error}); damaged or truncated?") from None
    if not sets:
        others = ", ".join(str(kind) for kind in sorted(set(types))) or "none"
        raise RecordError(f"{path.name} has no data set 58 (functions); it has {others}.")
    records = [one for one in sets if _is_time(one)]
    if not records:
        kinds = ", ".join(sorted({_KINDS.get(int(one["func_type"]), f"type {one['func_type']}") for one in sets}))
        raise RecordError(f"{path.name} holds no time responses but {kinds}. Export the time histories.")
    clocks = [_clock(one, f"{path.name}, {_label(one)}") for one in records]
    return Columns(
        source=path.name,
        labels=different([_label(one) for one in records]),
        values=tuple(_samples(one, path.name) for one in records),
        units=tuple(_unit(one) for one in records),
        sample_rates=tuple(rate for rate, _ in clocks),
        starts=tuple(start for _, start in clocks),
    )


def _is_time(one: Mapping[str, Any]) -> bool:
    return one["func_type"] == _TIME_RESPONSE or (
        one["func_type"] == 0 and one.get("abscissa_spec_data_type") == _TIME_AXIS
    )


def _label(one: Mapping[str, Any]) -> str:
    entity = str(one.get("rsp_ent_name", "")).strip()
    node, direction = int(one.get("rsp_node", 0)), int(one.get("rsp_dir", 0))
    place = f"{node}{_DIRECTIONS.get(direction, '')}" if node or direction else ""
    parts = [part for part in ("" if entity in _NOTHING else entity, place) if part]
    return ":".join(parts) or str(one.get("id1", "")).strip() or "unnamed"


def _unit(one: Mapping[str, Any]) -> str | None:
    unit = str(one.get("ordinate_axis_units_lab", "")).strip()
    return None if unit in _NOTHING else unit


def _samples(one: Mapping[str, Any], source: str) -> np.ndarray:
    values, announced = np.asarray(one["data"]), int(one["num_pts"])
    if np.iscomplexobj(values):
        raise RecordError(f"{source}, {_label(one)} is complex; a time record is real.")
    if len(values) < announced:
        raise RecordError(
            f"{source}, {_label(one)} announces {announced} samples and has {len(values)}: truncated. Export it again."
        )
    return values[:announced]  # line ends behind binary numbers may look like one more


def _clock(one: Mapping[str, Any], what: str) -> tuple[float, float]:
    if int(one["abscissa_spacing"]) != _EVEN:
        return rate_of_time(np.asarray(one["x"], dtype=np.float64), what)
    step = float(one["abscissa_inc"])
    if not step > 0.0:
        raise RecordError(f"{what}: the time step is {step:g} s.")
    return whole_rate(1.0 / step), float(one["abscissa_min"])

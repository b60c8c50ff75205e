"""Frequency responses in universal files, data set 58, by pyuff (extra ``uff``)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ibsdyn.axes import Array
from ibsdyn.errors import InterchangeError
from ibsdyn.frequency_response import FrequencyResponse
from ibsdyn.interchange.extras import extra_package
from ibsdyn.records.units import to_si

_FRF, _FREQUENCY, _COMPLEX_DOUBLE = 4, 18, 6
# Specific data type, exponents of length and force: addendum A of the universal file's description.
_UNIT_TYPES = {
    "m": (8, 1, 0),
    "m/s": (11, 1, 0),
    "m/s²": (12, 1, 0),
    "rad": (8, 0, 0),
    "rad/s": (11, 0, 0),
    "rad/s²": (12, 0, 0),
    "N": (13, 0, 1),
    "N·m": (13, 1, 1),
}
_UNKNOWN = (0, 0, 0)
_MARK = "ibsdyn: output, input above"
_DIRECTIONS = {0: "", 1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}
_DIRECTIONS |= {-key: name.replace("+", "-") for key, name in _DIRECTIONS.items() if key}
_NOTHING = ("", "NONE")
_ID_LINE = 80
# Frequencies are printed with six digits.
_SPACING = 1e-5


def write_uff(response: FrequencyResponse, path: Path) -> None:
    """Write each response as a data set 58."""
    pyuff = extra_package("pyuff", "uff", "a universal file")
    for name in (*response.outputs, *response.inputs):
        if len(name) > _ID_LINE or not name.isprintable() or name != name.strip():
            raise InterchangeError(f"{name!r} cannot stand in an ID line of a universal file, which has 80 characters.")
    steps = np.diff(response.frequencies)
    if len(steps) == 0:
        raise InterchangeError("a universal file needs two frequencies at least.")
    even = bool(np.ptp(steps) <= 1e-9 * abs(steps).max())
    sets: list[dict[str, Any]] = []
    for row, (output, output_unit) in enumerate(zip(response.outputs, response.output_units, strict=True)):
        for column, (source, unit) in enumerate(zip(response.inputs, response.input_units, strict=True)):
            sets.append(
                {
                    "type": 58,
                    "binary": 0,
                    "id1": output,
                    "id2": source,
                    "id3": _MARK,
                    "func_type": _FRF,
                    "func_id": len(sets) + 1,
                    "rsp_ent_name": _entity(output),
                    "rsp_node": row + 1,
                    "rsp_dir": 0,
                    "ref_ent_name": _entity(source),
                    "ref_node": len(response.outputs) + column + 1,
                    "ref_dir": 0,
                    "ord_data_type": _COMPLEX_DOUBLE,
                    "abscissa_spacing": int(even),
                    "abscissa_spec_data_type": _FREQUENCY,
                    "abscissa_axis_lab": "Frequency",
                    "abscissa_axis_units_lab": "Hz",
                    **_axis("ordinate", output_unit),
                    **_axis("orddenom", unit),
                    "x": response.frequencies,
                    "data": response.response[row, column],
                }
            )
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def read_uff(path: Path) -> FrequencyResponse:
    """Read the frequency response functions of a universal file."""
    pyuff = extra_package("pyuff", "uff", f"{path.name}, a universal file,")
    with open(path, "rb"):  # says in words of the system why it cannot be read
        pass
    try:
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        sets = [file.read_sets(place) for place, kind in enumerate(kinds) if kind == 58]
    except Exception as error:  # pyuff raises bare Exceptions for whatever is wrong
        raise InterchangeError(
            f"{path.name} cannot be read as a universal file ({error}); damaged or truncated?"
        ) from None
    found = [one for one in sets if int(one["func_type"]) == _FRF]
    if not found:
        raise InterchangeError(
            f"{path.name} has no frequency response functions (data set 58, function type 4); it has data sets "
            f"{sorted(set(kinds))}, {len(sets)} functions."
        )
    frequencies = np.asarray(found[0]["x"], dtype=float)
    pairs: dict[tuple[str, str], tuple[Mapping[str, Any], Array]] = {}
    for one in found:
        pair = (_label(one, "rsp", "id1"), _label(one, "ref", "id2"))
        x = np.asarray(one["x"], dtype=float)
        if x.shape != frequencies.shape or np.abs(x - frequencies).max() > _SPACING * np.abs(frequencies).max():
            raise InterchangeError(
                f"{path.name}: {pair[0]} over {pair[1]} has other frequencies than the first function."
            )
        if pair in pairs:
            raise InterchangeError(f"{path.name}: {pair[0]} over {pair[1]} is there twice; keep one of them.")
        pairs[pair] = (one, np.asarray(one["data"], dtype=complex)[: len(x)])
    outputs, inputs = (list(dict.fromkeys(pair[side] for pair in pairs)) for side in (0, 1))
    response = np.empty((len(outputs), len(inputs), len(frequencies)), complex)
    units: dict[str, str] = {}
    for row, output in enumerate(outputs):
        for column, source in enumerate(inputs):
            if (output, source) not in pairs:
                raise InterchangeError(f"{path.name}: {output} over {source} is missing; the matrix must be complete.")
            one, values = pairs[output, source]
            above, units[output] = _unit(one, "ordinate")
            below, units[source] = _unit(one, "orddenom")
            response[row, column] = values * above / below
    return FrequencyResponse(
        frequencies=frequencies,
        response=response,
        outputs=tuple(outputs),
        inputs=tuple(inputs),
        output_units=tuple(units[name] for name in outputs),
        input_units=tuple(units[name] for name in inputs),
    )


def _axis(axis: str, unit: str) -> dict[str, Any]:
    kind, length, force = _UNIT_TYPES.get(unit, _UNKNOWN)
    return {
        f"{axis}_spec_data_type": kind,
        f"{axis}_len_unit_exp": length,
        f"{axis}_force_unit_exp": force,
        f"{axis}_axis_units_lab": unit.replace("²", "^2").replace("·", "*")[:20] or "NONE",
    }


def _entity(name: str) -> str:
    return "".join(letter if letter.isascii() and letter.isprintable() else "_" for letter in name)[:10]


def _label(one: Mapping[str, Any], side: str, id_line: str) -> str:
    if str(one.get("id3", "")).strip() == _MARK:
        return str(one[id_line]).strip()
    entity = str(one.get(f"{side}_ent_name", "")).strip()
    node, direction = int(one.get(f"{side}_node", 0)), int(one.get(f"{side}_dir", 0))
    place = f"{node}:{_DIRECTIONS.get(direction, direction)}".rstrip(":")
    return place if entity in _NOTHING else f"{entity}:{place}"


def _unit(one: Mapping[str, Any], axis: str) -> tuple[float, str]:
    unit = str(one.get(f"{axis}_axis_units_lab", "")).strip()
    if unit in _NOTHING:
        return 1.0, "-"
    return to_si(unit) or (1.0, unit)

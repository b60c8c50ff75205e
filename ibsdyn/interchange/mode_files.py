"""Modes as files: a table, or shapes in a universal file (data set 55) that other programs animate."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import Any

import numpy as np

from fem_import.whole_file import whole_file
from ibsdyn.components import FlexibleBody
from ibsdyn.errors import InterchangeError, known_keywords
from ibsdyn.interchange.extras import extra_package
from ibsdyn.modes import Modes

_NORMAL_MODE, _SIX_DOF, _DISPLACEMENT = 2, 3, 8
_LINE_COLOUR = 1
_SI_UNITS = 1


@known_keywords
def write_modes(modes: Modes, path: str | os.PathLike[str]) -> None:
    """Write modes, whole or not at all.

    Parameters
    ----------
    modes : from ``system.modes()``.
    path : ending in .csv (frequencies, damping ratios, shares of energy, shapes over the coordinates; every digit) or
        in .uff or .unv (universal file, extra ``uff``: nodes in data set 2411, lines in 82, shapes in 55).

    Raises
    ------
    InterchangeError : another ending.
    ExtraMissingError : a universal file, and pyuff is not installed.
    OSError : the file cannot be written.

    Notes
    -----
    A node of the universal file is the CoG of a rigid body, a fixation, an interface or a sensor point of a flexible
    body; shapes have unit modal mass and six digits.
    """
    target = Path(path)
    writers = {".csv": _write_csv, ".uff": _write_uff, ".unv": _write_uff}
    if target.suffix.lower() not in writers:
        raise InterchangeError(f"{target.name}: modes are written as one of {', '.join(writers)}.")
    with whole_file(target) as temporary:
        writers[target.suffix.lower()](modes, temporary)


def mode_columns(modes: Modes) -> dict[str, np.ndarray]:
    """Return the columns of the table of modes: numbers from 1, frequencies, ratios, shares."""
    columns: dict[str, np.ndarray] = {
        "mode": np.arange(1, len(modes) + 1),
        "frequency [Hz]": modes.frequencies,
        "damping ratio [-]": modes.damping_ratios,
    }
    columns |= {f"strain energy {name} [-]": share for name, share in modes.strain_energy.items()}
    columns |= {f"kinetic energy {name} [-]": share for name, share in modes.kinetic_energy.items()}
    return columns


def _write_csv(modes: Modes, path: Path) -> None:
    columns = mode_columns(modes)
    columns |= {f"shape {name}": row for name, row in zip(modes.coordinates, modes.shapes, strict=True)}
    with open(path, "w", encoding="utf-8-sig", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        for number, *row in zip(*columns.values(), strict=True):
            writer.writerow([int(number), *(repr(float(value)) for value in row)])


def _write_uff(modes: Modes, path: Path) -> None:
    pyuff = extra_package("pyuff", "uff", "a universal file")
    assembly = modes._assembly
    names = [name for name in assembly.frames if not isinstance(assembly.items.get(name), FlexibleBody)]
    numbers = {name: place for place, name in enumerate(names, 1)}
    motion = np.stack([assembly.motion(name) @ modes._full_shapes for name in names])
    points = np.array([assembly.frames[name] for name in names])
    sets: list[dict[str, Any]] = [
        {"type": 164, "units_code": _SI_UNITS, "units_description": "SI", "temp_mode": 1}
        | {"length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15},
        {"type": 2411, "node_nums": list(numbers.values()), "x": points[:, 0], "y": points[:, 1], "z": points[:, 2]}
        | {key: [1] * len(names) for key in ("def_cs", "disp_cs", "color")},
    ]
    for count, line in enumerate(_lines(modes, numbers), 1):
        sets.append({"type": 82, "trace_num": count, "color": _LINE_COLOUR, "id": line[0], "nodes": np.array(line[1])})
    for mode in range(len(modes)):
        sets.append(
            {
                "type": 55,
                "id1": f"mode {mode + 1}",
                "model_type": 1,
                "analysis_type": _NORMAL_MODE,
                "data_ch": _SIX_DOF,
                "spec_data_type": _DISPLACEMENT,
                "load_case": 1,
                "mode_n": mode + 1,
                "freq": modes.frequencies[mode],
                "modal_m": 1.0,
                "modal_damp_vis": modes.damping_ratios[mode],
                "node_nums": list(numbers.values()),
                **{f"r{direction + 1}": motion[:, direction, mode] for direction in range(6)},
            }
        )
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def _lines(modes: Modes, numbers: dict[str, int]) -> list[tuple[str, list[int]]]:
    """A line a connection, and one through the interfaces and sensor points of each flexible body."""
    assembly = modes._assembly
    lines = [
        (joint.connection.name, [numbers[joint.connection.item1], numbers[joint.connection.item2]])
        for joint in assembly.joints
    ]
    for body in assembly.bodies:
        if isinstance(body, FlexibleBody):
            own = [number for name, number in numbers.items() if name.split(".", 1)[0] == body.name]
            lines.append((body.name, own))
    return [(name[:80] or "NONE", nodes) for name, nodes in lines if len(nodes) > 1]

"""Frequency responses as comma-separated columns of real and imaginary parts."""

from __future__ import annotations

import csv
import itertools
import re
from pathlib import Path

import numpy as np

from ibsdyn.errors import InterchangeError
from ibsdyn.frequency_response import FrequencyResponse

_FREQUENCY = "frequency [Hz]"
_PARTS = ("real", "imag")
_TITLE = re.compile(r"(real|imag) (.*) \[([^\[\]]*)\] / (.*) \[([^\[\]]*)\]")


def write_csv(response: FrequencyResponse, path: Path) -> None:
    """Write a column of frequencies and two for each output and input; every digit."""
    outputs = [f"{n} [{u}]" for n, u in zip(response.outputs, response.output_units, strict=True)]
    inputs = [f"{n} [{u}]" for n, u in zip(response.inputs, response.input_units, strict=True)]
    titles = [f"{part} {o} / {i}" for o, i in itertools.product(outputs, inputs) for part in _PARTS]
    if [_TITLE.fullmatch(title) is not None for title in titles].count(False) or len(set(titles)) < len(titles):
        raise InterchangeError(
            f"names {[*outputs, *inputs]} must differ and fit one line to stand in a title of a CSV."
        )
    pairs = response.response.reshape(-1, len(response.frequencies))
    columns = [response.frequencies, *(column for pair in pairs for column in (pair.real, pair.imag))]
    with open(path, "w", encoding="utf-8-sig", newline="") as stream:  # with the mark spreadsheets know UTF-8 by
        writer = csv.writer(stream)
        writer.writerow([_FREQUENCY, *titles])
        writer.writerows([repr(float(value)) for value in row] for row in np.column_stack(columns))


def read_csv(path: Path) -> FrequencyResponse:
    """Read what `write_csv` wrote."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as stream:
            titles, *rows = list(csv.reader(stream))
        numbers = np.array(rows, dtype=float)
    except (ValueError, csv.Error) as error:  # no lines, unequal lines, words among the numbers, other encodings
        raise InterchangeError(f"{path.name} is no table of frequency responses: {error}.") from None
    parsed = [_TITLE.fullmatch(title) for title in titles[1:]]
    found = [match.groups() for match in parsed if match is not None]
    if titles[0] != _FREQUENCY or len(found) < len(parsed) or not found or not _fits(numbers, titles):
        raise InterchangeError(
            f"{path.name}: the columns must be {_FREQUENCY!r} and pairs as 'real Y1 [m/s²] / push [N]', 'imag Y1 ...', "
            f"with a finite number in each line; got {titles[:3]}."
        )
    outputs = dict.fromkeys((name, unit) for _, name, unit, _, _ in found)
    inputs = dict.fromkeys((name, unit) for _, _, _, name, unit in found)
    wanted = [(part, *o, *i) for o, i in itertools.product(outputs, inputs) for part in _PARTS]
    if found != wanted:
        raise InterchangeError(
            f"{path.name}: not every output has a real and an imaginary part for every input, in order."
        )
    values = numbers[:, 1::2] + 1j * numbers[:, 2::2]
    return FrequencyResponse(
        frequencies=numbers[:, 0],
        response=np.ascontiguousarray(values.T).reshape(len(outputs), len(inputs), -1),
        outputs=tuple(name for name, _ in outputs),
        inputs=tuple(name for name, _ in inputs),
        output_units=tuple(unit for _, unit in outputs),
        input_units=tuple(unit for _, unit in inputs),
    )


def _fits(numbers: np.ndarray, titles: list[str]) -> bool:
    return numbers.ndim == 2 and numbers.shape[1] == len(titles) and bool(np.isfinite(numbers).all())

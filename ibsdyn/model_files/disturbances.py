"""Disturbances of a model, from tables of its file and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from ibsdyn.disturbances import AnyDisturbance, CorrelatedDisturbance, Disturbance, Tone
from ibsdyn.model import Model
from ibsdyn.model_files.signals import read_source, written_source
from ibsdyn.model_files.table import Table
from ibsdyn.psd import PSD
from ibsdyn.signals import Input
from ibsdyn.vibration_environments import floor_vibration, launch_vibration

_TYPES = ("random", "correlated", "tone")
_PSD_SOURCES = ("values", "white", "file", "criterion", "spectrum")


def read_disturbance(name: str, table: Table, model: Model) -> AnyDisturbance:
    """Return a Disturbance, CorrelatedDisturbance or Tone."""
    kind = table.choice("type", _TYPES) if "type" in table else "random"
    with table.placed_errors():
        if kind == "tone":
            table.refuse_unknown(("type", "input", "amplitude", "frequency"))
            source = read_source(table, "input", model)
            return Tone(name, source, table.numeric("amplitude"), table.numeric("frequency"))
        if kind == "random":
            table.refuse_unknown(("type", "input", "psd"))
            source = read_source(table, "input", model)
            return Disturbance(name, source, _psd(table.inner("psd"), source))
        return _correlated(name, table, model)


def written_disturbance(disturbance: AnyDisturbance, model: Model) -> dict[str, Any]:
    """Return the keys and values of a disturbance, without its name."""
    if isinstance(disturbance, Tone):
        return {
            "type": "tone",
            "input": written_source(disturbance.input, model),
            "amplitude": disturbance.amplitude,
            "frequency": disturbance.frequency,
        }
    if isinstance(disturbance, Disturbance):
        return {"input": written_source(disturbance.input, model), "psd": _written_psd(disturbance.psd)}
    values = {
        "type": "correlated",
        "inputs": [written_source(source, model) for source in disturbance.inputs],
        "psds": [_written_psd(psd) for psd in disturbance.psds],
        "correlation": disturbance.correlation.real.tolist(),
    }
    if disturbance.correlation.imag.any():
        values["correlation_imaginary"] = disturbance.correlation.imag.tolist()
    if disturbance.frequencies is not None:
        values["frequencies"] = disturbance.frequencies.tolist()
    return values


def _correlated(name: str, table: Table, model: Model) -> CorrelatedDisturbance:
    table.refuse_unknown(("type", "inputs", "psds", "correlation", "correlation_imaginary", "frequencies"))
    listed = {key: table.values.get(key) for key in ("inputs", "psds")}
    for key, value in listed.items():
        if not isinstance(value, list) or not value:
            raise table.error(key, f"must be a list with an entry for each input, got {value!r}.")
    inputs = listed["inputs"] or []
    sources = [read_source(table.with_value("inputs", given), "inputs", model) for given in inputs]
    psds = listed["psds"] or []
    if len(psds) != len(sources):
        raise table.error("psds", f"are {len(psds)} for {len(sources)} inputs; give one for each.")
    spectra = [_psd(table.inner("psds", psd), source) for psd, source in zip(psds, sources, strict=True)]
    correlation = table.numeric("correlation")
    if "correlation_imaginary" in table:
        correlation = _complex(table, correlation)
    return CorrelatedDisturbance(name, sources, spectra, correlation, table.numeric("frequencies"))


def _complex(table: Table, real: Any) -> Any:
    try:
        return np.array(real, dtype=float) + 1j * np.array(table.numeric("correlation_imaginary"), dtype=float)
    except (TypeError, ValueError):
        raise table.error("correlation_imaginary", "must have the shape of correlation.") from None


def _psd(table: Table, source: Input) -> PSD:
    given = [key for key in _PSD_SOURCES if key in table]
    if len(given) != 1:
        raise table.error("psd", f"needs one of {', '.join(_PSD_SOURCES)}; got {given or 'none'}.")
    kind = given[0]
    unit = {"unit": table.text("unit")} if "unit" in table else {"unit": source.unit}
    title = {"title": table.text("title")} if "title" in table else {}
    if kind == "values":
        table.refuse_unknown(("frequencies", "values", "unit", "title"))
        return PSD(table.numeric("frequencies", ()), table.numeric("values"), **unit, **title)
    if kind == "white":
        table.refuse_unknown(("white", "band", "unit", "title"))
        return PSD.white(table.numeric("white"), table.numeric("band"), **unit, **title)
    if kind == "file":
        table.refuse_unknown(("file", "unit", "title"))
        try:
            return PSD.from_csv(table.path("file"), **unit, **title)
        except UnicodeDecodeError:
            raise table.error("file", f"{table.text('file')!r} is not UTF-8; save it as UTF-8.") from None
    table.refuse_unknown((kind,))
    if kind == "criterion":
        return floor_vibration(table.text("criterion"), source.unit)
    return launch_vibration(table.text("spectrum"))


def _written_psd(psd: PSD) -> dict[str, Any]:
    return {
        "frequencies": psd.frequencies.tolist(),
        "values": psd.values.tolist(),
        "unit": psd.unit,
        "title": psd.title,
    }

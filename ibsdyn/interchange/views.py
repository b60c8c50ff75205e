"""Results as objects of other packages: xarray, pandas (extras of these names) and python-control (``control``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ibsdyn.interchange.extras import extra_package
from ibsdyn.interchange.mode_files import mode_columns

if TYPE_CHECKING:
    from ibsdyn.frequency_response import FrequencyResponse
    from ibsdyn.modes import Modes
    from ibsdyn.state_space import StateSpace
    from ibsdyn.time_record import TimeRecord


def frf_to_xarray(response: FrequencyResponse) -> Any:
    """Return a complex xarray.DataArray over output, input, frequency; units are coordinates beside the names."""
    xarray = extra_package("xarray", "xarray", "to_xarray()")
    return xarray.DataArray(
        response.response,
        dims=("output", "input", "frequency"),
        coords={
            "output": list(response.outputs),
            "input": list(response.inputs),
            "frequency": ("frequency", response.frequencies, {"units": "Hz"}),
            "output_unit": ("output", list(response.output_units)),
            "input_unit": ("input", list(response.input_units)),
        },
        name="frequency response",
    )


def frf_to_dataframe(response: FrequencyResponse) -> Any:
    """Return a complex pandas.DataFrame: frequencies [Hz] down, (output, input) across."""
    pandas = extra_package("pandas", "pandas", "to_dataframe()")
    return pandas.DataFrame(
        response.response.reshape(-1, len(response.frequencies)).T,
        index=pandas.Index(response.frequencies, name="frequency [Hz]"),
        columns=pandas.MultiIndex.from_product([response.outputs, response.inputs], names=["output", "input"]),
    )


def modes_to_dataframe(modes: Modes) -> Any:
    """Return a pandas.DataFrame: a row a mode; frequencies, damping ratios and shares of energy across."""
    pandas = extra_package("pandas", "pandas", "to_dataframe()")
    return pandas.DataFrame({name: np.array(values) for name, values in mode_columns(modes).items()}).set_index("mode")


def record_to_xarray(record: TimeRecord) -> Any:
    """Return an xarray.DataArray over channel and time; units are a coordinate beside the channels' names."""
    xarray = extra_package("xarray", "xarray", "to_xarray()")
    return xarray.DataArray(
        record.signals,
        dims=("channel", "time"),
        coords={
            "channel": list(record.names),
            "time": ("time", record.time, {"units": "s"}),
            "unit": ("channel", list(record.units)),
        },
        name=record.title,
        attrs={"sample_rate": record.sample_rate},
    )


def record_to_dataframe(record: TimeRecord) -> Any:
    """Return a pandas.DataFrame: times [s] down, channels across."""
    pandas = extra_package("pandas", "pandas", "to_dataframe()")
    return pandas.DataFrame(
        record.signals.T, index=pandas.Index(record.time, name="time [s]"), columns=list(record.names)
    )


def state_space_to_control(space: StateSpace) -> Any:
    """Return a control.StateSpace with the names of states, inputs and outputs."""
    control = extra_package("control", "control", "to_control()")
    return control.ss(
        space.A,
        space.B,
        space.C,
        space.D,
        states=list(space.states),
        inputs=list(space.inputs),
        outputs=list(space.outputs),
    )

"""WAV files, as sound cards and portable recorders write them."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from ibsdyn.errors import RecordError
from ibsdyn.records.columns import Columns


def read_wav(path: Path) -> Columns:
    """Return the channels of a WAV file as fractions of full scale.

    Raises
    ------
    RecordError : damaged, truncated or compressed.
    """
    _refuse_truncated(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of other programs, which no one asks for
            rate, data = wavfile.read(path)
    except (ValueError, OSError, EOFError, struct.error, ZeroDivisionError, UnboundLocalError, TypeError) as error:
        raise RecordError(f"{path.name} cannot be read as WAV ({error}).") from None
    samples = np.atleast_2d(data.T)
    if samples.shape[1] == 0 or samples.shape[0] == 0:
        raise RecordError(f"{path.name} holds no samples.")
    if samples.dtype.kind == "u":
        values = (samples.astype(np.float64) - 128.0) / 128.0  # 8 bit WAV is the one unsigned kind
    elif samples.dtype.kind == "i":
        values = samples / float(np.iinfo(samples.dtype).max + 1)  # scipy puts 24 bits into the upper ones of 32
    else:
        values = samples.astype(np.float64)
    count = len(values)
    return Columns(
        source=path.name,
        labels=tuple(f"channel {number}" for number in range(1, count + 1)),
        values=tuple(values),
        units=(None,) * count,
        sample_rates=(float(rate),) * count,
        starts=(0.0,) * count,
        full_scale=True,
    )


def _refuse_truncated(path: Path) -> None:
    """Hold the announced size of the samples against the file's: scipy would allocate what is announced."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        order = ">" if stream.read(4) == b"RIFX" else "<"
        at = 12
        while at + 8 <= size:
            stream.seek(at)
            kind, length = struct.unpack(order + "4sI", stream.read(8))
            if kind == b"ds64":
                raise RecordError(f"{path.name} is an RF64 file (longer than 4 GiB); split it or convert it to HDF5.")
            if kind == b"data":
                if at + 8 + length > size:
                    raise RecordError(
                        f"{path.name} announces {length} bytes of samples and has {size - at - 8}: truncated. Was the "
                        "recorder switched off before it closed the file?"
                    )
                return
            at += 8 + length + length % 2
    raise RecordError(f"{path.name} has no samples (no data chunk): truncated or damaged.")

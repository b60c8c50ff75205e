"""Speed and memory of FRF estimates: `python benchmarks/identification.py --help`."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import scipy.signal

RATE = 10_000.0


def main() -> None:
    """Make the record, run each method in a process of its own and print what it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3600.0, help="length of the record, at 10 kHz")
    parser.add_argument("--inputs", type=int, default=6)
    parser.add_argument("--outputs", type=int, default=6, help="1 makes the seven channels of the paper's experiment")
    parser.add_argument("--segment", type=int, default=1 << 14, help="samples of a segment; half as many lags")
    parser.add_argument("--skip-scipy", action="store_true", help="ours alone")
    parser.add_argument("--case", choices=("welch", "spectral", "scipy"), help=argparse.SUPPRESS)
    parser.add_argument("--file", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.case:
        print("RESULT " + json.dumps(measure(chosen)))
        return
    size = f"{chosen.inputs} inputs x {chosen.outputs} outputs, {chosen.seconds:g} s at 10 kHz"
    print(f"{size}, segments of {chosen.segment} samples, half overlapped")
    with tempfile.TemporaryDirectory() as folder:
        chosen.file = str(Path(folder) / "record.npy")
        write_record(chosen.file, chosen.inputs, chosen.outputs, int(chosen.seconds * RATE))
        results = {}
        for case in ("welch", "spectral") if chosen.skip_scipy else ("welch", "spectral", "scipy"):
            results[case] = run(case, chosen)
            took, peak = results[case]
            print(f"  {case}: {took:.3g} s, peak {peak:.3g} GiB beside the mapped record", flush=True)
        if not chosen.skip_scipy:
            print(f"  pairwise scipy.signal.csd / welch: {results['scipy'][0] / results['welch'][0]:.3g}")


def write_record(path: str, inputs: int, outputs: int, samples: int) -> None:
    """Write white inputs and outputs that depend on all of them, channel by channel."""
    rng = np.random.default_rng(0)
    signals = np.lib.format.open_memmap(path, mode="w+", dtype=np.float64, shape=(inputs + outputs, samples))
    for channel in range(inputs):
        signals[channel] = rng.standard_normal(samples)
    for channel in range(inputs, inputs + outputs):
        signals[channel] = rng.standard_normal(samples)
        for source in range(inputs):
            signals[channel] += (1.0 + channel) / (1.0 + source) * signals[source]
    signals.flush()


def run(case: str, chosen: argparse.Namespace) -> tuple[float, float]:
    """Return seconds and GiB of one case."""
    command = [sys.executable, __file__, "--case", case, "--file", chosen.file]
    for option in ("seconds", "inputs", "outputs", "segment"):
        command += [f"--{option}", str(getattr(chosen, option))]
    done = subprocess.run(command, capture_output=True, text=True)
    results = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not results:
        raise SystemExit(f"{case} failed: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    took, peak = json.loads(results[0].removeprefix("RESULT "))
    return took, peak


def measure(chosen: argparse.Namespace) -> tuple[float, float]:
    """Return seconds and the largest private memory of one estimate in this process [GiB].

    The record is a mapped file: its pages belong to the system's cache and are no part of private memory.
    """
    signals = np.load(chosen.file, mmap_mode="r")
    inputs = [f"U{k + 1}" for k in range(chosen.inputs)]
    outputs = [f"Y{k + 1}" for k in range(chosen.outputs)]
    peak, done = [private_memory()], threading.Event()

    def watch() -> None:
        while not done.wait(0.02):
            peak[0] = max(peak[0], private_memory())

    threading.Thread(target=watch, daemon=True).start()
    if chosen.case == "scipy":
        begin = time.perf_counter()
        pairwise_csd(signals, chosen.inputs, chosen.segment)
    else:
        import ibsdyn as ibs

        record = ibs.TimeRecord(signals, inputs + outputs, ["m/s²"] * len(signals), RATE)
        begin = time.perf_counter()
        length = chosen.segment if chosen.case == "welch" else chosen.segment // 2
        ibs.estimate_frf(record, inputs, outputs, chosen.case, window_length=length).radius(0.99)
    took = time.perf_counter() - begin
    done.set()
    return took, max(peak[0], private_memory()) / 2**30


def pairwise_csd(signals: np.ndarray, inputs: int, segment: int) -> None:
    """Estimate H1, its covariance and circles from one call of scipy.signal.csd for each pair of channels."""
    count = len(signals)
    lines = segment // 2 + 1
    spectra = np.empty((lines, count, count), dtype=complex)
    for a in range(count):
        for b in range(a, count):
            _, s = scipy.signal.csd(signals[b], signals[a], RATE, nperseg=segment)
            spectra[:, a, b], spectra[:, b, a] = s, s.conj()
    s_uu, s_yu, s_yy = spectra[1:-1, :inputs, :inputs], spectra[1:-1, inputs:, :inputs], spectra[1:-1, inputs:, inputs:]
    inverse = np.linalg.inv(s_uu)
    response = s_yu @ inverse
    left = s_yy - response @ s_yu.conj().transpose(0, 2, 1)
    averages = 0.948 * (2 * signals.shape[1] // segment - 1)
    variance = np.einsum("fii->fi", left).real[:, :, None] * np.einsum("fjj->fj", inverse).real[:, None]
    np.sqrt(4.605 * variance / (averages - inputs))


def private_memory() -> int:
    """Return the bytes of this process that no file stands behind (Linux)."""
    status = Path(f"/proc/{os.getpid()}/status").read_text()
    return int(status.split("RssAnon:")[1].split()[0]) * 1024


if __name__ == "__main__":
    main()

"""Speed and memory of reading and reducing: `python benchmarks/reduction.py --help`."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

SIZES = ("3e4", "1e5", "3e5", "1e6")
PARTS = ("flexure", "block")


def main() -> None:
    """Run the chosen cases one after the other and print what they measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", nargs="+", choices=SIZES, default=SIZES)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--others-up-to", choices=("none", *SIZES), default="1e5", help="Exudyn, CalculiX, reading")
    chosen = parser.parse_args()
    for size in chosen.sizes:
        others = chosen.others_up_to != "none" and float(size) <= float(chosen.others_up_to)
        for part in chosen.parts:
            print(f"\n{part}, about {size} DoF", flush=True)
            ours = show("ours", part, size)
            if ours is None or not others:
                continue
            for case, seconds in (("exudyn", "reduction [s]"), ("calculix", "whole run [s]")):
                other = show(case, part, size)
                if other is not None:
                    print(f"  {case} / ours: {other[seconds] / ours['reduction [s]']:.3g}", flush=True)
            show("reading", part, size)


def show(case: str, part: str, size: str) -> dict[str, Any] | None:
    """Measure in a process of its own and print; None, and why, where it failed."""
    command = [sys.executable, str(Path(__file__).with_name("cases.py")), case, part, size]
    run = subprocess.run(command, capture_output=True, text=True)
    results = [line for line in run.stdout.splitlines() if line.startswith("RESULT ")]
    if run.returncode or not results:
        reason = run.stderr.strip().splitlines()[-1:] or [f"ended with {run.returncode} (out of memory?)"]
        print(f"  {case}: {reason[0]}", flush=True)
        return None
    result: dict[str, Any] = json.loads(results[0].removeprefix("RESULT "))
    shown = [f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in result.items()]
    print(f"  {case}: " + ", ".join(shown), flush=True)
    return result


if __name__ == "__main__":
    main()

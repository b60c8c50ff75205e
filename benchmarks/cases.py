"""One measurement each, run by `reduction.py` in a process of its own so that peak memory is its own."""

from __future__ import annotations

import functools
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from parts import DENSITY, POISSON, YOUNG, Part, block, flexure

import fem_import as fi
from fem_import import factorization, interior, mkl
from fem_import.sparse_blocks import RowParallel

BLOCKS = {"3e4": (12, 10, 9), "1e5": (19, 15, 13), "3e5": (27, 23, 19), "1e6": (40, 33, 28)}
FLEXURES = {"3e4": (4, 1), "1e5": (5, 2), "3e5": (9, 2), "1e6": (13, 3)}
INTERFACES = {"left": "left", "right": "right"}


def make_part(name: str, size: str) -> Part:
    """Return the part of a name and a nominal size."""
    return block(BLOCKS[size]) if name == "block" else flexure(*FLEXURES[size])


class Stopwatch:
    """Seconds and calls spent inside some functions, which it wraps while it runs."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.columns: dict[str, int] = {}
        self._inside = False

    @contextmanager
    def watching(self, targets: list[tuple[str, Any, str]]) -> Iterator[None]:
        """Time calls of (label, owner, attribute)."""
        originals = [(owner, name, getattr(owner, name)) for _, owner, name in targets]
        for (label, _, _), (owner, name, function) in zip(targets, originals, strict=True):
            setattr(owner, name, self._timed(label, function))
        try:
            yield
        finally:
            for owner, name, function in originals:
                setattr(owner, name, function)

    def _timed(self, label: str, function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def timed(*arguments: Any, **keywords: Any) -> Any:
            if self._inside:
                return function(*arguments, **keywords)  # counted where it was called from
            self._inside = True
            start = time.perf_counter()
            try:
                result = function(*arguments, **keywords)
            finally:
                self._inside = False
                self.seconds[label] = self.seconds.get(label, 0.0) + time.perf_counter() - start
            if isinstance(result, np.ndarray) and result.ndim == 2:
                self.columns[label] = self.columns.get(label, 0) + result.shape[1]
            return result

        return timed


def ours(part: Part) -> dict[str, Any]:
    """Import from arrays and reduce; the bound is the time inside ordering, factor, solves and products."""
    K, M = part.matrices()
    labels = np.arange(1, len(part.positions) + 1)
    sets = {name: labels[rows] for name, rows in part.ends.items()}
    start = time.perf_counter()
    model = fi.FEModel.from_arrays(K, M, part.positions, 3, node_sets=sets)
    imported = time.perf_counter() - start
    del K, M
    watch = Stopwatch()
    factor_class = factorization.PardisoFactor if mkl.is_available() else factorization.SuperLUFactor
    targets = [
        ("ordering", interior, "elimination_order"),
        ("factor", factor_class, "__init__"),
        ("factor", factorization.MixedPrecisionFactor, "__init__"),
        ("solves", factor_class, "solve"),
        ("solves", factorization.MixedPrecisionFactor, "solve"),
        ("products", RowParallel, "__matmul__"),
    ]
    before_reduction = _peak_gib()
    with watch.watching(targets):
        start = time.perf_counter()
        body = fi.reduce(model, INTERFACES, part.cutoff)
        reduced = time.perf_counter() - start
    bound = sum(watch.seconds.values())
    return {
        "DoF": part.n_dofs,
        "modes": len(body.frequencies),
        "import [s]": imported,
        "reduction [s]": reduced,
        **{f"{label} [s]": seconds for label, seconds in watch.seconds.items()},
        "columns solved": watch.columns["solves"],
        "ratio to bound": reduced / bound,
        "peak [GiB]": _peak_gib(),
        "peak of import [GiB]": before_reduction,
        "first [Hz]": body.frequencies[0],
        "solver": body.solver,
    }


def exudyn(part: Part) -> dict[str, Any]:
    """Exudyn's Craig-Bampton modes of the same matrices, with as many modes and the same rigid interfaces."""
    from exudyn.FEM import FEMinterface, HCBstaticModeSelection
    from scipy import sparse

    K, M = part.matrices()
    fem = FEMinterface()
    fem.nodes = {"Position": part.positions}
    for name, matrix in (("massMatrix", M), ("stiffnessMatrix", K)):
        setattr(fem, name, sparse.csr_matrix(matrix))
    modes = len(fi.reduce(part.model(), INTERFACES, part.cutoff).frequencies)
    start = time.perf_counter()
    fem.ComputeHurtyCraigBamptonModes(
        boundaryNodesList=[part.ends["left"].tolist(), part.ends["right"].tolist()],
        nEigenModes=modes,
        useSparseSolver=True,
        computationMode=HCBstaticModeSelection.RBE2,
    )
    return {"reduction [s]": time.perf_counter() - start, "peak [GiB]": _peak_gib(), "modes": modes}


def calculix(part: Part) -> dict[str, Any]:
    """CalculiX's *FREQUENCY of the part with both ends held, 28 modes: assembly, factor and eigenmodes."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder, "part.inp")
        write_deck(part, deck, "*BOUNDARY\nLEFT,1,3\nRIGHT,1,3\n*STEP\n*FREQUENCY\n28\n")
        start = time.perf_counter()
        _run_ccx(deck)
        seconds = time.perf_counter() - start
        lines = deck.with_suffix(".dat").read_text().splitlines()
    first = next(float(words[3]) for words in map(str.split, lines) if len(words) == 5 and words[0] == "1")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    return {"whole run [s]": seconds, "peak [GiB]": peak, "first [Hz]": first}


def reading(part: Part) -> dict[str, Any]:
    """Reading CalculiX's export against numpy.loadtxt of its two matrices and against the disk."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder, "part.inp")
        write_deck(part, deck, "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n")
        _run_ccx(deck)
        matrices = [deck.with_suffix(suffix) for suffix in (".sti", ".mas")]
        size = sum(path.stat().st_size for path in matrices)
        disk = shortest(lambda: [path.read_bytes() for path in matrices])
        ours_seconds = shortest(lambda: fi.read(str(deck)))
        loadtxt = shortest(lambda: [np.loadtxt(path) for path in matrices])
    return {
        "MB": size / 1e6,
        "fi.read [s]": ours_seconds,
        "loadtxt [s]": loadtxt,
        "loadtxt / fi.read": loadtxt / ours_seconds,
        "fi.read / disk": ours_seconds / disk,
    }


def shortest(function: Callable[[], object], runs: int = 3) -> float:
    """Return the shortest time of some runs [s]."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def write_deck(part: Part, path: Path, step: str) -> None:
    """Write the part as a CalculiX deck of C3D10 elements."""
    labels = np.arange(1, len(part.positions) + 1)
    with path.open("w") as deck:
        deck.write("*NODE, NSET=NALL\n")
        np.savetxt(deck, np.column_stack([labels, part.positions]), fmt="%d,%.15g,%.15g,%.15g")
        deck.write("*ELEMENT, TYPE=C3D10, ELSET=EALL\n")
        # CalculiX numbers the mid-edge nodes 1-2, 2-3, 3-1, 1-4, 2-4, 3-4, as `parts` does.
        elements = np.column_stack([np.arange(1, len(part.elements) + 1), part.elements + 1])
        np.savetxt(deck, elements, fmt="%d", delimiter=",")
        for name, rows in part.ends.items():
            deck.write(f"*NSET, NSET={name.upper()}\n" + "".join(f"{row + 1},\n" for row in rows))
        deck.write(f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG},{POISSON}\n*DENSITY\n{DENSITY}\n")
        deck.write(f"*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n{step}*END STEP\n")


def _run_ccx(deck: Path) -> None:
    program = shutil.which("ccx")
    if program is None:
        raise FileNotFoundError("ccx (CalculiX) is not installed")
    subprocess.run([program, deck.stem], cwd=deck.parent, check=True, capture_output=True)


def _peak_gib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


CASES = {"ours": ours, "exudyn": exudyn, "calculix": calculix, "reading": reading}

if __name__ == "__main__":
    warnings.simplefilter("ignore", fi.ExportWarning)
    case, part_name, part_size = sys.argv[1:]
    print("RESULT " + json.dumps(CASES[case](make_part(part_name, part_size))))

"""Speed of reading text exports: `python benchmarks/reading.py --help`.

Writes one part in each program's text format and prints, for K and M together, the time of all of `fi.read`
(parsing, checks, model) against `numpy.loadtxt` of the same two files and against reading their bytes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from cases import BLOCKS, FLEXURES, make_part, shortest, write_deck
from parts import Part

import fem_import as fi

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "fem"))
import calculix_files
import export_writers


@dataclass(frozen=True)
class Export:
    """The two matrix files of one export, how it is read, and how loadtxt reads such a file (None: it cannot)."""

    files: tuple[Path, Path]
    read: Callable[[], fi.FEModel]
    loadtxt: dict[str, Any] | None


@dataclass(frozen=True, eq=False)
class Model:
    """A part as the writers of the tests take it."""

    K: Any
    M: Any
    positions: Any
    dofs: Any
    elements: Any
    node_sets: dict[str, Any]


def model_of(part: Part) -> Model:
    """Return the matrices and the table of DoF of a benchmark part."""
    K, M = part.matrices()
    labels = np.arange(1, len(part.positions) + 1)
    dofs = np.column_stack([np.repeat(labels, 3), np.tile([1, 2, 3], len(labels))])
    sets = {name.upper(): labels[rows] for name, rows in part.ends.items()}
    return Model(K, M, part.positions, dofs, part.elements + 1, sets)


def calculix(folder: Path, part: Part, model: Model) -> Export:
    """.sti and .mas."""
    deck = calculix_files.write_export(folder, model)
    write_deck(part, deck, "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n")
    return Export((deck.with_suffix(".sti"), deck.with_suffix(".mas")), lambda: fi.read(deck), {})


def matrix_market(folder: Path, part: Part, model: Model) -> Export:
    """One triangle, with a table of DoF."""
    stiffness = export_writers.write_matrix_market_job(folder, model)
    files = (stiffness, stiffness.with_name("part_M.mtx"))
    return Export(files, lambda: fi.read(stiffness, units="SI", dofs=folder / "dofs.csv"), {"skiprows": 3})


def abaqus(layout: str) -> Callable[[Path, Part, Model], Export]:
    """*MATRIX OUTPUT in one of its layouts."""

    def export(folder: Path, part: Part, model: Model) -> Export:
        deck = export_writers.write_abaqus_job(folder, model, layout)
        files = (folder / "job_STIF1.mtx", folder / "job_MASS1.mtx")
        how = {"delimiter": ","} if layout == "MATRIX INPUT" else {}
        return Export(files, lambda: fi.read(deck, units="SI"), how)

    return export


def ansys_export(folder: Path, part: Part, model: Model) -> Export:
    """*EXPORT,...,MMF with the vector of nodes."""
    stiffness = export_writers.write_ansys_mmf_job(folder, model)
    others = {"nodes": folder / "nodes.txt", "mapping": folder / "map.txt"}
    files = (stiffness, folder / "partMass.txt")
    return Export(files, lambda: fi.read(stiffness, units="SI", **others), {"skiprows": 3})


def ansys_hbmat(folder: Path, part: Part, model: Model) -> Export:
    """HBMAT with its mapping."""
    stiffness = export_writers.write_hbmat_job(folder, model)
    return Export((stiffness, folder / "mass.matrix"), lambda: fi.read(stiffness, units="SI"), None)


def nastran_punch(folder: Path, part: Part, model: Model) -> Export:
    """DMIG cards in large field; both matrices are in one file."""
    punch = export_writers.write_punch(folder, model)
    return Export((punch, punch), lambda: fi.read(punch, units="SI"), None)


FORMATS: dict[str, Callable[[Path, Part, Model], Export]] = {
    "CalculiX": calculix,
    "Matrix Market": matrix_market,
    "Ansys *EXPORT": ansys_export,
    "Ansys HBMAT": ansys_hbmat,
    "Abaqus MATRIX INPUT": abaqus("MATRIX INPUT"),
    "Abaqus LABELS": abaqus("LABELS"),
    "Abaqus COORDINATE": abaqus("COORDINATE"),
    "Nastran DMIG": nastran_punch,
}


def measured(export: Export, runs: int) -> str:
    """Return one line of the table."""
    files = list(dict.fromkeys(export.files))
    size = sum(file.stat().st_size for file in files) / 1e6
    ours = shortest(export.read, runs)
    disk = shortest(lambda: [file.read_bytes() for file in files], runs)
    ratio = "cannot"
    if export.loadtxt is not None:
        how = export.loadtxt
        ratio = f"{shortest(lambda: [np.loadtxt(file, **how) for file in files], runs) / ours:.2f}"
    return f"{size:>8.0f}{ours:>13.3f}{ratio:>19}{ours / disk:>17.1f}"


def main() -> None:
    """Write, read and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", choices=sorted(set(BLOCKS) & set(FLEXURES)), default="3e4")
    parser.add_argument("--part", choices=("flexure", "block"), default="flexure")
    parser.add_argument("--formats", nargs="+", choices=FORMATS, default=tuple(FORMATS))
    parser.add_argument("--runs", type=int, default=3, help="of which the shortest counts")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", fi.ExportWarning)
    part = make_part(chosen.part, chosen.size)
    model = model_of(part)
    print(f"{chosen.part}, {part.n_dofs} DoF; fi.read of K and M, shortest of {chosen.runs} runs")
    print(f"{'format':<22}{'MB':>8}{'fi.read [s]':>13}{'loadtxt / fi.read':>19}{'fi.read / bytes':>17}", flush=True)
    with tempfile.TemporaryDirectory() as root:
        for name in chosen.formats:
            folder = Path(root, name.replace("*", "").replace(" ", "_"))
            folder.mkdir()
            export = FORMATS[name](folder, part, model)
            print(f"{name:<22}" + measured(export, chosen.runs), flush=True)
            for file in folder.iterdir():
                file.unlink()


if __name__ == "__main__":
    main()

"""Readers, one file a program; `read` picks the right one."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, overload

from fem_import.errors import ExportError, MissingFileError, UnknownKeywordError, nearest_known
from fem_import.fe_model import FEModel
from fem_import.readers.abaqus import is_matrix_table, is_substructure, job_has_matrices, read_abaqus
from fem_import.readers.abaqus_substructure import read_abaqus_substructure
from fem_import.readers.ansys import is_full, read_ansys
from fem_import.readers.ansys_substructure import read_ansys_substructure, refuse_substructure_file
from fem_import.readers.calculix import JOB_SUFFIXES, job_stem, read_calculix
from fem_import.readers.harwell_boeing import is_harwell_boeing
from fem_import.readers.matlab import is_matlab, read_matlab
from fem_import.readers.matrix_market import read_matrix_market
from fem_import.readers.matrix_market_file import is_matrix_market
from fem_import.readers.nastran import is_bulk, read_nastran, read_nastran_superelement
from fem_import.readers.npz import read_npz
from fem_import.readers.packed_file import bare_suffix, first_bytes
from fem_import.reduced_body import ReducedBody

__all__ = [
    "read",
    "read_abaqus",
    "read_abaqus_substructure",
    "read_ansys",
    "read_ansys_substructure",
    "read_calculix",
    "read_matlab",
    "read_matrix_market",
    "read_nastran",
    "read_nastran_superelement",
    "read_npz",
]

_OPTIONS = ("mass", "damping", "mapping", "nodes", "node_sets", "deck", "dofs", "names", "bulk", "interfaces")
_OPTIONS_OF_SUPERELEMENTS = ("positions", "masters")
_HEAD = 4096
# Files that programs keep beside what is read here, and what to have written instead.
_INSTEAD = {
    ".op2": "Nastran's results in binary; have OUTPUT4 or DMIG written (EXTSEOUT: MATOP4= or DMIGPCH, not DMIGOP2)",
    ".odb": "Abaqus' results; *MATRIX GENERATE and *MATRIX OUTPUT, STIFFNESS, MASS write job_STIF1.mtx as text",
    ".sim": "Abaqus' own binary form; *MATRIX OUTPUT, STIFFNESS, MASS writes job_STIF1.mtx as text",
    ".rst": "Ansys' results; its matrices are in the .full file, or HBMAT writes them as text",
    ".db": "Ansys' database; its matrices are in the .full file, or HBMAT writes them as text",
    ".emat": "Ansys' element matrices; the assembled ones are in the .full file, or HBMAT writes them as text",
    ".frd": "CalculiX' results; *FREQUENCY, SOLVER=MATRIXSTORAGE writes .sti, .mas and .dof",
    ".mph": "COMSOL's model; mphmatrix of LiveLink gives the matrices, to be saved as .mat",
}


@overload
def read(
    path: str | os.PathLike[str], units: str | None = None, *, interfaces: Mapping[str, int], **options: Any
) -> ReducedBody: ...


@overload
def read(path: str | os.PathLike[str], units: str | None = None, **options: Any) -> FEModel: ...


def read(path: str | os.PathLike[str], units: str | None = None, **options: Any) -> FEModel | ReducedBody:
    """Read an export; the program it comes from is told by the files.

    Parameters
    ----------
    path : a CalculiX job (.inp, .sti, .mas, .dof or the stem); an Abaqus job (.inp with _STIF1.mtx beside it) or
        its stiffness matrix; an Ansys stiffness matrix (HBMAT or *EXPORT text) or .full file; a Matrix Market
        file; a .npz or .mat; DMIG cards or OUTPUT4 (.op4) of Nastran. Gzipped or not.
    units : of the model: "SI", "mm-t-s", "mm-kg-s" or "in-lbf-s". Required, except for CalculiX, whose reader
        takes "SI" by default.
    interfaces : {name: node label} of a superelement that the program has reduced already (Abaqus substructure,
        Nastran EXTSEOUT, Ansys .sub as text), and only of such: interfaces of a model are given to fi.reduce.
    options : what the reader of that program takes: mass=, nodes=, mapping=, deck= ...; see read_ansys,
        read_abaqus, read_matrix_market, read_npz, read_matlab, read_nastran, and for superelements
        read_abaqus_substructure, read_nastran_superelement, read_ansys_substructure.

    Returns
    -------
    FEModel : checked, SI; with interfaces= the ReducedBody that the superelement is.

    Raises
    ------
    ExportError : no reader knows the file, or it is damaged. MissingFileError, UnknownNameError.
    """
    known = ("path", "units", *_OPTIONS, *(_OPTIONS_OF_SUPERELEMENTS if "interfaces" in options else ()))
    for option in options:
        if option not in known:
            raise UnknownKeywordError(f"read() has no parameter {option!r}.{nearest_known(option, known)}")
    given = Path(path)
    if "interfaces" in options:
        return _reader_of_superelement(given)(given, units=units, **options)
    if _is_calculix_job(given):
        if options:
            raise ExportError(
                f"{given.name} is a CalculiX job, whose files are found by name; leave {next(iter(options))}= out."
            )
        return read_calculix(given, units="SI" if units is None else units)
    return _reader_of(given, options)(given, units=units, **options)


def _is_calculix_job(given: Path) -> bool:
    stem = job_stem(given)
    suffixes = [suffix for suffix in JOB_SUFFIXES if suffix != ".inp"]
    beside = any(stem.with_name(stem.name + suffix + packed).exists() for suffix in suffixes for packed in ("", ".gz"))
    return beside or bare_suffix(given) in suffixes


def _refuse_other_files(given: Path) -> None:
    refuse_substructure_file(given)
    what = _INSTEAD.get(bare_suffix(given))
    if what is not None:
        raise ExportError(f"{given.name} is {what}. The commands are in docs/import.md.")


def _reader_of_superelement(given: Path) -> Callable[..., ReducedBody]:
    _refuse_other_files(given)
    head = first_bytes(given, _HEAD)
    if is_substructure(head):
        return read_abaqus_substructure
    if bare_suffix(given) == ".op4" or is_bulk(head):
        return read_nastran_superelement
    if is_matrix_market(head):
        return read_ansys_substructure
    raise ExportError(
        f"{given.name} is no superelement that is reduced already (Abaqus substructure, Nastran EXTSEOUT, Ansys .sub "
        "as text). Leave interfaces= out and give them to fi.reduce(fi.read(...), interfaces=...)."
    )


def _reader_of(given: Path, options: dict[str, Any]) -> Callable[..., FEModel]:
    _refuse_other_files(given)
    head = first_bytes(given, _HEAD)
    suffix = bare_suffix(given)
    if suffix == ".inp":
        if job_has_matrices(given):
            return read_abaqus
        raise MissingFileError(
            f"No matrices lie beside {given.name}. CalculiX writes {given.stem}.sti, .mas and .dof by *FREQUENCY, "
            f"SOLVER=MATRIXSTORAGE; Abaqus writes {given.stem}_STIF1.mtx and _MASS1.mtx by *MATRIX GENERATE and "
            "*MATRIX OUTPUT, STIFFNESS, MASS."
        )
    if is_full(given) or is_harwell_boeing(head):
        return read_ansys
    if is_matrix_market(head):
        if b"ansys" in head.lower() or "mapping" in options:
            return read_ansys
        return read_matrix_market
    if head.startswith(b"PK"):
        return read_npz
    if suffix == ".op4" or is_bulk(head):
        return read_nastran
    if is_matlab(head):
        return read_matlab
    if is_substructure(head) or is_matrix_table(head):
        return read_abaqus
    known = (
        "Known: jobs of CalculiX and Abaqus (.inp with the matrices beside it), stiffness matrices of Ansys (HBMAT, "
        "*EXPORT), .full, Matrix Market with dofs=, .npz, .mat, DMIG, .op4."
    )
    if suffix in (".cdb", ".mapping"):
        raise ExportError(
            f"{given.name} holds no matrices. Give the stiffness matrix, and this file as nodes= or mapping=."
        )
    raise ExportError(
        f"{given.name}: no reader knows this kind of file. {known} Matrices of other programs come in by "
        "FEModel.from_arrays."
    )

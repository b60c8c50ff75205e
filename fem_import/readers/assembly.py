"""From matrices with a DoF table, as the readers find them, to an FEModel."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from fem_import.errors import ExportError, MissingFileError, warn_user
from fem_import.export_report import MINIMUM_DIGITS
from fem_import.fe_model import FEModel
from fem_import.readers.node_table import Nodes

IntArray: TypeAlias = NDArray[np.int64]
SparseMatrix: TypeAlias = "sparse.csr_array[Any, tuple[int, int]]"

_PENALTY = 1e30  # programs write 1e36 on the diagonal of a constrained DoF


@dataclass(frozen=True, eq=False)
class LabelledMatrices:
    """K, M and C (or None) of one export, both triangles, with node label and direction of each row (n, 2).

    of_one_triangle: whether each was printed as one triangle, so that there is no other to compare it with.
    """

    K: SparseMatrix
    M: SparseMatrix
    C: SparseMatrix | None
    dofs: IntArray
    digits: int | None
    of_one_triangle: bool = False

    def without_null_rows(self) -> LabelledMatrices:
        """Leave out the rows that nothing touches: DoF that the program keeps although they are constrained."""
        used = np.zeros(len(self.dofs), dtype=bool)
        for matrix in self._matrices():
            used |= np.diff(matrix.indptr) > 0
        return self._rows(used)

    def without_penalties(self) -> LabelledMatrices:
        """Leave out the rows whose diagonal says 1e36: constrained DoF."""
        return self._rows(self.K.diagonal() < _PENALTY)

    def _matrices(self) -> list[SparseMatrix]:
        return [matrix for matrix in (self.K, self.M, self.C) if matrix is not None]

    def _rows(self, kept: NDArray[np.bool_]) -> LabelledMatrices:
        if np.all(kept):
            return self
        if not np.any(kept):
            raise ExportError("Every DoF of the export is constrained or empty; there is nothing to import.")
        rows = np.flatnonzero(kept)

        def reduced(matrix: SparseMatrix) -> SparseMatrix:
            return sparse.csr_array(matrix[rows][:, rows])

        return replace(
            self,
            K=reduced(self.K),
            M=reduced(self.M),
            C=None if self.C is None else reduced(self.C),
            dofs=self.dofs[rows],
        )

    def model(self, nodes: Nodes, units: str, source: str, node_sets: Mapping[str, ArrayLike] | None = None) -> FEModel:
        """Make the FEModel; warn where too few digits are printed. node_sets go before those of `nodes`."""
        sets: dict[str, ArrayLike] = {**nodes.sets, **(node_sets or {})}
        missing = np.setdiff1d(self.dofs[:, 0], nodes.labels)
        if len(missing):
            raise ExportError(
                f"{source}: the matrices have rows of node {missing[0]}, of which the nodes give no position "
                f"({len(missing)} such). Are the nodes of another model, or only a selection of them?"
            )
        part = FEModel.from_arrays(
            K=self.K,
            M=self.M,
            C=self.C,
            positions=nodes.positions,
            dofs=self.dofs,
            node_ids=nodes.labels,
            node_sets=sets,
            units=units,
            source=source,
            digits=self.digits,
            copy=False,
            symmetric=self.of_one_triangle,
        )
        warn_of_few_digits(self.digits, source)
        return part


def warn_of_few_digits(digits: int | None, source: str) -> None:
    """Issue an ExportWarning below the digits that a flexure needs."""
    if digits is not None and digits < MINIMUM_DIGITS:
        warn_user(
            f"{source}: the matrices are printed with {digits} digits; below {MINIMUM_DIGITS} the rigid-body modes of "
            "flexures rise from zero and flexible modes go wrong. Export with more digits or in binary."
        )


def refuse_other_size(size: int, n_dofs: int, matrix_name: str, table_name: str) -> None:
    """Raise ExportError if a matrix and its DoF table do not fit; said before anything large is made of it."""
    if size != n_dofs:
        raise ExportError(
            f"{matrix_name} has {size} rows and {table_name} has {n_dofs} DoF; they are of different runs or models."
        )


def mass_beside(stiffness: Path, kinds: tuple[tuple[str, str], ...], how_to_export: str) -> Path:
    """Find the mass matrix of a stiffness file: the same name with another word in it ("STIF" -> "MASS")."""
    for stiffness_word, mass_word in kinds:
        # A single letter counts where it stands alone: K.mtx or beam_K.mtx, not block.mtx.
        pattern = r"(?<![^\W_])%s(?![^\W_])" if len(stiffness_word) == 1 else "%s"
        matches = list(re.finditer(pattern % stiffness_word, stiffness.name, re.IGNORECASE))
        if not matches:
            continue
        place = matches[-1].start()
        spelled = stiffness.name[place : place + len(stiffness_word)]
        word = mass_word.upper() if spelled.isupper() else mass_word.capitalize() if spelled.istitle() else mass_word
        name = stiffness.name[:place] + word + stiffness.name[place + len(stiffness_word) :]
        for candidate in (stiffness.with_name(name), stiffness.with_name(name + ".gz")):
            if candidate.is_file():
                return candidate
        raise MissingFileError(
            f"{name} is not beside {stiffness.name}: the mass matrix. The analysis never formed it, or it has another "
            f"name: give mass=. {how_to_export}"
        )
    raise MissingFileError(
        f"{stiffness.name} is one matrix and its name does not tell that of the mass matrix. Give mass=. "
        f"{how_to_export}"
    )

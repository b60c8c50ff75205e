"""The flexible modes of a reduced body by itself."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fem_import.reduced_body import ReducedBody

FloatArray: TypeAlias = NDArray[np.float64]

_RIGID = 1e-14  # of the highest eigenvalue: what rounding leaves of rigid-body modes is below


def flexible_modes(body: ReducedBody) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (k,) [Hz] and shapes (n, k) of unit modal mass; rigid-body modes are left out.

    M and K are scaled to a unit diagonal of M first: metres and radians differ by orders of magnitude.
    """
    scale = 1.0 / np.sqrt(np.diag(body.M))
    weights = np.outer(scale, scale)
    values, shapes = linalg.eigh(body.K * weights, body.M * weights)
    # A part held in some directions only (half of a symmetric one) has rigid-body modes too.
    rigid = 6 if body.is_free else int(np.count_nonzero(values < _RIGID * values[-1]))
    frequencies = np.sqrt(np.maximum(values[rigid:], 0.0)) / (2.0 * np.pi)
    return frequencies, scale[:, None] * shapes[:, rigid:]

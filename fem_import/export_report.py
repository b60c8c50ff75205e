"""What an imported model says about itself: the proof that the import is right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MINIMUM_DIGITS = 12
"""Printed digits below which flexures suffer: at 10 digits rigid modes were measured to rise to 2.6 Hz."""


@dataclass(frozen=True, eq=False)
class ExportReport:
    """Properties of an FEModel, SI.

    mass_per_axis (3,) [kg]; centre_of_mass (3,) [m]; inertia (3, 3) about it [kg m2], tensor elements;
    rigid_body_residual (6,): largest |K R| of a row over the sum of |K| |R| of that row, x..rz, 0 for a free
    part; rigid_body_frequencies (6,) [Hz]: what R^T K R and R^T M R make of the rigid motions;
    symmetry_residual: largest scaled K_ij - K_ji as exported; digits: printed ones, None where there are
    none; support: "free", "held" or "unclear"; findings: what deserves attention, in words.
    """

    source: str
    units: str
    n_nodes: int
    n_dofs: int
    mass_per_axis: NDArray[np.float64]
    centre_of_mass: NDArray[np.float64]
    inertia: NDArray[np.float64]
    rigid_body_residual: NDArray[np.float64]
    rigid_body_frequencies: NDArray[np.float64]
    symmetry_residual: float
    digits: int | None
    support: str
    node_sets: tuple[str, ...]
    findings: tuple[str, ...]

    @property
    def is_free(self) -> bool:
        """Whether all six rigid-body motions strain nothing."""
        return self.support == "free"

    @property
    def mass(self) -> float:
        """Mean of the masses along the three axes [kg]."""
        return float(np.mean(self.mass_per_axis))

    def __str__(self) -> str:
        """Return the report as a table."""
        tensor = self.inertia
        products = (tensor[0, 1], tensor[0, 2], tensor[1, 2])
        rows = [
            ("source", self.source),
            ("units of the export", self.units),
            ("nodes, DoF", f"{self.n_nodes}, {self.n_dofs}"),
            ("mass x, y, z", _numbers(self.mass_per_axis) + " kg"),
            ("centre of gravity", _numbers(self.centre_of_mass) + " m"),
            ("Ixx, Iyy, Izz about it", _numbers(np.diag(tensor)) + " kg m2"),
            ("Ixy, Ixz, Iyz (tensor)", _numbers(np.array(products)) + " kg m2"),
            ("support", self.support),
            ("rigid-body residual", f"{self.rigid_body_residual.max():.1e} of the row (six motions, worst)"),
            ("symmetry residual", f"{self.symmetry_residual:.1e}"),
            ("printed digits", "not printed: arrays" if self.digits is None else str(self.digits)),
            ("node sets", ", ".join(self.node_sets) or "none"),
        ]
        if self.is_free:
            highest = self.rigid_body_frequencies.max()
            frequency = (
                "unknown: a rigid-body motion moves no mass" if np.isnan(highest) else f"{max(highest, 1e-6):.1g} Hz"
            )
            rows.insert(9, ("rigid-body modes below", frequency))
        width = max(len(label) for label, _ in rows)
        lines = [f"{label:<{width}}  {value}" for label, value in rows]
        lines += [f"! {finding}" for finding in self.findings] or ["no findings"]
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Return the same, which says more at a prompt than the arrays."""
        return str(self)


def _numbers(values: NDArray[np.float64]) -> str:
    return ", ".join(f"{value:.6g}" for value in values)

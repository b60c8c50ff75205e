"""The table of components as text, with units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ibsdyn.axes import INERTIA_NAMES, STIFFNESS_NAMES
from ibsdyn.components import Connection, Fixation, Inertia1D, Item, RigidBody


def component_table(
    name: str, axis: str | None, items: Mapping[str, Item], connections: Mapping[str, Connection]
) -> str:
    """Return all components and their parameters as a text table."""
    kind = "3-D" if axis is None else f"1-D along {axis}"
    lines = [f"{name} ({kind})"]
    for item in items.values():
        if isinstance(item, Fixation):
            lines.append(f"  fixation       {item.name}: position {_row(item.position)} m")
        elif isinstance(item, RigidBody):
            inertia = ", ".join(f"{n} {v:.4g}" for n, v in zip(INERTIA_NAMES, item.inertia, strict=True))
            lines.append(
                f"  rigid body     {item.name}: mass {item.mass:.4g} kg, CoG {_row(item.cog)} m, {inertia} kg m²"
            )
        elif isinstance(item, Inertia1D):
            unit = "kg m²" if axis is not None and axis.startswith("r") else "kg"
            lines.append(f"  rigid body     {item.name}: {item.inertia:.4g} {unit}")
        else:
            reduced = item.reduced
            modes = len(reduced.coordinates) - 6 * len(reduced.interfaces)
            lines.append(
                f"  flexible body  {item.name}: {reduced.mass:.4g} kg, interfaces {', '.join(reduced.interfaces)}, "
                f"{modes} modes, {_loss(item.zeta, reduced.C is not None)}"
            )
    for connection in connections.values():
        lines.append(
            f"  connection     {connection.name}: {connection.item1} to {connection.item2}, {_spring(connection, axis)}"
        )
    return "\n".join(lines)


def _spring(connection: Connection, axis: str | None) -> str:
    loss = _loss(connection.zeta, connection.damping is not None)
    if axis is not None:
        unit = "N·m/rad" if axis.startswith("r") else "N/m"
        return f"k {connection.stiffness[0]:.4g} {unit}, {loss}"
    values = ", ".join(f"{n} {k:.4g}" for n, k in zip(STIFFNESS_NAMES, connection.stiffness, strict=True))
    where = f"at {_row(connection.position1 or ())} m"
    if connection.position2 != connection.position1:
        where = f"from {_row(connection.position1 or ())} to {_row(connection.position2 or ())} m"
    return f"{where}, {values} (N/m, N·m/rad), {loss}"


def _loss(zeta: float, explicit: bool) -> str:
    return "explicit damping" if explicit else f"zeta {zeta:.3g}"


def _row(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{v:.4g}" for v in values) + ")"

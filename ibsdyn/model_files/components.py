"""Tables of a model file turned into components of a model."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ibsdyn.errors import nearest
from ibsdyn.model import Model
from ibsdyn.model_files.flexible_bodies import FLEXIBLE_KEYS, reduced_body
from ibsdyn.model_files.table import Table

FIXATION_KEYS = ("position",)
RIGID_BODY_KEYS = ("mass", "cog", "inertia", "products")
CONNECTION_KEYS = (
    "between",
    "position1",
    "position2",
    "stiffness",
    "zeta",
    "axes",
    "damping",
    "elastic_centre",
)


def add_fixation(model: Model, name: str, table: Table) -> None:
    """Add a fixation."""
    table.refuse_unknown(FIXATION_KEYS)
    with table.placed_errors():
        model.fixation(name, table.numeric("position", (0.0, 0.0, 0.0)))


def add_rigid_body(model: Model, name: str, table: Table) -> None:
    """Add a rigid body, or the one inertia of a 1-D model."""
    table.refuse_unknown(RIGID_BODY_KEYS)
    products = table.choice("products", ("tensor", "integral")) if "products" in table else "tensor"
    with table.placed_errors():
        model.rigid_body(name, table.numeric("mass"), table.numeric("cog"), table.numeric("inertia"), products)


def add_flexible_body(model: Model, name: str, table: Table) -> None:
    """Add a flexible body out of a reduced body's file or an export."""
    table.refuse_unknown(FLEXIBLE_KEYS)
    with table.placed_errors():
        model.flexible_body(name, reduced_body(table), table.numeric("zeta", 0.0))


def add_connection(model: Model, name: str, table: Table) -> None:
    """Add a connection."""
    table.refuse_unknown(CONNECTION_KEYS)
    between = table.values.get("between")
    if not isinstance(between, list) or len(between) != 2 or not all(isinstance(end, str) for end in between):
        got = "is missing" if between is None else f"got {between!r}"
        raise table.error("between", f'must name two items, as ["platform", "flexure.base"]; {got}.')
    with table.placed_errors():
        model.connection(
            name,
            between[0],
            between[1],
            position1=table.numeric("position1"),
            position2=table.numeric("position2"),
            stiffness=table.numeric("stiffness"),
            zeta=table.numeric("zeta", 0.0),
            axes=table.numeric("axes"),
            damping=table.numeric("damping"),
            elastic_centre=table.numeric("elastic_centre"),
        )


ITEMS: Mapping[str, Callable[[Model, str, Table], None]] = {
    "fixation": add_fixation,
    "rigid_body": add_rigid_body,
    "flexible_body": add_flexible_body,
}
COMPONENTS: Mapping[str, Callable[[Model, str, Table], None]] = {**ITEMS, "connection": add_connection}


def add_component(model: Model, kind: str, name: str, table: Table) -> None:
    """Add a component of a kind.

    Raises
    ------
    ModelFileError : an unknown kind, an unknown key, or a value that cannot be right.
    """
    if kind not in COMPONENTS:
        raise table.error("kind", f"{kind!r} is not known. {nearest(kind, COMPONENTS)}")
    COMPONENTS[kind](model, name, table)

"""The flexible body of a model file: a reduced body beside it, or an FE export that is reduced when it is read."""

from __future__ import annotations

from typing import Any

import fem_import as fi
from fem_import.selection import Selection
from ibsdyn.model_files.table import Table

_READ_PATHS = ("mass", "damping", "mapping", "nodes", "deck", "dofs", "bulk")
_READ_TABLES = ("node_sets", "names")
_REDUCE_KEYS = ("tie", "method", "inertia_vectors", "min_participation")
EXPORT_KEYS = (
    "export",
    "units",
    *_READ_PATHS,
    *_READ_TABLES,
    "interfaces",
    "sensors",
    "max_frequency",
    *_REDUCE_KEYS,
    "cache",
)
FLEXIBLE_KEYS = ("reduced", *EXPORT_KEYS, "zeta")
_INTERFACE_KEYS = ("nodes", "position", "tie", "weights", "box", "plane", "cylinder")
_REGIONS: dict[str, tuple[type[Selection], tuple[str, ...]]] = {
    "box": (fi.Box, ("lower", "upper")),
    "plane": (fi.Plane, ("point", "normal", "thickness")),
    "cylinder": (fi.Cylinder, ("point", "axis", "radius", "inner_radius", "start", "end")),
}


def reduced_body(table: Table) -> fi.ReducedBody:
    """Return the reduced body that a table refers to.

    Raises
    ------
    ModelFileError : neither or both of reduced and export, keys that do not belong together, a path outside.
    FemImportError : what is wrong with the file or the reduction.
    """
    if ("reduced" in table) == ("export" in table):
        raise table.error("reduced", "give either reduced (a .npz of ReducedBody.save) or export (an FE export).")
    if "reduced" in table:
        for key in table.values:
            if key in EXPORT_KEYS:
                raise table.error(key, "belongs to an export; the body in reduced has been reduced already.")
        return fi.ReducedBody.load(table.path("reduced"))
    options: dict[str, Any] = {key: table.path(key) for key in _READ_PATHS if key in table}
    options |= {key: table.inner(key).values for key in _READ_TABLES if key in table}
    for key in ("interfaces", "max_frequency"):
        if key not in table:
            raise table.error(key, "is missing; an export needs it to be reduced.")
    part = fi.read(table.path("export"), units=table.text("units") if "units" in table else None, **options)
    return fi.reduce(
        part,
        _nodes(table, "interfaces"),
        table.numeric("max_frequency"),
        sensors=_nodes(table, "sensors") if "sensors" in table else None,
        cache=table.path("cache") if "cache" in table else None,
        **{key: table.values[key] for key in _REDUCE_KEYS if key in table},
    )


def _nodes(table: Table, key: str) -> dict[str, Any]:
    listed = table.inner(key)
    return {name: _interface(listed, name) for name in listed.values}


def _interface(listed: Table, name: str) -> Any:
    given = listed.values[name]
    if isinstance(given, (str, list, int)):
        return given
    table = listed.inner(name)
    table.refuse_unknown(_INTERFACE_KEYS)
    sources = [key for key in ("nodes", *_REGIONS) if key in table]
    if len(sources) != 1:
        raise table.error("nodes", f"give one of nodes, {', '.join(_REGIONS)}; got {sources or 'none'}.")
    source = sources[0]
    nodes = table.values[source] if source == "nodes" else _region(table, source)
    options = {key: table.numeric(key) for key in ("position", "weights") if key in table}
    if "tie" in table:
        options["tie"] = table.text("tie")
    return fi.Interface(nodes, **options)


def _region(table: Table, source: str) -> Selection:
    kind, keys = _REGIONS[source]
    region = table.inner(source)
    region.refuse_unknown(keys)
    try:
        return kind(**{key: region.numeric(key) for key in region.values})
    except TypeError as error:
        raise region.error(source, f"needs {', '.join(keys)}: {error}.") from None

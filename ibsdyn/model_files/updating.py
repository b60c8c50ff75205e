"""A model written into a file that is there: comments, parameters and expressions stay where nothing changed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Array

from fem_import.errors import FemImportError
from ibsdyn.errors import IbsdynError
from ibsdyn.model import Model
from ibsdyn.model_files.reading import model_of, parsed
from ibsdyn.model_files.writing import toml_value, written_tables


def updated_text(text: str, source: Path, model: Model) -> str | None:
    """Return a file's text changed as little as makes it that of a model; None where that cannot be done.

    Parameters
    ----------
    text : of the file as it is.
    source : its path, for the paths in it.
    model : what the text shall stand for; its flexible bodies' files are beside it already.

    Notes
    -----
    The result is read back and held against the model before it is returned: a file whose tables depend on each other
    in a way that is not foreseen here is not changed but written anew.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about what was in the file; its reader has been told before
            old = written_tables(model_of(parsed(text, source.name), source))
            document = tomlkit.parse(text)
            _update(document, old, written_tables(model))
            changed = model_of(parsed(tomlkit.dumps(document), source.name), source)
            if list(changed.items) != list(model.items):  # tables of one kind stand where the first of them stood
                document["model"]["order"] = toml_value(list(model.items))
                changed = model_of(parsed(tomlkit.dumps(document), source.name), source)
            if changed == model:
                return tomlkit.dumps(document)
    except (IbsdynError, FemImportError, TOMLKitError, OSError):
        pass  # whatever stands in the way, the file can be written anew
    return None


def _update(document: MutableMapping[str, Any], old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    _update_keys(document.setdefault("model", tomlkit.table()), old["model"], new["model"])
    for kind in dict.fromkeys((*old, *new)):
        if kind == "model":
            continue
        before, after = old.get(kind, {}), new.get(kind, {})
        for name in before.keys() - after.keys():
            document[kind].pop(name, None)
        for name, values in after.items():
            if before.get(name) == values:
                continue
            group = document.setdefault(kind, tomlkit.table(is_super_table=True))
            if name in group and kind != "flexible_body":
                _update_keys(group[name], before.get(name, {}), values)
            else:  # an export that is no longer what the body is goes with all its keys
                table = tomlkit.table()
                _update_keys(table, {}, values)
                group.pop(name, None)
                group[name] = table


def _update_keys(table: MutableMapping[str, Any], old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    for key in old.keys() - new.keys():
        table.pop(key, None)
    if old.get("inertia") != new.get("inertia"):
        table.pop("products", None)  # what is written are the elements of the tensor
    for key, value in new.items():
        if key in old and old[key] == value:
            continue
        there, before = table.get(key), old.get(key)
        if isinstance(there, Array) and isinstance(before, list) and len(there) == len(before) == len(value):
            for place, (one, other) in enumerate(zip(before, value, strict=True)):
                if one != other:
                    there[place] = toml_value(other)
        else:
            table[key] = toml_value(value)

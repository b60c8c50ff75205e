"""A model onto the disk: bodies first, then the text, each whole or not at all."""

from __future__ import annotations

import os

from ibsdyn.components import FlexibleBody
from ibsdyn.errors import warn_user
from ibsdyn.model import Model
from ibsdyn.model_files.text_file import checked_path, read_text, write_text
from ibsdyn.model_files.updating import updated_text
from ibsdyn.model_files.writing import body_file, toml_text, write_body, written_tables


def write_model(model: Model, path: str | os.PathLike[str]) -> None:
    """Write a model; see ``Model.to_toml``."""
    target = checked_path(path, "to_toml")
    text = toml_text(written_tables(model))
    for item in model.items.values():
        if isinstance(item, FlexibleBody):
            write_body(item.reduced, target.parent / body_file(item))
    if target.exists():
        before = read_text(target)
        kept = updated_text(before, target, model)
        if kept is None and ("#" in before or "[parameters]" in before):
            warn_user(f"{target.name} is written anew; the comments and expressions that stood in it are gone.")
        text = text if kept is None else kept
    write_text(target, text)

"""Models as files: TOML text, tables of components, the files beside them."""

from ibsdyn.model_files.reading import read_model
from ibsdyn.model_files.saving import write_model

__all__ = ["read_model", "write_model"]

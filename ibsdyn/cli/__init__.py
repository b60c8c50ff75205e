"""The command line ``ibsdyn``: models as files in, tables, figures and JSON out."""

from ibsdyn.cli.main import main

__all__ = ["main"]

"""The program: arguments in, one command run, its outcome printed, an exit code out."""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from collections.abc import Sequence
from typing import Any, NoReturn, TextIO

from fem_import import ExportWarning, FemImportError
from fem_import.errors import nearest_known
from ibsdyn.cli import (
    budget,
    check,
    compare,
    frf,
    history,
    import_part,
    modes,
    new,
    reduce_part,
    report,
    simulate,
    study,
)
from ibsdyn.cli.outcome import WRONG
from ibsdyn.errors import IbsdynError

# In the order in which a newcomer meets them.
COMMANDS = (new, check, modes, frf, budget, study, import_part, reduce_part, simulate, compare, history, report)
INTERRUPTED = 130

_INTRODUCTION = """\
Dynamics of precision machines from a table of components.

  ibsdyn new mirror.toml            write a commented model to start from
  ibsdyn check mirror.toml          what is doubtful in it, and which requirements it meets
  ibsdyn modes mirror.toml          frequencies, damping, what strains and what moves
  ibsdyn report mirror.toml         one HTML page for the design review
"""
_EXIT_CODES = """\
exit codes: 0 done; 1 done, but a requirement is missed or there are remarks; 2 not done, something given is wrong.
Every command takes --json and prints one JSON object then.
"""


class _Parser(argparse.ArgumentParser):
    """argparse, but one line for an error, and the nearest known command for an unknown one."""

    def error(self, message: str) -> NoReturn:
        self.exit(WRONG, f"{self.prog}: error: {message.rstrip('.')}. See {self.prog} --help.\n")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, f"there is no {value!r}.{nearest_known(value, action.choices)}")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    whole = _Parser(
        prog="ibsdyn",
        description=_INTRODUCTION,
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    whole.add_argument("--version", action="version", version=_version())
    commands = whole.add_subparsers(dest="command", metavar="command", required=True, parser_class=_Parser)
    for module in COMMANDS:
        one = commands.add_parser(
            module.NAME,
            help=module.SUMMARY,
            description=module.SUMMARY[0].upper() + module.SUMMARY[1:] + ".",
            epilog=module.EXAMPLES,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(one)
        one.add_argument("--json", action="store_true", help="print one JSON object instead of text")
        one.set_defaults(run=module.run, parser=one)
    return whole


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : without the program's name; those of the process if None.
    """
    try:
        given, unknown = parser().parse_known_args(arguments)
        if unknown:
            given.parser.error(_stranger(unknown, given.parser))
    except SystemExit as end:  # argparse has said what there is to say
        return int(end.code or 0)
    os.environ.setdefault("MPLBACKEND", "Agg")  # figures go to files; a terminal may have no display
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", ExportWarning)
            warnings.showwarning = _one_line
            outcome = given.run(given)
    except (IbsdynError, FemImportError, OSError) as error:
        return _fail(_told(error))
    except MemoryError:
        return _fail("not enough memory for this model.")
    except KeyboardInterrupt:
        print("\nibsdyn: stopped.", file=sys.stderr)
        return INTERRUPTED
    try:
        print(outcome.to_json() if given.json else outcome.text)
        sys.stdout.flush()
    except BrokenPipeError:  # `ibsdyn modes ... | head` has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return int(outcome.status)


def _stranger(unknown: Sequence[str], command: argparse.ArgumentParser) -> str:
    """Say which argument a command does not take, and the nearest option that it does."""
    option = next((word.partition("=")[0] for word in unknown if word.startswith("-")), None)
    if option is None:
        return f"{unknown[0]!r} is one argument too many"
    known = dict.fromkeys(re.findall(r"--[a-z-]+", command.format_usage()))
    return f"there is no {option}.{nearest_known(option, known)}"


def _told(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename and not isinstance(error, (IbsdynError, FemImportError)):
        return f"{error.filename}: {error.strerror or error}"
    return str(error)


def _fail(message: str) -> int:
    print(f"ibsdyn: error: {' '.join(message.split())}", file=sys.stderr)
    return WRONG


def _one_line(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Show a warning as one line; where in Python it arose means nothing to who uses the command line."""
    print(f"ibsdyn: warning: {' '.join(str(message).split())}", file=sys.stderr)


def _version() -> str:
    from importlib.metadata import version

    return f"ibsdyn {version('ibsdyn')}, exudyn {version('exudyn')}"

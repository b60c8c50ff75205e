"""The pages of the API reference: every public name, by the module that defines it."""

from __future__ import annotations

import contextlib
import importlib
import inspect
import io
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from types import ModuleType

from docstrings import escaped

from ibsdyn.cli.main import COMMANDS, parser

PACKAGES = {"ibsdyn": "ibs", "fem_import": "fi"}


@dataclass(frozen=True)
class Group:
    """The public names that one module defines.

    Attributes
    ----------
    package : through which they are imported.
    module : that defines them.
    names : in the order of its source.
    """

    package: str
    module: str
    names: tuple[str, ...]

    @property
    def page(self) -> str:
        """The name of its page."""
        return self.module

    @property
    def title(self) -> str:
        """The module's name as words."""
        words = self.module.split(".", 1)[1].replace(".", ": ").replace("_", " ")
        return words[0].upper() + words[1:]

    @property
    def purpose(self) -> str:
        """The first paragraph of the module's docstring, as reStructuredText."""
        text = inspect.getdoc(sys.modules[self.module]) or ""
        return escaped(" ".join(text.split("\n\n")[0].split()))


def groups(package: str) -> list[Group]:
    """Return the public names of a package, module by module."""
    public = importlib.import_module(package)
    found: dict[str, list[str]] = {}
    for name in public.__all__:
        found.setdefault(getattr(public, name).__module__, []).append(name)
    return [Group(package, module, _in_order(public, found[module])) for module in sorted(found)]


def reference_pages() -> dict[str, str]:
    """Return {path of a page: its text} for the whole reference, ``api/index.rst`` among them."""
    pages = {}
    index = ["Reference", "=========", "", ":doc:`command_line`: models as files, without Python.", ""]
    index += [".. toctree::\n   :hidden:\n\n   command_line", ""]
    for package, short in PACKAGES.items():
        title = f"``import {package} as {short}``"
        own = groups(package)
        index += [title, "-" * len(title), "", f".. toctree::\n   :hidden:\n\n{_indented(g.page for g in own)}", ""]
        for group in own:
            pages[f"api/{group.page}.rst"] = _page(group)
            names = ", ".join(f":py:obj:`{short}.{name} <{package}.{name}>`" for name in group.names)
            index += [f":doc:`{group.title} <{group.page}>`", f"    {group.purpose}", "", f"    {names}", ""]
    pages["api/command_line.rst"] = _command_line()
    pages["api/index.rst"] = "\n".join(index)
    return pages


def _command_line() -> str:
    """Return what ``ibsdyn --help`` and the help of each command print."""
    title = "Command line"
    lines = [title, "=" * len(title), "", *_literal(_help())]
    for command in COMMANDS:
        heading = f"ibsdyn {command.NAME}"
        lines += [heading, "-" * len(heading), "", *_literal(_help(command.NAME))]
    return "\n".join(lines)


def _help(*command: str) -> str:
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.suppress(SystemExit):
        parser().parse_args([*command, "--help"])
    return stream.getvalue()


def _literal(text: str) -> list[str]:
    return ["::", "", *(f"    {line}".rstrip() for line in text.splitlines()), ""]


def _page(group: Group) -> str:
    public = importlib.import_module(group.package)
    lines = [group.title, "=" * len(group.title), "", group.purpose, "", f".. currentmodule:: {group.package}", ""]
    for name in group.names:
        item = getattr(public, name)
        if inspect.isclass(item):
            members = "" if issubclass(item, Exception) else "   :members:\n"
            lines += [f".. autoclass:: {name}\n{members}"]
        else:
            lines += [f".. autofunction:: {name}\n"]
    return "\n".join(lines)


def _in_order(public: ModuleType, names: list[str]) -> tuple[str, ...]:
    def line(name: str) -> int:
        return inspect.getsourcelines(inspect.unwrap(getattr(public, name)))[1]

    return tuple(sorted(names, key=line))


def _indented(names: Iterable[str]) -> str:
    return "\n".join(f"   {name}" for name in names)

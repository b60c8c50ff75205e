"""The docstrings of this project, as reStructuredText for Sphinx.

They are plain text with ``literals``, and have sections underlined as numpydoc's. An entry of a section is a name, a
colon between spaces and a text that goes on in indented lines; numpydoc itself would take that text for a type.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

ENTRIES = ("Parameters", "Attributes", "Raises", "Warns")
PROSE = ("Returns", "Notes")
# "name : text" with names as "length, width" or "**options"; a line without them goes on with the entry before it.
ENTRY = re.compile(r"(\*{0,2}\w[\w, *]*?) : (.*)")
SECTION = re.compile(rf"({'|'.join(ENTRIES + PROSE)})\n-{{3,}}\n")


def restructured(docstring: str) -> str:
    """Return a docstring, without its indentation, as reStructuredText."""
    summary, *rest = SECTION.split(docstring.strip() + "\n")
    lines = [escaped(summary.rstrip()), ""]
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        lines += [f":{title}:"]
        written = _entries(body) if title in ENTRIES else escaped(body.strip()).splitlines()
        lines += [*(f"    {line}".rstrip() for line in written), ""]
    return "\n".join(lines)


def escaped(text: str) -> str:
    """Return plain text with ``literals`` so that nothing else in it is markup."""
    parts = re.split(r"(``.+?``|`[^`\n]+`)", text, flags=re.DOTALL)
    for number, part in enumerate(parts):
        if number % 2:
            parts[number] = f"``{part.strip('`')}``"
        else:
            plain = re.sub(r"([\\*|`])", r"\\\1", part)
            parts[number] = re.sub(r"_(?!\w)", r"\\_", plain)
    # A literal must stand apart from the letters beside it.
    return re.sub(r"(``[^`]+``)(?=\w)", r"\1\\ ", "".join(parts))


def _entries(body: str) -> Iterator[str]:
    for line in body.rstrip().splitlines():
        entry = ENTRY.fullmatch(line)
        if entry:
            names = ", ".join(f"**{escaped(name.strip())}**" for name in entry[1].split(","))
            yield f"* {names}: {escaped(entry[2])}"
        else:
            yield f"  {escaped(line.strip())}"

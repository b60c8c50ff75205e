"""Settings of Sphinx; `python docs/build.py` puts this file beside the pages and runs it."""

from __future__ import annotations

import inspect
import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform

import ibsdyn

DOCS = Path(ibsdyn.__file__).parents[1] / "docs"
sys.path.insert(0, str(DOCS))

from docstrings import restructured  # noqa: E402  a module beside this file, found by the line above
from reference_pages import PACKAGES, groups  # noqa: E402

project = "ibsdyn"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns: list[str] = []
language = "en"
highlight_language = "none"
smartquotes = False

myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_type_aliases = {"Array": "Array", "Complex": "Complex"}  # in place of numpy's long names
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 90
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = "ibsdyn"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_extra_path = ["written"]  # the reports that the pages write
html_theme_options = {"navigation_with_keys": True}

SHORT = {
    f"{short}.{name}": f"{package}.{name}"
    for package, short in PACKAGES.items()
    for group in groups(package)
    for name in group.names
}


class PublicNames(SphinxTransform):
    """A public name in a text, as ``ibs.Model(...)`` or ``fi.read``, leads to its place in the reference."""

    default_priority = 100

    def apply(self, **_: Any) -> None:
        """Put a reference around each such literal that is not part of a link or a heading."""
        for literal in list(self.document.findall(nodes.literal)):
            found = re.match(r"(ibs|fi)\.\w+", literal.astext())
            if (
                found is None
                or found[0] not in SHORT
                or isinstance(literal.parent, (nodes.reference, nodes.title, pending_xref))
            ):
                continue
            reference = pending_xref(
                "", literal.deepcopy(), refdomain="py", reftype="obj", reftarget=SHORT[found[0]], refexplicit=True
            )
            literal.replace_self(reference)


def _docstring(_app: Sphinx, _what: str, _name: str, _object: object, _options: object, lines: list[str]) -> None:
    lines[:] = restructured("\n".join(lines)).splitlines()


def _signature(
    _app: Sphinx, what: str, _name: str, item: object, _options: object, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    # Results are made by analyses, not by their users: how their constructor looks says nothing.
    text = inspect.getdoc(item) or ""
    if what == "class" and "Attributes\n---" in text and "Parameters\n---" not in text:
        return "", None
    return signature, returns


def setup(app: Sphinx) -> None:
    """Connect what is above to Sphinx."""
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
    app.add_transform(PublicNames)

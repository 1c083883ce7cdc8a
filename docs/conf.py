"""Sphinx: how the documentation is built. The pages fetch nothing when they are read."""

import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from docutils import nodes  # noqa: E402
from sphinx.addnodes import pending_xref  # noqa: E402
from sphinx.application import Sphinx  # noqa: E402
from sphinx.ext.napoleon import Config, NumpyDocstring  # noqa: E402

import rigidpend  # noqa: E402
from docs import generate, notebooks  # noqa: E402

generate.write(HERE / "generated")
notebooks.write(HERE, HERE / "generated")

project = "rigidpend"
author = "The rigidpend developers"
project_copyright = "2026, the rigidpend developers"
version = release = rigidpend.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
mathjax_path = "tex-svg.js"  # one file beside the pages, with its glyphs: nothing is fetched
exclude_patterns = ["generated/*"]  # included by the pages, no pages themselves
smartquotes_action = "D"  # dashes; quotes stay as they are typed

myst_enable_extensions = ["deflist", "attrs_block", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_preserve_defaults = True

html_theme = "furo"
html_title = f"rigidpend {release}"
html_static_path = ["static", "../build/mathjax"]
html_css_files = ["rigidpend.css"]
html_show_sourcelink = False
html_copy_source = False

OUTSIDE_LITERALS = re.compile(r"(``.*?``)")
SECTIONS = Config(napoleon_google_docstring=False, napoleon_use_rtype=False)


def setup(app: Sphinx) -> None:
    """Take the docstrings as they are written, for a reader of the source."""
    app.connect("autodoc-process-docstring", docstring)
    app.connect("doctree-read", unlinked)


def docstring(
    app: Sphinx, what: str, name: str, it: object, options: object, lines: list[str]
) -> None:
    """Read the sections of a function or class, and ``|M|`` as a length anywhere.

    reStructuredText would take the bars for a substitution; the other character is as wide, so
    that tables keep their columns. What is said of an attribute has no sections, and of a field
    of a named tuple nothing may be said.
    """
    if lines and lines[0].startswith("Alias for field number"):
        lines.clear()
    if what not in ("attribute", "data"):
        # A property is no attribute here, of which the words before a colon would be the type.
        kind = "method" if what == "property" else what
        lines[:] = NumpyDocstring(lines, SECTIONS, app, kind, name, it, options).lines()
    if what == "module":
        lines[:] = listed(lines)
    for number, line in enumerate(lines):
        parts = OUTSIDE_LITERALS.split(line)
        parts[::2] = [part.replace("|", "\N{DIVIDES}") for part in parts[::2]]
        lines[number] = "".join(parts)


def listed(lines: list[str]) -> list[str]:
    """Lists of modules as they stand; each folder has the heading, and the page only one."""
    if len(lines) < 3 or "" not in lines:
        return lines
    found: list[str] = []
    inside = False
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        if after and set(after) == {"-"} and line:
            found += [f".. rubric:: {line}", "", "::", ""]
            inside = True
        elif line and set(line) == {"-"}:
            continue
        else:
            found.append(f"   {line}" if inside else line)
    return found


def unlinked(app: Sphinx, page: nodes.document) -> None:
    """Take links from types such as `number` and `Path`: what else has that name is not meant."""
    for link in list(page.findall(pending_xref)):
        name = str(link["reftarget"])
        if link.hasattr("refspecific") and (name.islower() or name == "Path"):
            link.replace_self(link.children)

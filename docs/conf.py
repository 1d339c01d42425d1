"""Sphinx: ``python -m sphinx -W -b html docs build/docs`` builds the site, with what ``fabfem[docs]`` brings."""

import re
from pathlib import Path
from typing import Any

from fabfem import __version__

project = "fabfem"
author = "fabfem contributors"
copyright = "fabfem contributors, MIT licence"
release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["api/_*"]
default_role = "code"

myst_heading_anchors = 3

autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_class_signature = "separated"
napoleon_google_docstring = False
napoleon_use_ivar = True

# words of docstrings that are names of more than one attribute need no link
suppress_warnings = ["ref.python"]

html_theme = "furo"
html_title = f"fabfem {release}"

ROOT_FILES = {
    **{"start": "README.md", "contributing": "CONTRIBUTING.md", "changelog": "CHANGELOG.md"},
    "gallery": "cases/README.md",
}
"""Pages that are files of other folders, whose links start there."""

NAMED_BY_FILE = re.compile(r"\[(?:docs/|cases/)?\w+\.md\]\(")
"""Links that have a file for their text, which in the site is the title of the page."""


def read_root_file(app: Any, page: str, source: list[str]) -> None:
    """Put a file of another folder into its page, and let links to such files lead to their pages."""
    text = source[0]
    if page in ROOT_FILES:
        file = Path(__file__).parent.parent / ROOT_FILES[page]
        app.env.note_dependency(str(file))
        text = file.read_text(encoding="utf-8").replace("](docs/", "](").replace("](../docs/", "](")
    text = NAMED_BY_FILE.sub("[](", text)
    for name, there in ROOT_FILES.items():
        text = text.replace(f"]({there})", f"]({name}.md)").replace(f"](../{there})", f"]({name}.md)")
    source[0] = text.replace("[CITATION.cff](CITATION.cff)", "`CITATION.cff`")


def keep_bars(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Keep the bars of absolute values, which reStructuredText would take for substitutions."""
    lines[:] = [line.replace("|", "\\|") for line in lines]


def setup(app: Any) -> None:
    """Register what Sphinx calls."""
    app.connect("autodoc-process-docstring", keep_bars)
    app.connect("source-read", read_root_file)

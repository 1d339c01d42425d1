"""Sphinx: ``python -m sphinx -W -b html docs build/docs`` builds the site, with what ``fabfem[docs]`` brings."""

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

ROOT_FILES = {"start": "README.md", "contributing": "CONTRIBUTING.md", "changelog": "CHANGELOG.md"}
"""Pages that are files of the root folder, whose links start there."""


def read_root_file(app: Any, page: str, source: list[str]) -> None:
    """Put a file of the root folder into its page, with links that hold there."""
    if page in ROOT_FILES:
        text = (Path(__file__).parent.parent / ROOT_FILES[page]).read_text(encoding="utf-8").replace("](docs/", "](")
        for name, file in ROOT_FILES.items():
            text = text.replace(f"]({file})", f"]({name}.md)")
        source[0] = text.replace("[CITATION.cff](CITATION.cff)", "`CITATION.cff`")


def keep_bars(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Keep the bars of absolute values, which reStructuredText would take for substitutions."""
    lines[:] = [line.replace("|", "\\|") for line in lines]


def setup(app: Any) -> None:
    """Register what Sphinx calls."""
    app.connect("autodoc-process-docstring", keep_bars)
    app.connect("source-read", read_root_file)

"""Sphinx: the pages of this folder, the examples as a gallery, and the reference by topic."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import SphinxError

import hovi

TOP = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TOP / "docs"))

from docstrings import as_rst  # noqa: E402
from topics import TOPICS  # noqa: E402

project = "hovi"
author = copyright = "the hovi developers"
release = hovi.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "tables", "gallery/**/*.ipynb", "gallery/**/*.py"]
html_theme = "furo"
html_title = "hovi"
html_static_path = ["static"]
html_css_files = ["wide.css"]

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
autodoc_typehints = "none"
autodoc_member_order = "bysource"

sphinx_gallery_conf = {
    "image_scrapers": ("matplotlib", "gallery_pictures.scrape_motion"),
    "reset_modules": ("matplotlib",),
    "examples_dirs": ["../examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"/\d\d_",
    "ignore_pattern": r"^(?!\d\d_)",  # benchmarks are not examples
    "default_thumb_file": str(TOP / "docs" / "images" / "swing_up_surface.png"),
    "within_subsection_order": "FileNameSortKey",
    "nested_sections": False,
    "download_all_examples": False,
    "remove_config_comments": True,
    "write_computation_times": False,
}

KEY = re.compile(r"\[([A-Za-z]+\d{4})[],; ]|; ([A-Za-z]+\d{4})[],; ]")


def check_references(app: Sphinx) -> None:
    """Raise SphinxError where a docstring cites a source that references.md does not list."""
    listed = (TOP / "docs" / "references.md").read_text()
    for path in sorted((TOP / "src").rglob("*.py")):
        for match in KEY.finditer(path.read_text()):
            key = match[1] or match[2]
            if f"[{key}]" not in listed:
                raise SphinxError(f"{path.name} cites [{key}]: add it to docs/references.md")


def format_docstring(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Docstrings are prose with formulas: show parameters as a table and link public names."""
    try:
        parameters = set(inspect.signature(obj).parameters) if callable(obj) else set()
    except (TypeError, ValueError):
        parameters = set()
    parameters |= set(getattr(obj, "__dataclass_fields__", ()))
    lines[:] = as_rst("\n".join(lines), parameters, hovi.__all__)


def escape_norms(app: Sphinx, docname: str, source: list[str]) -> None:
    """|tau| in the prose of an example is a norm, not a substitution."""
    if docname.startswith("gallery/"):
        lines = source[0].split("\n")
        source[0] = "\n".join(x if x.startswith(" ") else x.replace("|", r"\|") for x in lines)


def list_public_names(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append one entry for each public class and function to the reference page, by topic."""
    if docname == "api":
        source[0] += "\n".join(_reference())


def _reference() -> Iterator[str]:
    listed = {name for names in TOPICS.values() for name in names}
    topics = {**TOPICS, "More": [name for name in hovi.__all__ if name not in listed]}
    for topic, names in topics.items():
        entries = [line for name in names for line in _entry(name)]
        if entries:
            yield from ("", f"## {topic}", "", "```{eval-rst}", *entries, "```", "")


def _entry(name: str) -> list[str]:
    value = getattr(hovi, name, None)
    if inspect.isclass(value):
        return [f".. autoclass:: hovi.{name}", "   :members:", ""]
    return [f".. autofunction:: hovi.{name}", ""] if inspect.isfunction(value) else []


def setup(app: Sphinx) -> None:
    app.connect("builder-inited", check_references)
    app.connect("source-read", escape_norms)
    app.connect("source-read", list_public_names)
    app.connect("autodoc-process-docstring", format_docstring)

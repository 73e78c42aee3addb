"""Modules, public names and files mentioned in texts exist.

After a rename, old names may remain in strings, comments and pages, where no other test fails.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from hovi.__main__ import EXTENSION_MODULE, INTERRUPTION_MODULE

TOP = Path(__file__).resolve().parents[1]
FOLDERS = ("src", "tests", "examples", "docs", "models", ".ci", ".github")
TABLES = "docs/tables/"
BUILT = ("docs/_build", "docs/gallery")
TEXTS = {"", ".cpp", ".hpp", ".in", ".markdown", ".md", ".py", ".pyi", ".rst", ".toml", ".txt"}

NAME = re.compile(r"(?<![\w/.-])hovi(?:[.:][A-Za-z_]\w*)+")
IMPORT = re.compile(r"\bfrom (hovi[\w.]*) import \(?\s*(\w+(?: as \w+)?(?:,\s*\w+(?: as \w+)?)*)")
BEFORE = r"(?<![\w/.<{}*-])"
FILE = re.compile(BEFORE + r"[\w.-]+(?:/[\w.-]+)*\.(?:cpp|hpp|markdown|md|py|pyi)\b(?!\.in)")
FOLDER = re.compile(BEFORE + r"(?:docs|examples|models|src|tests)(?:/[\w-]+)+(?![\w.*{</-])")


def files() -> Iterator[Path]:
    for path in [*TOP.glob("*.*"), *(path for each in FOLDERS for path in (TOP / each).rglob("*"))]:
        if path.is_file():
            yield path.relative_to(TOP)


FILES = sorted(path for path in files() if not path.as_posix().startswith(BUILT))
PAGES = [path for path in FILES if path.suffix in TEXTS and not path.as_posix().startswith(TABLES)]


def names(text: str) -> Iterator[tuple[str, int]]:
    """Names with dots, those of `from hovi.scene import forces` too, and where they begin."""
    for match in NAME.finditer(text):
        yield match[0], match.start()
    for match in IMPORT.finditer(text):
        for name in match[2].split(","):
            yield f"{match[1]}.{name.split()[0]}", match.start()


@cache
def is_name(name: str) -> bool:
    """Whether a name with dots is a module, or an attribute or field of what comes before."""
    value: object = import_module("hovi")
    for part in re.split("[.:]", name)[1:]:
        if hasattr(value, "__path__") and find_spec(f"{value.__name__}.{part}"):
            value = import_module(f"{value.__name__}.{part}")
        elif hasattr(value, part):
            value = getattr(value, part)
        else:
            return inspect.isclass(value) and part in inspect.get_annotations(value)
    return True


def paths(text: str) -> Iterator[tuple[str, int]]:
    for match in [*FILE.finditer(text), *FOLDER.finditer(text)]:
        yield match[0], match.start()


@cache
def is_path(path: str) -> bool:
    """Whether it is a folder, or a file named from any folder above it."""
    ending = f"/{path.removeprefix('../')}"
    is_file = any(f"/{file}".endswith(ending) for file in FILES)
    return is_file or (TOP / path).is_dir() or path.startswith(BUILT)


@pytest.mark.filterwarnings("ignore:.*:DeprecationWarning")  # old names that still resolve
@pytest.mark.parametrize("page", PAGES, ids=str)
def test_names_in_texts_exist(page: Path) -> None:
    text = (TOP / page).read_text()
    wrong = [each for each in names(text) if not is_name(each[0])]
    wrong += [each for each in paths(text) if not is_path(each[0])]
    assert not [f"{page}:{text.count(chr(10), 0, start) + 1}: {name}" for name, start in wrong]


def test_the_ctrl_c_handler_finds_its_modules() -> None:
    """The handler looks these up in sys.modules by name, and skips those that are missing."""
    assert callable(import_module(EXTENSION_MODULE).ignore_leaks)
    assert callable(import_module(INTERRUPTION_MODULE).record_interrupt)

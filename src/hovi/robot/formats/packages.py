"""Packages of ROS by name: folders with a package.xml, in given folders and around a file."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from hovi.system.files import require_file

LEVELS = 3
"""Folders above the package of a file in which other packages of the same source tree are."""

MAX_BYTES = 1_000_000
"""Largest package.xml that is read."""
_NAME = re.compile(r"<name>\s*([^\s<]+)\s*</name>")


def package_name(folder: Path) -> str | None:
    """The name of the package in a folder; None without a package.xml that has one."""
    file = folder / "package.xml"
    try:
        require_file(file, MAX_BYTES)
        found = _NAME.search(file.read_text(errors="replace"))
    except OSError:
        return None
    return found and found[1]


def packages_in(folders: Iterable[Path]) -> dict[str, Path]:
    """Packages that are one of the folders, in it, or in a folder in it; the first of a name."""
    found: dict[str, Path] = {}
    for folder in folders:
        for pattern in ("package.xml", "*/package.xml", "*/*/package.xml"):
            for file in sorted(folder.glob(pattern)):
                if name := package_name(file.parent):
                    found.setdefault(name, file.parent)
    return found


def packages_around(file: Path) -> dict[str, Path]:
    """The package of a file, those next to it, and the others of its source tree; nearest first."""
    return packages_in(each for each in _around(file.resolve()) if not holds_all_files(each))


def _around(file: Path) -> Iterator[Path]:
    """The folder of a file and those above, to LEVELS above its package, if it has one."""
    above = list(file.parents)
    roots = [k for k, folder in enumerate(above) if (folder / "package.xml").is_file()]
    yield from above[: roots[0] + 1 + LEVELS if roots else 2]


def holds_all_files(folder: str | Path) -> bool:
    """Whether a folder is the root of the file system or another one above the home folder.

    Links are followed, and bind mounts are noticed.
    """
    above = {Path(os.sep)}
    with suppress(RuntimeError, OSError):  # a user without a home
        above |= set(Path.home().resolve().parents)
    return any(_is_same(Path(folder), each) for each in above)


def _is_same(folder: Path, other: Path) -> bool:
    try:
        return folder.samefile(other)
    except (OSError, ValueError):  # no folder at all, or a NUL in its name
        return False

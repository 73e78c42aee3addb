"""The elements of an MJCF file, with what it includes, and the numbers in them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np
import numpy.typing as npt

from hovi.errors import nearest
from hovi.system.files import reason, require_file

Array = npt.NDArray[np.float64]

MAX_BYTES = 32_000_000
MAX_ELEMENTS = 100_000
MAX_DEPTH = 400
"""Largest file in bytes, and numbers of elements, nested or in all files together."""
MAX_MAGNITUDE = 1e12
"""Largest number of an element that is read."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class MjcfError(ValueError):
    """What is wrong with an MJCF: a sentence that follows the name of the file."""


def read_mjcf(path: Path) -> Element:
    """The element <mujoco> of a file, with the elements of included files in their places.

    Files are looked for from the folder of the first one, as MuJoCo does, and included once.
    Raises MjcfError, also for a file that cannot be read.
    """
    root = _parsed(path)
    if root.tag != "mujoco":
        raise MjcfError(f"its root element must be <mujoco>, not <{root.tag[:40]}>.")
    included = {path.resolve()}
    _include(root, path.parent, included)
    count = sum(1 for _ in root.iter())
    if count > MAX_ELEMENTS:
        raise MjcfError(f"it has {count:,} elements with those of included files, at most "
                        f"{MAX_ELEMENTS:,} are accepted.")  # fmt: skip
    return root


def _include(owner: Element, folder: Path, included: set[Path]) -> None:
    for place, child in reversed(list(enumerate(owner))):
        if child.tag != "include":
            _include(child, folder, included)
            continue
        name = child.get("file", "")
        path = folder / name
        if not name or path.resolve() in included:
            raise MjcfError(f"<include file={name[:60]!r}> names no file, or one a second time.")
        included.add(path.resolve())
        root = _parsed(path)
        if root.tag not in ("mujoco", "mujocoinclude"):
            raise MjcfError(f"the included {path.name!r} has the root element <{root.tag[:40]}>.")
        _include(root, folder, included)
        owner[place : place + 1] = list(root)


def _parsed(path: Path) -> Element:
    try:
        require_file(path, MAX_BYTES)
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else "no file can have that path"
        raise MjcfError(f"{path.name!r} cannot be read: {why}.") from error
    return _tree(content)


def _tree(content: bytes) -> Element:
    builder, depth, count = ElementTree.TreeBuilder(), 0, 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH or count > MAX_ELEMENTS:
            raise MjcfError(
                f"it has more than {MAX_ELEMENTS:,} elements, or elements nested more than "
                f"{MAX_DEPTH} deep."
            )
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def doctype(*_: object) -> None:
        raise MjcfError("an MJCF needs no DOCTYPE and no entities: delete that declaration.")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except MjcfError:
        raise
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise MjcfError(f"it is not well-formed XML: {error}.") from error
    return builder.close()


def name_of(element: Element) -> str:
    """An element in messages, such as "joint 'elbow'"."""
    return f"{element.tag} {element.get('name', '')[:60]!r}"


def numbers(given: dict[str, str], key: str, where: str, least: int, most: int = 0) -> Array | None:
    """The numbers of an attribute; None if it is not there.

    where: the element, for messages. least, most: how many there must be; most = least if 0.
    Raises MjcfError for other texts.
    """
    text = given.get(key)
    if text is None:
        return None
    words, most = text.split(), most or least
    if not least <= len(words) <= most or not all(map(_NUMBER.fullmatch, words)):
        many = f"{least}" if least == most else f"{least} to {most}"
        raise MjcfError(
            f"{key}={text[:60]!r} of {where} must be {many} finite decimal number"
            f"{'' if most == 1 else 's'}."
        )
    found = np.array([float(word) for word in words])
    if not (np.abs(found) <= MAX_MAGNITUDE).all():
        raise MjcfError(
            f"{key}={text[:60]!r} of {where} is larger than {MAX_MAGNITUDE:g} in magnitude."
        )
    return found


def number(given: dict[str, str], key: str, where: str, default: float) -> float:
    """The number of an attribute. Raises MjcfError for another text."""
    found = numbers(given, key, where, 1)
    return default if found is None else float(found[0])


def word(given: dict[str, str], key: str, where: str, known: tuple[str, ...]) -> str:
    """The word of an attribute, by default the first of the known ones. Raises MjcfError."""
    found = given.get(key, known[0])
    if found not in known:
        raise MjcfError(f"{key}={found[:60]!r} of {where} is unknown: {nearest(found, known)}")
    return found

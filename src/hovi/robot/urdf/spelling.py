"""Finds misspelt and misplaced elements and attributes of a URDF.

Pinocchio ignores what it does not know: with <inertail>, or <inertial> in the wrong place, the link
has no mass, and another robot is planned for. A name that is nearly one of URDF, or that belongs
elsewhere, is an error; others are reported by `hovi info`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cache
from xml.etree.ElementTree import Element

from hovi.robot.urdf.elements import CHILDREN, EXTENSIONS, PARENTS, attributes_of, tag_and_name
from hovi.system.dataclass import dataclass

MAX_UNKNOWN = 10_000
"""Maximum number of unknown names, so that a file full of them is refused in time."""


@dataclass(frozen=True)
class Unknown:
    """An element or attribute that URDF does not have at its place.

    where: the element that has it, for messages. place: the tag of that element.
    name: in angle brackets for an element, followed by = for an attribute.
    remedy: what is wrong and what to do, for a probable mistake; "" for others.
    """

    where: str
    place: str
    name: str
    remedy: str


def unknown_names(robot: Element) -> Iterator[Unknown]:
    """Every unknown element and attribute, without looking into extensions."""
    for element, owner in _known_elements(robot, robot):
        where = tag_and_name(owner)
        where = where if element is owner else f"<{element.tag}> of {where}"
        names = [f"{key}=" for key in element.attrib if not _is_qualified(key)]
        for name in (*names, *(f"<{child.tag}>" for child in element)):
            if name not in _known_in(element.tag):
                yield Unknown(where, element.tag, name, _remedy(element.tag, name))


def names_are_of_urdf(robot: Element) -> Iterator[str]:
    """No name is nearly one of URDF, and elements are where they belong."""
    for number, unknown in enumerate(unknown_names(robot)):
        if unknown.remedy:
            yield f"{unknown.where} has {unknown.name}, {unknown.remedy}"
        if number == MAX_UNKNOWN:
            yield f"it has more than {MAX_UNKNOWN:,} names that URDF does not have, the maximum."
            return


def ignored_names(robot: Element) -> list[str]:
    """The unknown names of a checked URDF, with their counts, the most frequent first."""
    counts = Counter((each.place, each.name[:40]) for each in unknown_names(robot))
    return [
        f"{name} in <{place}>" + (f" ({count} times)" if count > 1 else "")
        for (place, name), count in counts.most_common()
    ]


def values_are_attributes(robot: Element) -> Iterator[str]:
    """Values are not written as text, as in SDF."""
    for element, owner in _known_elements(robot, robot):
        text = (element.text or "").strip()
        if text and element.tag not in CHILDREN:
            attribute = attributes_of(element.tag)[0]
            yield (
                f"<{element.tag}> of {tag_and_name(owner)} has the text {text[:40]!r}: "
                f"write values as attributes, such as {attribute}=."
            )


def _known_elements(element: Element, owner: Element) -> Iterator[tuple[Element, Element]]:
    yield element, owner
    for child in element:
        if child.tag in CHILDREN.get(element.tag, ()):
            yield from _known_elements(child, child if element.tag == "robot" else owner)


def _is_qualified(attribute: str) -> bool:
    """Whether an attribute declares or uses a namespace."""
    return ":" in attribute or attribute == "xmlns"


@cache
def _known_in(place: str) -> frozenset[str]:
    """The names of attributes and elements in an element of URDF."""
    attributes = [f"{name}=" for name in attributes_of(place)]
    elements = (*CHILDREN.get(place, ()), *EXTENSIONS.get(place, ()))
    return frozenset((*attributes, *(f"<{tag}>" for tag in elements)))


def _remedy(place: str, name: str) -> str:
    """What is probably wrong with an unknown name in <place>, or ""."""
    parent = PARENTS.get(name.strip("<>"))
    if parent is not None:
        return f"which belongs in <{parent}>: move it there."
    near = [each for each in sorted(_known_in(place)) if is_near(name, each)]
    return f"which is unknown: did you mean {' or '.join(near)}?" if near else ""


def is_near(one: str, other: str) -> bool:
    """Whether two names differ, apart from case, by at most one letter or one swap of neighbors."""
    one, other = sorted((one.casefold(), other.casefold()), key=len)
    if one == other or len(other) - len(one) > 1:
        return one == other
    first = next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), len(one))
    if len(one) < len(other):
        return one[first:] == other[first + 1 :]
    swapped = one[first : first + 2][::-1] == other[first : first + 2]
    return one[first + 1 :] == other[first + 1 :] or (
        swapped and one[first + 2 :] == other[first + 2 :]
    )

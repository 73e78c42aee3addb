"""Settings of an MJCF: of its <compiler>, and the default classes of its elements."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from hovi.errors import nearest
from hovi.robot.formats.mjcf_poses import Angles
from hovi.robot.formats.mjcf_text import MjcfError, name_of, number, numbers, word
from hovi.system.dataclass import dataclass

_SEQUENCE = "xyzXYZ"
_MAIN = "main"


@dataclass(frozen=True)
class Compiler:
    """What <compiler> says about the bodies; the last value of a setting counts.

    angles: unit and sequence of angles. from_geoms: whether inertias come from geoms: "auto" for
    bodies without <inertial>. groups: first and last group of geoms that do. mass, inertia: the
    least ones of a body. balance: whether inertias that no body can have become spheres'.
    total: mass of all bodies, in [kg]; 0 or less for what they have.
    """

    angles: Angles
    autolimits: bool
    from_geoms: str
    groups: tuple[float, float]
    mass: float
    inertia: float
    balance: bool
    total: float
    mesh_folder: str
    strip_path: bool


def compiler_of(root: Element) -> Compiler:
    """The settings of all elements <compiler>. Raises MjcfError for those that are not known."""
    given: dict[str, str] = {}
    for element in root.iterfind("compiler"):
        given |= element.attrib
    for key, accepted in (("coordinate", "local"), ("alignfree", "false")):
        if given.get(key, accepted) != accepted:
            raise MjcfError(
                f"{key}={given[key][:40]!r} of <compiler> is not supported: save the model by "
                "MuJoCo itself, with mujoco.mj_saveLastXML."
            )
    where, flag = "<compiler>", ("false", "true")
    sequence = given.get("eulerseq", "xyz")
    if len(sequence) != 3 or not set(sequence) <= set(_SEQUENCE):
        raise MjcfError(
            f"eulerseq={sequence[:40]!r} of <compiler> must be three of x, y, z, X, Y, Z."
        )
    groups = numbers(given, "inertiagrouprange", where, 2)
    return Compiler(
        angles=Angles(word(given, "angle", where, ("degree", "radian")) == "degree", sequence),
        autolimits=word(given, "autolimits", where, ("true", "false")) == "true",
        from_geoms=word(given, "inertiafromgeom", where, ("auto", *flag)),
        groups=(0.0, 5.0) if groups is None else (float(groups[0]), float(groups[1])),
        mass=number(given, "boundmass", where, 0.0),
        inertia=number(given, "boundinertia", where, 0.0),
        balance=word(given, "balanceinertia", where, flag) == "true",
        total=number(given, "settotalmass", where, -1.0),
        mesh_folder=given.get("meshdir", given.get("assetdir", "")),
        strip_path=word(given, "strippath", where, flag) == "true",
    )


class Defaults:
    """The default attributes of elements by class.

    Raises MjcfError for a class that is nested without a name, or defined twice.
    """

    def __init__(self, root: Element) -> None:
        self.classes: dict[str, dict[str, dict[str, str]]] = {_MAIN: {}}
        for element in root.iterfind("default"):
            name = element.get("class", _MAIN)
            self._fill(element, name, self.classes.setdefault(name, {}))

    def _fill(self, element: Element, name: str, values: dict[str, dict[str, str]]) -> None:
        for child in element:
            if child.tag != "default":
                values[child.tag] = values.get(child.tag, {}) | child.attrib
        for child in element.iterfind("default"):
            inner = child.get("class", "")
            if not inner or inner in self.classes:
                raise MjcfError(f"<default class={inner[:60]!r}> has no name, or occurs twice.")
            self.classes[inner] = {tag: dict(given) for tag, given in values.items()}
            self._fill(child, inner, self.classes[inner])

    def of(self, element: Element, inherited: str) -> dict[str, str]:
        """The attributes of an element with those of its class, or of the inherited one."""
        name = element.get("class", inherited) or _MAIN
        if name not in self.classes:
            raise MjcfError(
                f"{name_of(element)} is of the class {name[:60]!r}, which no <default> defines: "
                + nearest(name, self.classes)
            )
        default = self.classes[name].get(element.tag, {})
        return {
            key: value for key, value in {**default, **element.attrib}.items() if key != "class"
        }


def sections(root: Element, tag: str) -> Iterator[Element]:
    """The children of all elements of a name below the root, which MuJoCo merges."""
    for section in root.iterfind(tag):
        yield from section

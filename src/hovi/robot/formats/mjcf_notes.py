"""What an MJCF says and a model of Pinocchio does not have, in sentences for `hovi info`."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from hovi.errors import nearest, some_of
from hovi.robot.formats.mjcf_defaults import Defaults, sections
from hovi.robot.formats.mjcf_text import MjcfError, name_of

_POSE = "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"
ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "body": (*_POSE, "childclass", "fuse", "gravcomp", "mocap", "name", "simple", "sleep", "user"),
    "frame": (*_POSE, "childclass", "name"),
    "inertial": (*_POSE, "diaginertia", "fullinertia", "mass"),
    "freejoint": ("align", "group", "name"),
    "joint": (
        *("actuatorfrclimited", "actuatorfrcrange", "actuatorgravcomp", "armature", "axis"),
        *("class", "damping", "frictionloss", "group", "limited", "margin", "name", "pos", "range"),
        *("ref", "solimpfriction", "solimplimit", "solreffriction", "solreflimit", "springdamper"),
        *("springref", "springyield", "stiffness", "type", "user"),
    ),
    "geom": (
        *(*_POSE, "adhesion", "castshadow", "class", "conaffinity", "condim", "contype", "density"),
        *("fitscale", "fluidcoef", "fluidshape", "friction", "fromto", "gap", "group", "hfield"),
        *("margin", "mass", "material", "mesh", "name", "priority", "rgba", "shellinertia", "size"),
        *("solimp", "solmix", "solref", "surfacevel", "type", "user"),
    ),
    "compiler": (
        *("alignfree", "angle", "assetdir", "autolimits", "balanceinertia", "boundinertia"),
        *("boundmass", "conflict", "convexhull", "coordinate", "discardvisual", "eulerseq"),
        *("exactmeshinertia", "fitaabb", "fusestatic", "inertiafromgeom", "inertiagrouprange"),
        *("meshdir", "passthrough", "savecanonical", "savecompiled", "saveinertial"),
        *("settotalmass", "strippath", "texturedir", "usethread"),
    ),
}
"""The attributes of elements that a model is made of, as MuJoCo 4.0 prints them, and older ones."""
SECTIONS = (
    *("actuator", "asset", "compiler", "contact", "custom", "default", "deformable", "equality"),
    *("extension", "keyframe", "option", "sensor", "size", "statistic", "tendon", "visual"),
    "worldbody",
)
"""The elements below the root."""
GRAVITY = [0.0, 0.0, -9.81]


def require_known(root: Element) -> None:
    """Raise MjcfError for an element or attribute that MuJoCo would not read, either."""
    for section in root:
        if section.tag not in SECTIONS:
            raise MjcfError(f"<{section.tag[:40]}> is unknown: {nearest(section.tag, SECTIONS)}")
    for element in root.iter():
        known = ATTRIBUTES.get(element.tag, ())
        if not known or (element.tag == "joint" and "joint1" in element.attrib):
            continue
        for key in element.attrib:
            if key not in known and not _is_of_other(element, key):
                raise MjcfError(
                    f"{key[:40]}= of {name_of(element)} is unknown: {nearest(key, known)}"
                )


def _is_of_other(element: Element, key: str) -> bool:
    """Whether an attribute is that of an element of the same name in a tendon."""
    return key in (
        "coef",
        "joint",
        "sidesite",
        "geom",
        "site",
        "body",
        "objtype",
        "cutoff",
        "noise",
    )


def loops(root: Element, locked: frozenset[str] = frozenset()) -> list[str]:
    """The equalities that tie bodies or joints together, which a tree of joints does not have."""
    found = []
    for element in sections(root, "equality"):
        ends = [value for key in ENDS if (value := element.get(key))]
        if element.get("active") != "false" and not locked.issuperset(ends or [""]):
            found.append(f"<{element.tag}> of {' and '.join(map(repr, ends)) or 'the world'}")
    return found


ENDS = "body1", "body2", "joint1", "joint2", "tendon1", "tendon2", "site1", "site2", "flex"


def notes_of(root: Element, defaults: Defaults) -> Iterator[str]:
    """What is not read, one sentence without a full stop each."""
    if found := loops(root):
        yield f"not kept, so that its bodies move freely: {some_of(found, 6)}"
    yield from _values(root, defaults)
    tendons = [name_of(each) for each in sections(root, "tendon")]
    if tendons:
        yield f"not read: {some_of(tendons, 6)}"
    actuators = [_actuator(each) for each in sections(root, "actuator")]
    if actuators:
        yield f"not read, give their ranges as limits: {some_of(actuators, 6)}"
    excluded = [each for each in sections(root, "contact") if each.tag == "exclude"]
    if excluded:
        pairs = [f"{each.get('body1')!r} and {each.get('body2')!r}" for each in excluded]
        yield f"not read, name them in an SRDF: pairs that may touch, {some_of(pairs, 6)}"
    for tag, what in (
        ("keyframe", "keyframes"),
        ("deformable", "deformables"),
        ("extension", "plugins"),
    ):
        names = [repr(each.get("name", each.get("plugin", ""))) for each in sections(root, tag)]
        if names:
            yield f"not read: {what} {some_of(names, 6)}"


def _values(root: Element, defaults: Defaults) -> Iterator[str]:
    """Attributes that change the dynamics and are not those of the model."""
    for option in root.iterfind("option"):
        gravity = option.get("gravity", "0 0 -9.81")
        if _floats(gravity) != GRAVITY:
            yield f"gravity={gravity[:60]!r} of <option> is not that of a scene: give it to Gravity"
        for key in ("wind", "density", "viscosity"):
            if any(_floats(option.get(key, "0"))):
                yield f"{key}={option.get(key, '')[:60]!r} of <option> is not read: give a Drag"
    bodies = list(root.iter("body"))
    for key, what in (
        ("gravcomp", "gravity acts on the whole of"),
        ("mocap", "fixed to the world:"),
    ):
        names = [name_of(each) for each in bodies if each.get(key, "0") not in ("0", "false")]
        if names:
            yield f"{key}= is not read, {what} {some_of(names, 6)}"
    joints = [
        (each, defaults.of(each, "")) for each in root.iter("joint") if not each.get("joint1")
    ]
    for key in ("stiffness", "springdamper", "actuatorgravcomp"):
        names = [
            name_of(joint)
            for joint, given in joints
            if given.get(key, "0").strip("0. ") not in ("", "false")
        ]
        if names:
            yield f"{key}= is not read, give the effect joint_springs: {some_of(names, 6)}"


def _floats(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []


def _actuator(element: Element) -> str:
    """An actuator with the ranges that it gives."""
    keys = ("ctrlrange", "forcerange", "gear")
    ranges = [f"{key} {element.get(key, '')[:40]}" for key in keys if element.get(key)]
    where = element.get("joint") or element.get("tendon") or element.get("site") or ""
    return f"<{element.tag}> of {where!r}" + (f" ({', '.join(ranges)})" if ranges else "")

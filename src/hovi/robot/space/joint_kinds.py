"""What hovi knows of Pinocchio's kinds of joints, in one table.

Nothing else compares their names: whoever asks what a joint is asks `kind_of`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import pinocchio as pin

from hovi.robot.space.groups import SE2, SE3, SO2, SO3, Group

Service = Literal["anywhere", "as base", "nowhere"]


class Units(NamedTuple):
    """Units of q, v, a and tau at one coordinate, in the order in which limits stack them."""

    q: str
    v: str
    a: str
    tau: str


ANGLE = Units("rad", "rad/s", "rad/s^2", "N m")
LENGTH = Units("m", "m/s", "m/s^2", "N")


@dataclass(frozen=True)
class JointKind:
    """One kind of joint.

    word: for reports, a URDF's where it has one.
    names: Pinocchio's short names, "JointModel" left out.
    units: of its coordinates, one each; None where joints of this kind differ in them.
    group: on which it moves; None where its configurations add like vectors, with q' = v.
    kernel: where the analytic kernel serves it. "anywhere" asks for axes that do not change along
        the joint's own motion, which the closed forms assume; a joint "as base", which carries all
        others, enters through gravity alone.
    """

    word: str
    names: tuple[str, ...]
    units: tuple[Units, ...] | None
    group: Group | None = None
    kernel: Service = "nowhere"


def _family(letter: str, *others: str) -> tuple[str, ...]:
    """The names of joints along each axis, and others."""
    return (*(letter + axis for axis in "XYZ"), *others)


def _on(group: Group, word: str, names: tuple[str, ...], kernel: Service) -> JointKind:
    """A kind whose coordinates are those of a group's tangent vectors."""
    units = (ANGLE if place in group.angular else LENGTH for place in range(group.nv))
    return JointKind(word, names, tuple(units), group, kernel)


FLOATING = _on(SE3, "floating", ("FreeFlyer",), "as base")
COMPOSITE = JointKind("composite", ("Composite",), None)
"""Its members say what it is."""

JOINT_KINDS = (
    JointKind("revolute", _family("R", "RevoluteUnaligned"), (ANGLE,), kernel="anywhere"),
    JointKind("prismatic", _family("P", "PrismaticUnaligned"), (LENGTH,), kernel="anywhere"),
    JointKind("helical", _family("H", "HelicalUnaligned"), (ANGLE,), kernel="anywhere"),
    JointKind("translation", ("Translation",), (LENGTH,) * 3, kernel="anywhere"),
    JointKind("universal", ("Universal",), (ANGLE,) * 2),
    JointKind("spherical", ("SphericalZYX",), (ANGLE,) * 3),
    JointKind("ellipsoid", ("Ellipsoid",), (ANGLE,) * 3),
    _on(SO2, "continuous", _family("RUB", "RevoluteUnboundedUnaligned"), "anywhere"),
    _on(SE2, "planar", ("Planar",), "as base"),
    _on(SO3, "spherical", ("Spherical",), "as base"),
    FLOATING,
    JointKind("mimic", ("Mimic",), ()),
    COMPOSITE,
)

_BY_NAME = {f"JointModel{name}": kind for kind in JOINT_KINDS for name in kind.names}


def kind_of(joint: pin.JointModel) -> JointKind:
    """The kind of a joint; one that bears Pinocchio's name for it where the table has none.

    Nothing can be planned on a joint that is not in the table.
    """
    name = str(joint.shortname())
    return _BY_NAME.get(name) or JointKind(name, (), None)


def coordinate_units(model: pin.Model) -> tuple[Units, ...]:
    """Units at each coordinate of a model, (nv,); angles where the kind does not tell."""
    units: list[Units] = []
    for joint in list(model.joints)[1:]:
        units += kind_of(joint).units or joint.nv * (ANGLE,)
    return tuple(units)

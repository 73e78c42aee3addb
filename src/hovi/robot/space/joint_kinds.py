"""The table of Pinocchio's joint types and their properties.

No other code compares joint names: `kind_of` returns the kind of a joint.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import pinocchio as pin

from hovi.robot.space.groups import SE2, SE3, SO2, SO3, Group
from hovi.system.dataclass import dataclass

KernelSupport = Literal["anywhere", "as base", "nowhere"]


class Units(NamedTuple):
    """Units at one coordinate, in the order in which limits stack them."""

    q: str
    v: str
    a: str
    tau: str
    jerk: str
    torque_rate: str


ANGLE = Units("rad", "rad/s", "rad/s^2", "N m", "rad/s^3", "N m/s")
LENGTH = Units("m", "m/s", "m/s^2", "N", "m/s^3", "N/s")


@dataclass(frozen=True)
class JointKind:
    """One kind of joint.

    label: its name in reports, that of URDF if there is one.
    names: Pinocchio's short names without "JointModel".
    units: of its coordinates, one each; None if they vary within the kind.
    group: its Lie group; None if its configurations form a vector space with q' = v.
    kernel: where in the tree the analytic kernel supports it. The closed forms require axes that do
        not change along the joint's own motion ("anywhere"); other joints are supported "as base",
        the root of all others, where they enter through gravity alone.
    """

    label: str
    names: tuple[str, ...]
    units: tuple[Units, ...] | None
    group: Group | None = None
    kernel: KernelSupport = "nowhere"


def _family(letter: str, *others: str) -> tuple[str, ...]:
    """The names of joints along x, y and z, and others."""
    return (*(letter + axis for axis in "XYZ"), *others)


def _on(group: Group, label: str, names: tuple[str, ...], kernel: KernelSupport) -> JointKind:
    """A kind whose velocities are the tangent vectors of a group."""
    units = (ANGLE if index in group.angular else LENGTH for index in range(group.nv))
    return JointKind(label, names, tuple(units), group, kernel)


FLOATING = _on(SE3, "floating", ("FreeFlyer",), "as base")
COMPOSITE = JointKind("composite", ("Composite",), None)
"""Its properties are those of its members."""

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
    """The kind of a joint; for a type that is not in the table, a kind with Pinocchio's name.

    Joints that are not in the table do not support planning.
    """
    name = str(joint.shortname())
    return _BY_NAME.get(name) or JointKind(name, (), None)


def coordinate_units(model: pin.Model) -> tuple[Units, ...]:
    """Units at each coordinate of a model, (nv,); those of angles where unknown."""
    units: list[Units] = []
    for joint in list(model.joints)[1:]:
        units += kind_of(joint).units or joint.nv * (ANGLE,)
    return tuple(units)

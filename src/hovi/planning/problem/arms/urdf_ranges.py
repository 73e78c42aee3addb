"""Ranges of positions that a URDF leaves empty, and those of its safety controllers."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.urdf.check import checked_urdf

Array = npt.NDArray[np.float64]
Range = tuple[float, float]
_SHOWN = 4
"""Names in a sentence."""


def require_ranges(robot: Robot, others: Collection[int] = ()) -> None:
    """Raise InputError for a range of the URDF without an inside, such as that of a file without.

    others: coordinates that have a range of their own.
    """
    if robot.unplanned_joints:
        return
    iq, iv = robot.space.plain
    empty = np.asarray(iv)[robot.upper[iq] <= robot.lower[iq]]
    names = [robot.coordinate_names[i] for i in empty if i not in others]
    if not names:
        return
    some = ", ".join(map(repr, names[:_SHOWN]))
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    joints, have = ("joints", "have") if len(names) > 1 else ("joint", "has")
    raise InputError(
        f"{joints} {some}{more} of robot {robot.name!r} {have} an empty position range in the "
        "URDF: lock such joints (locked=), make their type continuous, "
        f'or give their ranges, such as limits={{"q": {{{names[0]!r}: [-3.14, 3.14]}}}}.'
    )


def position_ranges(robot: Robot, soft: bool = False) -> tuple[Array, Array]:
    """The ranges of positions of the URDF, (nv,) each; infinite without one and for empty ones.

    soft: whether joints have those of their safety controllers.
    """
    lower, upper = np.full(robot.nv, -np.inf), np.full(robot.nv, np.inf)
    if not robot.unplanned_joints:
        iq, iv = robot.space.plain
        lower[iv], upper[iv] = robot.lower[iq], robot.upper[iq]
    for name, pair in _soft_ranges(robot).items() if soft else ():
        i = robot.coordinate_names.index(name)
        lower[i], upper[i] = pair
    empty = lower >= upper
    return np.where(empty, -np.inf, lower), np.where(empty, np.inf, upper)


def _soft_ranges(robot: Robot) -> dict[str, Range]:
    """The ranges of safety controllers that lie inside those of the joints, by coordinate.

    Of joints with one position. A controller whose soft limits are both zero,
    which is what URDF takes for missing ones, has none. Raises InputError where there is none.
    """
    iq, iv = robot.space.plain
    pairs = zip(iq, iv, strict=True)
    given = {robot.coordinate_names[v]: (robot.lower[q], robot.upper[q]) for q, v in pairs}
    found = {}
    for joint in _joints(robot):
        controller, name = joint.find("safety_controller"), joint.get("name", "")
        if controller is None or name not in given:
            continue
        keys = "soft_lower_limit", "soft_upper_limit"
        soft = [float(controller.get(key, "0")) for key in keys]
        lower, upper = max(soft[0], given[name][0]), min(soft[1], given[name][1])
        if any(soft) and lower < upper:
            found[name] = (float(lower), float(upper))
    if not found:
        raise InputError(
            f"the URDF of robot {robot.name!r} has no <safety_controller> with soft limits: use "
            'limits = "urdf".'
        )
    return found


def _joints(robot: Robot) -> Iterator[Element]:
    if robot.source.urdf is not None:
        yield from checked_urdf(robot.source.urdf, robot.source.reference).iterfind("joint")

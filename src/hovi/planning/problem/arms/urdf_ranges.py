"""Ranges of positions that a URDF leaves empty, and those of its safety controllers."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, some_of
from hovi.robot.robot import Robot
from hovi.robot.urdf.check import checked_urdf

Array = npt.NDArray[np.float64]
Range = tuple[float, float]


def require_ranges(robot: Robot, others: Collection[int] = ()) -> None:
    """Raise InputError for a range of the URDF without an inside, such as that of a file without.

    others: coordinates that have a range of their own.
    """
    names = [
        robot.coordinate_names[i]
        for i, (lower, upper) in _stated(robot).items()
        if upper <= lower and i not in others
    ]
    if not names:
        return
    joints, have = ("joints", "have") if len(names) > 1 else ("joint", "has")
    raise InputError(
        f"{joints} {some_of(map(repr, names))} of robot {robot.name!r} {have} an empty "
        "position range in the URDF: lock such joints (locked=), make their type continuous, "
        f'or give their ranges, such as limits={{"q": {{{names[0]!r}: [-3.14, 3.14]}}}}.'
    )


def position_ranges(robot: Robot, soft: bool = False) -> tuple[Array, Array]:
    """The ranges of positions of the URDF, (nv,) each; infinite without one and for empty ones.

    soft: whether joints have those of their safety controllers.
    """
    lower, upper = np.full(robot.nv, -np.inf), np.full(robot.nv, np.inf)
    for i, pair in {**_stated(robot), **(_soft_ranges(robot) if soft else {})}.items():
        lower[i], upper[i] = pair
    empty = lower >= upper
    return np.where(empty, -np.inf, lower), np.where(empty, np.inf, upper)


def _stated(robot: Robot) -> dict[int, Range]:
    """The ranges of the URDF by the index in v of joints with plain positions."""
    if robot.unplanned_joints:
        return {}
    iq, iv = robot.space.plain
    return {v: (float(robot.lower[q]), float(robot.upper[q])) for q, v in zip(iq, iv, strict=True)}


def _soft_ranges(robot: Robot) -> dict[int, Range]:
    """The ranges of safety controllers that lie inside those of the joints, by index in v.

    Of joints with one position. A controller whose soft limits are both zero,
    which is what URDF takes for missing ones, has none. Raises InputError where there is none.
    """
    given, found = _stated(robot), dict[int, Range]()
    numbers = {name: i for i, name in enumerate(robot.coordinate_names)}
    for joint in _joints(robot):
        controller, i = joint.find("safety_controller"), numbers.get(joint.get("name", ""), -1)
        if controller is None or i not in given:
            continue
        keys = "soft_lower_limit", "soft_upper_limit"
        soft = [float(controller.get(key, "0")) for key in keys]
        lower, upper = max(soft[0], given[i][0]), min(soft[1], given[i][1])
        if any(soft) and lower < upper:
            found[i] = (float(lower), float(upper))
    if not found:
        raise InputError(
            f"the URDF of robot {robot.name!r} has no <safety_controller> with soft limits: use "
            'limits = "urdf".'
        )
    return found


def _joints(robot: Robot) -> Iterator[Element]:
    if robot.source.urdf is not None:
        yield from checked_urdf(robot.source.urdf, robot.source.reference).iterfind("joint")

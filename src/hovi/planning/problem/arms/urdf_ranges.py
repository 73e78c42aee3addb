"""Ranges of positions that a URDF leaves empty, and those of its safety controllers."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, some_of
from hovi.robot.robot import Robot
from hovi.robot.urdf.check import checked_urdf
from hovi.robot.urdf.safety_controllers import Range, soft_ranges

Array = npt.NDArray[np.float64]


def require_ranges(robot: Robot, others: Collection[int] = ()) -> None:
    """Raise InputError for joints whose position range in the URDF is empty, lower >= upper.

    others: indices in v whose ranges the user gives.
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
    """The ranges of safety controllers by index in v. Raises InputError where there is none."""
    stated, found = _stated(robot), dict[str, Range]()
    if robot.source.urdf is not None:
        urdf = checked_urdf(robot.source.urdf, robot.source.reference)
        found = soft_ranges(urdf, {robot.coordinate_names[i]: x for i, x in stated.items()})
    if not found:
        raise InputError(
            f"the URDF of robot {robot.name!r} has no <safety_controller> with soft limits: use "
            'limits = "urdf".'
        )
    return {i: found[x] for i in stated if (x := robot.coordinate_names[i]) in found}

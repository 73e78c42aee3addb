"""The soft limits of <safety_controller>, which are used where they are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

Range = tuple[float, float]


def soft_ranges(robot: Element, given: Mapping[str, Range]) -> dict[str, Range]:
    """The ranges of safety controllers by joint, as far as they lie inside those of the joints.

    given: ranges of the joints, in [rad] or [m]. A controller whose soft limits are both zero,
    which is what URDF takes for missing ones, has none.
    """
    found = {}
    for joint in robot.iterfind("joint"):
        controller, name = joint.find("safety_controller"), joint.get("name", "")
        if controller is None or name not in given:
            continue
        low, high = (float(controller.get(f"soft_{x}_limit", "0")) for x in ("lower", "upper"))
        lower, upper = max(low, given[name][0]), min(high, given[name][1])
        if (low or high) and lower < upper:
            found[name] = (lower, upper)
    return found

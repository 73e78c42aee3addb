"""A Pinocchio joint of every type, in general position."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from hovi.robot.space.reordered_model import continuous_joint

_ALONG, _ACROSS = np.array([0.48, -0.6, 0.64]), np.array([0.8, 0.0, -0.6])
_NAMED = {
    "HX": pin.JointModelHX(0.2),
    "HY": pin.JointModelHY(-0.3),
    "HZ": pin.JointModelHZ(0.1),
    "RevoluteUnaligned": pin.JointModelRevoluteUnaligned(_ALONG),
    "PrismaticUnaligned": pin.JointModelPrismaticUnaligned(_ALONG),
    "HelicalUnaligned": pin.JointModelHelicalUnaligned(_ALONG, 0.3),
    "RevoluteUnboundedUnaligned": continuous_joint(_ALONG),
    "Universal": pin.JointModelUniversal(_ALONG, _ACROSS),
    "Ellipsoid": pin.JointModelEllipsoid(0.4, 0.3, 0.2),
}
_OF_OTHERS = "Composite", "Mimic"
"""Types that are composed of other joints."""
TYPES = tuple(name[10:] for name in dir(pin) if name.startswith("JointModel") and name[10:])
"""All joint types of Pinocchio."""
JOINTS: dict[str, pin.JointModel] = {
    name: _NAMED[name] if name in _NAMED else getattr(pin, f"JointModel{name}")()
    for name in TYPES
    if name not in _OF_OTHERS
}

"""Which scenes the reference tools support: rigid bodies on vector joints, gravity, armature."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from hovi.accuracy import Setting
from hovi.errors import UnmeasurableError

POINTS = 20
SAME = 1e-9
"""Relative difference of the cost's integrand up to which two scenes are the same."""


def require_plain(setting: Setting) -> None:
    """Raise UnmeasurableError for a scene whose cost is not 1/2 |RNEA|^2."""
    problem = setting.problem
    if not problem.plain:
        raise UnmeasurableError(
            "reference tools are measured between two states, with a torque at every joint."
        )
    if not problem.robot.vector_joints:
        raise UnmeasurableError("reference tools are measured on revolute and sliding joints only.")
    model, n = problem.scene.model, problem.robot.nv
    data = model.createData()
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, POINTS, n))
    tau = np.array([pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)])
    plain, ours = 0.5 * np.sum(tau**2, axis=1), problem.ld.lagrangian.value(q, v, a)
    if np.max(np.abs(plain - ours) / np.maximum(plain, 1.0)) > SAME:
        raise UnmeasurableError(
            "reference tools know rigid bodies, gravity and armature, and this scene has more in "
            "its torques or in its cost; they are left out."
        )

"""The check that the reference tools support a scene: a torque per joint, no limits."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from hovi.accuracy import Setting
from hovi.errors import UnmeasurableError

POINTS = 20
MAX_RELATIVE_DIFFERENCE = 1e-9
"""Largest relative difference of the integrand of the cost from 1/2 |RNEA|^2."""


def require_supported(setting: Setting) -> None:
    """Raise UnmeasurableError for limits, and for a scene whose cost is not 1/2 |RNEA|^2."""
    problem = setting.problem
    if problem.limited:
        raise UnmeasurableError(
            "The reference tools are left out: they do not hold limits along the whole motion."
        )
    if not problem.plain:
        raise UnmeasurableError(
            "the reference tools need two boundary states and a torque at every joint."
        )
    if not problem.robot.vector_joints:
        raise UnmeasurableError("the reference tools support only revolute and prismatic joints.")
    model, n = problem.scene.model, problem.robot.nv
    data = model.createData()
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, POINTS, n))
    tau = np.array([pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)])
    reference, ours = 0.5 * np.sum(tau**2, axis=1), problem.ld.lagrangian.value(q, v, a)
    if np.max(np.abs(reference - ours) / np.maximum(reference, 1.0)) > MAX_RELATIVE_DIFFERENCE:
        raise UnmeasurableError(
            "the reference tools support rigid bodies, gravity and armature, but this scene has "
            "further torques or costs; they are left out."
        )

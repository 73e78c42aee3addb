"""The inertia that effects add to a robot: the coefficient of accelerations in their torques."""

from __future__ import annotations

import casadi as ca
import numpy as np

from hovi.errors import SceneError
from hovi.scene.scene import Scene


def added_inertia(scene: Scene) -> ca.SX | None:
    """A(q) of effects whose torque is A(q) a + ..., shape (nv, nv); None without such effects."""
    q, v, a, t = scene.terms.symbols.columns()
    total = None
    for effect in scene.effects:
        term = effect.torque(scene.robot, scene.terms.symbols)
        if term is None or not ca.depends_on(term, a):
            continue
        A = ca.simplify(ca.jacobian(term, a))
        if ca.depends_on(A, ca.vertcat(v, a, t)) or not _symmetric(A, q):
            raise SceneError(
                f"effect {effect.key!r} depends on the acceleration, but not as an inertia does "
                "(a symmetric A(q) times a), so it cannot be simulated: remove it."
            )
        total = A if total is None else total + A
    return total


def _symmetric(A: ca.SX, q: ca.SX) -> bool:
    """Whether A(q) equals its transpose, at three fixed random points."""
    skew = ca.Function("skew", [q], [ca.densify(A - A.T), ca.densify(A)])
    random = np.random.default_rng(0)
    pairs = (skew(random.normal(size=q.shape[0])) for _ in range(3))
    return all(
        np.abs(np.array(odd)).max() <= 1e-12 * max(1.0, np.abs(np.array(full)).max())
        for odd, full in pairs
    )

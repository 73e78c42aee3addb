"""Conserved momenta of a robot with an unactuated floating base.

Under gravity g alone, with total mass m, the center of mass is c(t) = c0 + P0 t/m + g t^2/2, the
linear momentum is P(t) = P0 + m g t, and the angular momentum about the center of mass is
constant. A goal that prescribes these as well is redundant or infeasible.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.guess import Ends
from hovi.robot.space.joint_kinds import FLOATING, kind_of
from hovi.scene.scene import Scene
from hovi.scene.segmented_lagrangian import NODE_TOLERANCE
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MOMENTUM_TOLERANCE = 1e-6
"""Relative tolerance for the agreement of a goal with the conserved quantities."""


@dataclass(frozen=True, eq=False)
class Stop:
    """What is given of a motion at a time, in [s]: q, v, and which of them are free, (2, nv)."""

    time: float
    q: Array
    v: Array
    free: Mask

    @property
    def given(self) -> bool:
        """Whether nothing is free."""
        return not self.free.any()

    @property
    def at_rest(self) -> bool:
        """Whether the velocity is given as zero, so that the momenta are zero."""
        return not self.v.any() and not self.free[1].any()


@dataclass(frozen=True, eq=False)
class CentroidalState:
    """Center of mass [m], linear momentum [kg m/s] and angular momentum about it [N m s]."""

    center: Array
    linear: Array
    angular: Array


def falls_freely(scene: Scene) -> bool:
    """Whether the first joint is a passive floating base on which only gravity acts."""
    if scene.robot.joint_names[0] not in scene.passive:
        return False
    model, terms = scene.robot.model, scene.terms
    alone = sum(parent == 0 for parent in list(model.parents)[1:]) == 1
    if kind_of(model.joints[1]) is not FLOATING or not alone:
        return False
    untouched = terms.torque is None or ca.SX(terms.torque)[:6].is_zero()
    return untouched and terms.base is None and not scene.model.armature[:6].any()


def centroidal_state(scene: Scene, q: Array, v: Array) -> CentroidalState:
    """Center of mass and momenta of a state, in the world frame."""
    data = scene.model.createData()
    momentum = pin.computeCentroidalMomentum(scene.model, data, q, v)
    center = pin.centerOfMass(scene.model, data, q)
    return CentroidalState(center.copy(), momentum.linear.copy(), momentum.angular.copy())


def after_free_fall(scene: Scene, start: CentroidalState, duration: float) -> CentroidalState:
    """The centroidal state after free fall for a duration in [s]."""
    mass, g, T = pin.computeTotalMass(scene.model), scene.model.gravity.linear, duration
    center = start.center + start.linear / mass * T + g * T**2 / 2
    return CentroidalState(center, start.linear + mass * g * T, start.angular)


def kept_in_free_fall(
    scenes: Sequence[Scene], ends: Sequence[float], stops: Sequence[Stop]
) -> tuple[str, list[Mask]]:
    """Why no joint torques take a robot from stop to stop, or "", and what is free at each.

    Redundant components of the base are freed: see `without_redundancy`.
    scenes: of the segments. ends: of all segments but the last, in [s]. stops: the start, the
    seams, and the goal.
    """
    reason, free = "", [stop.free for stop in stops]
    for i, stop in enumerate(stops):
        for before in _last_known(stops[:i]):
            scene = _falling_between(scenes, ends, before.time, stop.time)
            if scene is not None:
                jets = np.stack([before.q, stop.q]), np.stack([before.v, stop.v])
                both, T = np.stack([before.free, stop.free]), stop.time - before.time
                reason = reason or free_fall_contradiction(scene, jets, both, T)
                free[i] = free[i] | without_redundancy(scene, jets, both)[1]
    return reason, free


def _last_known(stops: Sequence[Stop]) -> list[Stop]:
    """The last stop of which all is given, and the last one at rest."""
    given = next((stop for stop in reversed(stops) if stop.given), None)
    rest = next((stop for stop in reversed(stops) if stop.at_rest), None)
    return [stop for stop in dict.fromkeys((given, rest)) if stop is not None]


def _falling_between(
    scenes: Sequence[Scene], ends: Sequence[float], begin: float, end: float
) -> Scene | None:
    """The scene of a free fall between two times; None if masses or gravity change on the way."""
    least = NODE_TOLERANCE * end
    first = int(np.searchsorted(np.array(ends), begin + least))
    last = int(np.searchsorted(np.array(ends), end - least))
    between = scenes[first : last + 1]
    falls = all(falls_freely(each) and _falls_as(each, between[0]) for each in between)
    return between[0] if falls else None


def _falls_as(one: Scene, other: Scene) -> bool:
    """Whether two scenes of a robot have the same masses and the same gravity."""
    a, b = one.model, other.model
    return a is b or (list(a.inertias) == list(b.inertias) and a.gravity == b.gravity)


def free_fall_contradiction(scene: Scene, ends: Ends, free: Mask, duration: float) -> str:
    """Why no joint torques take a free-falling robot from one state to another, or "".

    ends: (q, v) at both. free: which of (q, v) are free at both ends, shape (2, 2, nv).
    """
    (q0, q1), (v0, v1) = ends[:2]
    given = not free[0].any()
    if not (given or _at_rest(v0, free[0])) or not falls_freely(scene):
        return ""
    expected = after_free_fall(scene, centroidal_state(scene, q0, v0), duration)
    base = scene.robot.joint_names[0]
    if given and not free[1, 0].any():
        gap = float(np.linalg.norm(centroidal_state(scene, q1, v1).center - expected.center))
        if gap > MOMENTUM_TOLERANCE * (1.0 + float(np.linalg.norm(expected.center))):
            return (
                f"the base {base!r} is passive, so joint torques cannot move the center of mass: "
                f"the goal's is {gap:.4g} m from where free fall takes it; leave the goal's base "
                "position free"
            )
    if not free[1, 0, 3:].any() or _at_rest(v1, free[1]):
        return _momentum_contradiction(scene, q1, v1, free[1, 1], expected, base)
    return ""


def without_redundancy(scene: Scene, ends: Ends, free: Mask) -> Mask:
    """The free components of both ends, with redundant ones of the base freed.

    ends, free: as above.
    The base's position is redundant if all else of the goal's configuration is fixed, and its
    velocity if all joint rates are. Redundant equations would have no unique multipliers. A start
    whose configuration is free has momenta that are known if it is at rest.
    """
    given = not free[0].any()
    if not (given or _at_rest(ends[1][0], free[0])) or not falls_freely(scene):
        return free
    freed = free.copy()
    if given and not free[1, 0].any():
        freed[1, 0, :3] = True
    known = not free[1, 0, 3:].any() or _at_rest(ends[1][1], free[1])
    if known and not free[1, 1, 6:].any():
        freed[1, 1, :6] = True
    return freed


def _at_rest(v: Array, free: Mask) -> bool:
    """Whether a velocity is prescribed as zero, so that the momenta are zero. free: of (q, v)."""
    return not v.any() and not free[1].any()


def _momentum_contradiction(
    scene: Scene, q: Array, v: Array, free: Mask, expected: CentroidalState, base: str
) -> str:
    """Why no choice of the free velocities has the expected momenta, or ""."""
    data = scene.model.createData()
    A = pin.computeCentroidalMap(scene.model, data, q)  # momenta = A v
    wanted = np.concatenate([expected.linear, expected.angular])
    gap = wanted - A @ np.where(free, 0.0, v)
    if free.any():
        gap = gap - A[:, free] @ np.linalg.lstsq(A[:, free], gap, rcond=None)[0]
    if np.linalg.norm(gap) <= MOMENTUM_TOLERANCE * (1.0 + np.linalg.norm(wanted)):
        return ""
    kind, size, unit = "linear", np.linalg.norm(gap[:3]), "kg m/s"
    if size < np.linalg.norm(gap[3:]):
        kind, size, unit = "angular", np.linalg.norm(gap[3:]), "N m s"
    return (
        f"the base {base!r} is passive, so joint torques cannot change the momentum: the goal's "
        f"{kind} momentum is off by {size:.4g} {unit}; leave the goal's base velocity free"
    )

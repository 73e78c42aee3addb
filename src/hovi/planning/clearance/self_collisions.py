"""The pairs of a robot's own shapes that are kept apart."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError, warn
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.pair_distances import PairDistances
from hovi.robot.robot import Robot
from hovi.robot.srdf import checked_pairs
from hovi.robot.urdf.added_link import added_links

Array = npt.NDArray[np.float64]

SAMPLES = 128
"""Number of random configurations at which pairs are looked at."""
FIRST_SAMPLES = 8
"""Number of random configurations at which all pairs are looked at; most pairs are apart at one."""


@lru_cache(maxsize=16)
def self_collision_pairs(
    robot: Robot, may_touch: tuple[tuple[str, str], ...] = ()
) -> tuple[tuple[int, int], ...]:
    """Pairs of shapes, by index in the convex geometry, that a motion can keep apart.

    All pairs of shapes on joints of which neither is the parent of the other, except those that the
    SRDF disables, and those that overlap at every one of many configurations: a warning names them.
    may_touch: pairs of names of links that may overlap without a warning.
    """
    for sentence in pairs_left_out(robot, may_touch):
        warn(sentence)
    return _split_pairs(robot)[0]


def pairs_left_out(robot: Robot, may_touch: tuple[tuple[str, str], ...] = ()) -> list[str]:
    """Which pairs are not kept apart, as they always overlap, in sentences; none if all are."""
    allowed = {frozenset(each) for each in may_touch}
    links = [pair for pair in _split_pairs(robot)[1] if frozenset(pair) not in allowed]
    grasped = added_links(robot.model)
    of_robot = [pair for pair in links if grasped.isdisjoint(pair)]
    of_grasped = [pair for pair in links if not grasped.isdisjoint(pair)]
    advice = "name the links in `may_touch` of the grasped object"
    found = [_sentence(robot, of_robot, "disable them in an SRDF")] if of_robot else []
    return found + ([_sentence(robot, of_grasped, advice)] if of_grasped else [])


def touching_links(robot: Robot) -> tuple[tuple[str, str], ...]:
    """The pairs of links that overlap at every configuration. Raises ModelError without shapes."""
    return _split_pairs(robot)[1]


@lru_cache(maxsize=16)
def can_keep_apart(robot: Robot, may_touch: tuple[tuple[str, str], ...] = ()) -> bool:
    """Whether a robot has all of its collision shapes, and links that can be kept apart."""
    try:
        return bool(self_collision_pairs(robot, may_touch))
    except ModelError:
        return False


def names_shapes(robot: Robot) -> bool:
    """Whether the URDF of a robot names collision shapes, which may not be readable."""
    return "<collision" in (robot.source.urdf or "")


def not_looked_at(robot: Robot) -> str:
    """Why links of a robot with collision shapes cannot be kept apart, as a sentence, or ""."""
    if not names_shapes(robot):
        return ""
    try:
        self_collision_pairs(robot)
    except ModelError as error:
        return f"Self-collision was not looked at: {error}"
    return ""


@lru_cache(maxsize=16)
def _split_pairs(robot: Robot) -> tuple[tuple[tuple[int, int], ...], tuple[tuple[str, str], ...]]:
    """The pairs of shapes that can be kept apart, and the pairs of links of the others."""
    geometry = convex_geometry(robot)
    pairs = checked_pairs(robot.model, geometry, robot.semantics.disabled)
    touching = _always_overlapping(robot, geometry, pairs)
    frames = [shape.parentFrame for shape in geometry.geometryObjects]
    links = [str(robot.model.frames[frame].name) for frame in frames]
    named = dict.fromkeys((links[i], links[j]) for i, j in touching)
    return tuple(pair for pair in pairs if pair not in touching), tuple(named)


def _always_overlapping(
    robot: Robot, geometry: pin.GeometryModel, pairs: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    paired = geometry.copy()
    for i, j in pairs:
        paired.addCollisionPair(pin.CollisionPair(i, j))
    distances, q = PairDistances(robot, paired), _samples(robot)
    left = np.arange(len(pairs))
    for some in (q[:FIRST_SAMPLES], q[FIRST_SAMPLES:]):
        left = left[(distances.values(some, left, 0.0) <= 0.0).all(axis=0)]
    return [pairs[k] for k in left]


def _samples(robot: Robot) -> Array:
    """Random configurations within the limits, (SAMPLES, nq)."""
    random, model = np.random.default_rng(0), robot.model
    neutral = np.tile(np.asarray(pin.neutral(model)), (SAMPLES, 1))
    q = robot.integrate(neutral, random.uniform(-np.pi, np.pi, (SAMPLES, robot.nv)))
    for joint in list(model.joints)[1:]:
        i = joint.idx_q
        if joint.nq == joint.nv == 1:
            lower, upper = model.lowerPositionLimit[i], model.upperPositionLimit[i]
            if upper - lower < 2 * np.pi:
                q[:, i] = random.uniform(lower, upper, SAMPLES)
    return q


def _sentence(robot: Robot, links: list[tuple[str, str]], advice: str) -> str:
    names = ", ".join(f"{a!r} and {b!r}" for a, b in links)
    return (
        f"the collision shapes of robot {robot.name!r} overlap at every configuration between "
        f"links {names}: these pairs are not kept apart; {advice}."
    )

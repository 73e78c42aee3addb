"""A success is a motion within its limits, wherever its ends are and wherever they lead.

Ends at, beyond and near bounds, with derivatives of every direction, judged by dense samples of the
motion alone: no success is over a limit by more than the tolerance, but for what it says is excused
until when; and none is not usable.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import hovi

pytestmark = pytest.mark.filterwarnings("ignore")
SAMPLES = 50_001
T = 2.2
TOLERANCE = 1e-6
OUTWARDS = (-0.2, 0.0, 1e-3, 0.02, 0.1, 0.3)
"""Velocities out of a bound, in rad/s."""


@dataclass(frozen=True)
class Case:
    """A motion whose start or goal is somewhere about a bound of its last joint."""

    scene: hovi.Scene
    start: hovi.State
    goal: hovi.State
    limits: dict[str, Any]

    @property
    def bounds(self) -> dict[str, np.ndarray]:
        return {kind: np.array(self.limits[kind]) for kind in ("q", "v", "tau")}


def case(scene: hovi.Scene, rng: np.random.Generator, *, at_start: bool) -> Case:
    """An end at a bound of a joint's position or velocity, or next to it, and one inside."""
    n = scene.robot.nv
    limits = {"base": "none", "q": [1.5] * n, "v": [3.0] * n, "tau": [60.0] + [40.0] * (n - 1)}
    q, v = rng.uniform(-1, 1, n), rng.uniform(-0.2, 0.2, n)
    side, joint = rng.choice([-1.0, 1.0]), rng.integers(n)
    q[joint] = side * (1.5 + rng.choice([0.0, 0.0, 1e-9, 1e-5, 2e-3, -1e-3, 0.2]))
    v[joint] = side * rng.choice(OUTWARDS)
    if rng.random() < 0.3:
        q[joint] = rng.uniform(-1, 1)
        v[joint] = side * (3.0 + rng.choice([0.0, 1e-9, 1e-3, 0.02, 0.5]))
    at, inside = hovi.State(q, v), hovi.State(rng.uniform(-1, 1, n))
    return Case(scene, *((at, inside) if at_start else (inside, at)), limits)


def excess(solution: hovi.Solution, bounds: dict[str, np.ndarray]) -> float:
    """The largest excess over any bound, as a share of its range, but for what is excused."""
    motion = solution.trajectory
    t = np.linspace(0.0, motion.duration, SAMPLES)
    sample, worst = motion.sample(t), -np.inf
    for kind, bound in bounds.items():
        over = np.abs(getattr(sample, kind)) - bound
        for each in getattr(solution, "excused", ()):
            if each.limit == kind:
                joint = motion.coordinate_names.index(each.joint)
                over[t < each.until, joint] -= each.excess
        worst = max(worst, float((over / (2 * bound)).max()))
    return worst


def judge(solution: hovi.Solution, bounds: dict[str, np.ndarray]) -> None:
    if solution.success:
        assert solution.usable, solution.message
        assert excess(solution, bounds) <= 1.1 * TOLERANCE, solution.message


@pytest.fixture(scope="module")
def arm() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])


@pytest.mark.parametrize("seed", range(8))
def test_planned_motions_with_an_end_at_a_bound(arm: hovi.Scene, seed: int) -> None:
    rng = np.random.default_rng(seed)
    given = case(arm, rng, at_start=bool(seed % 2))
    smooth = seed % 3 == 2
    found = hovi.plan(
        arm, given.start, given.goal, T, limits=given.limits, smooth=smooth, time_limit=20
    )
    judge(found, given.bounds)

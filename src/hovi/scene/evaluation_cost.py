"""The cost of each effect of a scene: instructions of the expression graph, and measured time."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol, Self

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.effects import Effect
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline

Array = npt.NDArray[np.float64]

POINTS = 64
"""Points per evaluation: about those of a motion with 16 intervals."""
SECONDS = 0.02
"""Time for the repeated evaluation of each scene, in [s]."""
MIN_TURNS = 3
"""Minimum number of repetitions, less one."""


class AccountedScene(Protocol):
    """What is measured of a scene."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def effects(self) -> Sequence[Effect]:
        """Its effects."""

    def without(self, key: str) -> Self:
        """The same scene without one of its effects."""

    def graph(self) -> ca.Function:
        """(q, v, a, t) -> (tau, L~)."""

    def evaluation(self) -> Callable[..., Any]:
        """(q, v, a, t) -> L~ with its derivatives at a batch of points."""


@dataclass(frozen=True)
class EffectCost:
    """The cost of one effect.

    key: of the effect. touches: what it modifies, as text.
    instructions: number added to the graph of (tau, L~); 0 if only constants change.
    seconds, seconds_without: per point of an evaluation with derivatives, in [s].
    """

    key: str
    touches: str
    instructions: int
    seconds: float
    seconds_without: float


@dataclass(frozen=True)
class SceneAccount:
    """The cost of evaluating a scene.

    instructions: of its graph. seconds: per point of an evaluation with derivatives, in [s].
    effects: the cost of each effect, from the scene with and without it.
    """

    instructions: int
    seconds: float
    effects: tuple[EffectCost, ...]

    def lines(self) -> list[str]:
        """The account as text, with one line per effect."""
        first = (
            f"cost: {_microseconds(self.seconds)} per point with derivatives, "
            f"{self.instructions} instructions in the expression graph"
        )
        if not self.effects:
            return [first]
        width = max(len(cost.key) for cost in self.effects)
        head = f"  {'':{width}}  {'touches':12}  {'instructions':>12}  {'without it':>11}"
        return [first, head, *(self._line(cost, width) for cost in self.effects)]

    def _line(self, cost: EffectCost, width: int) -> str:
        without = _microseconds(cost.seconds_without)
        return f"  {cost.key:{width}}  {cost.touches:12}  {cost.instructions:>+12d}  {without:>11}"


def _microseconds(seconds: float) -> str:
    us = 1e6 * seconds
    return f"{us:.3g} us" if us < 1000 else f"{us:.0f} us"


def account(scene: AccountedScene) -> SceneAccount:
    """Count and measure a scene, and the same scene without each of its effects."""
    bare = [scene.without(effect.key) for effect in scene.effects]
    instructions = scene.graph().n_instructions()
    seconds, *without = seconds_per_point([scene, *bare])
    costs = tuple(
        EffectCost(
            effect.key,
            ", ".join(effect.touches),
            instructions - other.graph().n_instructions(),
            seconds,
            seconds_without,
        )
        for effect, other, seconds_without in zip(scene.effects, bare, without, strict=True)
    )
    return SceneAccount(instructions, seconds, costs)


def seconds_per_point(scenes: Sequence[AccountedScene]) -> list[float]:
    """The shortest time per point of an evaluation with derivatives, in [s], of each scene.

    The scenes take turns, so that other load on the machine affects all of them alike.
    """
    evaluations = [scene.evaluation() for scene in scenes]
    batches = [_points(scene.robot) for scene in scenes]
    shortest = [np.inf] * len(scenes)
    deadline = Deadline(SECONDS * len(scenes))
    for turn in itertools.count():
        for i, (evaluate, points) in enumerate(zip(evaluations, batches, strict=True)):
            evaluate(*points)  # warms the caches after the previous scene
            began = time.perf_counter()
            evaluate(*points)
            shortest[i] = min(shortest[i], time.perf_counter() - began)
        if turn >= MIN_TURNS and deadline.passed:
            break
    return [float(each) / POINTS for each in shortest]


def _points(robot: Robot) -> tuple[Array, Array, Array, Array]:
    random = np.random.default_rng(0)
    dq, v, a = random.uniform(-1.0, 1.0, (3, POINTS, robot.nv))
    q = np.stack([pin.integrate(robot.model, pin.neutral(robot.model), x) for x in dq])
    return q, v, a, np.linspace(0.0, 1.0, POINTS)

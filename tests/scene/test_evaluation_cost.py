"""The description of a scene: what is simulated, what is left out, what each effect costs."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from hovi import plan
from hovi.effects import REGISTRY, Effect, Gravity, Payload, ViscousFriction
from hovi.flows.simulator import simulate
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.evaluation_cost import account, seconds_per_point
from hovi.scene.scene import Scene
from samples.sample_effects import sample_effects

RICH = ("viscous_friction", "dry_friction", "armature", "payload", "drag")


@pytest.fixture(scope="module")
def rich() -> Task:
    return load_task(example("panda_reach_rich"))


def test_a_scene_with_five_effects_on_panda_plans_and_simulates(rich: Task) -> None:
    assert tuple(effect.key for effect in rich.scene.effects) == ("gravity", *RICH)
    ends = rich.start, rich.goal, rich.duration
    solution = plan(rich.scene, *ends, limits="none", tolerance=1e-7, self_collision=False)
    assert solution.success
    simple = plan(
        Scene(rich.scene.robot, [Gravity()]),
        rich.start,
        rich.goal,
        rich.duration,
        limits="none",
        self_collision=False,
    )
    assert solution.cost > 1.5 * simple.cost
    motion = simulate(rich.scene, rich.start, rich.duration, solution.trajectory, intervals=320)
    np.testing.assert_allclose(motion.q[-1], rich.goal.q, atol=2e-2)


def test_the_account_of_five_effects_is_correct(rich: Task) -> None:
    text = rich.scene.describe()
    simulated, rest = text.split("left out:")
    for effect in rich.scene.effects:
        assert f"  {effect.describe()}\n" in simulated
    assert "nothing in the URDF" in rest  # its damping is an effect
    bare = rich.scene.graph().n_instructions()
    for effect in rich.scene.effects:
        added = bare - rich.scene.without(effect.key).graph().n_instructions()
        row = re.search(rf"^  {effect.key} +(\S+) +([+-]\d+) +([\d.]+) us$", rest, re.M)
        assert row is not None
        assert row[1] == ", ".join(effect.touches)
        assert int(row[2]) == added
        assert float(row[3]) > 0
    without = rich.scene.without("viscous_friction").describe().split("left out:")[1]
    assert "damping of panda_joint1, panda_joint2" in without


def test_the_account_measures_the_scene_with_and_without(two_link: Robot) -> None:
    effects = [Gravity(), ViscousFriction(0.1), Payload(two_link.tip_frame, 1.0)]
    costs = account(Scene(two_link, effects))
    assert [cost.key for cost in costs.effects] == ["gravity", "viscous_friction", "payload"]
    assert costs.instructions == Scene(two_link, effects).graph().n_instructions()
    for cost in costs.effects:
        assert cost.seconds == costs.seconds > 0
        assert cost.seconds_without > 0
    assert costs.effects[1].instructions > 0


@pytest.mark.parametrize("key", REGISTRY)
def test_every_effect_has_an_account(two_link: Robot, key: str) -> None:
    scene = Scene(two_link, [sample_effects(two_link)[key]])
    (cost,) = account(scene).effects
    grown = scene.graph().n_instructions() - scene.without(key).graph().n_instructions()
    assert (cost.key, cost.instructions) == (key, grown)


def test_a_scene_without_effects_has_a_cost_too(two_link: Robot) -> None:
    (line,) = account(Scene(two_link)).lines()
    assert line.startswith("cost: ")


def test_a_robot_on_a_manifold_has_an_account() -> None:
    assert "gravity" in Scene(load_robot("kinova"), [Gravity()]).describe().split("cost:")[1]


@dataclass
class Interrupted:
    """A scene whose first evaluation takes long, as when another process has the processor."""

    robot: Robot
    effects: tuple[Effect, ...] = ()
    evaluations: int = 0

    def evaluation(self) -> Callable[..., None]:
        return self._evaluate

    def _evaluate(self, *points: np.ndarray) -> None:
        self.evaluations += 1
        if self.evaluations <= 2:  # the one that warms the caches, and the measured one
            time.sleep(0.2)

    def without(self, key: str) -> Interrupted:
        raise KeyError(key)

    def graph(self) -> ca.Function:
        return ca.Function("none", [], [])


def test_a_slow_scene_is_measured_four_times_all_the_same(two_link: Robot) -> None:
    """Though the time for it has passed: the shortest counts."""
    scene = Interrupted(two_link)
    seconds_per_point([scene])
    assert scene.evaluations >= 2 * 4

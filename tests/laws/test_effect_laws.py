"""Laws of every effect: exact derivatives, no cost if unused, files and back."""

from __future__ import annotations

import dataclasses
import json
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi import plan
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.effects import (
    REGISTRY,
    Effect,
    EffortWeight,
    Gravity,
    JointSprings,
    SceneSymbols,
    Touch,
    VelocityCost,
    ViscousFriction,
    register,
)
from hovi.errors import SceneError
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.writing import save_task
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.sample_effects import sample_effects, zero_strength_effects

Array = npt.NDArray[np.float64]

OF_ORDER_2 = [key for key in REGISTRY if key != "jerk_cost"]
"""Effects that leave the Lagrangian one of order 2; that of order 3 has tests of its own."""


def points(robot: Robot, count: int = 4) -> tuple[Array, Array, Array, Array]:
    random = np.random.default_rng(robot.nv)
    dq, v, a = random.normal(size=(3, count, robot.nv))
    q = robot.integrate(np.tile(robot.neutral(), (count, 1)), dq)
    return q, v, a, random.uniform(0.1, 2.0, count)


@pytest.fixture(scope="module")
def kinova() -> Robot:
    """An arm with continuous joints (nq = 2, nv = 1)."""
    return load_robot("kinova")


def with_gravity(effect: Effect) -> list[Effect]:
    return [effect] if isinstance(effect, Gravity) else [Gravity(), effect]


def test_there_is_a_sample_of_every_effect(two_link: Robot) -> None:
    assert set(sample_effects(two_link)) == set(REGISTRY)
    assert set(zero_strength_effects(two_link)) == set(OF_ORDER_2)


@pytest.mark.parametrize("key", OF_ORDER_2)
@pytest.mark.parametrize("name", ["two_link", "panda", "kinova"])
def test_gradient_and_hessian_match_finite_differences(
    request: pytest.FixtureRequest, name: str, key: str
) -> None:
    robot: Robot = request.getfixturevalue(name)
    lagrangian = Scene(robot, with_gravity(sample_effects(robot)[key])).effort_lagrangian()
    *jet, t = points(robot)
    n, m = robot.nv, 3 * robot.nv
    _, gradient, hessian = lagrangian.evaluate(*jet, t=t)
    e = 1e-5
    for i in range(m):
        dq, dv, da = np.split(np.tile(e * np.eye(m)[i], (len(t), 1)), [n, 2 * n], axis=1)
        above, below = (
            [robot.integrate(jet[0], s * dq), jet[1] + s * dv, jet[2] + s * da] for s in (1, -1)
        )
        slope = (lagrangian.value(*above, t=t) - lagrangian.value(*below, t=t)) / (2 * e)
        scale = np.abs(gradient).max()
        np.testing.assert_allclose(gradient.reshape(-1, m)[:, i], slope, atol=1e-7 * scale)
        bend = lagrangian.gradient(*above, t=t) - lagrangian.gradient(*below, t=t)
        scale = np.abs(hessian).max()
        found = hessian.reshape(-1, m, m)[:, i]
        np.testing.assert_allclose(found, bend.reshape(-1, m) / (2 * e), atol=1e-7 * scale)


@pytest.mark.parametrize("key", OF_ORDER_2)
def test_the_kernel_and_the_expression_graph_agree(two_link: Robot, key: str) -> None:
    scene = Scene(two_link, with_gravity(sample_effects(two_link)[key]))
    *jet, t = points(two_link)
    tau, cost = scene.graph().map(len(t))(*(x.T for x in jet), t[None])
    np.testing.assert_allclose(scene.inverse_dynamics(*jet, t), np.array(tau).T, rtol=1e-12)
    value = scene.effort_lagrangian().value(*jet, t=t)
    np.testing.assert_allclose(value, np.array(cost)[0], rtol=1e-12)


# Nothing for nothing


def inverse_dynamics_graph(robot: Robot) -> ca.Function:
    """Gravity and inertia only, without a scene."""
    model = robot.model.copy()
    model.armature = np.zeros(model.nv)
    q, v, a, t = (ca.SX.sym(name, n) for name, n in zip("qvat", (*[model.nv] * 3, 1), strict=True))
    tau = casadi_functions(model).inverse_dynamics(q, v, a)
    return ca.Function(
        "inverse_dynamics_graph", [q, v, a, t], [tau, ca.dot(ca.DM.ones(model.nv), tau**2) / 2]
    )


@pytest.mark.parametrize("key", [key for key in OF_ORDER_2 if key != "gravity"])
@pytest.mark.parametrize("name", ["two_link", "panda"])
def test_an_unused_effect_adds_no_instruction(
    request: pytest.FixtureRequest, name: str, key: str
) -> None:
    robot: Robot = request.getfixturevalue(name)
    scene = Scene(robot, with_gravity(sample_effects(robot)[key]))
    bare = inverse_dynamics_graph(robot).n_instructions()
    assert scene.without(key).graph().n_instructions() == bare
    if key == "payload" and robot.nv > 2:  # the hand has a full inertia already: other numbers
        assert scene.graph().n_instructions() == bare
    else:
        assert scene.graph().n_instructions() > bare


def test_unused_gravity_adds_no_instruction(panda: Robot) -> None:
    weightless = panda.model.copy()
    weightless.gravity.linear = np.zeros(3)
    scene = Scene(panda, [Gravity()])
    expected = inverse_dynamics_graph(load_robot(weightless)).n_instructions()
    assert scene.without("gravity").graph().n_instructions() == expected
    assert scene.graph().n_instructions() > expected


@pytest.mark.parametrize(
    ("effect", "a_joint", "besides"),
    [
        (ViscousFriction(0.3), 2, 1),  # a product and a sum; the constant
        (JointSprings(0.3, 0.7), 3, 3),  # a difference more; two constants, and RNEA has no q1
        (VelocityCost(0.3), 3, 2),  # a square, a product, a sum; the constant and a half
        (EffortWeight(0.3), 1, 1),  # a product; the constant
    ],
    ids=lambda each: getattr(each, "key", None),
)
def test_an_effect_adds_the_instructions_of_its_formula(
    panda: Robot, effect: Effect, a_joint: int, besides: int
) -> None:
    scene = Scene(panda, [Gravity(), effect])
    grown = scene.graph().n_instructions() - scene.without(effect.key).graph().n_instructions()
    assert grown == a_joint * panda.nv + besides


@pytest.mark.parametrize("key", OF_ORDER_2)
@pytest.mark.parametrize("name", ["two_link", "panda"])
def test_an_effect_of_strength_zero_changes_nothing(
    request: pytest.FixtureRequest, name: str, key: str
) -> None:
    robot: Robot = request.getfixturevalue(name)
    scene = Scene(robot, with_gravity(zero_strength_effects(robot)[key]))
    *jet, t = points(robot)
    bare = scene.without(key).effort_lagrangian().evaluate(*jet, t=t)
    for found, expected in zip(scene.effort_lagrangian().evaluate(*jet, t=t), bare, strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


# What an effect is


@pytest.mark.parametrize("key", REGISTRY)
def test_every_effect_is_frozen_and_described_in_one_line(two_link: Robot, key: str) -> None:
    effect = sample_effects(two_link)[key]
    assert effect.key == key
    text = effect.describe()
    assert text.startswith(key)
    assert "\n" not in text
    field = dataclasses.fields(effect)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(effect, field, 1.0)


@pytest.mark.parametrize("key", OF_ORDER_2)
def test_an_effect_touches_what_it_declares_and_nothing_else(panda: Robot, key: str) -> None:
    effect = sample_effects(panda)[key]
    scene, bare = Scene(panda, [effect]), Scene(panda)
    *jet, t = points(panda)
    same_torque = np.array_equal(scene.inverse_dynamics(*jet, t), bare.inverse_dynamics(*jet, t))
    assert same_torque == (effect.touches == (Touch.COST,))
    named = (scene.terms.torque, scene.terms.potential)
    assert (named[0] is not None) <= (Touch.TORQUE in effect.touches)
    assert (named[1] is not None) <= (Touch.COST in effect.touches)


def test_an_effect_that_touches_more_than_it_declares_is_refused(two_link: Robot) -> None:
    @dataclasses.dataclass(frozen=True)
    class Secret(Effect):
        key: ClassVar[str] = "secret"
        touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

        def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
            return symbols.v

        def describe(self) -> str:
            return "secret"

    with pytest.raises(SceneError, match=r"'secret' adds to the torque without declaring it"):
        Scene(two_link, [Secret()]).inverse_dynamics(*points(two_link))


# Files


@pytest.mark.parametrize("key", REGISTRY)
def test_an_effect_survives_json(two_link: Robot, key: str) -> None:
    scene = Scene(two_link, [sample_effects(two_link)[key]])
    text = json.dumps(scene.to_dict())
    copy = Scene.from_dict(json.loads(text))
    assert copy.effects == scene.effects
    assert json.dumps(copy.to_dict()) == text
    assert pickle.loads(pickle.dumps(scene)).effects == scene.effects


@pytest.mark.parametrize("key", REGISTRY)
def test_an_effect_survives_toml(two_link: Robot, tmp_path: Path, key: str) -> None:
    scene = Scene(two_link, with_gravity(sample_effects(two_link)[key]))
    task = Task(scene, State([0.0, 0.0]), State([1.0, 0.5]), 1.0)
    assert load_task(save_task(task, tmp_path / "scene.toml")).scene.effects == scene.effects


def test_time_dependent_effects_are_detected(panda: Robot) -> None:
    scene = Scene(panda, list(sample_effects(panda).values()))
    timed = ("wrench", "drag", "moving_base", "custom", "reference_cost", "running_cost")
    assert set(scene.terms.timed) == set(timed)
    assert Scene(panda, list(zero_strength_effects(panda).values())[:7]).terms.timed == ()


# One's own


@dataclasses.dataclass(frozen=True)
class Cogging(Effect):
    """tau_1 += c sin(12 q_1)."""

    strength: float
    key: ClassVar[str] = "cogging"

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        return ca.vertcat(self.strength * ca.sin(12 * symbols.q[0]), ca.SX.zeros(robot.nv - 1))

    def describe(self) -> str:
        return f"cogging: {self.strength:g} N m"


@pytest.fixture
def registered() -> Iterator[None]:
    register(Cogging)
    yield
    del REGISTRY["cogging"]


@pytest.mark.usefixtures("registered")
def test_a_registered_effect_is_stored_in_scene_and_motion_files(
    two_link: Robot, tmp_path: Path
) -> None:
    scene = Scene(two_link, [Gravity(), Cogging(0.2)])
    ends = State([0.0, 0.0]), State([0.5, 0.5])
    path = save_task(Task(scene, *ends, 1.0), tmp_path / "scene.toml")
    assert load_task(path).scene.effects == scene.effects
    motion = plan(scene, *ends, 1.0, intervals=4, limits="none").trajectory
    motion.save(tmp_path / "motion.npz")
    loaded = Trajectory.load(tmp_path / "motion.npz")
    assert loaded.scene is not None
    assert set(loaded.scene.effects) == set(scene.effects)
    np.testing.assert_allclose(loaded.sample(0.3).tau, motion.sample(0.3).tau, rtol=1e-12)


def test_an_unregistered_effect_cannot_be_stored(two_link: Robot) -> None:
    scene = Scene(two_link, [Cogging(0.2)])
    jet = points(two_link)[:3]
    added = scene.inverse_dynamics(*jet) - Scene(two_link).inverse_dynamics(*jet)
    np.testing.assert_allclose(added[:, 0], 0.2 * np.sin(12 * jet[0][:, 0]), atol=1e-13)
    with pytest.raises(SceneError, match="'cogging' is not registered, so it cannot be stored"):
        scene.to_dict()


def test_a_key_belongs_to_one_effect() -> None:
    @dataclasses.dataclass(frozen=True)
    class Weight(Gravity):
        pass

    with pytest.raises(SceneError, match="the key 'gravity' belongs to the effect Gravity"):
        register(Weight)

"""A scene simulates its effects only: RNEA with the scene's own gravity and armature."""

from __future__ import annotations

import dataclasses
import json
import pickle
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.effects import Effect, Gravity, JointLimitPotential, PowerCost, ViscousFriction
from hovi.errors import ModelError, SceneError
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.manifold_robots import chain, half_turning

Array = npt.NDArray[np.float64]

POTENTIAL = JointLimitPotential({"elbow": (0.0, 2.9)})


def random_points(model: pin.Model, points: int = 9) -> tuple[Array, Array, Array]:
    random = np.random.default_rng(model.nv)
    dq, v, a = random.normal(size=(3, points, model.nv))
    q = np.stack([pin.integrate(model, pin.neutral(model), x) for x in dq])
    return q, v, a


def rnea(robot: Robot, gravity: float, q: Array, v: Array, a: Array) -> Array:
    """Pinocchio's own inverse dynamics, without any armature."""
    model = robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    model.armature = np.zeros(model.nv)
    data = model.createData()
    return np.stack([pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)])


def with_armature(robot: Robot) -> Robot:
    model = robot.model.copy()
    model.armature = np.linspace(0.5, 2.0, model.nv)
    return load_robot(model)


# Torques


@pytest.mark.parametrize("name", ["two_link", "ur5", "panda"])
@pytest.mark.parametrize("gravity", [None, 9.8, 9.81, -1.62])  # the last one pulls upwards
@pytest.mark.parametrize("armature", [False, True])
def test_inverse_dynamics_is_rnea(
    request: pytest.FixtureRequest, name: str, gravity: float | None, armature: bool
) -> None:
    robot: Robot = request.getfixturevalue(name)
    robot = with_armature(robot) if armature else robot
    up = (0.0, 0.0, float(np.sign(-(gravity or 0.0))))
    effects = [] if gravity is None else [Gravity(abs(gravity), direction=up)]
    q, v, a = random_points(robot.model)
    tau = Scene(robot, effects).inverse_dynamics(q, v, a)
    expected = rnea(robot, gravity or 0.0, q, v, a)
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_gravity_is_9_81_by_default(two_link: Robot) -> None:
    jet = random_points(two_link.model)
    tau = Scene(two_link, [Gravity()]).inverse_dynamics(*jet)
    np.testing.assert_allclose(tau, rnea(two_link, 9.81, *jet), atol=1e-12)


@pytest.mark.parametrize(("name", "free_flyer"), [("finger_edu", True), ("kinova", False)])
def test_torques_on_manifolds_match_rnea(name: str, free_flyer: bool) -> None:
    robot = load_robot(name, free_flyer=free_flyer)
    assert robot.nq != robot.nv
    scene = Scene(robot, [Gravity()])
    jet = random_points(robot.model)
    expected = rnea(robot, 9.81, *jet)
    tau = scene.inverse_dynamics(*jet)
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_lists_are_accepted_as_points(two_link: Robot) -> None:
    scene = Scene(two_link)
    tau = scene.inverse_dynamics([[0, 1]], [[1, 2]], [[3, 4]], t=[0])
    jet = (np.array([row], dtype=float) for row in ([0, 1], [1, 2], [3, 4]))
    np.testing.assert_array_equal(tau, scene.inverse_dynamics(*jet))


def test_the_scene_has_its_own_model(two_link: Robot) -> None:
    robot = with_armature(two_link)
    robot.model.gravity.linear = np.array([1.0, 2.0, 3.0])
    scene = Scene(robot, [Gravity(5.0)])
    np.testing.assert_array_equal(scene.model.gravity.linear, [0.0, 0.0, -5.0])
    np.testing.assert_array_equal(scene.model.armature, 0.0)
    np.testing.assert_array_equal(robot.model.gravity.linear, [1.0, 2.0, 3.0])
    assert robot.model.armature.all()
    np.testing.assert_array_equal(Scene(robot).model.gravity.linear, 0.0)


# Lagrangians


def test_effort_weights_are_one_by_default(two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity()])
    jet = random_points(two_link.model)
    tau = scene.inverse_dynamics(*jet)
    plain, weighted = scene.effort_lagrangian(), scene.effort_lagrangian([1.0, 4.0])
    np.testing.assert_allclose(plain.value(*jet), 0.5 * (tau**2).sum(axis=1))
    np.testing.assert_allclose(weighted.value(*jet), 0.5 * tau**2 @ [1.0, 4.0])


@pytest.mark.parametrize(
    "weight", [[1.0], [1.0, 1.0, 1.0], [1.0, -2.0], [np.nan, 1.0], [1.0, np.inf], 2.0]
)
def test_an_invalid_weight_is_refused(two_link: Robot, weight: Any) -> None:
    with pytest.raises(SceneError, match="weight needs 2 numbers of 0 or more"):
        Scene(two_link).effort_lagrangian(weight)


def test_a_robot_that_does_not_support_planning_has_no_effort() -> None:
    robot = load_robot(half_turning())
    with pytest.raises(ModelError, match=r"'last' mimics.*lock one"):
        Scene(robot, [Gravity()]).effort_lagrangian()


# What a scene is


def test_duplicate_effects_are_refused(two_link: Robot) -> None:
    with pytest.raises(SceneError, match="the effect 'gravity' is named twice"):
        Scene(two_link, [Gravity(9.8), POTENTIAL, Gravity(9.81)])


def test_a_scene_is_immutable(two_link: Robot) -> None:
    effects: list[Effect] = [Gravity()]
    scene = Scene(two_link, effects)
    effects.append(POTENTIAL)
    assert scene.effects == (Gravity(),)
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.effects = ()  # type: ignore[misc]


def assert_same_scene(scene: Scene, copy: Scene) -> None:
    jet = random_points(scene.model)
    assert copy.effects == scene.effects
    assert copy.robot.name == scene.robot.name
    assert scene.inverse_dynamics(*jet).tobytes() == copy.inverse_dynamics(*jet).tobytes()
    pairs = zip(
        scene.effort_lagrangian().evaluate(*jet),
        copy.effort_lagrangian().evaluate(*jet),
        strict=True,
    )
    for one, other in pairs:
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("effects", [[], [Gravity(9.8)], [Gravity(), POTENTIAL]])
def test_a_scene_survives_json(two_link: Robot, effects: list[Effect]) -> None:
    scene = Scene(two_link, effects)
    text = json.dumps(scene.to_dict())
    copy = Scene.from_dict(json.loads(text))
    jet = random_points(scene.model)
    np.testing.assert_array_equal(scene.inverse_dynamics(*jet), copy.inverse_dynamics(*jet))
    np.testing.assert_array_equal(
        scene.effort_lagrangian().value(*jet), copy.effort_lagrangian().value(*jet)
    )
    assert json.dumps(copy.to_dict()) == text


def test_a_scene_survives_pickling(two_link: Robot, panda: Robot) -> None:
    for scene in (Scene(two_link, [Gravity(9.8), POTENTIAL]), Scene(panda, [Gravity()])):
        scene.inverse_dynamics(*random_points(scene.model))  # what is cached does not travel
        assert_same_scene(scene, pickle.loads(pickle.dumps(scene)))


def test_an_unknown_effect_of_a_stored_scene_is_refused(two_link: Robot) -> None:
    data = Scene(two_link).to_dict() | {"effects": {"gravitiy": {}}}
    with pytest.raises(SceneError, match="no effect 'gravitiy'; did you mean 'gravity'"):
        Scene.from_dict(data)


def test_the_description_lists_what_is_simulated_and_what_is_left_out(two_link: Robot) -> None:
    model = two_link.model.copy()
    model.damping, model.friction = np.array([0.0, 0.3]), np.array([0.1, 0.2])
    model.armature = np.array([0.5, 0.0])
    robot = load_robot(model)
    left_out = Scene(robot).describe().split("left out:")[1]
    for line in ("gravity", "damping of elbow", "friction of shoulder, elbow"):
        assert f"  {line}\n" in left_out
    assert "  armature of shoulder\n" in left_out
    text = Scene(robot, [Gravity(9.8), POTENTIAL]).describe()
    simulated, left_out = text.split("left out:")
    assert "gravity: 9.8 m/s^2 along -z" in simulated
    assert "elbow in [0, 2.9]" in simulated
    assert "gravity" not in left_out.split("derivatives:")[0]


def test_the_description_says_which_derivatives_are_used(two_link: Robot) -> None:
    assert "analytic (C++)" in Scene(two_link).describe()
    assert "analytic (C++)" in Scene(load_robot("kinova")).describe()
    text = Scene(load_robot(chain([pin.JointModelRX(), pin.JointModelSpherical()]))).describe()
    assert "CasADi's, since there are no analytic second derivatives for 'j1'" in text


def test_the_graph_of_a_scene_has_its_torques_and_its_cost(two_link: Robot) -> None:
    effects = [Gravity(9.8), ViscousFriction([0.4, 0.3]), PowerCost(0.5)]
    scene = Scene(two_link, effects)
    q, v, a = np.random.default_rng(5).normal(size=(3, 4, 2))
    found = [scene.graph()(*point, 0.0) for point in zip(q, v, a, strict=True)]
    tau = np.array([np.asarray(each[0]).ravel() for each in found])
    np.testing.assert_allclose(tau, scene.inverse_dynamics(q, v, a), rtol=1e-11)
    cost = [float(each[1]) for each in found]
    np.testing.assert_allclose(cost, scene.effort_lagrangian().value(q, v, a), rtol=1e-11)

"""Torques at the ends of a motion, against Pinocchio's gravity and a linear program."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.presolve.end_torques import held_still, unavoidable_torque
from hovi.planning.problem.presolve.findings import about_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.schemes import galerkin

REST = np.array([0.0, -1.57, 0.0, -1.57, 0.0, 0.0])


def problem(
    scene: hovi.Scene, start: Any, goal: Any, **kinds: Any
) -> tuple[TrajectoryProblem, Any]:
    limits = as_limits(scene.robot, {"base": "none", **kinds})
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(2.0, 2, galerkin(1)))
    return TrajectoryProblem(ld, start, goal, limits), limits


def static(scene: hovi.Scene, q: np.ndarray) -> np.ndarray:
    return pin.computeGeneralizedGravity(scene.model, scene.model.createData(), q)


@pytest.mark.parametrize("end", ["start", "goal"])
def test_the_joint_that_gravity_overloads_is_named_with_torque_and_limit(
    ur5: hovi.Robot, end: str
) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    q = {"start": REST, "goal": REST} | {end: np.zeros(6)}
    states = (hovi.State(q[each]) for each in ("start", "goal"))
    asked, limits = problem(scene, *states, tau=30.0)
    tau = static(scene, np.zeros(6))
    (clause,) = held_still(asked, limits)
    i = int(np.argmax(np.abs(tau)))
    assert f"at the {end} takes {tau[i]:.4g} N m" in clause
    assert f"{ur5.joint_names[i]!r}, whose limit is -30" in clause


def test_what_moves_or_is_free_or_passive_is_not_held_still(ur5: hovi.Robot) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    for state in (
        hovi.State(np.zeros(6), np.full(6, 0.1)),
        hovi.State(np.zeros(6), free=["elbow_joint"]),
    ):
        asked, limits = problem(scene, state, hovi.State(REST), tau=30.0)
        assert not list(held_still(asked, limits))
    overloaded = np.abs(static(scene, np.zeros(6))) > 30.0
    names = [name for name, over in zip(ur5.joint_names, overloaded, strict=True) if over]
    passive = hovi.Scene(ur5, [hovi.effects.Gravity()], passive=names)
    asked, limits = problem(passive, hovi.State(np.zeros(6)), hovi.State(REST), tau=30.0)
    assert not list(held_still(asked, limits))


def test_the_goal_of_a_frame_is_named_only_if_every_configuration_is_overloaded(
    ur5: hovi.Robot,
) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", np.full(6, 0.3)))
    q = hovi.inverse_kinematics(ur5, goal)
    least = np.abs([static(scene, each) for each in q]).max(axis=1).min()
    for share, count in ((0.99, 1), (1.01, 0)):
        asked, limits = problem(scene, hovi.State(REST), goal, tau=share * float(least))
        assert len(list(held_still(asked, limits))) == count


def has_acceleration(scene: hovi.Scene, q: np.ndarray, a: float, tau: float) -> bool:
    """Whether there is an acceleration within +-a whose torques are within +-tau."""
    M = pin.crba(scene.model, scene.model.createData(), q)
    M = np.triu(M) + np.triu(M, 1).T
    g = static(scene, q)
    A, b = np.vstack([M, -M]), np.concatenate([tau - g, tau + g])
    found = linprog(np.zeros(len(q)), A_ub=A, b_ub=b, bounds=[(-a, a)] * len(q))
    return bool(found.status == 0)


def test_what_some_acceleration_avoids_is_no_contradiction(ur5: hovi.Robot) -> None:
    random = np.random.default_rng(5)
    scene = hovi.Scene(ur5, [hovi.effects.Gravity(), hovi.effects.Payload("tool0", 3.0)])
    said = []
    for _ in range(30):
        q, a = random.uniform(-1.5, 1.5, 6), float(random.choice([0.1, 2.0, 10.0]))
        tau = float(random.uniform(5.0, 80.0))
        asked, limits = problem(scene, hovi.State(q), hovi.State(REST), a=a, tau=tau)
        sentence = unavoidable_torque(asked, limits)
        said.append(bool(sentence) and "at the start" in sentence)
        assert not (said[-1] and has_acceleration(scene, q, a, tau))
    assert 5 < sum(said) < 25


@pytest.mark.parametrize(("a", "tau"), [(1.0, 5.0), (1.0, 7.5), (3.0, 6.0), (0.2, 9.0)])
def test_for_one_joint_the_check_is_exact(a: float, tau: float) -> None:
    robot = hovi.load_robot(hovi.example("pendulum.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    for q in np.linspace(0.1, 3.0, 9):
        asked, limits = problem(scene, hovi.State([q]), hovi.State([0.0]), a=a, tau=tau)
        start = "at the start" in unavoidable_torque(asked, limits)
        assert start != has_acceleration(scene, np.array([q]), a, tau)


def test_without_limits_on_the_acceleration_nothing_is_refused(ur5: hovi.Robot) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    asked, limits = problem(scene, hovi.State(np.zeros(6)), hovi.State(REST), tau=0.1)
    assert unavoidable_torque(asked, limits) == ""


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_an_end_with_a_given_acceleration_has_the_torque_of_inverse_dynamics(
    ur5: hovi.Robot, share: float
) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity(), hovi.effects.JerkCost(0.1)])
    q, v, a = np.zeros(6), np.linspace(-0.4, 0.4, 6), np.linspace(0.5, -0.5, 6)
    tau = np.abs(pin.rnea(scene.model, scene.model.createData(), q, v, a)).max()
    limits = as_limits(ur5, {"base": "none", "tau": share * float(tau)}, 3)
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(2.0, 2, galerkin(1, 3)))
    asked = TrajectoryProblem(ld, hovi.State(REST), hovi.State(q, v, a=a), limits)
    assert ("at the goal is" in unavoidable_torque(asked, limits)) == (share < 1)


def test_an_end_that_cannot_be_held_is_no_fault_of_one_with_an_acceleration(
    ur5: hovi.Robot,
) -> None:
    """A smooth motion ends with the acceleration that is given, be it zero."""
    scene = hovi.Scene(ur5, [hovi.effects.Gravity(), hovi.effects.JerkCost(0.1)])
    q = np.array([0.0, -0.3, 0.3, -1.57, -1.57, 0.0])
    static = scene.inverse_dynamics(q[None], *np.zeros((2, 1, 6)), np.zeros(1))[0]
    mass = pin.crba(scene.model, scene.model.createData(), q)
    falling = np.linalg.solve(np.triu(mass) + np.triu(mass, 1).T, -0.2 * static)
    limits = as_limits(ur5, {"base": "none", "tau": np.maximum(0.9 * np.abs(static), 5.0)}, 3)
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(2.0, 2, galerkin(1, 3)))
    for a, expected in ((falling, 0), (np.zeros(6), 1)):
        start, goal = hovi.State(q, a=a), hovi.State(REST)
        asked = TrajectoryProblem(ld, start, goal, limits)
        found = about_limits(asked, start, goal)
        assert len(found.warnings) + bool(found.reason) == expected


@pytest.mark.parametrize(("smooth", "what"), [(False, "may not exist"), (True, "has to be zero")])
def test_a_frame_goal_that_cannot_be_held_is_told_with_what_smooth_asks(
    ur5: hovi.Robot, smooth: bool, what: str
) -> None:
    load = hovi.effects.Payload(frame="tool0", mass=14.0)
    scene = hovi.Scene(ur5, [hovi.effects.Gravity(), load])
    goal = hovi.FrameGoal("tool0", position=[0.85, 0.1, 0.1])
    given = {"smooth": smooth, "limits": "urdf", "time_limit": 0.5}
    with pytest.warns(hovi.errors.HoviWarning, match=what):
        hovi.plan(scene, REST, goal, 2.0, **given, self_collision=False)

"""Derivatives of conditions are those of finite differences, torques and groups included."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hovi
from hovi.conditions.condition import with_function
from hovi.conditions.function import Points
from hovi.planning.problem.limits import as_limits
from hovi.planning.solver.condition_outputs import ConditionOutputs
from hovi.schemes import galerkin

STEP = 1e-5


def scene_of(name: str) -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(name), [hovi.effects.Gravity()])


FUNCTIONS: dict[str, Any] = {
    "power": "tau * v",
    "torque": lambda tau: tau[0] ** 2 + tau[-1],
    "all": lambda q, v, a, tau, t: [
        t * v[0] * a[1] + q[0] ** 3,
        v[1] ** 2 + tau[0] * tau[1] + tau[1] * a[0] + q[0] * tau[1],
    ],
    "linear": lambda a: a[0] + 2 * a[1],
}
ROBOTS = "two_link", "panda", "kinova"


@pytest.fixture(params=ROBOTS)
def scene(request: pytest.FixtureRequest, two_link: hovi.Robot) -> hovi.Scene:
    if request.param == "two_link":
        return hovi.Scene(two_link, [hovi.effects.Gravity(), hovi.effects.ViscousFriction(0.3)])
    return scene_of(request.param)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_the_chain_rule_through_the_torques_is_exact(scene: hovi.Scene, function: str) -> None:
    robot = scene.robot
    given = hovi.Condition(FUNCTIONS[function], hovi.Between(-3.0, 5.0), name="c", scale=2.0)
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), hovi.Grid.uniform(1.0, 3, galerkin(1)))
    state = hovi.State(robot.neutral())
    problem = hovi.TrajectoryProblem(ld, state, state, conditions=[given])
    outputs = ConditionOutputs(problem)
    random, t = np.random.default_rng(3), np.concatenate(ld.point_times)
    P, n = len(t), robot.nv
    q0 = np.stack([robot.integrate(robot.neutral(), x) for x in random.uniform(-1, 1, (P, n))])
    x0 = random.uniform(-1, 1, (P, 3 * n))

    def at(x: np.ndarray) -> Points:
        q = np.stack([robot.integrate(a, b) for a, b in zip(q0, x[:, :n], strict=True)])
        v, a = x[:, n : 2 * n].copy(), x[:, 2 * n :].copy()
        return Points(q, v, t, a, ld.lagrangian.output(q, v, a, t=t))

    x0[:, :n] = 0.0
    force = random.standard_normal((P, outputs.size))
    J, curvature, torques = outputs.expand(at(x0), force)
    basis = np.eye(3 * n)

    def slope(x: np.ndarray) -> np.ndarray:
        """Of sum force y by central differences, (P, 3 n)."""
        columns = []
        for e in basis:
            above, below = (outputs.values(at(x + s * STEP * e)) for s in (1, -1))
            columns.append(np.vecdot(force, above - below) / (2 * STEP))
        return np.stack(columns, axis=1)

    numeric = slope(x0)
    size = max(1.0, np.abs(numeric).max())
    np.testing.assert_allclose(np.matmul(force[:, None], J)[:, 0], numeric, atol=1e-7 * size)
    second = curvature.copy()
    if torques is not None:
        q, v, a = at(x0).q, at(x0).v, at(x0).a
        zero, H = np.zeros(n), scene.torques.expand
        second += H(q, v, a, t, zero, torques)[2]
    np.testing.assert_allclose(second, second.transpose(0, 2, 1), atol=1e-12 * np.abs(second).max())
    wide = 1e-3
    for i in random.choice(3 * n, 4, replace=False):
        there, back = (slope(x0 + s * wide * basis[i]) for s in (1, -1))
        bend = (there - back) / (2 * wide)
        if robot.curved_space is None or i >= n:  # slopes elsewhere are those of another chart
            np.testing.assert_allclose(second[:, i], bend, atol=1e-4 * max(1, np.abs(bend).max()))


def test_a_limit_on_the_power_is_of_the_joints_that_it_names(ur5: hovi.Robot) -> None:
    limits = as_limits(ur5, {"power": {"elbow_joint": 3.0, "wrist_1_joint": [-1.0, 2.0]}})
    (power,) = limits.conditions
    assert power.of == ("elbow_joint", "wrist_1_joint")
    random = np.random.default_rng(1)
    q, v, tau = random.uniform(-1, 1, (3, 5, 6))
    at = Points(q, v, np.zeros(5), None, tau)
    np.testing.assert_allclose(power.y.values(at), (tau * v)[:, [2, 3]])
    lower, upper = power.on.at(np.zeros(1), 2)
    assert lower.tolist() == [[-3.0, -1.0]]
    assert upper.tolist() == [[3.0, 2.0]]
    tighter = as_limits(ur5, {"power": {"elbow_joint": 3.0}, "margin": 0.1, "tolerance": 1e-4})
    assert tighter.conditions[0].on.upper == pytest.approx([2.4])
    assert tighter.conditions[0].tolerance == 1e-4


def test_a_function_of_ones_own_takes_part(ur5: hovi.Robot) -> None:
    """Values, slopes and curvature in Python, without CasADi."""

    class Energy(hovi.Function):
        @property
        def needs(self) -> frozenset[str]:
            return frozenset({"v"})

        @property
        def size(self) -> int:
            return 1

        def values(self, at: hovi.Points) -> np.ndarray:
            return 0.5 * np.vecdot(at.v, at.v)[:, None]

        def slopes(self, at: hovi.Points) -> dict[str, np.ndarray]:
            return {"v": at.v[:, None]}

        def curvature(
            self, at: hovi.Points, weights: np.ndarray
        ) -> dict[tuple[str, str], np.ndarray]:
            return {("v", "v"): weights[:, :, None] * np.eye(at.v.shape[1])}

    start, goal = np.array([0, -1.5, 1.5, 0, 0, 0.0]), np.array([1.0, -1.0, 1.0, 0.5, 0.5, 0.5])
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    common: dict[str, Any] = {"limits": "none", "self_collision": False}
    free = hovi.plan(scene, start, goal, 1.5, **common)
    t = np.linspace(0, 1.5, 2001)
    most = 0.9 * float((0.5 * free.trajectory.sample(t).v ** 2).sum(axis=1).max())
    asked = hovi.Condition(Energy(), hovi.Between(upper=most), name="energy")
    found = hovi.plan(scene, start, goal, 1.5, conditions=[asked], **common)
    assert found.success, found.message
    assert (0.5 * found.trajectory.sample(t).v ** 2).sum(axis=1).max() <= most + 2e-6 * max(1, most)


def test_a_condition_gets_its_function_once_for_a_robot(ur5: hovi.Robot) -> None:
    given = hovi.Condition("tau * v", hovi.Between(-1, 1))
    assert with_function(given, ur5) is with_function(given, ur5)

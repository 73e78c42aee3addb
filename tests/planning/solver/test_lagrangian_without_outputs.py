"""The solver accepts any Lagrangian: here one without outputs, |a|^2 of a robot's joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from hovi import Solution, Status, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.joint_lagrangian import JointLagrangian

Array = npt.NDArray[np.float64]
START, GOAL, T = np.array([-1.0, 0.3]), np.array([0.8, -0.5]), 1.3


@dataclass(frozen=True, eq=False)
class LeastAcceleration(JointLagrangian):
    """L = 1/2 |a|^2 + 1/4 s sum a_i^4."""

    stiffening: float = 0.0

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        a = jet[2]
        return np.asarray(np.sum(a**2 / 2 + self.stiffening * a**4 / 4, axis=1))

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        a, n = jet[2], self.nv
        gradient, hessian = np.zeros((len(a), 3, n)), np.zeros((len(a), 3, n, 3, n))
        gradient[:, 2] = a + self.stiffening * a**3
        for i in range(n):
            hessian[:, 2, i, 2, i] = 1 + 3 * self.stiffening * a[:, i] ** 2
        return self.value(*jet), gradient, hessian


def solved(scene: Scene, limits: object = None, stiffening: float = 0.0) -> Solution:
    ld = DiscreteLagrangian(LeastAcceleration(scene, stiffening), Grid.uniform(T, 6, galerkin(2)))
    bounds = None if limits is None else as_limits(scene.robot, limits)
    return solve(TrajectoryProblem(ld, State(START), State(GOAL), bounds))


def test_least_acceleration_is_the_cubic(arm_scene: Scene) -> None:
    found = solved(arm_scene)
    assert found.success
    assert found.cost == pytest.approx(6 * np.sum((GOAL - START) ** 2) / T**3, rel=1e-13)
    s = found.trajectory.t[:, None] / T
    cubic = START + (3 * s**2 - 2 * s**3) * (GOAL - START)
    np.testing.assert_allclose(found.trajectory.q, cubic, rtol=0, atol=1e-13)


def test_a_stiffer_cost_takes_newton_steps_and_keeps_the_symmetry(arm_scene: Scene) -> None:
    found = solved(arm_scene, stiffening=0.3)
    assert found.success
    assert found.nit > 1
    middle = (START + GOAL) / 2
    np.testing.assert_allclose(found.trajectory.q[3], middle, rtol=0, atol=1e-12)


def test_velocities_are_limited_without_any_torque(arm_scene: Scene) -> None:
    free = solved(arm_scene)
    fastest = float(np.abs(free.trajectory.v).max())
    found = solved(arm_scene, {"base": "none", "v": 0.85 * fastest})
    assert found.status is Status.MINIMUM, found.message
    v = found.trajectory.sample(np.linspace(0.0, T, 10_000)).v
    assert np.abs(v).max() <= 0.85 * fastest * (1 + 1e-5)
    assert found.cost > free.cost


def test_limits_on_torques_need_torques(arm_scene: Scene) -> None:
    with pytest.raises(
        InputError, match="limits on tau need a Lagrangian whose outputs are torques"
    ):
        solved(arm_scene, {"base": "none", "tau": 5.0})


def test_passive_joints_need_torques(arm_scene: Scene) -> None:
    scene = Scene(arm_scene.robot, passive=[arm_scene.robot.coordinate_names[1]])
    with pytest.raises(InputError, match="passive joints need a Lagrangian of torques"):
        solved(scene)

"""Methods for programs: sequential quadratic programs next to the interior point, and bad ones.

What a method claims counts for nothing: a success is one by hovi's own judgement.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError
from hovi.methods import Ended, Method, Reason, SequentialQuadratic, Start

ARMS = "ur5", "z1"
SEEDS = range(5)
INTERVALS = 8
CRITERIA = hovi.methods.Criteria(decrease=1e-10, max_iterations=100)


@cache
def scene(arm: str) -> hovi.Scene:
    locked = ["jointGripper"] if arm == "z1" else []
    return hovi.Scene(hovi.load_robot(arm, locked=locked), [hovi.effects.Gravity()])


def reach(
    arm: str, seed: int, frame: bool = False, slowness: float = 1.6
) -> hovi.TrajectoryProblem:
    """A random reach whose torques and speeds are near their limits."""
    rng, robot = np.random.default_rng(seed), scene(arm).robot
    low, high = np.maximum(robot.lower, -1.5), np.minimum(robot.upper, 1.5)
    start, goal = rng.uniform(low, high, (2, robot.nv))
    duration = slowness * float(np.max(np.abs(goal - start) / robot.velocity_limit))
    grid = hovi.Grid.uniform(duration, INTERVALS, hovi.schemes.by_name("galerkin-2"))
    ld = hovi.DiscreteLagrangian(scene(arm).effort_lagrangian(), grid)
    end: Any = hovi.State(goal)
    if frame:
        place = robot.frame_pose("tool0", goal)[:3, 3]
        end = hovi.FrameGoal("tool0", position=place)
    limits = hovi.as_limits(robot, "urdf")
    return hovi.TrajectoryProblem(ld, hovi.State(start), end, limits=limits)


@cache
def by_interior_point(arm: str, seed: int, frame: bool = False) -> hovi.Solution:
    return hovi.solve(reach(arm, seed, frame))


def program_of(known: hovi.Solution) -> Any:
    """The last program of a solve, with rows that stay as they are."""
    assert known.solved_bounds is not None, known.message
    return known.solved_bounds.objective.with_fixed_rows()


def excess(problem: hovi.TrajectoryProblem, motion: hovi.Trajectory) -> float:
    """By how much the limits of q, v and tau are exceeded, of their ranges, by pin.rnea."""
    model, limits = problem.robot.model.copy(), problem.limits
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    x, data = motion.sample(np.linspace(0.0, motion.duration, 1001)), model.createData()
    tau = np.array([pin.rnea(model, data, *at) for at in zip(x.q, x.v, x.a, strict=True)])
    assert limits is not None
    worst = []
    for row, y in ((0, x.q), (1, x.v), (3, tau)):
        low, high = limits.lower[row], limits.upper[row]
        worst.append(np.max(np.maximum(y - high, low - y) / (high - low)))
    return float(max(worst))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("arm", ARMS)
def test_sequential_quadratic_ends_at_the_cost_of_the_interior_point(arm: str, seed: int) -> None:
    """On the same grid and rows, from a random motion around."""
    ends_at_its_cost(by_interior_point(arm, seed), seed)


def test_sequential_quadratic_ends_there_with_a_goal_of_a_frame() -> None:
    ends_at_its_cost(by_interior_point("ur5", 1, frame=True), 1)


def ends_at_its_cost(known: hovi.Solution, seed: int) -> None:
    program = program_of(known)
    path, none = known.trajectory.path, np.zeros(len(program.bounds.lower))
    model = program.quadratic(path, none).model
    moved = np.random.default_rng(seed).normal(size=model.gradient.shape)
    first = program.retract(path, 0.05 * moved, model)
    assert program.outputs(first).value > 1.01 * known.cost
    ended = SequentialQuadratic().minimize(program, Start(first), CRITERIA)
    assert ended.why is Reason.STATIONARY
    assert ended.value == pytest.approx(known.cost, rel=1e-6)
    assert program.bounds.excess(ended.outputs.y).max() < 1e-8


@pytest.mark.parametrize(("seed", "frame"), [(1, False), (4, False), (1, True)])
def test_solve_takes_the_method(seed: int, frame: bool) -> None:
    problem, known = reach("ur5", seed, frame), by_interior_point("ur5", seed, frame)
    found = hovi.solve(problem, known.trajectory, method=SequentialQuadratic())
    assert found.status == "minimum", found.message
    assert found.n_neg == 0
    assert found.cost == pytest.approx(known.cost, rel=1e-4)
    assert excess(problem, found.trajectory) < 1e-6


def test_a_problem_without_limits_is_solved_by_it() -> None:
    limited = reach("ur5", 1)
    problem = hovi.TrajectoryProblem(limited.ld, limited.start, limited.goal)
    known = hovi.solve(problem)
    found = hovi.solve(problem, known.trajectory, method=SequentialQuadratic())
    assert found.status == known.status
    assert found.n_neg == known.n_neg == 0
    assert found.cost == pytest.approx(known.cost, rel=1e-9)


@pytest.mark.parametrize("solver", ["highs", "proxqp"])
def test_other_solvers_of_quadratic_programs_end_there_too(solver: str) -> None:
    """Of a small robot: they take long for arms."""
    small = hovi.load_task(hovi.example("two_link_reach")).scene
    grid = hovi.Grid.uniform(2.0, 6, hovi.schemes.by_name("galerkin-2"))
    ld = hovi.DiscreteLagrangian(small.effort_lagrangian(), grid)
    ends = hovi.State([0.0, 0.0]), hovi.State([0.6, 1.2])
    limits = hovi.as_limits(small.robot, {"base": "none", "v": 1.0})
    problem = hovi.TrajectoryProblem(ld, *ends, limits=limits)
    found = [hovi.solve(problem, method=SequentialQuadratic(each)) for each in ("piqp", solver)]
    assert found[0].status == found[1].status
    assert found[0].cost == pytest.approx(found[1].cost, rel=1e-9)


def test_matrices_are_those_of_differences() -> None:
    known = by_interior_point("ur5", 1)
    program = program_of(known)
    path, solved = known.trajectory.path, known.solved_bounds
    assert solved is not None
    z = solved.barrier.multipliers
    here = program.quadratic(path, z)
    rng, h = np.random.default_rng(0), 1e-5
    s = rng.normal(size=here.gradient.shape)
    ends = [program.retract(path, sign * h * s, here.model) for sign in (1, -1)]
    plus, minus = (program.outputs(x) for x in ends)
    slopes = (plus.y - minus.y) / (2 * h)
    assert np.abs(here.slopes @ s - slopes).max() < 1e-6 * np.abs(slopes).max()
    assert here.gradient @ s == pytest.approx((plus.value - minus.value) / (2 * h), rel=1e-6)
    forces = program.bounds.weights * z
    gradients = [
        each.gradient + each.slopes.T @ forces for each in (program.quadratic(x, z) for x in ends)
    ]
    curvature = (gradients[0] - gradients[1]) / (2 * h)
    assert np.abs(here.hessian @ s - curvature).max() < 1e-5 * np.abs(curvature).max()


class Claims(Method):
    """A method that claims to have found a minimum wherever it is."""

    def minimize(self, program: Any, start: Any, criteria: Any, report: Any = None) -> Any:
        outputs = program.outputs(start.x)
        return Ended(start.x, outputs, np.zeros_like(outputs.y), Reason.STATIONARY)


class LeavesOut(SequentialQuadratic):
    """A method that leaves the bound out that holds its motion most."""

    def minimize(self, program: Any, start: Any, criteria: Any, report: Any = None) -> Any:
        ended = super().minimize(program, start, criteria, report)
        most, bounds = np.argmax(np.abs(ended.z)), program.bounds
        wider = bounds.lower.copy(), bounds.upper.copy()
        wider[0][most], wider[1][most] = -np.inf, np.inf
        program.bounds = dataclasses.replace(bounds, lower=wider[0], upper=wider[1])
        try:
            return super().minimize(program, Start(ended.x), criteria, report)
        finally:
            program.bounds = bounds


class StaysInside(SequentialQuadratic):
    """A method that keeps a distance from bounds."""

    def minimize(self, program: Any, start: Any, criteria: Any, report: Any = None) -> Any:
        bounds = program.bounds
        program.bounds = bounds.shrunk(1e-3)
        try:
            return super().minimize(program, start, criteria, report)
        finally:
            program.bounds = bounds


class Reversed(SequentialQuadratic):
    """A method whose forces pull towards bounds instead of holding them."""

    def minimize(self, program: Any, start: Any, criteria: Any, report: Any = None) -> Any:
        ended = super().minimize(program, start, criteria, report)
        return dataclasses.replace(ended, z=-ended.z)


@pytest.mark.parametrize(
    "method", [Claims(), LeavesOut(), StaysInside(), Reversed()], ids=lambda m: type(m)
)
def test_what_a_method_claims_is_no_success(method: Method) -> None:
    problem, known = reach("ur5", 1), by_interior_point("ur5", 1)
    program = program_of(known)
    claimed = method.minimize(program, Start(known.trajectory.path), CRITERIA)
    assert claimed.why is Reason.STATIONARY
    found = hovi.solve(problem, method=method, max_iterations=60)
    assert not found.success
    assert found.status != "minimum"


def test_a_claim_next_to_a_minimum_is_no_success() -> None:
    limited = reach("ur5", 1)
    problem = hovi.TrajectoryProblem(limited.ld, limited.start, limited.goal)
    known = hovi.solve(problem)
    q = known.trajectory.path.q.copy()
    q[4, 1] += 1e-3
    near = dataclasses.replace(known.trajectory.path, q=q)
    assert hovi.solve(problem, known.trajectory, method=Claims()).status == known.status
    found = hovi.solve(problem, problem.trajectory(near), method=Claims())
    assert found.status == "iteration_limit"
    assert not found.success


class ForgetsForces(Method):
    """A method that returns no forces."""

    def minimize(self, program: Any, start: Any, criteria: Any, report: Any = None) -> Any:
        return Ended(start.x, program.outputs(start.x), None)


def test_a_method_has_to_return_forces() -> None:
    with pytest.raises(InputError, match=r"ForgetsForces.minimize .* shape \(\d+,\)"):
        hovi.solve(reach("ur5", 1), method=ForgetsForces())


def test_time_and_steps_end_a_method() -> None:
    late = hovi.solve(reach("ur5", 1), method=SequentialQuadratic(), time_limit=1e-3)
    assert late.status == "time_limit"
    assert not late.success
    few = hovi.solve(reach("ur5", 1), method=SequentialQuadratic(), max_iterations=2)
    assert few.status == "iteration_limit"
    assert not few.success

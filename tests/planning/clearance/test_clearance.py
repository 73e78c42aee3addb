"""Motions that keep a margin to obstacles."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi import Status
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.clearance_violation import approach_along
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.obstacles import Box, Obstacle, Sphere
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid

Array = npt.NDArray[np.float64]
HANG, REACH = [-np.pi / 2, 0.0], [0.3, 0.7]
BALL = Sphere([0.7, 0.0, -1.65], 0.15, name="ball")
"""Blocks the arm's forearm between HANG and REACH."""


def problem(scene: hovi.Scene, *obstacles: Obstacle, intervals: int = 16) -> TrajectoryProblem:
    """The reach of the two-link arm in a second and a half, 0.05 m away from obstacles."""
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.5, intervals, galerkin(2)))
    clearance = Clearance(obstacles, 0.05)
    return TrajectoryProblem(ld, hovi.State(HANG), hovi.State(REACH), clearance=clearance)


def least_distance(
    trajectory: Trajectory, robot: hovi.Robot, clearance: Clearance, samples: int = 10_000
) -> float:
    q = trajectory.configurations(np.linspace(0.0, trajectory.duration, samples))
    return float(Distances(robot, clearance).values(q).min())


def test_a_ball_on_the_path_is_passed_at_the_margin(arm_scene: hovi.Scene) -> None:
    """At 10,000 samples; the bound is active, and the cost is higher than without the ball."""
    free = solve_on_grid(problem(arm_scene))
    kept = problem(arm_scene, BALL)
    assert kept.clearance is not None
    assert least_distance(free.trajectory, arm_scene.robot, kept.clearance) < -0.05
    solution = solve_on_grid(kept)
    assert solution.status is Status.MINIMUM, solution.message
    assert solution.n_neg == 0
    distance = least_distance(solution.trajectory, arm_scene.robot, kept.clearance)
    assert 0.05 <= distance <= 0.055
    assert solution.cost > free.cost
    assert solution.trajectory.metadata["clearance"] == kept.clearance.to_dict()


def test_a_distant_obstacle_changes_nothing(arm_scene: hovi.Scene) -> None:
    free = solve_on_grid(problem(arm_scene))
    far = solve_on_grid(problem(arm_scene, Sphere([-5.0, 3.0, 0.0], 0.3)))
    assert far.cost == pytest.approx(free.cost, rel=1e-9)
    np.testing.assert_allclose(far.trajectory.q, free.trajectory.q, atol=1e-6)


def test_approaches_are_those_of_dense_sampling(arm_scene: hovi.Scene) -> None:
    given = problem(arm_scene, BALL, intervals=6)
    assert given.distances is not None
    motion = solve_on_grid(problem(arm_scene, intervals=6)).trajectory
    found = approach_along(motion, given.distances, 0.05)
    dense = given.distances.values(motion.configurations(np.linspace(0.0, 1.5, 60_001)))
    near = dense.min(axis=0) < 0.05
    assert near.any()
    np.testing.assert_allclose(found.distance.min(axis=0)[near], dense.min(axis=0)[near], atol=1e-7)


@pytest.mark.parametrize(
    ("obstacle", "words"),
    [
        (Sphere([1.7, 0.0, 1.2], 0.4, name="ball"), ("goal", "'forearm'", "'ball'", "overlap by")),
        (Sphere([0.0, 0.0, -2.62], 0.05), ("start", "'tip'", "'sphere 1'", "0.01 m apart", "0.05")),
        (Box([0.4, 0.4, 0.4], [2.0, 0, 1.2], name="box"), ("goal", "'box'", "overlap by")),
    ],
)
def test_an_end_within_the_margin_is_infeasible_before_any_step(
    arm_scene: hovi.Scene, obstacle: Obstacle, words: tuple[str, ...]
) -> None:
    solution = hovi.plan(arm_scene, HANG, REACH, 1.5, obstacles=[obstacle], margin=0.05)
    assert solution.status is Status.INFEASIBLE
    assert not solution.success
    assert solution.nit == 0
    for word in words:
        assert word in solution.message


@pytest.mark.parametrize("limits", [None, {"base": "none", "v": 10.0}])
def test_a_ball_that_cannot_be_passed_is_infeasible_and_named(
    arm_scene: hovi.Scene, limits: Any
) -> None:
    """The upper arm cannot pass it in its plane, for any motion of the forearm."""
    barred = problem(arm_scene, Sphere([0.49, 0.0, -0.41], 0.2, name="ball"))
    if limits is not None:
        barred = dataclasses.replace(barred, limits=as_limits(arm_scene.robot, limits))
    solution = solve_on_grid(barred)
    assert solution.status is Status.INFEASIBLE
    for word in ("link '", "obstacle 'ball'", "overlap by", "at t ="):
        assert word in solution.message


def test_a_start_in_which_links_overlap_is_infeasible_and_names_them(ur5: hovi.Robot) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    folded, open_ = [0.0, -1.5, 2.9, 0.0, 0.0, 0.0], [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
    solution = hovi.plan(scene, folded, open_, 2.0, limits="none", self_collision=True)
    assert solution.status is Status.INFEASIBLE
    assert solution.nit == 0
    for word in ("at the start link", "'upper_arm_link'", "'wrist_2_link'", "overlap by"):
        assert word in solution.message


def test_the_shipped_scene_keeps_its_margin_at_ten_thousand_samples(ur5: hovi.Robot) -> None:
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    kept, ends = task.options.clearance, (task.start, task.goal, task.duration)
    free = hovi.plan(task.scene, *ends, limits=task.options.limits)
    assert least_distance(free.trajectory, ur5, kept) < -0.05
    solution = hovi.plan(
        task.scene, *ends, limits=task.options.limits, obstacles=kept.obstacles, margin=kept.margin
    )
    assert solution.success, solution.message
    assert solution.n_neg == 0
    assert least_distance(solution.trajectory, ur5, kept) >= kept.margin


@pytest.mark.parametrize(
    ("missing", "is_infeasible"), [(5e-10, False), (5e-9, False), (9e-6, False), (1.1e-5, True)]
)
def test_an_end_may_miss_the_margin_by_ten_micrometres(
    arm_scene: hovi.Scene, missing: float, is_infeasible: bool
) -> None:
    """The ball at the tip hangs 2.5 m below the base, straight above the obstacle."""
    height = 2.5 + 0.06 + 0.05 + 0.05 - missing
    given = problem(arm_scene, Sphere([0.0, 0.0, -height], 0.05))
    words = contradiction(given, as_limits(arm_scene.robot, "none"))
    assert bool(words) == is_infeasible

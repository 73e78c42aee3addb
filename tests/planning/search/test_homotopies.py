"""Homotopies: the changes of a job, against Pinocchio and the laws of mechanics."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from hovi import PlanOptions
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.planning.problem.limits import as_limits
from hovi.planning.search.homotopies import (
    HeavierRotors,
    WeakerGravity,
    finer_grids,
    growing_gravity,
    lighter_rotors,
    narrowing_limits,
    other_durations,
)
from hovi.planning.search.job import Job
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V

POINTS = np.random.default_rng(0).normal(size=(3, 5, 2))


@pytest.fixture(scope="module")
def job(arm_scene: Scene) -> Job:
    grid = Grid.uniform(1.0, 50, by_name("taylor-midpoint"))
    options = PlanOptions(max_iterations=200, limits="none")
    return Job(arm_scene, grid, State(HANG), State(REACH_Q, REACH_V), options)


@pytest.fixture(scope="module")
def limited(job: Job) -> Job:
    limits = as_limits(job.scene.robot, {"base": "none", "v": 5.0, "tau": 20.0})
    return job.with_options(limits=limits)


def test_heavier_rotors_add_the_same_inertia_to_every_joint(arm_scene: Scene) -> None:
    eased = Scene(arm_scene.robot, [*arm_scene.effects, HeavierRotors(0.7)])
    q, v, a = POINTS
    more = eased.inverse_dynamics(q, v, a) - arm_scene.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(more, 0.7 * a, rtol=0, atol=1e-13)


def test_weaker_gravity_is_a_share_of_gravity(two_link: Robot) -> None:
    eased = Scene(two_link, [Gravity(9.8), WeakerGravity(0.25)])
    model = two_link.model.copy()
    model.gravity.linear = np.array([0, 0, -9.8 / 4])
    expected = [pin.rnea(model, model.createData(), *point) for point in zip(*POINTS, strict=True)]
    np.testing.assert_allclose(eased.inverse_dynamics(*POINTS), expected, rtol=0, atol=1e-13)


def test_rotors_fall_from_more_than_every_link_to_less_than_any(job: Job, limited: Job) -> None:
    q = np.array(job.start.q)
    M = pin.crba(job.scene.model, job.scene.model.createData(), q)
    M = np.triu(M) + np.triu(M, 1).T
    rotors = [stage.job.scene.model.armature for stage in lighter_rotors(job)]
    assert np.ptp(rotors, axis=1).max() == 0
    sizes = np.array(rotors)[:, 0]
    assert sizes[0] == pytest.approx(10 * M.diagonal().max())
    assert 0.1 * np.linalg.eigvalsh(M)[0] < sizes[-1] <= np.linalg.eigvalsh(M)[0]
    np.testing.assert_allclose(sizes[:-1] / sizes[1:], 10.0)
    first = lighter_rotors(limited)[0].job.limits
    assert not first.bounded[3].any()
    np.testing.assert_array_equal(first.upper[:3], limited.limits.upper[:3])


def test_gravity_increases_from_zero_if_there_is_any(job: Job) -> None:
    pulls = [-stage.job.scene.model.gravity.linear[2] for stage in growing_gravity(job)]
    np.testing.assert_allclose(pulls, 9.8 * np.array([0, 0.25, 0.5, 0.75]))
    floating = dataclasses.replace(job, scene=Scene(job.scene.robot))
    assert growing_gravity(floating) == []


def test_intervals_are_doubled_up_to_those_of_the_job(job: Job) -> None:
    grids = [stage.job.grid for stage in finer_grids(job)]
    assert [grid.intervals for grid in grids] == [7, 13, 25]
    assert {scheme.name for grid in grids for scheme in grid.schemes} == {"galerkin-2"}
    assert all(grid.duration == pytest.approx(1.0) for grid in grids)
    few = dataclasses.replace(job, grid=Grid.uniform(1.0, 8, galerkin(2)))
    assert finer_grids(few) == []


def test_another_duration_without_gravity_is_the_same_motion(job: Job) -> None:
    # tau scales like 1/T^2, hence the cost like 1/T^3
    grid = Grid.uniform(1.0, 8, galerkin(2))
    floating = dataclasses.replace(job, scene=Scene(job.scene.robot), grid=grid)
    whole = solve_on_grid(floating.problem())
    for stage, share in zip(other_durations(floating), (0.125, 0.25, 0.5), strict=True):
        other = solve_on_grid(stage.job.problem(), whole.trajectory)
        assert other.cost == pytest.approx(whole.cost / share**3, rel=1e-9)
        np.testing.assert_allclose(other.trajectory.q, whole.trajectory.q, atol=1e-7)


def test_durations_are_shorter_without_limits_and_longer_with_them(job: Job, limited: Job) -> None:
    assert [stage.job.grid.duration for stage in other_durations(job)] == [0.125, 0.25, 0.5]
    longer = [stage.job.grid.duration for stage in other_durations(limited)]
    np.testing.assert_allclose(longer, [2, 1.5, 1.25, 1.1])


def test_limits_narrow_about_their_centers(job: Job, limited: Job) -> None:
    assert narrowing_limits(job) == []
    stages = narrowing_limits(limited)
    shares = np.array([8, 4, 2, 1.5, 1.25, 1.1])
    np.testing.assert_allclose([stage.job.limits.upper[1, 0] for stage in stages], 5 * shares)
    np.testing.assert_allclose([stage.job.limits.lower[3, 1] for stage in stages], -20 * shares)
    assert all(np.array_equal(r.job.limits.bounded, limited.limits.bounded) for r in stages)

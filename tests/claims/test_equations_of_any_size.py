"""Motions under equations: of torques of any size, without a solution, and unfinished ones."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi

DOWN, UP = [-np.pi / 2, 0.0], [np.pi / 2, 0.0]


def two_link(
    *passive: str, lighter: float = 1.0, effects: tuple[hovi.effects.Effect, ...] = ()
) -> hovi.Scene:
    """A pendulum of two links, the outer one with a fraction of its mass."""
    model = hovi.load_robot(hovi.example("two_link.urdf")).model.copy()
    outer = model.inertias[2]
    model.inertias[2] = pin.Inertia(lighter * outer.mass, outer.lever, lighter * outer.inertia)
    robot = hovi.load_robot(model)
    return hovi.Scene(robot, [hovi.effects.Gravity(), *effects], passive=passive)


def problem(
    scene: hovi.Scene, scheme: str, intervals: int, **given: object
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(3.0, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, hovi.State(DOWN), hovi.State(UP), **given)


@pytest.mark.parametrize("lighter", [1.0, 1e-3, 1e-6])
def test_a_light_passive_joint_passes_a_via_point(lighter: float) -> None:
    """Its torques are a millionth of those of the via point, in the same matrix."""
    via = (hovi.Via(1.5, hovi.State([0.0, 0.3])),)
    scene = two_link("elbow", lighter=lighter)
    found = hovi.solve(problem(scene, "galerkin-2", 24, via=via))
    assert found.status in ("minimum", "unresolved"), found.message
    assert (found.n_neg, found.violation) == (0, "")
    assert found.nit < 100
    middle = found.trajectory.sample([1.5]).q[0]
    assert np.allclose(middle, [0.0, 0.3], atol=1e-10)
    torques = np.abs(found.trajectory.sample_intervals(*_points(found)).tau)
    assert torques[:, 1].max() < 1e-9 * lighter * torques[:, 0].max()


def _points(found: hovi.Solution) -> tuple[np.ndarray, np.ndarray]:
    """Intervals and quadrature points of the scheme, at which passive torques vanish."""
    grid = found.trajectory.grid
    points = grid.schemes[0].points
    each = np.repeat(np.arange(grid.intervals), len(points))
    return each, np.tile(points, grid.intervals)


def test_dry_friction_at_a_passive_shoulder_is_solved() -> None:
    scene = two_link("shoulder", effects=(hovi.effects.DryFriction(0.05),))
    found = hovi.solve(problem(scene, "galerkin-2", 24))
    assert found.n_neg == 0
    assert found.status in ("minimum", "unresolved"), found.message
    assert found.violation == ""


@pytest.mark.parametrize("scheme", ["galerkin-1", "galerkin-2x8"])
def test_a_swing_up_in_one_interval_has_no_solution(scheme: str) -> None:
    """The torque of the passive shoulder has a minimum that is far from zero."""
    found = hovi.solve(problem(two_link("shoulder"), scheme, 1))
    assert found.status == "infeasible", found.message
    assert "no motion was found with zero torque at passive joint 'shoulder'" in found.message


@pytest.mark.parametrize("limit", [{"max_iterations": 5}, {"time_limit": 0.0}])
@pytest.mark.parametrize("passive", [(), ("wrist_3_joint",)])
def test_an_unfinished_solve_counts_no_curvature_and_gives_up_no_goal(
    passive: tuple[str, ...], limit: dict[str, float]
) -> None:
    """Ctrl-C or a limit says nothing about what can be reached."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()], passive=passive)
    grid = hovi.Grid.uniform(1.5, 8, hovi.schemes.by_name("galerkin-2"))
    goal = hovi.FrameGoal("tool0", position=[0.5, 0.4, 0.3])
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    reach = hovi.TrajectoryProblem(ld, hovi.State(np.zeros(6)), goal)
    found = hovi.solve(reach, **limit)
    assert found.status in ("iteration_limit", "time_limit")
    assert found.n_neg == -1
    assert "cannot be met" not in found.message
    assert "no motion was found" not in found.message
    assert ("So far, the " in found.message) == bool(found.violation)


@pytest.mark.parametrize("intervals", [1, 2, 8])
def test_a_frame_goal_with_a_passive_joint_is_no_saddle(intervals: int) -> None:
    """Goals in [m] and torques in [N m] are equations of one matrix."""
    robot = hovi.load_robot("ur5")
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, np.array([0.9, -0.6, 0.4, 0.2, 0.3, 0.0]))
    at = data.oMf[model.getFrameId("tool0")].translation
    scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=["wrist_2_joint"])
    grid = hovi.Grid.uniform(1.5, intervals, hovi.schemes.by_name("galerkin-0"))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    goal = hovi.FrameGoal("tool0", position=at)
    found = hovi.solve(hovi.TrajectoryProblem(ld, hovi.State(np.zeros(6)), goal))
    assert (found.n_neg, found.violation) == (0, ""), found.message

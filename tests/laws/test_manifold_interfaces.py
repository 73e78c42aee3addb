"""Robots on manifolds in all interfaces: limits, files, figures, named coordinates, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from typer.testing import CliRunner

from hovi import Solution, certify, plan, solve
from hovi.cli.application import application
from hovi.cli.reports.peaks import peaks
from hovi.conditions.function import linear
from hovi.conditions.state_difference import StateDifference
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import regularized, with_ends_of_nodes
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Armature, Gravity
from hovi.errors import ChartError, InputError, SceneError
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.space.unwrapped_angles import unwrapped
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from hovi.viewing.csv_table import write_csv
from hovi.viewing.plotting import motion_figure
from oracles.on_grid import solve_on_grid
from samples.manifold_robots import configurations, with_arm

Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def kinova() -> Robot:
    return load_robot("kinova")


@pytest.fixture(scope="module")
def free_motion() -> Solution:
    robot = load_robot(with_arm("free-flyer"))
    grid = Grid.uniform(1.0, 6, galerkin(2))
    ld = DiscreteLagrangian(Scene(robot).effort_lagrangian(), grid)
    q0, q1 = configurations(robot, 2, 3, 0.5)
    solution = solve_on_grid(TrajectoryProblem(ld, State(q0), State(q1)))
    assert solution.success
    return solution


# Limits


def test_limits_hold_for_continuous_joints(kinova: Robot) -> None:
    scene = Scene(kinova, [Gravity(), Armature(0.1)])
    q0 = kinova.integrate(kinova.neutral(), np.array([0.0, 2.5, 2.0, 0.0, 1.0, 0.0]))
    q1 = kinova.integrate(q0, np.array([1.5, 0.4, -0.5, 2.0, 0.5, -2.5]))
    solution = plan(scene, q0, q1, 5.0, intervals=14, self_collision=False)
    assert solution.success, solution.message
    limits = as_limits(kinova, "urdf")
    assert closeness(solution.trajectory, limits).min() >= -limits.tolerance
    free = plan(scene, q0, q1, 5.0, intervals=14, limits="none", self_collision=False)
    assert closeness(free.trajectory, limits).min() < -0.01
    assert solution.cost > free.cost


def test_position_limits_need_joints_with_positions(kinova: Robot) -> None:
    limits = as_limits(kinova, {"base": "none", "q": {"j2s6s200_joint_2": [1.0, 2.0]}})
    np.testing.assert_array_equal(limits.lower[0, 1], 1.0)
    with pytest.raises(InputError, match="'j2s6s200_joint_1' has no position limits"):
        as_limits(kinova, {"q": {"j2s6s200_joint_1": [1.0, 2.0]}})


# Files and pictures


def test_a_motion_survives_its_file(free_motion: Solution, tmp_path: Path) -> None:
    trajectory = free_motion.trajectory
    trajectory.save(tmp_path / "free.npz")
    loaded = Trajectory.load(tmp_path / "free.npz")
    t = np.linspace(0.0, 1.0, 7)
    for found, expected in zip(loaded.sample(t), trajectory.sample(t), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_angles_are_unwrapped_in_figures(kinova: Robot, free_motion: Solution) -> None:
    angle = np.linspace(0.0, 20.0, 200)
    q = kinova.integrate(kinova.neutral(), angle[:, None] * np.eye(6)[5])
    np.testing.assert_allclose(unwrapped(kinova.space, q)[:, 5], angle, atol=1e-12)
    robot = load_robot(with_arm("free-flyer"))
    turn = np.zeros((200, robot.nv))
    turn[:, 3:6] = angle[:, None] * np.array([0.6, 0.0, 0.8])
    shown = unwrapped(robot.space, robot.integrate(robot.neutral(), turn))
    np.testing.assert_allclose(shown[:, 3:6], turn[:, 3:6], atol=1e-9)


def test_figures_of_a_base_are_labeled(free_motion: Solution) -> None:
    trajectory = free_motion.trajectory
    figure = motion_figure(trajectory)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    base = [f"j0[{part}] (right)" for part in "xyz"] + [f"j0[r{part}]" for part in "xyz"]
    arm = zip(trajectory.coordinate_names[6:], texts[6:], strict=True)
    assert texts[:6] == base
    assert all(text in (name, f"{name} (right)") for name, text in arm)
    for ax in figure.axes[:3]:
        (twin,) = (a for a in figure.axes if a is not ax and a.bbox.bounds == ax.bbox.bounds)
        (low, high), (least, most) = ax.get_ylim(), twin.get_ylim()
        assert low / (high - low) == pytest.approx(least / (most - least), abs=1e-12)
    assert peaks(trajectory).shown[:4] == ("j0[x]", "j0[y]", "j0[z]", "j0[rx]")


def test_every_part_of_a_certificate_holds(free_motion: Solution) -> None:
    certificate = certify(free_motion, estimate=False)
    assert certificate.hamiltonian is not None
    assert certificate.hamiltonian.spread < 1e-4
    assert certificate.residual is not None
    assert certificate.residual < 1e-8
    assert certificate.replay is not None
    assert np.max(certificate.replay.q) < 1e-9


# Search and replanning


def test_replanning_follows_a_moving_goal(free_motion: Solution) -> None:
    problem = free_motion.problem
    assert problem is not None
    robot = problem.robot
    goal = robot.integrate(free_motion.trajectory.q[-1], 1e-3 * np.ones(robot.nv))
    again = free_motion.replan(goal=goal)
    assert again.success
    assert again.nit <= 3
    np.testing.assert_allclose(robot.difference(again.trajectory.q[-1], goal), 0.0, atol=1e-13)


def test_several_starts_try_different_turns(kinova: Robot) -> None:
    scene = Scene(kinova, [Gravity(), Armature(0.1)])
    q0 = kinova.integrate(kinova.neutral(), np.array([0.0, 2.5, 2.0, 0.0, 1.0, 0.0]))
    q1 = kinova.integrate(q0, np.array([0.5, 0.2, 0.1, 0.5, 0.2, 3.0]))
    solution = plan(
        scene, q0, q1, 2.0, intervals=6, limits="none", starts=6, processes=1, self_collision=False
    )
    assert solution.success
    assert len(solution.minima) > 1


def test_a_full_rotation_needs_enough_intervals_for_its_charts() -> None:
    robot = load_robot(with_arm("free-flyer"))
    q = robot.neutral()
    goal = State(q, turns={"j0": [0, 1, 0]})
    ld = DiscreteLagrangian(Scene(robot).effort_lagrangian(), Grid.uniform(2.0, 2, galerkin(2)))
    with pytest.raises(ChartError, match=r"rotates joint 'j0' by .* use \d+ or more intervals"):
        solve(TrajectoryProblem(ld, State(q), goal))
    solution = plan(
        Scene(robot),
        q,
        goal,
        2.0,
        intervals=4,
        limits="none",
        max_iterations=1,
        continuation=False,
        self_collision=False,
    )
    assert solution.trajectory.grid.intervals == 4
    shown = unwrapped(robot.space, solution.trajectory.configurations(np.linspace(0, 2, 200)))
    assert np.linalg.norm(shown[-1, 3:6]) == pytest.approx(2 * np.pi, abs=1e-6)


def test_an_orientation_is_continuous_beyond_half_a_turn() -> None:
    robot = load_robot(with_arm("spherical"))
    grid, axis = Grid.uniform(1.0, 1, galerkin(0)), np.array([0.6, 0.0, 0.8, 0, 0, 0])
    q0, v = robot.neutral(), np.zeros((2, robot.nv))
    turn = 3.0
    q = np.stack([q0, robot.integrate(q0, turn * axis)])
    path = DiscretePath(q, v, regularized(robot, grid, q, v), np.zeros((1, 0, robot.nv)))
    while turn < 4.0:
        turn += 0.25
        q = np.stack([q0, robot.integrate(q0, turn * axis)])
        path = with_ends_of_nodes(DiscretePath(q, v, path.z, path.inner), grid, robot)
        np.testing.assert_allclose(path.z[0, 0], turn * axis, atol=1e-12)
    ld = DiscreteLagrangian(Scene(robot).effort_lagrangian(), grid)
    assert ld.turns(path)[0] == pytest.approx(4.0, abs=1e-12)


def test_second_derivatives_of_a_joint_condition_match_finite_differences() -> None:
    robot = load_robot(with_arm("free-flyer"))
    q, target = configurations(robot, 2, 5)
    v, n = np.zeros(robot.nv), robot.nv
    error = StateDifference(robot, (target, v), np.ones((2, n), dtype=bool))
    _, J = linear(error, q, v)
    h = 1e-5
    for i, e in enumerate(np.eye(n)):
        there, back = (linear(error, robot.integrate(q, s * h * e), v)[0] for s in (1, -1))
        np.testing.assert_allclose(J[:, 0, i], (there - back) / (2 * h), atol=1e-8)


# Scene files and bad input


@pytest.mark.parametrize("name", ["kinova_reach", "flying_body_flip"])
def test_scenes_on_manifolds_are_planned(models: Path, name: str) -> None:
    result = CliRunner().invoke(
        application(["plan"]), ["plan", str(models / f"{name}.toml"), "--json"]
    )
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["status"] == "minimum"


KINOVA = """robot = "kinova"
duration = 2.0
[start]
q = [1, 0, 2.5, 2.0, 1, 0, 1.0, 1, 0]
[goal.q]
j2s6s200_joint_1 = 1.5
j2s6s200_joint_2 = 2.5
j2s6s200_joint_3 = 2.0
j2s6s200_joint_4 = [0.0, 1.0]
j2s6s200_joint_5 = 1.0
j2s6s200_joint_6 = 0.0
"""


def test_a_continuous_joint_takes_an_angle_or_two_numbers(tmp_path: Path) -> None:
    (tmp_path / "reach.toml").write_text(KINOVA)
    goal = load_task(tmp_path / "reach.toml").goal
    assert isinstance(goal, State)
    expected = [np.cos(1.5), np.sin(1.5), 2.5, 2.0, 0.0, 1.0, 1.0, 1.0, 0.0]
    np.testing.assert_allclose(np.asarray(goal.q), expected)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[1, 0, 2.5, 2.0, 1, 0, 1.0, 1, 0]", "[0, 2.5, 2.0, 0, 1.0]", "take 2: .cos, sin."),
        ("[1, 0, 2.5, 2.0, 1, 0, 1.0, 1, 0]", "[1, 0.1, 2.5, 2, 1, 0, 1, 1, 0]", "unit norm"),
        ("[0.0, 1.0]", "[0.0, 0.0]", "unit norm"),
        ("[0.0, 1.0]", "[0.0, 1.0, 0.0]", "must be 2 numbers"),
    ],
)
def test_an_invalid_configuration_is_refused_with_its_line(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    (tmp_path / "reach.toml").write_text(KINOVA.replace(old, new))
    with pytest.raises(SceneError, match=words):
        load_task(tmp_path / "reach.toml")


@pytest.mark.parametrize("factor", [0.0, 1.01, 1.0 + 3e-6, np.nan])
def test_a_quaternion_without_unit_norm_is_refused(factor: float) -> None:
    robot = load_robot(with_arm("free-flyer"))
    q = robot.neutral()
    q[3:7] = factor * np.array([0.5, 0.5, 0.5, 0.5])
    with pytest.raises(InputError, match=r"unit norm|finite"):
        State(q).on(robot, "goal")
    q[3:7] = (1 + 1e-7) * np.array([0.5, 0.5, 0.5, 0.5])
    assert np.linalg.norm(State(q).on(robot, "goal")[0][3:7]) == pytest.approx(1.0, abs=1e-15)


def test_a_wrong_length_lists_joints_with_several_coordinates() -> None:
    robot = load_robot(with_arm("free-flyer"))
    with pytest.raises(InputError, match="j0 takes 7: a position and a unit quaternion"):
        State(np.zeros(9)).on(robot, "goal")
    with pytest.raises(InputError, match="j0 takes 4: a unit quaternion"):
        State(np.zeros(6)).on(load_robot(with_arm("spherical")), "goal")
    assert pin.isNormalized(robot.model, robot.neutral())


def test_tables_and_reports_give_angles_of_continuous_joints(kinova: Robot, tmp_path: Path) -> None:
    start, goal = kinova.neutral(), kinova.neutral()
    goal[:2] = np.cos(1.2), np.sin(1.2)
    motion = plan(
        Scene(kinova, [Armature(0.1)]), start, goal, 2.0, intervals=8, self_collision=False
    ).trajectory
    found = peaks(motion)
    assert found.q_high[0] == pytest.approx(1.2, abs=1e-2)
    assert np.isfinite([found.q_low, found.q_high]).all()
    write_csv(motion, tmp_path / "motion.csv", rate=10)
    header = (tmp_path / "motion.csv").read_text().splitlines()[0].split(",")
    assert header[1:4] == [f"q_{kinova.joint_names[0]}[{part}]" for part in ("cos", "sin")] + [
        f"q_{kinova.joint_names[1]}"
    ]


def test_torques_of_a_passive_base_have_no_separate_scale(models: Path) -> None:
    axes = motion_figure(plan_task(load_task(models / "spacecraft_reorients.toml")).trajectory).axes
    torque, force = (
        next(ax for ax in axes if ax.get_ylabel() == label)
        for label in ("torque [N m]", "force [N]")
    )
    assert torque.get_ylim() == force.get_ylim()

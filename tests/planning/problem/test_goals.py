"""Motions to task-space goals, with free components, and through via points."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.schemes import galerkin

SCENES = (("ur5_reach", "tool0"), ("panda_reach", "panda_hand"))


def placement(robot: Robot, frame: str, q: np.ndarray) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.model.getFrameId(frame)].copy()


def at_goal(task: hovi.Task, frame: str) -> pin.SE3:
    """The pose of a frame at the task's own goal."""
    return placement(task.scene.robot, frame, np.array(task.goal.q))


@pytest.mark.parametrize(("scene", "frame"), SCENES)
@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_a_pose_goal_is_met_and_costs_no_more_than_its_joint_goal(
    scene: str, frame: str, limits: str
) -> None:
    task = hovi.load_task(hovi.example(scene))
    robot, wanted = task.scene.robot, at_goal(task, frame)
    goal = hovi.FrameGoal(frame, wanted)
    grid = {"intervals": 48} if limits == "none" else {}
    solution = hovi.plan(
        task.scene, task.start, goal, 2.5, limits=limits, **grid, self_collision=False
    )
    assert solution.n_neg == 0, solution.message
    end = solution.trajectory.q[-1]
    error = pin.log6(placement(robot, frame, end).actInv(wanted)).vector
    assert np.linalg.norm(error) < 1e-9
    np.testing.assert_array_equal(solution.trajectory.v[-1], 0.0)
    if limits == "none":
        guess = solution.trajectory
        same = hovi.plan(
            task.scene,
            task.start,
            end,
            2.5,
            limits=limits,
            guess=guess,
            **grid,
            self_collision=False,
        )
        assert solution.cost <= same.cost * (1 + 1e-9)


def test_a_position_goal_costs_less_than_the_pose_that_fixes_more() -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    wanted = at_goal(task, "tool0")
    pose = hovi.plan(
        task.scene, task.start, hovi.FrameGoal("tool0", wanted), 2.5, self_collision=False
    )
    position = hovi.plan(
        task.scene,
        task.start,
        hovi.FrameGoal("tool0", position=wanted.translation),
        2.5,
        self_collision=False,
    )
    axis = hovi.plan(
        task.scene,
        task.start,
        hovi.FrameGoal(
            "tool0", position=wanted.translation, axis=([0, 0, 1], wanted.rotation[:, 2])
        ),
        2.5,
        self_collision=False,
    )
    assert position.cost < axis.cost < pose.cost


def test_a_hand_that_a_frame_goal_does_not_mention_keeps_its_opening() -> None:
    """Joints that do not move the frame are at the goal where they are at the start."""
    robot = hovi.load_robot("panda")
    start = robot.pose("default")
    start[-2:] = 0.011, 0.023
    goal = hovi.FrameGoal("panda_hand", position=[0.4, 0.1, 0.5])
    ld = hovi.DiscreteLagrangian(
        hovi.Scene(robot).effort_lagrangian(), hovi.Grid.uniform(1.0, 4, galerkin(2))
    )
    problem = hovi.TrajectoryProblem(ld, hovi.State(start), goal)
    np.testing.assert_array_equal(problem.ends[0][1][-2:], start[-2:])
    np.testing.assert_array_equal(problem.free_ends[1, 0], [True] * 7 + [False] * 2)
    loose = hovi.State(start, free=["panda_finger_joint1"])
    problem = hovi.TrajectoryProblem(ld, loose, goal)
    np.testing.assert_array_equal(problem.free_ends[1, 0], [True] * 8 + [False])


def test_free_components_leave_no_momentum_at_the_end(arm_scene: hovi.Scene) -> None:
    """The natural boundary conditions: p = 0 where q is free, p~ = 0 where v is."""
    goal = hovi.State([0.3, 0.7], free=["elbow"], free_velocity=["shoulder"])
    solution = hovi.plan(arm_scene, [-1.5, 0.0], goal, 1.0, limits="none")
    assert solution.success, solution.message
    motion = solution.trajectory
    assert motion.q[-1, 0] == 0.3
    assert motion.q[-1, 1] != 0.7
    assert motion.v[-1, 1] == 0.0
    assert motion.v[-1, 0] != 0.0
    p, p_tilde = motion.momenta[-1]
    assert abs(p[1]) < 1e-8 * abs(p[0])
    assert abs(p_tilde[0]) < 1e-8 * abs(p_tilde[1])
    fixed = hovi.plan(arm_scene, [-1.5, 0.0], [0.3, 0.7], 1.0, limits="none")
    assert solution.cost < fixed.cost


def test_a_free_end_costs_what_the_best_of_many_fixed_ends_costs(arm_scene: hovi.Scene) -> None:
    free = hovi.plan(
        arm_scene, [-1.5, 0.0], hovi.State([0.3, 0.7], free=["elbow"]), 1.0, limits="none"
    )
    elbow = float(free.trajectory.q[-1, 1])

    def cost(x: float) -> float:
        return hovi.plan(
            arm_scene, [-1.5, 0.0], [0.3, x], 1.0, limits="none", guess=free.trajectory
        ).cost

    costs = [cost(elbow + d) for d in (-0.02, 0.0, 0.02)]
    assert costs[1] == pytest.approx(free.cost, rel=1e-10)
    assert min(costs) == costs[1]


def test_via_points_are_passed_in_joints_and_in_space() -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    robot = task.scene.robot
    above = at_goal(task, "tool0").translation + np.array([0.0, 0.0, 0.15])
    vias = [
        hovi.Via(1.7, hovi.FrameGoal("tool0", position=above)),
        hovi.Via(0.8, hovi.State([0.4, -1.4, 1.0, -0.5, 0.0, 0.0], free=["wrist_3_joint"])),
    ]
    rotors = hovi.Scene(robot, [hovi.effects.Gravity(), hovi.effects.Armature(0.1)])
    solution = hovi.plan(
        rotors, task.start, task.goal, 2.5, via=vias, limits="none", self_collision=False
    )
    assert solution.success, solution.message
    passed = solution.trajectory.sample([0.8, 1.7])
    np.testing.assert_allclose(passed.q[0, :5], [0.4, -1.4, 1.0, -0.5, 0.0], atol=1e-9)
    np.testing.assert_allclose(placement(robot, "tool0", passed.q[1]).translation, above, atol=1e-9)
    direct = hovi.plan(
        rotors,
        task.start,
        task.goal,
        2.5,
        limits="none",
        guess=solution.trajectory,
        self_collision=False,
    )
    assert direct.cost < solution.cost


def test_unreachable_goals_and_via_points_are_infeasible_with_the_reason() -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    far = hovi.FrameGoal("tool0", position=[2.0, 0.0, 0.5])
    for limits in ("none", "urdf"):
        solution = hovi.plan(task.scene, task.start, far, 2.0, limits=limits, self_collision=False)
        assert solution.status is hovi.Status.INFEASIBLE
        assert "that reaches the goal was found" in solution.message
        assert "frame 'tool0' misses it by" in solution.message
    via = hovi.Via(1.0, far)
    solution = hovi.plan(
        task.scene, task.start, task.goal, 2.0, via=[via], limits="none", self_collision=False
    )
    assert solution.status is hovi.Status.INFEASIBLE
    assert not solution.success
    assert "that reaches the via point at 1 s was found" in solution.message


def test_replanning_to_a_goal_turned_by_half_a_turn_turns_the_hand() -> None:
    """At half a turn the equations of the new goal hold at the old motion's end."""
    task = hovi.load_task(hovi.example("ur5_reach"))
    pose = at_goal(task, "tool0")
    goal = hovi.FrameGoal("tool0", pose)
    rotors = hovi.Scene(task.scene.robot, [hovi.effects.Gravity(), hovi.effects.Armature(0.1)])
    fine = {"scheme": "galerkin-2x8", "intervals": 48}
    first = hovi.plan(rotors, task.start, goal, 2.5, limits="none", self_collision=False, **fine)
    turned = pose.rotation @ np.diag([-1.0, -1.0, 1.0])
    again = first.replan(goal=hovi.FrameGoal("tool0", position=pose.translation, rotation=turned))
    assert again.success, again.message
    end = placement(task.scene.robot, "tool0", again.trajectory.q[-1])
    assert np.linalg.norm(pin.log3(end.rotation.T @ turned)) < 1e-9
    stuck = hovi.solve(again.problem, first.trajectory)
    assert stuck.status is hovi.Status.INFEASIBLE
    assert "half a turn away from its goal" in stuck.message


def test_two_via_points_may_share_a_time(arm_scene: hovi.Scene) -> None:
    vias = [
        hovi.Via(0.5, hovi.State([-0.5, 0.0], free=["elbow"])),
        hovi.Via(0.5, hovi.State([0.0, 0.4], free=["shoulder"])),
    ]
    solution = hovi.plan(arm_scene, [-1.5, 0.0], [0.3, 0.7], 1.0, via=vias, limits="none")
    assert solution.success, solution.message
    np.testing.assert_allclose(solution.trajectory.sample(0.5).q[0], [-0.5, 0.4], atol=1e-9)


def test_a_configuration_alone_is_a_via_point(arm_scene: hovi.Scene) -> None:
    for q in ([-0.5, 0.4], np.array([-0.5, 0.4])):
        via = hovi.Via(0.5, q)  # type: ignore[arg-type]
        assert isinstance(via.goal, hovi.State)
    solution = hovi.plan(arm_scene, [-1.5, 0.0], [0.3, 0.7], 1.0, via=[via], limits="none")
    np.testing.assert_allclose(solution.trajectory.sample(0.5).q[0], [-0.5, 0.4], atol=1e-9)
    assert np.abs(solution.trajectory.sample(0.5).v).max() > 0.1


def test_bad_goals_and_via_points_are_refused() -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    scene, start, goal = task.scene, task.start, task.goal
    with pytest.raises(InputError, match="no frame 'tool9'"):
        hovi.plan(
            scene, start, hovi.FrameGoal("tool9", position=[0, 0, 1]), 1.0, self_collision=False
        )
    with pytest.raises(InputError, match="did you mean 'elbow_joint'"):
        hovi.plan(
            scene, start, hovi.State(goal.q, free=["elbow_joints"]), 1.0, self_collision=False
        )
    with pytest.raises(InputError, match="is not inside the motion of 1 s"):
        hovi.plan(scene, start, goal, 1.0, via=[hovi.Via(1.5, goal)], self_collision=False)
    with pytest.raises(InputError, match="must be positive"):
        hovi.Via(-1.0, goal)
    with pytest.raises(InputError, match=r"must be a hovi.State.q. or a hovi.FrameGoal"):
        hovi.Via(1.0, 0.5)  # type: ignore[arg-type]


def test_goals_survive_scene_files(tmp_path, models) -> None:
    text = (models / "ur5_reach.toml").read_text()
    head, rest = text.split("[goal]")[0], text.split("[scheme]")[1]
    goal = """[goal]
frame = "tool0"
position = [0.4, 0.3, 0.4]
axis = {frame = [0, 0, 1], world = [0, 0, -1]}
free_velocity = ["wrist_3_joint"]

[[via]]
time = 0.7
q = [0.5, -1.0, 0.8, -0.2, 0.0, 0.5]
free = ["wrist_3_joint"]

[scheme]"""
    (tmp_path / "scene.toml").write_text(head + goal + rest)
    task = hovi.load_task(tmp_path / "scene.toml")
    from hovi.planning.task_file.writing import save_task

    again = hovi.load_task(save_task(task, tmp_path / "again.toml"))
    for each in (task, again):
        assert each.goal.frame == "tool0"
        np.testing.assert_allclose(each.goal.position, [0.4, 0.3, 0.4])
        assert each.goal.free_velocity == ("wrist_3_joint",)
        assert each.options.via[0].goal.free == ("wrist_3_joint",)
        assert each.options.via[0].time == 0.7


def test_a_bad_via_point_is_named_by_its_number_and_line(tmp_path, models) -> None:
    head = (models / "ur5_reach.toml").read_text()
    via = "\n[[via]]\ntime = 0.3\nq = [0, 0, 0, 0, 0, 0]\n\n[[via]]\ntime = 0.6\nq = {}\n"
    line = len((head + via).splitlines())
    for q, sentence in (
        ("[0, 0, 0]", "via[1].q has shape (3,)"),
        ('["x", 0, 0, 0, 0, 0]', "`via[1].q[0]` must be a finite number"),
        ('"home"', "home"),
        ("{elbow_joint = 1.0}", "`via[1].q` leaves out joint"),
    ):
        (tmp_path / "scene.toml").write_text(head + via.format(q))
        with pytest.raises(hovi.errors.SceneError) as refused:
            hovi.load_task(tmp_path / "scene.toml")
        assert f"line {line}: " in str(refused.value)
        assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("wrong", "place", "sentence"),
    [
        (
            "[[via]]\ntime = 5.0\nq = [0,0,0,0,0,0]",
            2,
            "a via point or condition at 5 s is not inside the motion",
        ),
        (
            "[[via]]\ntme = 0.5\nq = [0,0,0,0,0,0]",
            2,
            "unknown key `via[0].tme`; did you mean 'time'",
        ),
        (
            "[[via]]\ntime = 0.5\nframe = 'tool0'\naxis = {frame = [0, 0, 1], wrld = [0, 0, 1]}",
            4,
            "unknown key `via[0].axis.wrld`; did you mean 'world'?",
        ),
        (
            "[[via]]\ntime = 0.5\nq = [0,0,0,0,0,0]\nv = [0, 0, 0, 0, 0]",
            4,
            "via[0].v has shape (5,), expected (6,)",
        ),
    ],
)
def test_a_mistake_in_a_via_point_is_reported_with_its_line_and_a_hint(
    tmp_path, models, wrong: str, place: int, sentence: str
) -> None:
    head = (models / "ur5_reach.toml").read_text() + "\n"
    (tmp_path / "scene.toml").write_text(head + wrong)
    with pytest.raises(hovi.errors.SceneError) as refused:
        hovi.load_task(tmp_path / "scene.toml")
    assert f"line {len(head.splitlines()) + place}: {sentence}" in str(refused.value)


def test_via_points_stay_at_their_times_on_other_grids(arm_scene: hovi.Scene) -> None:
    grid = Grid.uniform(1.0, 4, galerkin(2))
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    vias = (hovi.Via(0.25, hovi.State([0.1, 0.2])), hovi.Via(0.75, hovi.State([0.3, 0.1])))
    problem = hovi.TrajectoryProblem(ld, hovi.State([0, 0]), hovi.State([0.5, 0.5]), via=vias)
    finer = grid.halved(np.array([True, False, True, True]))
    for other in (finer, grid.enriched(2), finer.halved(np.ones(7, dtype=bool))):
        times = [other.t[each.where.node] for each in problem.on(other).equations]
        assert times == pytest.approx([0.25, 0.75], abs=1e-14)


@pytest.mark.parametrize("far", [0, 1])
def test_one_unreachable_via_point_of_two_is_enough(far: int) -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    near = hovi.State(np.asarray(task.start.q) + 0.1)
    goals = [near, near]
    goals[far] = hovi.FrameGoal("tool0", position=[5.0, 0.0, 0.0])
    vias = [hovi.Via(t, goal) for t, goal in zip((0.5, 1.0), goals, strict=True)]
    solution = hovi.plan(
        task.scene, task.start, task.goal, 2.0, via=vias, limits="none", self_collision=False
    )
    assert solution.status is hovi.Status.INFEASIBLE
    assert solution.nit == 0
    assert f"the via point at {0.5 if far == 0 else 1:g} s" in solution.message


def test_a_via_point_at_a_frame_that_the_robot_does_not_have_is_refused() -> None:
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    via = [hovi.Via(0.8, hovi.FrameGoal("tol0", position=[0.5, 0.1, 0.5]))]
    with pytest.raises(InputError, match="has no frame 'tol0': did you mean 'tool0'"):
        hovi.plan(
            scene,
            [0.0, -1.4, 1.6, -0.2, 0.5, 0.0],
            [1.0, -1.0, 1.2, -0.2, 0.9, 0.3],
            1.5,
            via=via,
            self_collision=False,
        )

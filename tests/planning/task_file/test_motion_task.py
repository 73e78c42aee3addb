"""The scene file of a motion: hovi reads it, and plans the motion again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.planning.task_file.motion_task import task_of_motion
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.planning.task_file.writing import save_task, task_text
from hovi.robot.robot import Robot

PAYLOAD = hovi.effects.Payload("tip", 0.5)


def again(task: hovi.Task, folder: Path) -> hovi.Task:
    """The task as hovi reads it from its file."""
    return load_task(save_task(task, folder / "scene.toml"))


def test_a_motion_within_limits_is_planned_again_from_its_scene_file(
    two_link: Robot, tmp_path: Path
) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)])
    ball = hovi.Sphere([1.5, 0.0, -1.5], 0.1, name="ball")
    kept = {"limits": {"base": "none", "tau": 30.0}, "obstacles": [ball], "margin": 0.02}
    first = hovi.plan(scene, [0.0, 0.0], hovi.State([0.7, 0.9], [0.5, 0.0]), 0.6, **kept)
    problem = first.problem
    assert problem is not None
    task = again(task_of_motion(first.trajectory, problem.limits, (), problem.clearance), tmp_path)
    assert [each.name for each in task.options.obstacles] == ["ball"]
    second = plan_task(task)
    assert second.cost == pytest.approx(first.cost, rel=2e-3)
    np.testing.assert_allclose(second.trajectory.v[-1], [0.5, 0.0], atol=1e-9)
    assert second.problem is not None
    np.testing.assert_array_equal(second.problem.limits.upper, problem.limits.upper)
    assert second.problem.clearance.margin == 0.02


def test_a_sequence_has_the_effects_of_each_segment(two_link: Robot, tmp_path: Path) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)])
    segments = [
        hovi.Segment([0.7, 0.9], 0.6, name="reach", limits={"base": "none", "v": 100.0}),
        hovi.Segment([0.0, 0.0], 0.8, name="carry", effects=[PAYLOAD]),
    ]
    first = hovi.plan_sequence(scene, [0.0, 0.0], segments, limits="none")
    assert first.problem is not None
    parts = first.problem.limits.parts
    task = again(task_of_motion(first.trajectory, first.problem.limits, parts), tmp_path)
    assert [each.name for each in task.segments] == ["reach", "carry"]
    assert [[x.key for x in each.effects] for each in task.segments] == [[], ["payload"]]
    assert [each.key for each in task.scene.effects] == ["gravity"]
    assert plan_task(task).cost == pytest.approx(first.cost, rel=1e-6)


def test_limits_of_the_urdf_have_their_name(two_link: Robot, tmp_path: Path) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)])
    first = hovi.plan(scene, [0.0, 0.0], [0.7, 0.9], 0.6)
    assert first.problem is not None
    assert 'limits = "urdf"' in task_text(task_of_motion(first.trajectory, first.problem.limits))


def test_what_is_for_readers_elsewhere_has_no_path_of_this_machine(
    two_link: Robot, tmp_path: Path
) -> None:
    mesh = tmp_path / "rock.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)])
    rock = hovi.Mesh(mesh, [5.0, 0.0, 0.0])
    task = hovi.Task(scene, [0.0, 0.0], [0.7, 0.9], 0.6).with_options(obstacles=[rock])
    assert 'file = "rock.obj"' in task_text(task)
    assert str(tmp_path) not in task_text(task)
    assert 'file = "rock.obj"' in task_text(task, tmp_path)
    assert f'file = "{tmp_path.name}/rock.obj"' in task_text(task, tmp_path.parent)


AT = {"frame": "tip", "position": [1.2, 0.0, 1.0]}


@pytest.mark.parametrize("options", [{}, {"limits": {"base": "none", "tau": 40.0}}])
def test_the_goal_of_a_frame_stays_the_goal_of_a_frame(
    two_link: Robot, tmp_path: Path, options: dict[str, object]
) -> None:
    """Also of a motion that was saved; a replan to another goal knows its joints alone."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)])
    first = hovi.plan(scene, [0.0, 0.0], AT, 1.0, **options)
    first.save(tmp_path / "motion.npz")
    problem = first.problem
    assert problem is not None
    task = again(task_of_motion(hovi.Trajectory.load(tmp_path / "motion.npz"), None), tmp_path)
    assert isinstance(task.goal, hovi.FrameGoal)
    assert (task.goal.frame, list(np.asarray(task.goal.position))) == ("tip", AT["position"])
    limits = {"limits": problem.limits} if options else {}
    assert plan_task(task, **limits).cost == pytest.approx(first.cost, rel=2e-3)
    moved = first.replan(goal=[0.4, 0.9])
    assert isinstance(task_of_motion(moved.trajectory, None).goal, hovi.State)

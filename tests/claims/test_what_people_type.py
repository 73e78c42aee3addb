"""What people type first is taken as it is meant, or answered by what there is instead."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.errors import InputError

HOME, AWAY = [0.0, -1.4, 1.6, -0.2, 0.5, 0.0], [1.0, -1.0, 1.2, -0.2, 0.9, 0.3]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


@pytest.fixture(scope="module")
def solution(scene: hovi.Scene) -> hovi.Solution:
    return hovi.plan(scene, HOME, AWAY, 2.0)


def test_a_solution_stands_for_its_trajectory(solution: hovi.Solution, tmp_path: Path) -> None:
    for name, given in (("a", solution), ("b", solution.trajectory)):
        hovi.replay(given, html=tmp_path / f"{name}.html", compare=given)
        hovi.export(given, tmp_path / f"{name}.csv")
        hovi.write_report(given, tmp_path / f"{name}_report.html")
    for kind in ("{}.html", "{}.csv", "{}_report.html"):
        one, other = ((tmp_path / kind.format(name)).read_bytes() for name in "ab")
        assert one == other
    with pytest.raises(InputError, match="expected a Trajectory"):
        hovi.replay(3)  # type: ignore[arg-type]
    for name in ("motion.npz", tmp_path / "motion.npz"):
        with pytest.raises(InputError, match=r"read the file by hovi\.Trajectory\.load"):
            hovi.replay(name)  # type: ignore[arg-type]


def test_a_pose_is_taken_with_its_frame_and_answered_without(
    scene: hovi.Scene, solution: hovi.Solution
) -> None:
    pose = scene.robot.frame_pose("tool0", np.array(AWAY))
    found = hovi.plan(scene, HOME, hovi.FrameGoal("tool0", pose), 2.0)
    assert found.success, found.message
    reached = scene.robot.frame_pose("tool0", found.trajectory.q[-1])
    np.testing.assert_allclose(reached, pose, atol=1e-5)
    tasks = [
        lambda given: hovi.plan(scene, HOME, given, 2.0),
        lambda given: hovi.plan(scene, given, HOME, 2.0),
        lambda given: hovi.plan_sequence(scene, HOME, [hovi.Segment(given, 2.0)]),
        lambda given: solution.replan(goal=given),
        lambda given: solution.advance(0.5, goal=given),
    ]
    for given, what in ((pose, "pose"), (pose.tolist(), "pose"), (pose[:3, :3], "rotation")):
        for task in tasks:
            with pytest.raises(InputError, match=f"a {what} of no frame: give .*'tool0', {what}="):
                task(given)


def test_a_rotation_of_three_digits_is_the_nearest_one(scene: hovi.Scene) -> None:
    pose = scene.robot.frame_pose("tool0", np.array(AWAY))
    found = hovi.plan(scene, HOME, hovi.FrameGoal("tool0", np.round(pose, 3)), 2.0)
    assert found.success, found.message
    reached = scene.robot.frame_pose("tool0", found.trajectory.q[-1])
    assert np.abs(reached - pose).max() < 2e-3
    left, _, right = np.linalg.svd(np.round(pose[:3, :3], 3))
    assert np.abs(reached[:3, :3] - left @ right).max() < 1e-5
    wrong = pose.copy()
    wrong[:3, :3] = np.round(pose[:3, :3], 1)
    with pytest.raises(InputError, match=r"to three digits, and is off by 0\.\d+"):
        hovi.FrameGoal("tool0", wrong)


@pytest.mark.parametrize(
    ("option", "instead"),
    [
        ("constraints", r"conditions=\[hovi.Condition\("),
        ("contacts", "not planned for: see docs/when_not.md"),
        ("velocity_scaling", "limits="),
        ("acceleration_scaling", "limits="),
    ],
)
def test_options_of_other_planners_are_answered(
    scene: hovi.Scene, solution: hovi.Solution, option: str, instead: str
) -> None:
    with pytest.raises(InputError, match=f"there is no option {option!r}: .*{instead}"):
        hovi.plan(scene, HOME, AWAY, 2.0, **{option: "50 %"})
    for again in (solution.replan, functools.partial(solution.advance, 0.5)):
        with pytest.raises(InputError, match=f"has no option {option!r}: .*{instead}"):
            again(**{option: "50 %"})

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


@pytest.mark.parametrize(
    ("power", "said"),
    [
        ("28 W", r"is '28 W': give a number such as 28, or a pair"),
        ("watts", r"is 'watts': give a number such as 1, or a pair"),
        ("50 %", r"no limit on the power of which that is a fraction: give a number, or a pair"),
    ],
)
def test_a_power_in_words_is_answered_by_the_number(
    scene: hovi.Scene, power: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        hovi.plan(scene, HOME, AWAY, 2.0, limits={"power": power})


def test_conditions_in_a_scene_file_are_answered_by_how_they_are_given(tmp_path: Path) -> None:
    file = tmp_path / "task.toml"
    file.write_text(
        f'robot = "ur5"\nstart = {HOME}\ngoal = {AWAY}\nduration = 2.0\n'
        '[[conditions]]\nfunction = "tau * v"\nlower = -80\n'
    )
    with pytest.raises(hovi.HoviError, match=r"there is no key `conditions`: .*hovi\.plan_task\("):
        hovi.load_task(file)
    file.write_text(file.read_text().partition("[[")[0])
    given = [hovi.Condition("tau * v", hovi.Between(-80, 80), name="power")]  # as the answer says
    found = hovi.plan_task(hovi.load_task(file), conditions=given)
    assert found.success
    assert "power" in found.margins().conditions


@pytest.mark.parametrize(
    "function",
    [
        np.sin,
        lambda q: np.dot(q, np.ones(6)),
        lambda q: np.asarray(q).sum(),
        lambda q: q[0] if q[0] > 0 else 0 * q[0],
        lambda joints: joints,
        lambda q: None,
    ],
)
@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_a_function_of_arrays_is_answered_by_what_a_condition_takes(
    scene: hovi.Scene, function: object
) -> None:
    given = hovi.Condition(function, hovi.Between(-9, 9))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"give a formula, .*, for NumPy, a hovi\.Function"):
        hovi.plan(scene, HOME, AWAY, 2.0, conditions=[given])


def test_a_solution_is_saved_as_its_motion(solution: hovi.Solution, tmp_path: Path) -> None:
    solution.save(tmp_path / "a.npz")
    solution.trajectory.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert np.array_equal(hovi.Trajectory.load(tmp_path / "a.npz").q, solution.trajectory.q)


@pytest.mark.parametrize(
    ("name", "instead"),
    [
        ("load", r"hovi\.Trajectory\.load"),
        ("save", r"solution\.save"),
        ("replan", r"solution\.replan"),
        ("advance", r"solution\.advance"),
    ],
)
def test_functions_that_are_methods_are_answered(name: str, instead: str) -> None:
    with pytest.raises(AttributeError, match=f"hovi has no {name!r}: use .*{instead}"):
        getattr(hovi, name)


def test_what_a_plan_leaves_out_of_its_guess_is_said(scene: hovi.Scene, tmp_path: Path) -> None:
    asked = [hovi.Condition("q", hovi.Between(-9, 9), name="inside")]
    limits = {"power": 500.0}
    hovi.plan(scene, HOME, AWAY, 2.0, conditions=asked, limits=limits).save(tmp_path / "a.npz")
    guess = hovi.Trajectory.load(tmp_path / "a.npz")
    said = "The guess was planned with 'inside', 'power', which this plan leaves out"
    without = hovi.plan(guess.scene, HOME, AWAY, 2.5, guess=guess)
    assert said in without.message
    assert any(said in each for each in without.trajectory.cautions)
    again = hovi.plan(scene, HOME, AWAY, 2.5, guess=guess, conditions=asked, limits=limits)
    assert "The guess was planned with" not in again.message

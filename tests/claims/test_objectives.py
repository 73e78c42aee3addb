"""Objectives: "acceleration" and "jerk" need no torques, "time" is the least time, in every use.

Oracles: 6 d^2 / T^3 and 360 d^2 / T^5 per joint, and trapezoids of velocity.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.cli.application import main

LINKS = "".join(
    f'<link name="{name}"><collision><origin xyz="0.25 0 0"/><geometry><box size="0.3 0.05 0.05"/>'
    "</geometry></collision></link>"
    for name in ("upper", "lower")
)
JOINTS = "".join(
    f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
    f'<origin xyz="{x} 0 0"/><axis xyz="0 0 1"/>'
    '<limit lower="-2.5" upper="2.5" velocity="2" effort="30"/></joint>'
    for name, parent, child, x in (("a", "base", "upper", 0), ("b", "upper", "lower", 0.5))
)
TIP = (
    '<link name="tool"/><joint name="flange" type="fixed"><parent link="lower"/>'
    '<child link="tool"/><origin xyz="0.5 0 0"/></joint>'
)
BARE = f'<robot name="bare"><link name="base"/>{LINKS}{JOINTS}{TIP}</robot>'
START, GOAL, T = np.array([0.0, 0.1]), np.array([1.0, 0.5]), 2.0
D = GOAL - START
LIMITS = {"v": 0.7, "a": 2.0}
LEAST = D.max() / 0.7 + 0.7 / 2.0
"""The least time within the limits, of the joint that moves farthest, in [s]."""
CLOSED = {
    "acceleration": float((6 * D**2 / T**3).sum()),
    "jerk": float((360 * D**2 / T**5).sum()),
}


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, hovi.Robot]:
    file = tmp_path_factory.mktemp("robot") / "bare.urdf"
    file.write_text(BARE)
    return {
        "without inertia": hovi.load_robot(file),
        "with inertia": hovi.load_robot(hovi.example("two_link.urdf")),
    }


def planned(robot: hovi.Robot, objective: str, **options: Any) -> hovi.Solution:
    duration: Any = (0.5, 8.0) if objective == "time" else T
    given: dict[str, Any] = {"duration": duration, "limits": "none", "goal": GOAL} | options
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    goal, duration = given.pop("goal"), given.pop("duration")
    return hovi.plan(scene, START, goal, duration, objective=objective, **given)


def assert_within(motion: hovi.Trajectory, v: float, a: float) -> None:
    at = motion.sample(np.linspace(0.0, motion.duration, 20001))
    assert np.abs(at.v).max() <= v * (1 + 1e-5)
    assert np.abs(at.a).max() <= a * (1 + 1e-5)


ROBOTS = "without inertia", "with inertia"


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("objective", CLOSED)
class TestWithoutTorques:
    def test_cost_is_the_closed_form(
        self, robots: Mapping[str, hovi.Robot], name: str, objective: str
    ) -> None:
        found = planned(robots[name], objective)
        assert found.success
        assert found.usable
        assert found.cost == pytest.approx(CLOSED[objective], rel=1e-9)

    def test_limits_hold_in_plan_replan_and_advance(
        self, robots: Mapping[str, hovi.Robot], name: str, objective: str
    ) -> None:
        found = planned(robots[name], objective, limits=LIMITS)
        for each in (found, found.replan(goal=GOAL - 0.05), found.advance(0.2)):
            assert each.success, each.message
            assert each.usable
            assert_within(each.trajectory, 0.7, 2.0)
        assert found.cost > CLOSED[objective]

    def test_the_best_duration_is_that_of_the_closed_form(
        self, robots: Mapping[str, hovi.Robot], name: str, objective: str
    ) -> None:
        found = planned(robots[name], objective, duration=(0.5, 8.0), time_weight=1.0)
        p = {"acceleration": 3, "jerk": 5}[objective]
        best = (p * CLOSED[objective] * T**p) ** (1 / (p + 1))
        assert found.success
        assert found.trajectory.duration == pytest.approx(best, rel=1e-4)

    def test_a_sequence_costs_the_sum_of_stops(
        self, robots: Mapping[str, hovi.Robot], name: str, objective: str
    ) -> None:
        if objective == "jerk":
            pytest.skip("accelerations are free where segments meet")
        scene = hovi.Scene(robots[name], [hovi.effects.Gravity()])
        parts = [hovi.Segment(GOAL, T), hovi.Segment(START, T)]
        found = hovi.plan_sequence(scene, START, parts, objective=objective, limits="none")
        assert found.success
        assert found.cost == pytest.approx(2 * CLOSED[objective], rel=1e-9)

    def test_obstacles_and_frames(
        self, robots: Mapping[str, hovi.Robot], name: str, objective: str
    ) -> None:
        if name == "with inertia":
            pytest.skip("the other robot has a frame in the plane of the obstacle")
        ball = hovi.Sphere([0.74, 0.54, 0.0], 0.05)
        found = planned(robots[name], objective, obstacles=[ball], limits="urdf")
        assert found.success
        assert found.cost > CLOSED[objective] * 1.01
        target = hovi.FrameGoal("tool", position=[0.3, 0.6, 0.0])
        met = planned(robots[name], objective, goal=target, limits="urdf")
        assert met.success
        assert met.usable

    def test_a_saved_motion_is_the_same(
        self, robots: Mapping[str, hovi.Robot], name: str, objective: str, tmp_path: Path
    ) -> None:
        found = planned(robots[name], objective, limits=LIMITS)
        found.trajectory.save(tmp_path / "motion.npz")
        again = hovi.Trajectory.load(tmp_path / "motion.npz")
        assert again.scene is not None
        keys = {each.key for each in again.scene.effects}
        assert keys == {"gravity", "effort_weight", f"{objective}_cost"}
        t = np.linspace(0.0, T, 50)
        np.testing.assert_array_equal(again.sample(t).q, found.trajectory.sample(t).q)
        hovi.write_report(again, tmp_path / "report.html")
        hovi.export(again, tmp_path / "motion.csv", format="csv")
        assert {"report.html", "motion.csv"} <= {each.name for each in tmp_path.iterdir()}


@pytest.mark.parametrize("name", ROBOTS)
def test_time_is_that_of_a_trapezoid(robots: Mapping[str, hovi.Robot], name: str) -> None:
    limits = LIMITS | {"base": "none"}
    found = planned(robots[name], "time", limits=limits)
    assert found.success, found.message
    assert found.usable
    assert LEAST * (1 - 1e-5) <= found.trajectory.duration <= LEAST * (1 + 2e-3)
    assert_within(found.trajectory, 0.7, 2.0)
    assert "halving it changed the duration by" in found.message
    assert found.replan(goal=GOAL - 0.01).success


def test_time_needs_a_free_duration_and_no_weight(robots: Mapping[str, hovi.Robot]) -> None:
    with pytest.raises(hovi.HoviError, match="needs a free duration"):
        planned(robots["with inertia"], "time", duration=2.0)
    with pytest.raises(hovi.HoviError, match="chooses time_weight"):
        planned(robots["with inertia"], "time", time_weight=1.0)


def test_limits_on_torques_hold_where_there_is_inertia(robots: Mapping[str, hovi.Robot]) -> None:
    robot = robots["with inertia"]
    free = planned(robot, "acceleration", limits="none")
    peak = float(np.abs(free.trajectory.sample(np.linspace(0, T, 2001)).tau).max())
    bound = 0.95 * peak
    found = planned(robot, "acceleration", limits={"base": "none", "tau": bound})
    assert found.success, found.message
    at = found.trajectory.sample(np.linspace(0.0, T, 20001))
    assert np.abs(at.tau).max() <= bound * (1 + 1e-5)


def test_they_are_left_out_and_said_where_there_is_none(robots: Mapping[str, hovi.Robot]) -> None:
    found = planned(robots["without inertia"], "acceleration", limits="urdf")
    assert "Torques, and limits on them, are left out" in found.message
    assert any("left out" in each for each in found.trajectory.cautions)


@pytest.mark.parametrize("smooth", [False, True])
def test_torques_of_a_robot_without_inertia_are_refused(
    robots: Mapping[str, hovi.Robot], smooth: bool
) -> None:
    scene = hovi.Scene(robots["without inertia"])
    with pytest.raises(hovi.HoviError, match=r"armature.*objective = .acceleration") as refused:
        hovi.plan(scene, START, GOAL, T, smooth=smooth)
    assert "density" in str(refused.value)
    rotors = hovi.Scene(robots["without inertia"], [hovi.effects.Armature(0.1)])
    assert hovi.plan(rotors, START, GOAL, T, smooth=smooth, limits="none").success


def test_smooth_accelerations_begin_with_none(robots: Mapping[str, hovi.Robot]) -> None:
    found = planned(robots["without inertia"], "acceleration", smooth=True)
    assert found.success
    assert np.abs(found.trajectory.sample(np.array([0.0, T])).a).max() < 1e-9
    assert CLOSED["acceleration"] < found.cost < 1.3 * CLOSED["acceleration"]


def test_weights_of_torques_contradict(robots: Mapping[str, hovi.Robot]) -> None:
    robot = robots["with inertia"]
    with pytest.raises(hovi.HoviError, match="leave one of the two out"):
        planned(robot, "jerk", weight=[1.0, 1.0])
    scene = hovi.Scene(robot, [hovi.effects.EffortWeight(2.0)])
    with pytest.raises(hovi.HoviError, match="leave one of the two out"):
        hovi.plan(scene, START, GOAL, T, objective="acceleration")
    with pytest.raises(hovi.HoviError, match="did you mean 'jerk'"):
        planned(robot, "jerks")


SCENE = """format = 2
robot = "bare.urdf"
duration = 2.0
objective = "acceleration"
[start]
q = [0.0, 0.1]
[goal]
q = [1.0, 0.5]
"""


def test_a_file_and_a_study_have_the_key(tmp_path: Path) -> None:
    (tmp_path / "bare.urdf").write_text(BARE)
    (tmp_path / "bare.toml").write_text(SCENE)
    task = hovi.load_task(tmp_path / "bare.toml")
    found = hovi.plan_task(task)
    assert found.success
    assert found.cost == pytest.approx(CLOSED["acceleration"], rel=1e-6)
    again = hovi.load_task(hovi.save_task(task, tmp_path / "copy" / "again.toml"))
    assert again.options.objective == "acceleration"
    (tmp_path / "study.toml").write_text(
        'scene = "bare.toml"\n[[vary]]\nfield = "goal.q[0]"\nvalues = [0.5, 1.0]\n'
    )
    report = hovi.Study.read(tmp_path / "study.toml").run(tmp_path / "out", workers=1)
    assert report.complete
    rows = hovi.Study.load(tmp_path / "out")
    expected = [6 * (x**2 + D[1] ** 2) / T**3 for x in (0.5, 1.0)]
    assert sorted(rows["cost"]) == pytest.approx(sorted(expected), rel=1e-6)


def test_what_plays_torques_refuses_a_robot_without_inertia(
    robots: Mapping[str, hovi.Robot], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bare.urdf").write_text(BARE)
    (tmp_path / "bare.toml").write_text(SCENE)
    scene, motion = str(tmp_path / "bare.toml"), str(tmp_path / "motion.npz")
    planned(robots["without inertia"], "acceleration").trajectory.save(motion)
    for command in (
        ["simulate", scene, "--plan", motion],
        ["simulate", scene, "--plan", motion, "--feedback", "computed-torque"],
        ["simulate", scene],
        ["effects", scene],
        ["check", motion, "--in", "mujoco"],
    ):
        assert main(command) == 2
        said = capsys.readouterr()
        assert "needs torques, and robot 'bare' has none, as there is no inertia at" in said.err
        assert len(said.err.strip().splitlines()) == 1
        assert not said.out


def test_the_effort_of_a_robot_without_inertia_is_unknown(
    robots: Mapping[str, hovi.Robot], tmp_path: Path
) -> None:
    found = planned(robots["without inertia"], "acceleration")
    assert found.effort is None
    hovi.write_report(found, tmp_path / "bare.html")
    assert "integral of the squared torques" not in (tmp_path / "bare.html").read_text()
    found = planned(robots["with inertia"], "acceleration")
    assert found.effort is not None
    assert found.effort > 0.0

"""A cycle is planned once and run several times, alike each time, beside cycles written out."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError

Array = npt.NDArray[np.float64]

N, HOME = 3, [0.0, 0.0]
LOAD = hovi.effects.Payload(frame="tip", mass=0.5)
INSIDE = 1e-6
"""Distance of samples from nodes, where torques jump, in [s]."""


@cache
def scene() -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [hovi.effects.Gravity(9.8)])


def cycle(*, last: Any = (0.0, 0.0), duration: Any = 0.6) -> list[hovi.Segment]:
    there = hovi.FrameGoal("tip", position=[-0.6, 0.0, 1.4])
    return [
        hovi.Segment([0.7, 0.9], duration, name="reach"),
        hovi.Segment(there, 0.9, effects=[LOAD], name="carry"),
        hovi.Segment(last, 0.8, name="return"),
    ]


def planned(times: int, segments: list[hovi.Segment] | None = None, **options: Any) -> Any:
    given: dict[str, Any] = {"limits": "none", "repeat": times} | options
    start = given.pop("start", HOME)
    return hovi.plan_sequence(scene(), start, segments or cycle(), **given)


def inner_times(motion: hovi.Trajectory) -> Array:
    """Times away from nodes."""
    t = motion.t
    return np.sort(np.concatenate([t[:-1] + INSIDE, (t[:-1] + t[1:]) / 2, t[1:] - INSIDE]))


@pytest.mark.parametrize("smooth", [False, True])
def test_every_repetition_is_the_cycle(smooth: bool) -> None:
    one, many = (planned(n, smooth=smooth) for n in (1, N))
    assert many.success
    assert many.trajectory.duration == pytest.approx(N * one.trajectory.duration, rel=1e-14)
    t = inner_times(one.trajectory)
    first = one.trajectory.sample(t)
    for k in range(N):
        again = many.trajectory.sample(t + k * one.trajectory.duration)
        for x, y in zip(first, again, strict=True):
            np.testing.assert_allclose(y, x, rtol=1e-9, atol=1e-9)


def test_velocity_and_acceleration_go_on_where_smooth_cycles_meet() -> None:
    motion = planned(N, smooth=True).trajectory
    ends = motion.duration / N * np.arange(1, N)
    before, after = (motion.sample(ends + side) for side in (-INSIDE, INSIDE))
    for x, y in zip(before, after, strict=True):
        np.testing.assert_allclose(x, y, atol=1e-3 * max(1.0, float(np.abs(motion.v).max())))


def test_its_cost_is_the_integral_over_all_repetitions() -> None:
    many = planned(N)
    motion, robot = many.trajectory, scene().robot
    loaded = scene().model.copy()
    tip = loaded.frames[loaded.getFrameId("tip")]
    loaded.appendBodyToJoint(tip.parentJoint, pin.Inertia.FromSphere(0.5, 1e-9), tip.placement)
    points, weights = np.polynomial.legendre.leggauss(12)
    begins, h = motion.t[:-1], np.diff(motion.t)
    t = (begins[:, None] + h[:, None] * (points + 1) / 2).ravel()
    q, v, a, _ = motion.sample(t)
    part = np.searchsorted(np.cumsum(motion.segment_durations)[:-1], t) % 3
    models = scene().model, loaded, scene().model
    data = [each.createData() for each in models]
    tau = [pin.rnea(models[p], data[p], *x) for p, *x in zip(part.tolist(), q, v, a, strict=True)]
    density = 0.5 * np.square(tau).sum(axis=1)
    assert robot.nv == 2
    assert many.cost == pytest.approx(density @ np.outer(h / 2, weights).ravel(), rel=1e-5)
    assert many.effort == pytest.approx(many.cost, rel=1e-9)


def test_it_costs_as_much_as_the_cycles_written_out() -> None:
    names = [f"{each.name} of {k}" for k in range(N) for each in cycle()]
    pairs = zip(cycle() * N, names, strict=True)
    written = [
        hovi.Segment(each.goal, each.duration, effects=each.effects, name=name)
        for each, name in pairs
    ]
    options = {"tolerance": 1e-6}
    assert planned(N, **options).cost == pytest.approx(
        planned(1, written, **options).cost, rel=1e-5
    )


@pytest.mark.parametrize("options", [{}, {"limits": "urdf"}, {"smooth": True}])
def test_it_is_a_minimum_of_all_repetitions(options: dict[str, Any]) -> None:
    many = planned(N, **options)
    again = many.replan()
    assert again.success, again.message
    assert again.cost == pytest.approx(many.cost, rel=1e-9)
    assert many.advance(2.5).success


def test_its_multipliers_are_those_of_all_repetitions() -> None:
    one, many = (planned(n, limits={"base": "none", "v": 9.0}) for n in (1, N))
    assert one.forces is not None
    h = 1e-4
    slower = planned(1, _stretched(1 + h), limits={"base": "none", "v": 9.0})
    slope = (slower.cost - one.cost) / (h * one.trajectory.duration)
    assert one.duration_derivative == pytest.approx(slope, rel=1e-2)
    assert many.duration_derivative == pytest.approx(one.duration_derivative, rel=1e-6)


def _stretched(factor: float) -> list[hovi.Segment]:
    return [
        hovi.Segment(x.goal, factor * x.seconds, effects=x.effects, name=x.name) for x in cycle()
    ]


def test_objects_and_what_is_kept_come_again() -> None:
    arm = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    home, there = [0.0, -1.2, 1.5, -1.87, -1.57, 0.0], [0.6, -1.2, 1.5, -1.87, -1.57, 0.0]
    crate = hovi.Grasped(
        hovi.Sphere([0.0, 0.0, 0.1], 0.03), "tool0", 1.5, "crate", may_touch=["wrist_3_link"]
    )
    slow = hovi.conditions.ToolSpeed("tool0", 0.6)
    segments = [
        hovi.Segment(there, 1.0, name="go", keep=[slow]),
        hovi.Segment(home, 1.0, grasped=[crate], name="carry"),
    ]
    one, many = (hovi.plan_sequence(arm, home, segments, repeat=n) for n in (1, N))
    assert many.success, many.message
    assert many.problem is not None
    assert many.problem.clearance is not None
    ends = [(end - 1.0, end) for end in (2.0, 4.0, 6.0)]
    found = [(begin, end) for _, begin, end in many.problem.clearance.during]
    np.testing.assert_allclose(found, ends, atol=1e-9)
    kept = [each for each in many.problem.conditions if each.name.startswith("tool speed")]
    parts = [each.during for each in kept]
    np.testing.assert_allclose(parts, [(k, k + 1.0) for k in (0.0, 2.0, 4.0)], atol=1e-9)
    margins = many.margins()
    assert margins.distance == pytest.approx(one.margins().distance, abs=1e-9)
    assert len(margins.conditions) == N
    for each in margins.conditions.values():
        assert each == pytest.approx(one.margins().conditions["tool speed tool0 in go"], abs=1e-6)


def test_what_is_carried_through_the_end_of_a_cycle_is_carried_on() -> None:
    arm = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    home, there = [0.0, -1.2, 1.5, -1.87, -1.57, 0.0], [0.4, -1.2, 1.5, -1.87, -1.57, 0.0]
    crate = hovi.Grasped(
        hovi.Sphere([0.0, 0.0, 0.1], 0.03), "tool0", 1.5, "crate", may_touch=["wrist_3_link"]
    )
    segments = [
        hovi.Segment(there, 1.0, grasped=[crate]),
        hovi.Segment(there, 0.5, limits={"v": 1e-3}),
        hovi.Segment(home, 1.0, grasped=[crate]),
    ]
    many = hovi.plan_sequence(arm, home, segments, repeat=2)
    assert many.problem is not None
    assert many.problem.clearance is not None
    found = [(begin, end) for _, begin, end in many.problem.clearance.during]
    np.testing.assert_allclose(found, [(0.0, 1.0), (1.5, 3.5), (4.0, 5.0)], atol=1e-9)


def test_a_saved_motion_has_all_repetitions(tmp_path: Path) -> None:
    many = planned(N)
    many.save(tmp_path / "many.npz")
    loaded = hovi.Trajectory.load(tmp_path / "many.npz")
    t = inner_times(loaded)
    for x, y in zip(loaded.sample(t), many.trajectory.sample(t), strict=True):
        np.testing.assert_allclose(x, y, atol=1e-12)
    assert loaded.metadata["segment_names"][3] == "reach (2)"
    hovi.export(loaded, tmp_path / "many.csv", rate=100.0)
    rows = list(csv.reader((tmp_path / "many.csv").read_text().splitlines()))
    assert float(rows[-1][0]) == pytest.approx(loaded.duration)


SCENE = """
format = 2
robot = "two_link.urdf"
limits = "none"
repeat = 3
[start]
q = [0.0, 0.0]
[[segments]]
duration = 0.6
goal = { q = [0.7, 0.9] }
[[segments]]
duration = 0.8
goal = { q = [%s, 0.0] }
[effects.gravity]
"""


def test_a_scene_file_repeats_its_cycle(tmp_path: Path) -> None:
    path = tmp_path / "cycle.toml"
    path.write_text(SCENE % 0.0)
    command = [sys.executable, "-m", "hovi", "plan", str(path), "--json", "--out"]
    done = subprocess.run([*command, str(tmp_path / "m.npz")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [round(each["end"], 9) for each in found["segments"]] == [0.6, 1.4, 2.0, 2.8, 3.4, 4.2]
    assert "repeats 3 times" in found["message"]
    assert hovi.Trajectory.load(tmp_path / "m.npz").duration == pytest.approx(4.2)
    task = hovi.load_task(path)
    assert task.options.repeat == N
    hovi.save_task(task, tmp_path / "again.toml")
    assert "repeat = 3" in (tmp_path / "again.toml").read_text()
    path.write_text(SCENE % 0.1)
    done = subprocess.run([*command, str(tmp_path / "n.npz")], capture_output=True, text=True)
    assert done.returncode == 2
    assert "'shoulder' is 0.1 rad" in done.stderr


def test_a_motion_through_via_points_is_a_cycle_too() -> None:
    via = [hovi.Via(0.9, [0.7, 0.9])]
    one, many = (hovi.plan(scene(), HOME, HOME, 2.0, via=via, repeat=n) for n in (1, N))
    assert many.success
    q = many.trajectory.sample([0.9, 2.9, 4.9]).q
    np.testing.assert_allclose(q, [[0.7, 0.9]] * N, atol=1e-8)
    assert many.cost == pytest.approx(N * one.cost, rel=1e-12)


def test_a_cycle_is_found_with_the_durations_that_it_has_alone() -> None:
    segments = [hovi.Segment([0.7, 0.9], (0.3, 2.0)), hovi.Segment(HOME, (0.3, 2.0))]
    one, many = (planned(n, segments, time_weight=20.0) for n in (1, N))
    lengths = one.trajectory.segment_durations
    np.testing.assert_allclose(many.trajectory.segment_durations, np.tile(lengths, N), rtol=1e-9)
    assert many.cost == pytest.approx(N * one.cost, rel=1e-12)


def timed() -> hovi.Scene:
    cost = hovi.effects.RunningCost({"late": "t * v['shoulder']**2"})
    return hovi.Scene(scene().robot, [hovi.effects.Gravity(9.8), cost])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"segments": cycle(last=[0.2, 0.0])}, "the position of 'shoulder' is 0.2 rad"),
        ({"segments": cycle()[:2]}, "frame 'tip' misses it by 3.4 m"),
        ({"start": hovi.State(HOME, [0.1, 0.0])}, "velocity of 'shoulder' is 0.1 rad/s"),
        ({"start": hovi.State(HOME, free_velocity=["all"])}, "given wholly"),
        ({"start": hovi.FrameGoal("tip", position=[-0.6, 0.0, 1.4])}, "given wholly"),
        ({"scene": timed}, "the effect 'running_cost' changes with time"),
        (
            {
                "conditions": [
                    hovi.Condition("v['shoulder'] - t", hovi.Between(-90.0, 90.0), name="later"),
                ]
            },
            "condition 'later' changes with time",
        ),
        ({"repeat": 0}, "repeat"),
        ({"repeat": 1.5}, "repeat"),
    ],
)
def test_what_does_not_repeat_is_refused_by_name(changes: dict[str, Any], said: str) -> None:
    given: dict[str, Any] = {"limits": "none", "repeat": N, "segments": cycle()} | changes
    on = given.pop("scene", scene)()
    with pytest.raises(InputError, match=said):
        hovi.plan_sequence(on, given.pop("start", HOME), given.pop("segments"), **given)


def test_a_moving_obstacle_is_refused_by_name() -> None:
    arm = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    home = [0.0, -1.2, 1.5, -1.87, -1.57, 0.0]
    path = hovi.ObstaclePath([0.0, 3.0], [[1.5, 0.0, 0.0], [1.5, 1.0, 0.0]])
    ball = hovi.Sphere([0.0, 0.0, 0.0], 0.05, name="ball", path=path)
    segments = [hovi.Segment([0.6, *home[1:]], 1.0), hovi.Segment(home, 1.0)]
    with pytest.raises(InputError, match="the obstacle 'ball' changes with time"):
        hovi.plan_sequence(arm, home, segments, obstacles=[ball], repeat=2)


def test_a_cycle_that_is_not_found_is_not_repeated() -> None:
    short = [hovi.Segment([0.7, 0.9], 0.02), hovi.Segment(HOME, 0.02)]
    many = planned(N, short, limits={"base": "none", "v": 1.0})
    assert not many.success
    assert "one cycle, which is not repeated" in many.message
    assert many.trajectory.duration == pytest.approx(0.04)

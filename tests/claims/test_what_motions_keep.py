"""What motions keep all along, judged by Pinocchio alone at 2,001 samples."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.conditions import (
    CasadiRow,
    Follow,
    Formula,
    Keep,
    KeepOrientation,
    KeepPose,
    OnLine,
    OnPlane,
    ToolAcceleration,
    ToolSpeed,
    Upright,
)
from hovi.conditions.condition import with_function
from hovi.conditions.excess import worst

Array = npt.NDArray[np.float64]
FRAME, T = "tool0", 1.5
START = np.array([0.0, -1.2, 1.5, -0.3, 0.5, 0.0])
ASIDE = np.array([0.0, 0.3, 0.0])
"""From the tool's place at the start to its goal, in [m]."""
DOWN = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
SPEED = 0.25
"""Largest speed of the tool in segments that limit it, in [m/s]."""


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def begin() -> Array:
    return scene().robot.frame_pose(FRAME, START)


def planned(*kept: Keep | dict[str, Any], **options: Any) -> hovi.Solution:
    goal = hovi.FrameGoal(FRAME, position=begin()[:3, 3] + ASIDE)
    asked: dict[str, Any] = {"self_collision": False} | options
    return hovi.plan(scene(), START, goal, T, keep=kept, **asked)


@cache
def turning() -> hovi.Solution:
    """To where the tool points aside."""
    goal = hovi.FrameGoal(FRAME, position=begin()[:3, 3] + ASIDE, axis=([0, 0, 1], [0, 1, 0]))
    return hovi.plan(scene(), START, goal, T, self_collision=False)


def times(motion: hovi.Trajectory, part: tuple[float, float] | None = None) -> Array:
    first, last = part or (0.0, motion.duration)
    return np.linspace(first, last, 2001)


def poses(motion: hovi.Trajectory, t: Array) -> Array:
    """Of the tool, (M, 4, 4), by Pinocchio's forward kinematics."""
    model, data, found = scene().robot.model, scene().robot.model.createData(), []
    for q in motion.sample(t).q:
        pin.framesForwardKinematics(model, data, q)
        found.append(data.oMf[model.getFrameId(FRAME)].homogeneous.copy())
    return np.array(found)


def off_line(p: Array) -> float:
    """Largest distance of points from the line between the first and the last of them."""
    d = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    away = p - p[0]
    return float(np.linalg.norm(away - np.outer(away @ d, d), axis=1).max())


def tilt(R: Array) -> float:
    """Largest angle by which what pointed up at first does not, in [rad]."""
    up = R @ (R[0].T @ [0.0, 0.0, 1.0])
    chord = np.linalg.norm(up - [0.0, 0.0, 1.0], axis=1)
    return float((2.0 * np.arcsin(chord / 2)).max())


def turn(R: Array) -> float:
    """Largest angle of a turn from the first rotation, in [rad]."""
    return float(max(np.linalg.norm(pin.log3(R[0].T @ each)) for each in R))


def rates(p: Array, t: Array, order: int = 1) -> Array:
    """Sizes of the derivatives of positions by central differences."""
    for _ in range(order):
        p, t = (p[2:] - p[:-2]) / (t[2:] - t[:-2])[:, None], t[1:-1]
    return np.linalg.norm(p, axis=1)


@cache
def kept(name: str) -> hovi.Solution:
    return planned(*KEPT[name])


KEPT: dict[str, tuple[Keep, ...]] = {
    "line": (OnLine(FRAME),),
    "tube": (OnLine(FRAME, within="5 mm"),),
    "plane": (OnPlane(FRAME),),
    "upright": (Upright(FRAME),),
    "nearly upright": (Upright(FRAME, within="5 deg"),),
    "line and upright": (OnLine(FRAME), Upright(FRAME)),
    "orientation": (KeepOrientation(FRAME), OnLine(FRAME)),
    "speed": (ToolSpeed(FRAME, "400 mm/s", "60 deg/s"), OnLine(FRAME)),
    "acceleration": (ToolAcceleration(FRAME, 1.0), OnLine(FRAME)),
}


@pytest.mark.parametrize("name", KEPT)
def test_what_is_kept_holds_between_nodes(name: str) -> None:
    found = kept(name)
    assert found.success, found.message
    t = times(found.trajectory)
    found_poses = poses(found.trajectory, t)
    R, p = found_poses[:, :3, :3], found_poses[:, :3, 3]
    assert np.allclose(p[-1], begin()[:3, 3] + ASIDE, atol=1e-9)
    if OnLine in map(type, KEPT[name]):
        room = 5e-3 * (1 + 1e-6) if name == "tube" else 1e-5
        assert off_line(p) <= room
    if name == "tube":
        assert off_line(p) > 0.9 * room  # which the least effort uses
    if name == "plane":
        assert np.abs(p[:, 2] - p[0, 2]).max() <= 1e-5
    if "upright" in name:
        room = np.deg2rad(5.0) * (1 + 1e-6) if name == "nearly upright" else np.deg2rad(0.01)
        assert tilt(R) <= room
    if name == "orientation":
        assert turn(R) <= np.deg2rad(0.01)
    if name == "speed":
        spin = rates(R.reshape(-1, 9), t) / np.sqrt(2.0)
        assert rates(p, t).max() <= 0.4 * (1 + 1e-6)
        assert spin.max() <= np.deg2rad(60.0) * (1 + 1e-6)
    if name == "acceleration":
        assert rates(p, t, 2).max() <= 1.0 + 1e-3  # as differences have it


def test_keeping_more_costs_more() -> None:
    assert kept("tube").cost < kept("line").cost < kept("line and upright").cost
    assert kept("nearly upright").cost < kept("upright").cost
    assert kept("line").cost < min(kept("speed").cost, kept("acceleration").cost)


@pytest.mark.parametrize(
    ("slow", "words"),
    [
        (
            ToolSpeed(FRAME, 0.19),
            "allows 0.19 m/s, and the frame moves by 0.3 m in 1.5 s: give more",
        ),
        (ToolSpeed(FRAME, angular="20 deg/s"), "and the frame moves by 1 rad in 1.5 s"),
    ],
)
def test_a_speed_at_which_the_goal_is_out_of_reach_is_refused(slow: Keep, words: str) -> None:
    turned = begin()[:3, :3] @ pin.rpy.rpyToMatrix(0.0, 0.0, 1.0)
    goal = hovi.FrameGoal(FRAME, position=begin()[:3, 3] + ASIDE, rotation=turned)
    options: dict[str, Any] = {"keep": [slow], "self_collision": False}
    with pytest.raises(hovi.HoviError, match=re.escape(words)):
        hovi.plan(scene(), START, goal, T, **options)
    assert hovi.plan(scene(), START, goal, (T, 3 * T), time_weight=50.0, **options).success


def test_a_wide_room_is_none_and_a_narrow_one_a_value() -> None:
    free = planned(OnLine(FRAME))
    wide = planned(OnLine(FRAME), Upright(FRAME, within=3.0))
    assert np.isclose(free.cost, wide.cost, rtol=1e-3)
    narrow = planned(OnLine(FRAME, within="0.05 mm"))
    assert narrow.margins().missed["on line tool0"] <= 1e-5
    assert np.isclose(free.cost, narrow.cost, rtol=1e-3)


ROOMS: dict[str, tuple[Keep, str, Callable[[Array], float]]] = {
    "an angle": (
        Upright(FRAME, axis=([0, 0, 1], begin()[:3, 2]), within="5 deg"),
        r"(\S+) deg at .* its bound is 5$",
        lambda T: np.degrees(np.arccos(T[:, :3, 2] @ T[0, :3, 2])).max(),
    ),
    "a distance": (
        OnPlane(FRAME, normal=[0, 1, 0], point=begin()[:3, 3], within="5 mm"),
        r"(\S+) m at .* its bound is 0.005$",
        lambda T: np.abs(T[:, 1, 3] - T[0, 1, 3]).max(),
    ),
    "a speed": (
        ToolSpeed(FRAME, "50 mm/s"),
        r"(\S+) m/s at .* its bound is 0.05$",
        lambda T: 2000 / 1.5 * np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1).max(),
    ),
}


@pytest.mark.parametrize("what", ROOMS)
def test_what_exceeds_its_room_is_said_in_the_unit_of_the_room(what: str) -> None:
    kept, said, judged = ROOMS[what]
    (given,) = kept.conditions(scene().robot)
    clause = worst(turning().trajectory, with_function(given, scene().robot))[1]
    found = re.search(said, clause)
    assert found, clause
    most = judged(poses(turning().trajectory, times(turning().trajectory)))
    assert float(found[1]) == pytest.approx(most, rel=1e-3)


def test_margins_name_what_is_kept() -> None:
    assert set(kept("line and upright").margins().missed) == {"on line tool0", "upright tool0"}
    bounds = kept("speed").margins().conditions
    assert set(bounds) == {"tool speed tool0", "tool speed tool0 (turn)"}
    assert min(bounds.values()) >= -1e-6


def test_what_is_not_said_is_taken_from_the_ends() -> None:
    p, R = begin()[:3, 3], begin()[:3, :3]
    q = pin.Quaternion(R)
    said = planned(
        OnLine(FRAME, direction=7.0 * ASIDE, point=p + 0.4 * ASIDE),
        KeepOrientation(FRAME, quaternion_wxyz=[q.w, q.x, q.y, q.z]),
    )
    assert np.isclose(said.cost, kept("orientation").cost, rtol=1e-6)


def test_an_axis_of_the_frame_is_kept_along_one_of_the_world() -> None:
    R = begin()[:3, :3]
    named = planned(Upright(FRAME, axis={"frame": R.T @ [0.0, 0.0, 2.0], "world": [0, 0, 5]}))
    assert np.isclose(named.cost, kept("upright").cost, rtol=1e-6)


def test_formulas_and_functions_are_the_same() -> None:
    x = begin()[0, 3]

    def aside(q: ca.SX) -> ca.SX:
        return place(q)[1][0] - x

    place = hovi.symbolic.rigid_body(scene()).frame_placement(FRAME)
    formula = f'position["{FRAME}"][0]'
    named = planned(Formula(formula, equals=x, unit="m", tolerance=1e-5))
    own = planned(CasadiRow(aside, level=0, unit="m", tolerance=1e-5))
    plane = planned(OnPlane(FRAME, normal=[1.0, 0.0, 0.0]))
    assert np.allclose([named.cost, own.cost], plane.cost, rtol=1e-6)


@pytest.mark.parametrize("axis", ["x_axis", "y_axis", "z_axis"])
def test_axes_in_formulas_are_columns_of_the_rotation(axis: str) -> None:
    column = begin()[:3, ["x_axis", "y_axis", "z_axis"].index(axis)]
    met = Formula(f'{axis}["{FRAME}"]', lower=column - 0.7, upper=column + 0.7)
    assert planned(met, OnLine(FRAME)).success
    off = Formula(f'{axis}["{FRAME}", "y"]', lower=column[1] + 0.1)
    refused = planned(off)
    assert refused.status is hovi.Status.INFEASIBLE
    assert "at the start, outside its bounds" in refused.message


def test_a_start_that_misses_a_line_a_little_enters_it() -> None:
    p = begin()[:3, 3] + [4e-4, 0.0, 0.0]
    goal = hovi.FrameGoal(FRAME, position=p + ASIDE)
    line = OnLine(FRAME, direction=ASIDE, point=p)
    with pytest.warns(hovi.errors.HoviWarning, match=r"0.0004 m at the start.*within 0.3 s"):
        found = hovi.plan(scene(), START, goal, T, keep=[line], self_collision=False)
    assert found.success, found.message
    assert "enters it" in str(found.trajectory.metadata["cautions"])
    away = np.abs(poses(found.trajectory, times(found.trajectory))[:, 0, 3] - p[0])
    assert np.isclose(away[0], 4e-4, rtol=1e-6)
    assert away.max() <= 4e-4 + 1e-5
    assert away[times(found.trajectory) >= 0.3].max() <= 1e-5


def test_a_start_that_misses_it_by_more_is_refused_with_the_gap() -> None:
    line = OnLine(FRAME, direction=ASIDE, point=begin()[:3, 3] + [4e-3, 0.0, 0.0])
    with pytest.raises(hovi.errors.InputError, match=r"missed by 0.004 m at the start, more than"):
        planned(line)
    near = OnLine(FRAME, direction=ASIDE, point=begin()[:3, 3] + [4e-4, 0.0, 0.0])
    goal = hovi.FrameGoal(FRAME, position=begin()[:3, 3] + ASIDE)
    with pytest.raises(hovi.errors.InputError, match="needs a given duration"):
        hovi.plan(scene(), START, goal, (1.0, 2.0), keep=[near])


def test_what_is_kept_where_a_via_point_is_missed_is_named() -> None:
    """Not what is kept elsewhere."""
    line = OnLine(FRAME, name="seam")
    before = OnPlane(FRAME, normal=[1, 0, 0], during=(0.0, 0.2 * T), name="wall")
    beside = hovi.FrameGoal(FRAME, position=begin()[:3, 3] + ASIDE / 2 + [0.05, 0.0, 0.0])
    goal = hovi.FrameGoal(FRAME, position=begin()[:3, 3] + ASIDE)
    asked: dict[str, Any] = {"via": [hovi.Via(T / 2, beside)], "self_collision": False}
    found = hovi.plan(scene(), START, goal, T, keep=[line, before], **asked)
    assert found.status is hovi.Status.INFEASIBLE
    assert "frame 'tool0' misses it by" in found.message
    assert "with 'seam' kept" in found.message


def test_a_level_of_a_row_is_checked() -> None:
    row = CasadiRow(lambda v: v[0] + v[1], level=0)
    with pytest.raises(hovi.errors.InputError, match="says level 0, but its level is 1"):
        planned(row)
    bounded = CasadiRow(lambda q: q[0], level=0, upper=1.0)
    with pytest.raises(hovi.errors.InputError, match="its level is none, with bounds"):
        planned(bounded)


def test_a_replan_keeps_it() -> None:
    found = kept("line and upright")
    start = found.trajectory.sample([0.3]).q[0]
    goal = found.trajectory.q[-1]
    again = found.replan(start, goal)
    assert again.success, again.message
    found_poses = poses(again.trajectory, times(again.trajectory))
    assert off_line(found_poses[:, :3, 3]) <= 1e-5
    assert tilt(found_poses[:, :3, :3]) <= np.deg2rad(0.02)


def segments(lasting: float | tuple[float, float] | None = None) -> list[hovi.Segment]:
    """To above a place, straight down to it, straight up again slowly, and home."""

    def over(z: float) -> hovi.FrameGoal:
        return hovi.FrameGoal(FRAME, position=[0.4, 0.2, z], axis=DOWN)

    def seconds(T: float) -> float | tuple[float, float]:
        return T if lasting is None else (0.5 * T, 2.0 * T)

    lowered: list[Keep] = [OnLine(FRAME), Upright(FRAME, axis=DOWN)]
    lifted: list[Keep] = [OnLine(FRAME), ToolSpeed(FRAME, SPEED)]
    return [
        hovi.Segment(over(0.3), seconds(1.0), name="above"),
        hovi.Segment(over(0.2), seconds(0.6), name="down", keep=lowered),
        hovi.Segment(over(0.3), seconds(0.6), name="up", keep=lifted),
        hovi.Segment([0.0, -1.2, 1.5, -1.8, -1.57, 0.0], seconds(1.0), name="home"),
    ]


def require_kept(found: hovi.Solution) -> None:
    """Straight down with the tool's axis, straight up no faster than SPEED, and neither before."""
    assert found.success, found.message
    assert found.problem is not None
    first, second, third = found.problem.ld.lagrangian.ends
    down = poses(found.trajectory, times(found.trajectory, (first, second)))
    assert off_line(down[:, :3, 3]) <= 1e-5
    assert np.abs(down[:, :3, 2] + [0.0, 0.0, 1.0]).max() <= np.deg2rad(0.01)
    t = times(found.trajectory, (second, third))
    up = poses(found.trajectory, t)[:, :3, 3]
    assert off_line(up) <= 1e-5
    assert rates(up, t).max() <= SPEED * (1 + 1e-6)
    t = times(found.trajectory, (0.0, first))
    before = poses(found.trajectory, t)[:, :3, 3]
    assert off_line(before) > 1e-2
    assert rates(before, t).max() > 2 * SPEED


def sequence(**options: Any) -> hovi.Solution:
    home = [0.0, -1.2, 1.5, -1.8, -1.57, 0.0]
    asked: dict[str, Any] = {"self_collision": False} | options
    return hovi.plan_sequence(scene(), home, asked.pop("segments", segments()), **asked)


def test_segments_keep_what_is_theirs() -> None:
    found = sequence()
    require_kept(found)
    said = {each["name"]: each["during"] for each in found.trajectory.metadata["keep"]}
    assert np.allclose(said["on line tool0 in down"], [1.0, 1.6])


def test_a_part_of_a_segment_is_refused() -> None:
    part = OnLine(FRAME, during=(0.1, 0.3), name="seam")
    with pytest.raises(hovi.errors.InputError, match="'seam' is kept in a segment from its begin"):
        hovi.Segment(START, 1.0, keep=[part])


def test_free_durations_of_segments_that_keep_something_are_solved_jointly() -> None:
    found = sequence(segments=segments((0.5, 2.0)), time_weight=200.0)
    require_kept(found)
    assert found.nit <= 300  # a search over durations takes more than 1,000
    assert found.problem is not None
    ends = [0.0, *found.problem.ld.lagrangian.ends, found.trajectory.duration]
    said = {each["name"]: each["during"] for each in found.trajectory.metadata["keep"]}
    assert np.allclose(said["tool speed tool0 in up"], ends[2:4])
    lasts = np.diff(ends)
    longer = [  # no better with another length of the one that is not at a bound
        dataclasses.replace(each, duration=float(T))
        for each, T in zip(segments(), lasts * [1.0, 1.0, 1.1, 1.0], strict=True)
    ]
    near = sequence(segments=longer)
    assert near.cost + 200.0 * near.trajectory.duration > found.cost


def test_a_report_has_what_is_kept_in_the_words_of_a_scene_file(tmp_path: Path) -> None:
    from hovi.planning.task_file.motion_task import task_of_motion

    task = task_of_motion(kept("line and upright").trajectory, None)
    read = hovi.load_task(hovi.save_task(task, tmp_path / "kept.toml"))
    again = hovi.plan_task(read.with_options(self_collision=False, limits="urdf"))
    assert again.success, again.message
    assert np.isclose(again.cost, kept("line and upright").cost, rtol=1e-5)


def test_the_whole_sequence_keeps_what_all_of_it_does() -> None:
    found = sequence(keep=[Upright(FRAME, axis=DOWN, within="30 deg")])
    require_kept(found)
    R = poses(found.trajectory, times(found.trajectory))[:, :3, :3]
    angle = np.arccos(np.clip(-R[:, 2, 2], -1.0, 1.0)).max()
    assert angle <= np.deg2rad(30.0) * (1 + 1e-6)


def test_a_part_of_a_motion_is_kept() -> None:
    part = 0.5, 1.0
    found = planned(OnPlane(FRAME, point=[0.0, 0.0, begin()[2, 3] - 0.02], during=part))
    assert found.success, found.message
    inside = poses(found.trajectory, times(found.trajectory, part))[:, 2, 3]
    assert np.abs(inside - begin()[2, 3] + 0.02).max() <= 1e-5
    whole = poses(found.trajectory, times(found.trajectory))[:, 2, 3]
    assert np.isclose(whole[0], begin()[2, 3])
    slow = planned(ToolSpeed(FRAME, 0.2, during=part))
    t = times(slow.trajectory, part)
    assert rates(poses(slow.trajectory, t)[:, :3, 3], t).max() <= 0.2 * (1 + 1e-6)
    t = times(slow.trajectory, (0.0, 0.5))
    assert rates(poses(slow.trajectory, t)[:, :3, 3], t).max() > 0.3


def test_a_part_begins_at_a_node() -> None:
    plane = hovi.Condition("q", hovi.Between(upper=9.0), name="few", during=(0.5, 0.7))
    lagrangian = scene().effort_lagrangian()
    goal = hovi.State(START + 0.1)

    def problem(grid: hovi.Grid) -> hovi.TrajectoryProblem:
        ld = hovi.DiscreteLagrangian(lagrangian, grid)
        return hovi.TrajectoryProblem(ld, hovi.State(START), goal, conditions=[plane])

    grid = hovi.Grid.uniform(T, 8, hovi.schemes.by_name("galerkin-2"))
    with pytest.raises(hovi.errors.InputError, match=r"until 0\.5 s, where the grid needs a node"):
        problem(grid)
    assert problem(grid.with_nodes([0.5, 0.7])).conditions[0].during == (0.5, 0.7)


def test_parts_that_meet_ask_once_where_they_do() -> None:
    halves = [OnPlane(FRAME, during=(0.0, 0.7)), OnPlane(FRAME, name="rest", during=(0.7, T))]
    found = planned(*halves)
    assert found.success, found.message
    assert np.isclose(found.cost, kept("plane").cost, rtol=1e-3)


@cache
def planar(links: int = 4) -> hovi.Robot:
    """An arm of parallel axes, for which rows of lines and turns depend on each other."""
    return hovi.load_robot(pin.buildModelFromXML(hovi.chain(links)))


def on_planar(*kept: Keep, goal: hovi.FrameGoal | Array) -> hovi.Solution:
    scene = hovi.Scene(planar(), [hovi.effects.Gravity()])
    return hovi.plan(scene, BENT, goal, 1.0, keep=kept)


BENT = np.array([0.3, 0.5, 0.4, 0.3])


def planar_poses(found: hovi.Solution) -> Array:
    assert found.success, found.message
    q = found.trajectory.sample(times(found.trajectory)).q
    return np.array([planar().frame_pose("tip", each) for each in q])


def test_rows_that_no_joint_changes_do_no_harm() -> None:
    begun = planar().frame_pose("tip", BENT)
    goal = hovi.FrameGoal("tip", position=begun[:3, 3] + [-0.15, 0.0, 0.1])
    moved = planar_poses(on_planar(OnLine("tip"), KeepOrientation("tip"), goal=goal))
    assert off_line(moved[:, :3, 3]) <= 1e-5
    assert turn(moved[:, :3, :3]) <= np.deg2rad(0.01)
    still = planar_poses(on_planar(KeepPose("tip", axes=["x", "y", "z"]), goal=BENT))
    assert np.abs(still[:, :3, 3] - begun[:3, 3]).max() <= 1e-5
    assert turn(still[:, :3, :3]) > 0.1  # while the arm moves


def test_coordinates_of_a_pose_are_those_in_its_axes() -> None:
    begun = planar().frame_pose("tip", BENT)
    R, p = begun[:3, :3], begun[:3, 3]
    goal = hovi.FrameGoal("tip", position=p + 0.2 * R[:, 0])
    moved = planar_poses(on_planar(KeepPose("tip", axes=["z"]), goal=goal))
    inside = (moved[:, :3, 3] - p) @ R
    assert np.abs(inside[:, 2]).max() <= 1e-5
    assert np.isclose(inside[-1, 0], 0.2)


def test_a_path_is_followed_through_its_poses() -> None:
    begun = planar().frame_pose("tip", BENT)
    shifts = [[0.0, 0.0, 0.0], [-0.1, 0.0, 0.05], [-0.1, 0.0, 0.15]]
    turns = [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.3, 0.0]]
    places = begun[:3, 3] + np.array(shifts)
    rpy = [pin.rpy.matrixToRpy(pin.rpy.rpyToMatrix(*x) @ begun[:3, :3]) for x in turns]
    goal = hovi.FrameGoal("tip", position=places[-1], rpy=rpy[-1])
    found = on_planar(Follow("tip", [0.0, 0.4, 1.0], places, rpy=rpy), goal=goal)
    moved = planar_poses(found)
    at = [0, 800, 2000]
    assert np.allclose(moved[at, :3, 3], places, atol=1e-5)
    assert max(
        np.linalg.norm(pin.log3(pin.rpy.rpyToMatrix(*each).T @ R))
        for each, R in zip(rpy, moved[at, :3, :3], strict=True)
    ) <= np.deg2rad(0.01)
    speeds = rates(moved[:, :3, 3], times(found.trajectory))
    assert speeds[[0, -1]].max() < 1e-2 * speeds.max()  # at rest at both ends


def test_a_path_shorter_than_the_motion_is_held_at_its_last_pose() -> None:
    begun = planar().frame_pose("tip", BENT)
    places = begun[:3, 3] + np.array([[0.0, 0.0, 0.0], [-0.1, 0.0, 0.05], [-0.1, 0.0, 0.15]])
    goal = hovi.FrameGoal("tip", position=places[-1])
    found = on_planar(Follow("tip", [0.0, 0.3, 0.6], places), goal=goal)
    moved, t = planar_poses(found)[:, :3, 3], times(found.trajectory)
    assert np.isclose(t[-1], 1.0)
    assert np.abs(moved[t >= 0.6] - places[-1]).max() <= 1e-5
    assert np.linalg.norm(moved[600] - places[1]) <= 1e-5


def test_two_hands_keep_their_relative_pose() -> None:
    held = [f"{side}_gripper_{finger}_finger_joint" for side in "lr" for finger in "lr"]
    robot = hovi.load_robot("baxter", locked=["head_pan", *held])
    hands = "left_gripper", "right_gripper"
    start = [0.03, -0.18, -0.65, 1.0, -0.68, 1.7, -0.97, -0.03, -0.18, 0.65, 1.0, 0.68, 1.7, 0.97]
    left = robot.frame_pose(hands[0], start)
    raised = left[:3, 3] + [-0.05, 0.05, 0.15]
    goal = hovi.FrameGoal(hands[0], position=raised, rotation=left[:3, :3])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    kept = [hovi.conditions.Together(*hands)]
    found = hovi.plan(scene, start, goal, 1.5, keep=kept, self_collision=False)
    assert found.success, found.message
    apart = []
    for q in found.trajectory.sample(times(found.trajectory)).q:
        one, other = (robot.frame_pose(hand, q) for hand in hands)
        apart.append(np.linalg.inv(one) @ other)
    places = np.array(apart)
    assert np.linalg.norm(places[:, :3, 3] - places[0, :3, 3], axis=1).max() <= 1e-5
    assert turn(places[:, :3, :3]) <= np.deg2rad(0.01)
    last = robot.frame_pose(hands[1], found.trajectory.q[-1])
    first = robot.frame_pose(hands[1], start)
    assert np.allclose(last[:3, 3] - first[:3, 3], raised - left[:3, 3], atol=2e-5)

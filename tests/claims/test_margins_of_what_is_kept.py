"""Margins have each condition and region, by how much it is missed and when: by Pinocchio alone."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main

Array = npt.NDArray[np.float64]

BEGIN = [0.0, -1.2, 1.5, -0.3, 0.5, 0.0]
SAMPLES = 20_001
KEEP = hovi.conditions


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def aside(**more: Any) -> hovi.FrameGoal:
    p = scene().robot.frame_pose("tool0", BEGIN)[:3, 3]
    return hovi.FrameGoal("tool0", position=p + np.array([0.0, 0.3, 0.0]), **more)


def planned(*keep: Any, goal: Any = None, **options: Any) -> hovi.Solution:
    found = hovi.plan(scene(), BEGIN, goal or aside(), 1.5, keep=list(keep), **options)
    assert found.success, found.message
    return found


def along(motion: hovi.Trajectory) -> tuple[Array, list[pin.SE3], Array, Array]:
    """Times, placements of the tool, and its speeds and accelerations, (SAMPLES, 3)."""
    model, t = scene().robot.model, np.linspace(0.0, motion.duration, SAMPLES)
    data, frame, places = model.createData(), model.getFrameId("tool0"), []
    v, a = np.zeros((2, SAMPLES, 3))
    world = pin.LOCAL_WORLD_ALIGNED
    for i, jet in enumerate(zip(*motion.sample(t)[:3], strict=True)):
        pin.forwardKinematics(model, data, *jet)
        places.append(pin.updateFramePlacement(model, data, frame).copy())
        v[i] = pin.getFrameVelocity(model, data, frame, world).linear
        a[i] = pin.getFrameClassicalAcceleration(model, data, frame, world).linear
    return t, places, v, a


def off_line(places: list[pin.SE3]) -> Array:
    return np.array([np.hypot(*(p.translation - places[0].translation)[[0, 2]]) for p in places])


def test_a_value_is_missed_by_what_pinocchio_says_and_then() -> None:
    found = planned(KEEP.OnLine("tool0"))
    t, places, *_ = along(found.trajectory)
    margins, off = found.margins(), off_line(places)
    missed = margins.missed["on line tool0"]
    assert missed == pytest.approx(off.max(), rel=2e-2)  # far below the tolerance
    at = margins.times["on line tool0"]
    assert np.interp(at, t, off) == pytest.approx(off.max(), rel=5e-2)
    assert f"at t = {at:.4g} s" in str(margins)


@pytest.mark.parametrize("name", ["speed", "acceleration"])
@pytest.mark.parametrize("more", [1.0, 3.0])
def test_a_bound_is_nearest_when_pinocchio_says(name: str, more: float) -> None:
    bound = {"speed": 0.45, "acceleration": 3.0}[name] * more
    kinds = {"speed": KEEP.ToolSpeed, "acceleration": KEEP.ToolAcceleration}
    found = planned(kinds[name]("tool0", bound))
    t, _, v, a = along(found.trajectory)
    size = np.linalg.norm(v if name == "speed" else a, axis=1)
    margins, key = found.margins(), f"tool {name} tool0"
    assert margins.conditions[key] == pytest.approx(1.0 - (size.max() / bound) ** 2, abs=1e-4)
    assert np.interp(margins.times[key], t, size) == pytest.approx(size.max(), rel=1e-4)
    if more > 1.0:  # it moves at its bound for a while otherwise
        assert margins.times[key] == pytest.approx(t[np.argmax(size)], abs=5e-3)


KINDS: dict[str, Any] = {
    "upright": KEEP.Upright("tool0"),
    "upright within": KEEP.Upright("tool0", within="5 deg"),
    "line within": KEEP.OnLine("tool0", within="5 mm"),
    "plane": KEEP.OnPlane("tool0"),
    "orientation": KEEP.KeepOrientation("tool0"),
    "pose": KEEP.KeepPose("tool0", rpy=[0.0, 0.0, 0.0], axes=["x", "z"]),
    "formula": KEEP.Formula('velocity["tool0", "z"]', equals=0.0),
    "bounds": KEEP.Formula('position["tool0", "z"]', lower=-1.0, upper=1.0),
    "speeds": KEEP.ToolSpeed("tool0", 0.6, 3.0),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_its_margin_and_its_time(kind: str) -> None:
    found = planned(KINDS[kind])
    assert found.problem is not None
    margins = found.margins()
    names = {each.name for each in found.problem.conditions}
    assert set(margins.conditions) | set(margins.missed) == names == set(margins.times)
    assert all(0.0 <= t <= 1.5 for t in margins.times.values())
    assert all(each > -1e-5 for each in margins.conditions.values())


def test_two_hands_together_have_theirs() -> None:
    moving = {f"{side}_{joint}" for side in ("left", "right") for joint in ("s0", "s1", "e1", "w1")}
    names = hovi.load_robot("baxter").joint_names
    robot = hovi.load_robot("baxter", locked=[each for each in names if each not in moving])
    q = np.zeros(robot.nq)
    goal = q + 0.2 * np.sign(np.arange(robot.nq) % 2 - 0.5)
    speeds = [KEEP.ToolSpeed(f"{side}_endpoint", 1.5) for side in ("left", "right")]
    hands = [
        hovi.FrameGoal(
            f"{side}_endpoint", position=robot.frame_position(f"{side}_endpoint", goal), within=r
        )
        for side, r in (("left", "20 mm"), ("right", "10 mm"))
    ]
    on = hovi.Scene(robot)
    found = hovi.plan(on, q, hands, 1.0, keep=speeds, self_collision=False)
    assert found.success, found.message
    margins = found.margins()
    assert set(margins.conditions) == {"tool speed left_endpoint", "tool speed right_endpoint"}
    for hand, each, r in zip(("left_endpoint", "right_endpoint"), hands, (0.02, 0.01), strict=True):
        off = robot.frame_position(hand, found.trajectory.q[-1]) - np.asarray(each.position)
        left = margins.regions[f"{hand} distance"]
        assert left == pytest.approx(r - np.linalg.norm(off), abs=1e-9)


def test_regions_of_goals_on_the_way_have_their_room() -> None:
    back = hovi.FrameGoal(
        "tool0", position=scene().robot.frame_position("tool0", BEGIN), within="5 mm"
    )
    segments = [hovi.Segment(aside(within="10 mm"), 1.0), hovi.Segment(back, 1.0)]
    found = hovi.plan_sequence(scene(), BEGIN, segments)
    assert found.success, found.message
    regions = found.margins().regions
    assert list(regions) == ["tool0 distance", "tool0 distance at 2 s"]
    assert list(found.region_prices) == list(regions)
    for (_, left), time, goal in zip(regions.items(), (1.0, 2.0), segments, strict=True):
        q = found.trajectory.sample([time]).q[0]
        off = scene().robot.frame_position("tool0", q) - np.asarray(goal.goal.position)  # type: ignore[union-attr]
        room = 0.01 if time == 1.0 else 0.005
        assert left == pytest.approx(room - np.linalg.norm(off), abs=1e-9)


def test_values_at_given_times_are_among_them() -> None:
    asked = hovi.Condition(
        "v['elbow_joint']", hovi.Equal(0.1), where=hovi.AtTimes([0.5, 0.9]), name="elbow"
    )
    margins = planned(conditions=[asked]).margins()
    assert margins.missed["elbow"] < 1e-6
    assert margins.times["elbow"] in (pytest.approx(0.5), pytest.approx(0.9))


SCENE = """robot = "ur5"
duration = 1.5
[start]
q = [0.0, -1.2, 1.5, -0.3, 0.5, 0.0]
[goal]
frame = "tool0"
position = {position}
within = "10 mm"
[effects.gravity]
[[keep]]
kind = "on_plane"
frame = "tool0"
[[keep]]
kind = "tool_speed"
frame = "tool0"
linear = "450 mm/s"
"""


def test_reports_have_them(tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(position=np.asarray(aside().position).tolist()))
    assert main(["plan", str(path)]) == 0
    text = capsys.readouterr().out
    assert "on plane tool0 condition that is missed by at most" in text
    assert "region   tool0 distance: " in text
    assert main(["plan", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["condition_times"]) == {"on plane tool0", "tool speed tool0"}
    assert set(found["missed"]) == {"on plane tool0"}
    assert set(found["regions"]) == {"tool0 distance"}

"""What asked for the last grid is said: a condition or an error, judged by Pinocchio and costs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main

ASIDE = np.array([0.0, 0.3, 0.0])
BEGIN = [0.0, -1.2, 1.5, -0.3, 0.5, 0.0]
ROOM, LOOSE, N = 1e-5, 1e-2, 6
SCENE = """robot = "ur5"
duration = 1.5
intervals = 6
tolerance = 0.01
[start]
q = [0.0, -1.2, 1.5, -0.3, 0.5, 0.0]
[goal]
frame = "tool0"
position = {position}
[effects.gravity]
[[keep]]
kind = "on_line"
frame = "tool0"
tolerance = "{tolerance}"
"""


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def place(scene: hovi.Scene) -> np.ndarray:
    found: np.ndarray = scene.robot.frame_pose("tool0", BEGIN)[:3, 3]
    return found


def planned(scene: hovi.Scene, room: float | None, **options: Any) -> hovi.Solution:
    end = hovi.FrameGoal("tool0", position=place(scene) + ASIDE)
    keep = [] if room is None else [hovi.conditions.OnLine("tool0", tolerance=room)]
    return hovi.plan(scene, BEGIN, end, 1.5, keep=keep, **options)


def missed(scene: hovi.Scene, motion: hovi.Trajectory) -> float:
    """How far the tool leaves the line along y, in [m]."""
    model = scene.robot.model
    data, first, far = model.createData(), place(scene), 0.0
    for q in motion.sample(np.linspace(0.0, motion.duration, 4001)).q:
        pin.framesForwardKinematics(model, data, q)
        off = data.oMf[model.getFrameId("tool0")].translation - first
        far = max(far, float(np.hypot(off[0], off[2])))
    return far


def fixed_by(found: hovi.Solution) -> str:
    assert found.accuracy is not None
    return found.accuracy.fixed_by


def test_a_condition_that_the_first_grid_misses_fixed_the_grid(scene: hovi.Scene) -> None:
    found = planned(scene, ROOM, intervals=N, tolerance=LOOSE)
    assert found.success, found.message
    assert fixed_by(found) == "condition 'on line tool0'"
    assert missed(scene, found.trajectory) <= ROOM
    coarse = planned(scene, ROOM, intervals=N, scheme="galerkin-2x8")
    assert missed(scene, coarse.trajectory) > ROOM
    finest = planned(scene, ROOM, tolerance=1e-6)
    assert abs(coarse.cost / finest.cost - 1.0) < 0.5 * LOOSE  # the cost did not ask for it


def test_one_with_more_room_did_not(scene: hovi.Scene) -> None:
    found = planned(scene, 1e-2, intervals=N, tolerance=LOOSE)
    assert found.success, found.message
    assert fixed_by(found) == ""
    assert found.trajectory.grid.intervals == N


def test_the_cost_did_where_it_is_asked_for(scene: hovi.Scene) -> None:
    found = planned(scene, 1e-2, intervals=N, tolerance=1e-5)
    assert fixed_by(found) == "the cost"
    found = planned(scene, None, tolerance="0.1 mm")
    assert fixed_by(found).startswith("the position of tool0")


def test_it_is_said_of_free_durations_of_segments(scene: hovi.Scene) -> None:
    line = hovi.conditions.OnLine("tool0", tolerance=ROOM)
    there = hovi.FrameGoal("tool0", position=place(scene) + ASIDE)
    segments = [
        hovi.Segment(there, (0.5, 3.0), keep=[line], name="out"),
        hovi.Segment(BEGIN, (0.5, 3.0), name="back"),
    ]
    options: dict[str, Any] = {"time_weight": 300.0, "intervals": N, "tolerance": LOOSE}
    found = hovi.plan_sequence(scene, BEGIN, segments, **options)
    assert found.success, found.message
    assert found.accuracy is not None
    assert "condition 'on line tool0 in out'" in [each.asked_by for each in found.accuracy.rounds]


def test_reports_say_it(scene: hovi.Scene, tmp_path: Path, capsys: Any) -> None:
    path, position = tmp_path / "scene.toml", (place(scene) + ASIDE).tolist()
    path.write_text(SCENE.format(position=position, tolerance="0.01 mm"))
    said = "last refined for condition 'on line tool0'"
    assert main(["plan", str(path)]) == 0
    assert said in capsys.readouterr().out
    assert main(["plan", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["grid_fixed_by"] == "condition 'on line tool0'"
    assert [each["asked_by"] for each in found["grids"]] == [None, "condition 'on line tool0'"]
    assert main(["info", str(path), "--kept"]) == 0
    assert said in capsys.readouterr().out
    path.write_text(SCENE.format(position=position, tolerance="10 mm"))
    assert main(["plan", str(path)]) == 0
    assert "last refined" not in capsys.readouterr().out

"""What conditions that are kept cost, against plans of one's own and Pinocchio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.accuracy.kept_study import KeptTrial, kept_rows, kept_study
from hovi.cli.application import main
from hovi.errors import InputError

SCENE = """robot = "ur5"
duration = 1.5
[start]
q = [0.0, -1.2, 1.5, -1.8, -1.57, 0.0]
[goal]
frame = "tool0"
position = {position}
[effects.gravity]
[[keep]]
kind = "on_line"
frame = "tool0"
[[keep]]
kind = "tool_speed"
frame = "tool0"
linear = "240 mm/s"
[[keep]]
kind = "upright"
frame = "forearm_link"
within = "100 deg"
"""
START = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    x, y, z = hovi.load_robot("ur5").frame_pose("tool0", START)[:3, 3]
    path = tmp_path_factory.mktemp("kept") / "scene.toml"
    path.write_text(SCENE.format(position=[float(x), float(y) + 0.2, float(z)]))
    return path


@pytest.fixture(scope="module")
def trials(file: Path) -> list[KeptTrial]:
    return kept_study(hovi.load_task(file))


def places(motion: hovi.Trajectory) -> np.ndarray:
    model = hovi.load_robot("ur5").model
    data, found = model.createData(), []
    for q in motion.sample(np.linspace(0.0, motion.duration, 2001)).q:
        pin.framesForwardKinematics(model, data, q)
        found.append(data.oMf[model.getFrameId("tool0")].translation.copy())
    return np.array(found)


def test_every_condition_is_left_out_once(file: Path, trials: list[KeptTrial]) -> None:
    titles = [each.title for each in trials]
    assert titles == ["(all)", "on line tool0", "tool speed tool0", "upright forearm_link"]
    assert all(each.success and each.effort <= trials[0].effort * (1 + 1e-6) for each in trials)


def test_trials_are_plans_and_what_they_miss_is_measured(
    file: Path, trials: list[KeptTrial]
) -> None:
    task = hovi.load_task(file)
    line, speed, upright = task.options.keep
    own = hovi.plan_task(task.with_options(keep=[speed, upright]))
    assert trials[1].effort == pytest.approx(own.effort, rel=1e-9)
    assert trials[1].steps == own.nit
    p = places(own.trajectory)
    along = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    away = p - p[0]
    off = 1e3 * np.linalg.norm(away - np.outer(away @ along, along), axis=1).max()
    said = float(trials[1].missed.removeprefix("missed by ").removesuffix(" mm"))
    assert off / np.sqrt(2.0) * 0.999 <= said <= off * 1.001  # the larger one of two offsets
    p = places(hovi.plan_task(task.with_options(keep=[line, upright])).trajectory)
    speeds = np.linalg.norm(np.diff(p, axis=0), axis=1) / (1.5 / 2000)
    ratio = float(trials[2].missed.removesuffix(" times its bound"))
    assert ratio == pytest.approx(speeds.max() / 0.24, rel=2e-3)
    assert trials[3].missed == "kept all the same"


def test_the_command_prints_the_table(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(file), "--kept"]) == 0
    shown = capsys.readouterr().out
    for word in ("on line tool0", "times its bound", "kept all the same", "without it"):
        assert word in shown


def test_rows_say_where_no_minimum_was_found() -> None:
    rows = kept_rows(
        [
            KeptTrial("(all)", True, 2.0, 3, 0.1, ""),
            KeptTrial("one", True, 1.0, 4, 0.1, "missed by 3 mm"),
            KeptTrial("other", False, np.nan, 5, 0.1, "the time limit was reached."),
        ]
    )
    assert [row[1] for row in rows] == ["2", "1", "no minimum"]
    assert [row[2] for row in rows] == ["", "-50 %", ""]


def test_what_keeps_nothing_or_finds_nothing_is_refused(file: Path) -> None:
    with pytest.raises(InputError, match="keeps nothing"):
        kept_study(hovi.load_task(file).with_options(keep=()))
    with pytest.raises(InputError, match="no motion that keeps all was found"):
        kept_study(hovi.load_task(file), time_limit=1e-3)


@pytest.mark.parametrize("what", ["ur5", None])
def test_what_is_kept_is_asked_of_a_scene(
    what: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", *([what] if what else []), "--kept"]) == 2
    assert "asked of a scene" in capsys.readouterr().err

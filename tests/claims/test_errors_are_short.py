"""An error of a public function shows who called it, one frame of hovi, and a sentence."""

from __future__ import annotations

import pickle
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hovi

PACKAGE = str(Path(hovi.__file__).parent)
ARM = hovi.load_robot(hovi.example("two_link.urdf"))
SCENE = hovi.Scene(ARM, [hovi.effects.Gravity()])
WRONG: dict[str, Callable[[], object]] = {
    "plan, the kind of an argument": lambda: hovi.plan("arm", [0, 0], [1, 1], 1.0),  # type: ignore[arg-type]
    "plan, an option": lambda: hovi.plan(SCENE, [0, 0], [1, 1], 1.0, speed=3),  # type: ignore[call-arg]
    "plan, a number of joints": lambda: hovi.plan(SCENE, [0, 0], [1, 1, 1], 1.0),
    "plan, a duration": lambda: hovi.plan(SCENE, [0, 0], [1, 1], -1.0),
    "plan, limits": lambda: hovi.plan(SCENE, [0, 0], [1, 1], 1.0, limits={"speed": 1}),
    "plan_sequence": lambda: hovi.plan_sequence(SCENE, [0, 0], []),
    "Segment": lambda: hovi.Segment([0, 0], -1.0),
    "load_robot, a name": lambda: hovi.load_robot("ur55"),
    "load_robot, a file": lambda: hovi.load_robot("none.urdf"),
    "Scene": lambda: hovi.Scene(ARM, [1]),  # type: ignore[list-item]
    "an effect": lambda: hovi.effects.Gravity("down"),  # type: ignore[arg-type]
    "State": lambda: hovi.State([0, 0], free=3),  # type: ignore[arg-type]
    "PlanOptions": lambda: hovi.PlanOptions(starts=0),
    "load_task": lambda: hovi.load_task("none.toml"),
    "Trajectory.load": lambda: hovi.Trajectory.load("none.npz"),
    "inverse_kinematics": lambda: hovi.inverse_kinematics(
        ARM, hovi.FrameGoal("tool9", position=[0, 0, 0])
    ),
    "FrameGoal": lambda: hovi.FrameGoal("tip", [0, 0, 0]),
    "FrameGoal, a name": lambda: hovi.FrameGoal("tip", place=[0, 0, 0]),  # type: ignore[call-arg]
    "as_limits": lambda: hovi.as_limits(ARM, {"speed": 1}),
    "holding": lambda: hovi.holding(ARM, 3),  # type: ignore[arg-type]
    "Sphere": lambda: hovi.Sphere([0, 0, 0], -1.0),
    "Grid": lambda: hovi.Grid.uniform(1.0, 0, hovi.schemes.galerkin(2)),
}


def refusal(call: Callable[[], object]) -> hovi.HoviError:
    with pytest.raises(hovi.HoviError) as caught:
        call()
    return caught.value


def own_frames(lines: list[str]) -> list[str]:
    """The frames of a traceback in hovi's own files, or in what dataclasses compile for it."""
    return [each for each in lines if each.startswith((f'  File "{PACKAGE}', '  File "<string>"'))]


def assert_short(lines: list[str], name: str) -> None:
    assert len(own_frames(lines)) <= (2 if name == "an effect" else 1), "\n".join(lines)
    assert lines[-1].startswith("hovi.errors."), name
    assert sum(line.startswith("Traceback") for line in lines) == 1, "a cause is shown, too"


@pytest.mark.parametrize("name", WRONG)
def test_an_error_is_short(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOVI_TRACEBACK", raising=False)
    shown = "".join(traceback.format_exception(refusal(WRONG[name]))).splitlines()
    assert_short(shown, name)


def test_a_replan_and_a_sample_are_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOVI_TRACEBACK", raising=False)
    found = hovi.plan(SCENE, [0, 0], [0.5, 0], 1.0, intervals=4)
    for call in (
        lambda: found.replan(start=[0, 0, 0]),
        lambda: found.advance(-1.0),
        lambda: found.trajectory.sample(np.array(["late"])),
        lambda: found.trajectory.save("none/motion.csv"),
    ):
        assert_short("".join(traceback.format_exception(refusal(call))).splitlines(), "replan")


def test_all_frames_are_there_on_request(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOVI_TRACEBACK", "full")
    frames = traceback.extract_tb(refusal(WRONG["plan, a number of joints"]).__traceback__)
    assert sum(PACKAGE in frame.filename for frame in frames) > 5


def test_an_error_of_a_thread_and_a_pickled_one_are_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOVI_TRACEBACK", raising=False)
    caught: list[hovi.HoviError] = []
    call = WRONG["plan, a duration"]
    thread = threading.Thread(target=lambda: caught.append(refusal(call)))
    thread.start()
    thread.join(60)
    assert_short("".join(traceback.format_exception(caught[0])).splitlines(), "thread")
    again = pickle.loads(pickle.dumps(caught[0]))
    assert (type(again), str(again)) == (type(caught[0]), str(caught[0]))


@pytest.mark.parametrize(
    "line",
    [
        'hovi.plan(hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf"))), [0], [1, 2], 1.0)',
        'hovi.Study.load("none.toml")',
    ],
    ids=["plan", "Study"],
)
def test_a_script_shows_its_own_line(line: str, tmp_path: Path) -> None:
    script = tmp_path / "wrong"
    script.write_text(f"import hovi\n\n{line}\n")
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60)
    lines = ran.stderr.splitlines()
    assert ran.returncode == 1
    assert_short(lines, line)
    assert f'  File "{script}", line 3, in <module>' in lines

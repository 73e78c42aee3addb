"""The exit code of `hovi plan`: 0 for a minimum, 1 where none was found, 2 for invalid input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import hovi
from hovi.cli.application import main

SCENE = """robot = "two_link.urdf"
duration = 1.0
limits = "none"
self_collision = false
start.q = [-1.0, 0.0]
goal.q = [1.0, 0.5]
effects.gravity.acceleration = 9.8
"""
CASES = {
    "minimum": ("", [], 0),
    "infeasible": ('limits = { base = "none", v = 0.5 }', [], 1),
    "iteration_limit": ("max_iterations = 1\ncontinuation = false", [], 1),
    "unresolved": ('[scheme]\nname = "galerkin-0"\nintervals = 2', [], 1),
    "unknown key": ("duraton = 2.0", [], 2),
    "unknown scheme": ("", ["--scheme", "galerkn-2"], 2),
    "bad number": ("", ["--time-limit", "-1"], 2),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    urdf = Path(str(hovi.example("two_link.urdf"))).read_text()
    (tmp_path / "two_link.urdf").write_text(urdf)
    return tmp_path


@pytest.mark.parametrize("case", CASES)
def test_the_exit_code_is_that_of_what_was_found(
    case: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more, options, expected = CASES[case]
    lines = [] if "limits" in more else ['limits = "none"']
    text = SCENE.replace('limits = "none"', "\n".join(lines)) + more + "\n"
    head, table = text.partition("[")[::2] if more.startswith("[") else (text, "")
    (folder / "scene.toml").write_text(head + (f"[{table}" if table else ""))
    arguments = ["plan", str(folder / "scene.toml"), "--no-certificate", *options]
    out = folder / "motion.npz"
    code = main([*arguments, "--json", "--out", str(out)])
    printed = capsys.readouterr()
    assert code == expected, printed
    if expected == 2:
        assert printed.err.startswith("error: ")
        assert printed.out == ""
        assert not out.exists()
        return
    fields = json.loads(printed.out)
    assert fields["success"] == (code == 0)
    assert fields["status"] == case
    assert main(arguments) == code
    shown = capsys.readouterr().out
    assert f"status   {case}" in shown
    if fields["out"] is not None:
        motion = hovi.Trajectory.load(out)
        assert motion.metadata["status"] == case
        assert bool(motion.cautions) == (code != 0)


def test_a_study_and_a_missing_scene_have_theirs(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(folder / "missing.toml")]) == 2
    assert main(["info", str(folder / "missing.npz")]) == 2
    assert main(["simulate", str(folder / "missing.toml")]) == 2
    capsys.readouterr()

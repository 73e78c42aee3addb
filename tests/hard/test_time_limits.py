"""Time limits on hostile scenes: each plan would take minutes, and ends by itself with a result.

The waiting times below only tell an end from none; `examples/benchmarks/time_limits.py` measures.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

PATIENCE = 150.0
"""Time in [s] after which a plan under a limit of some seconds counts as one that does not end."""
UR5 = """
robot = "ur5"
duration = 2.0
{keys}
[start]
q = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
[goal]
q = [1.8, -1.0, 1.4, -0.5, 0.3, 0.1]
[effects.gravity]
acceleration = 9.81
[scheme]
name = "galerkin-2"
intervals = {intervals}
"""
BALL = """
self_collision = true
obstacles = [{ kind = "sphere", position = [0.05, 0.35, 0.25], radius = 0.1 }]
"""
STIFF = """
robot = "{models}/two_link.urdf"
duration = 2.0
limits = "none"
[start]
q = [-1.5, 0.0]
v = [0.25, 0.15]
[goal]
q = [-1.0, 0.3]
v = [0.25, 0.15]
[effects.viscous_friction]
coefficient = 1e9
"""
MODELS = Path(__file__).resolve().parents[2] / "models"


def planned(scene: str, folder: Path, *options: str) -> dict[str, Any]:
    """The JSON of `hovi plan`, which must end before PATIENCE does."""
    path = folder / "scene.toml"
    path.write_text(scene)
    done = subprocess.run(
        [sys.executable, "-m", "hovi", "plan", str(path), "--json", *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.stderr == ""
    result: dict[str, Any] = json.loads(done.stdout)
    assert done.returncode == (0 if result["success"] else 1)
    return result


@pytest.mark.parametrize("limits", ["urdf", "none"])
def test_a_million_intervals_end_with_the_motion_on_a_coarse_grid(
    limits: str, tmp_path: Path
) -> None:
    scene = UR5.format(keys=f'limits = "{limits}"', intervals=1_000_000)
    found = planned(scene, tmp_path, "--time-limit", "2")
    assert found["status"] == "time_limit"
    assert found["intervals"] < 1000
    assert "the requested grid of 1,000,000 intervals" in found["message"]


def test_distances_to_obstacles_end_with_the_limit(tmp_path: Path) -> None:
    found = planned(UR5.format(keys=BALL, intervals=20_000), tmp_path, "--time-limit", "2")
    assert found["status"] == "time_limit"


def test_a_million_starts_end_with_the_best_motion(tmp_path: Path) -> None:
    scene = UR5.format(keys='limits = "none"', intervals=16)
    found = planned(scene, tmp_path, "--time-limit", "8 s", "--starts", "1000000")
    assert found["status"] in ("minimum", "unresolved")
    assert " of 1000000 starts." in found["message"]


@pytest.mark.parametrize("limit", [("--time-limit", "4"), ()])
def test_a_certificate_that_would_take_hours_gives_up_and_says_what_is_missing(
    limit: tuple[str, ...], tmp_path: Path
) -> None:
    """Forward simulation with such friction takes a step of nanoseconds."""
    found = planned(STIFF.format(models=MODELS), tmp_path, *limit, "--tolerance", "1e-3")
    assert found["status"] == "minimum"
    assert found["certificate"]["replay"] is None
    assert found["certificate"]["missing"]["replay"] == "the time limit was reached"
    assert found["certificate"]["errors"] is not None

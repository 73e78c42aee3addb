"""Intervals are halved until charts hold the orientations of a guess, and not for ever."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import ChartError
from samples.manifold_robots import chain


@pytest.mark.parametrize(("turns", "intervals"), [(0, 4), (30, None), (3_000, 0)])
def test_a_guess_of_many_turns_is_split_up_to_two_thousand_intervals(
    turns: int, intervals: int | None
) -> None:
    """Of less than half a turn each."""
    scene = hovi.Scene(hovi.load_robot(chain([pin.JointModelSpherical()])))
    rest = np.array([0.0, 0.0, 0.0, 1.0])
    goal = hovi.State(rest, turns={scene.robot.joint_names[0]: [0, 0, turns]})
    once = {"max_iterations": 1, "continuation": False, "limits": "none"}
    grid = {"scheme": "galerkin-1", "intervals": 4}
    if intervals == 0:
        with pytest.raises(ChartError):
            hovi.plan(scene, rest, goal, 1.0, **grid, **once)
        return
    found = hovi.plan(scene, rest, goal, 1.0, **grid, **once).trajectory.grid.intervals
    assert found == intervals or 2 * turns < found <= 2_000

"""Jobs: intervals are halved until charts hold the orientations of a guess, and not for ever."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from hovi import PlanOptions
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.errors import ChartError
from hovi.planning.search.job import Job, split_for_charts
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.manifold_robots import chain


@pytest.mark.parametrize(("turns", "intervals"), [(0, 4), (30, None), (3_000, 0)])
def test_a_guess_of_many_turns_is_split_up_to_two_thousand_intervals(
    turns: int, intervals: int | None
) -> None:
    """Of less than half a turn each."""
    scene = Scene(load_robot(chain([pin.JointModelSpherical()])))
    rest = np.array([0.0, 0.0, 0.0, 1.0])
    name = scene.robot.joint_names[0]
    goal = State(rest, turns={name: [0, 0, turns]})
    grid = Grid.uniform(1.0, 4, galerkin(1))
    job = Job(scene, grid, State(rest), goal, PlanOptions(limits="none"))
    if intervals == 0:
        with pytest.raises(ChartError):
            split_for_charts(job, "cubic")
        return
    found = split_for_charts(job, "cubic").grid.intervals
    assert found == intervals or 2 * turns < found <= 2_000

"""Points of a central path from which a nearby problem is solved."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi.discrete.grid import DiscretePath
from hovi.planning.solver.central_path import FARTHEST, CentralPath
from hovi.robot.robot import Robot


def moved(path: DiscretePath, by: float) -> DiscretePath:
    q = path.q.copy()
    q[1, 0] += by
    return dataclasses.replace(path, q=q)


@pytest.mark.parametrize(
    ("distances", "chosen"),
    [
        ([0.2, 0.5, 0.8], 1),
        ([0.2, 2.0, 0.8], 2),
        ([0.2, 2.0, 2.0], 3),
        ([0.2, -2.0, 0.0], 2),
        ([2.0, 0.5, 0.5], 1),
    ],
)
def test_the_point_to_begin_at_is_close_to_the_solution(
    two_link: Robot, distances: list[float], chosen: int
) -> None:
    """distances: of points of the levels 1e-1, 1e-2 and 1e-3 from the solution, in FARTHEST."""
    none = np.zeros((1, 2, 2))
    path = DiscretePath(np.zeros((2, 2)), np.zeros((2, 2)), none, none)
    levels = 1e-1, 1e-2, 1e-3, 1e-6
    paths = [moved(path, FARTHEST * each) for each in (*distances, 0.0)]
    central = CentralPath(tuple(zip(levels, paths, strict=True)), None)
    assert central.at(5e-3)[0] == levels[1]
    level, found = central.close(5e-3, two_link)
    assert (level, found) == (levels[chosen], paths[chosen])

"""`advance` goes on with its own motion, however many inner modes the rest of it has."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.schemes import galerkin

MODES = ([3] * 2 + [2] * 8, [6] + [2] * 9, [2] * 3 + [5] * 2 + [1] * 5)


@pytest.fixture(scope="module", params=MODES, ids=str)
def planned(request: pytest.FixtureRequest) -> hovi.Solution:
    scene = hovi.Scene(
        hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()], compile=False
    )
    grid = hovi.Grid(np.full(10, 0.1), tuple(map(galerkin, request.param)))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.solve(hovi.TrajectoryProblem(ld, hovi.State([0, 0]), hovi.State([0.3, 0.7])))


@pytest.mark.parametrize("time", [0.05, 0.25, 0.55, 0.85])
def test_the_rest_of_a_motion_is_the_motion(planned: hovi.Solution, time: float) -> None:
    rest = planned.advance(time)
    assert rest.success, rest.message
    t = np.linspace(0.0, 1.0 - time, 200)
    np.testing.assert_allclose(
        rest.trajectory.sample(t).q, planned.trajectory.sample(t + time).q, atol=1e-4
    )


def test_a_chain_of_advances_reaches_the_goal(planned: hovi.Solution) -> None:
    found = planned
    for _ in range(9):
        found = found.advance(0.1)
        assert found.success, found.message
    np.testing.assert_allclose(found.trajectory.q[-1], [0.3, 0.7], atol=1e-9)

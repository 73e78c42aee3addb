"""A robot that rests at an equilibrium under gravity is a minimum without cost, however long."""

from __future__ import annotations

import numpy as np
import pytest

import hovi

HANGING, UPRIGHT, FOLDED = [-np.pi / 2, 0.0], [np.pi / 2, 0.0], [np.pi / 2, np.pi]


def two_link(*passive: str) -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [hovi.effects.Gravity()], passive=passive)


@pytest.mark.parametrize("T", [8.0, 1e3])
@pytest.mark.parametrize("rest", [HANGING, UPRIGHT, FOLDED])
@pytest.mark.parametrize("passive", [(), ("shoulder",), ("elbow",)])
def test_rest_is_a_minimum_on_one_grid(
    passive: tuple[str, ...], rest: list[float], T: float
) -> None:
    """Torques are the rounding errors of gravity's, which no step removes."""
    scene = two_link(*passive)
    found = hovi.plan(scene, rest, rest, T, limits="none", intervals=24, self_collision=False)
    assert (found.status, found.n_neg) == ("minimum", 0)
    assert found.nit <= 2
    assert found.cost < 1e-20
    assert np.allclose(found.trajectory.q, rest, atol=1e-6)


@pytest.mark.parametrize("passive", [(), ("shoulder",), ("elbow",)])
def test_rest_is_within_its_tolerance_at_once(passive: tuple[str, ...]) -> None:
    """The grid is not refined for rounding errors of a cost that is zero."""
    found = hovi.plan(two_link(*passive), FOLDED, FOLDED, 100.0, self_collision=False)
    assert found.status == "minimum"
    assert found.error_estimate is not None
    assert found.error_estimate < 1e-3
    assert found.trajectory.grid.intervals <= 16


@pytest.mark.parametrize("passive", ["shoulder", "elbow"])
def test_small_motions_near_an_equilibrium_cost_what_a_linear_system_does(passive: str) -> None:
    """Costs are squares of displacements far below those whose torques count as none."""
    costs = []
    for size in (1e-3, 1e-5):
        away = hovi.State(np.array(HANGING) + size, free=[passive], free_velocity=[passive])
        found = hovi.plan(
            two_link(passive), HANGING, away, 3.0, limits="none", self_collision=False
        )
        assert found.success, found.message
        costs.append(found.cost / size**2)
    assert costs[0] > 0
    assert np.isclose(*costs, rtol=1e-2)

"""The last check of a motion, where everything before it is blind or was asked for less."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.solver.methods import bounded_search
from hovi.planning.solver.outcome.judge import judged

Array = npt.NDArray[np.float64]
MOST = 6.0
"""The largest torque, in [N m]."""
HANGING, UPWARDS = [-1.57, 0.0], [1.57, 0.0]


@pytest.fixture(scope="module")
def limited(arm_scene: hovi.Scene) -> hovi.Solution:
    return hovi.plan(arm_scene, HANGING, UPWARDS, 1.5, limits={"tau": MOST})


@pytest.fixture
def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search within limits that does not look at torques between its points."""

    def none(motion: Trajectory, limits: Limits, chosen: object) -> tuple[Array, Array]:
        nothing = np.full((motion.grid.intervals, *limits.lower.shape), -np.inf)
        return nothing, nothing

    monkeypatch.setattr(bounded_search, "excess_of", none)


def over(solution: hovi.Solution) -> float:
    """The largest excess of a torque at 20,001 samples, in [N m]."""
    motion = solution.trajectory
    tau = motion.sample(np.linspace(0.0, motion.duration, 20_001)).tau
    return float(np.abs(tau).max() - MOST)


CALLS: dict[str, Callable[[hovi.Solution], hovi.Solution]] = {
    "plan": lambda known: hovi.plan(
        known.trajectory.scene, HANGING, UPWARDS, 1.5, limits={"tau": MOST}, intervals=8
    ),
    "solve": lambda known: hovi.solve(known.problem),
    "replan": lambda known: known.replan(goal=[1.3, 0.2]),
    "advance": lambda known: known.advance(0.05, goal=[1.3, 0.2]),
}


@pytest.mark.usefixtures("blind")
@pytest.mark.parametrize("call", CALLS)
def test_what_a_blind_search_finds_is_no_success(limited: hovi.Solution, call: str) -> None:
    found = CALLS[call](limited)
    assert over(found) > 1e-3
    assert not found.success
    assert not found.usable
    assert "torque" in found.message


@pytest.mark.parametrize("kind", ["q", "v", "a", "tau"])
def test_a_motion_beyond_narrower_limits_is_no_success(limited: hovi.Solution, kind: str) -> None:
    assert limited.success
    motion = limited.trajectory
    most = np.abs(getattr(motion.sample(np.linspace(0.0, 1.5, 500)), kind)).max(axis=0)
    narrower = as_limits(motion.robot, {"base": "none", kind: (0.9 * most).tolist()})
    problem = dataclasses.replace(limited.problem, limits=narrower)
    found = judged(dataclasses.replace(limited, problem=problem))
    assert not found.success
    assert found.status == "unresolved"
    assert not found.usable

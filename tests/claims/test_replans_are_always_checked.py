"""What follows a motion that is no success is checked as a first plan is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

import hovi

START, GOAL, OTHER = [0.3, -0.2], [2.5, 1.5], [2.4, 1.4]
FEW = {"intervals": 3, "scheme": "galerkin-2", "limits": "none"}


def problem_of(scene: hovi.Scene) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(5.0, 3, hovi.schemes.galerkin(inner_modes=2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, start=hovi.State(START), goal=hovi.State(GOAL))


SOLVED: dict[str, Callable[[hovi.Scene], hovi.Solution]] = {
    "unresolved": lambda scene: hovi.plan(scene, START, GOAL, 5.0, **FEW),
    "iteration_limit": lambda scene: hovi.plan(scene, START, GOAL, 5.0, max_iterations=2, **FEW),
    "time_limit": lambda scene: hovi.plan(scene, START, GOAL, 5.0, time_limit=1e-3, **FEW),
    "in segments": lambda scene: hovi.plan_sequence(
        scene, START, [hovi.Segment([1.0, 0.4], 2.0), hovi.Segment(GOAL, 3.0)], **FEW
    ),
    "of solve": lambda scene: hovi.solve(problem_of(scene)),
}
AGAIN: dict[str, Callable[[hovi.Solution], hovi.Solution]] = {
    "unchanged": lambda base: base.replan(),
    "to another goal": lambda base: base.replan(goal=OTHER),
    "twice": lambda base: base.replan(goal=OTHER).replan(goal=GOAL),
    "in time": lambda base: base.replan(time_limit=5.0),
    "from a time on": lambda base: base.advance(0.5),
    "from two times on": lambda base: base.advance(0.5).advance(0.3),
}


def effort(motion: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 by pin.rnea along the curve."""
    model = motion.scene.robot.model
    data, times = model.createData(), np.linspace(0.0, motion.duration, 4001)
    along = motion.sample(times)
    tau = [pin.rnea(model, data, *jet) for jet in zip(along.q, along.v, along.a, strict=True)]
    return float(np.trapezoid(0.5 * np.square(tau).sum(axis=1), times))


@pytest.mark.parametrize("again", AGAIN)
@pytest.mark.parametrize("solved", SOLVED)
def test_a_success_costs_what_its_torques_do(solved: str, again: str) -> None:
    """Three intervals show the solver a twentieth to a third of the effort of this swing."""
    scene = hovi.Scene(hovi.load_robot("double_pendulum"), [hovi.effects.Gravity()])
    base = SOLVED[solved](scene)
    found = AGAIN[again](base)
    assert not found.success or found.cost == pytest.approx(effort(found.trajectory), rel=0.05)
    assert found.status not in ("minimum", "stationary") or found.success

"""Rounds of an augmented Lagrangian: minimise, correct the multipliers, minimise again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.trust_region import Stop
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.multipliers import Multipliers, Residuals

TORQUE_PENALTY = 10.0
"""First penalty of a passive joint's torque, relative to the mean weight of the others."""
NEARLY = 0.1
"""The same as TORQUE_SHARE for a guess that is a solution nearby, and keeps its passive joints."""
WARM = 1e3
"""Factor of the first penalty for such a guess."""
NODE_PENALTY = 1e3
"""First penalty of conditions at nodes, relative to the cost, per [rad^2] or [m^2]."""
GROWTH = 10.0
"""Factor of a penalty whose equations fall too slowly."""
FALL = 0.1
"""Share of the last round's residual above which they do."""
LARGEST = 1e9
"""Largest penalty, relative to the first."""
ROUNDS = 60
"""Rounds before giving up."""
TORQUE_SHARE = 1e-10
"""Torque of a passive joint that counts as none, as a share of the largest torque."""
NODE_MISS = 1e-11
"""Residual of a condition that counts as met, in [rad] or [m]."""
CLOSE = 1e-6
"""The same for a round whose residuals rounding keeps from falling further."""
FIRST_DECREASE = 1e-3
"""Relative decrease that a first round may leave; later rounds leave what their residual allows."""


class Minimized(Protocol):
    """Where one round ended."""

    x: DiscretePath
    stop: Stop


Result = TypeVar("Result", bound=Minimized)


@dataclass(frozen=True, eq=False)
class Satisfied(Generic[Result]):
    """Where the rounds ended.

    result: of the last round. multipliers: those of that round, or the next ones where the number
    of rounds ended it. reason: why the equations cannot be met,
    in a sentence without its end, or "".
    """

    result: Result
    multipliers: Multipliers
    residuals: Residuals
    reason: str = ""

    @property
    def met(self) -> bool:
        """Whether the equations hold to working precision."""
        return within(self.residuals, TORQUE_SHARE, NODE_MISS)


def satisfy(
    problem: TrajectoryProblem,
    path: DiscretePath,
    minimize: Callable[[Multipliers, DiscretePath, float], Result],
    known: Multipliers | None = None,
) -> Satisfied[Result]:
    """Minimise under the problem's equations.

    minimize: a minimum of the augmented Lagrangian with given multipliers, from a path, to a
        relative decrease.
    known: multipliers of a problem nearby.
    """
    multipliers = known or first_multipliers(problem, path)
    first = multipliers
    decrease = FIRST_DECREASE
    last = np.inf, np.inf
    for _ in range(ROUNDS):
        result = minimize(multipliers, path, decrease)
        path = result.x
        residuals = ActionObjective(problem, multipliers=multipliers).residuals(path)
        sizes = residuals.torque_share, residuals.node_miss
        if result.stop is not Stop.STATIONARY or within(residuals, TORQUE_SHARE, NODE_MISS):
            break
        slow = [
            size > max(FALL * before, 0.1 * met)
            for size, before, met in zip(sizes, last, (TORQUE_SHARE, NODE_MISS), strict=True)
        ]
        if _stiffest(multipliers, first, slow):
            break
        multipliers = multipliers.updated(residuals, problem.passive)
        multipliers = multipliers.stiffer(*(GROWTH if each else 1.0 for each in slow))
        decrease = float(np.clip(max(sizes) ** 2, 1e-12, FIRST_DECREASE))
        last = sizes
    reason = ""
    if result.stop is Stop.STATIONARY and not within(residuals, CLOSE, CLOSE):
        reason = unmet_sentence(problem, path, residuals)
    elif result.stop is Stop.STATIONARY:
        reason = _elsewhere(problem, path)
    return Satisfied(result, multipliers, residuals, reason)


def first_multipliers(problem: TrajectoryProblem, path: DiscretePath) -> Multipliers:
    """None, with penalties that suit the weights of the torques and the cost of a path."""
    weights = np.delete(problem.ld.lagrangian.output_weight, problem.passive)
    weight = float(weights.mean()) if len(weights) > 0 else 1.0
    cost = max(abs(problem.ld.action(path)), 1e-6)
    none = Multipliers.zero(problem, TORQUE_PENALTY * weight, NODE_PENALTY * cost)
    share = ActionObjective(problem, multipliers=none).residuals(path).torque_share
    return none.stiffer(WARM, 1.0) if share <= NEARLY else none


def within(residuals: Residuals, torque_share: float, node_miss: float) -> bool:
    """Whether passive torques and conditions at nodes fail by no more than that."""
    return residuals.torque_share <= torque_share and residuals.node_miss <= node_miss


def _stiffest(now: Multipliers, first: Multipliers, slow: list[bool]) -> bool:
    """Whether a penalty that would have to grow has grown as far as it may."""
    grown = now.torque_penalty / first.torque_penalty, now.node_penalty / first.node_penalty
    return any(each and size >= LARGEST for each, size in zip(slow, grown, strict=True))


def _elsewhere(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """Which condition is met by what it does not mean, or ""."""
    for each in problem.conditions:
        q, v = path.q[each.node], path.v[each.node]
        if each.condition.elsewhere(q, v):
            return (
                f"the motion ends turned over at t = {problem.grid.t[each.node]:.4g} s: "
                f"{each.condition.describe(q, v)}; plan again from another guess"
            )
    return ""


def unmet_sentence(problem: TrajectoryProblem, path: DiscretePath, residuals: Residuals) -> str:
    """Which equation fails most."""
    if residuals.torque_share > CLOSE or not problem.conditions:
        joints = ", ".join(repr(joint) for joint in problem.scene.passive)
        return (
            f"no motion was found on which joint {joints} carries no torque: it still takes "
            f"{residuals.torque_share:.3g} of the largest torque; allow more time or another goal"
        )
    worst = max(
        zip(problem.conditions, residuals.nodes, strict=True),
        key=lambda pair: float(np.max(np.abs(pair[1]), initial=0.0)),
    )[0]
    missed = worst.condition.describe(path.q[worst.node], path.v[worst.node])
    return (
        f"what is asked at t = {problem.grid.t[worst.node]:.4g} s cannot be met: {missed}; ask for "
        "less, or plan again from another guess"
    )

"""What is said of a motion as a guess: what it was planned with, and that it is far."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from hovi.checks.kinds import shown
from hovi.discrete.output.caution import LEFT_OUT, Caution
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem

FAR = 0.5
"""Change from which a guess is far: of the duration, or of an end relative to the way from the
guess's start to its end, or to its farthest point if it ends where it starts. Of 29 swing-ups from
such guesses 12 cost 1.2 to 265 times as much as without one, and of 114 from nearer ones 4 cost 1.4
to 4.3 times as much."""


def cautions_of_guess(
    guess: Trajectory, problem: TrajectoryProblem, found: Trajectory
) -> Iterator[Caution]:
    """What a plan leaves out of its guess, and that it is far from what was asked."""
    missing = _left_out(guess, problem)
    if missing:
        yield Caution(
            LEFT_OUT,
            f"The guess was planned with {', '.join(map(shown, missing[:5]))}, which this plan "
            "leaves out: give the conditions and limits again.",
        )
    if is_far(guess, problem, found):
        yield Caution(
            LEFT_OUT,
            "The guess is far from this task, and another motion may cost much less than the one "
            "near it: compare with a plan without the guess.",
        )


def _left_out(guess: Trajectory, problem: TrajectoryProblem) -> list[str]:
    """The names of conditions and limits of a guess, untrusted, that the problem has none of."""
    limits, asked = guess.metadata.get("limits"), guess.metadata.get("conditions")
    named = limits.get("conditions") if isinstance(limits, Mapping) else None
    known = {each.name for each in (*problem.conditions, *problem.bounds)}
    return [
        each
        for names in (asked, named)
        for each in (names if isinstance(names, list | Mapping) else ())
        if isinstance(each, str) and each not in known
    ]


def is_far(guess: Trajectory, problem: TrajectoryProblem, found: Trajectory) -> bool:
    """Whether the duration or an end of a guess differs by FAR from those of the motion found."""
    times = guess.grid.duration, found.grid.duration
    if max(times) > (1.0 + FAR) * min(times):
        return True
    on = problem.coordinates
    if guess.q.shape[1] != on.nq:
        return False
    path = np.abs(on.difference(np.broadcast_to(guess.q[0], guess.q.shape), guess.q)).max(axis=1)
    moved = on.difference(guess.q[[0, -1]], found.q[[0, -1]])
    return bool(np.abs(moved).max() > FAR * (path[-1] or path.max()))

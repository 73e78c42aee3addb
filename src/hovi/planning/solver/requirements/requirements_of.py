"""The requirements of a problem, in the order in which a motion is held against them."""

from __future__ import annotations

from collections.abc import Iterator

from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.requirements.asked import Asked
from hovi.planning.solver.requirements.distances import Apart
from hovi.planning.solver.requirements.ends import Ends
from hovi.planning.solver.requirements.limits import WithinLimits
from hovi.planning.solver.requirements.nodes import Nodes
from hovi.planning.solver.requirements.passive_joints import PassiveJoints
from hovi.planning.solver.requirements.requirement import Requirement


def requirements_of(problem: TrajectoryProblem) -> Iterator[Requirement]:
    """All that a problem requires of a motion."""
    yield Ends(problem)
    yield from requirements_between_ends(problem)


def requirements_between_ends(problem: TrajectoryProblem) -> Iterator[Requirement]:
    """What a problem requires of a motion that has its ends."""
    if len(problem.passive) > 0:
        yield PassiveJoints(problem)
    if problem.equations:
        yield Nodes(problem)
    if problem.limits is not None and problem.has_limits:
        yield WithinLimits(problem.limits, problem.coordinates)
    if problem.bounds:
        yield Asked(problem.bounds)
    if problem.clearance is not None:
        yield Apart(problem, problem.clearance)

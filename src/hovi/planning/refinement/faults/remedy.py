"""What to do about a motion that its grid does not resolve."""

from __future__ import annotations

from hovi.planning.refinement.faults.narrow_features import NARROW
from hovi.planning.refinement.spinning import spin
from hovi.planning.solver.solver import Solution


def remedy(solution: Solution, reason: str) -> str:
    """Against narrow features or a joint that spins, else with the grid or the search; a clause.

    reason: why the motion is not resolved.
    """
    if NARROW in reason:
        return "make them wider, or give more intervals"
    spinning = spin(solution)
    if spinning is not None:
        return str(spinning)
    if solution.accuracy is None:
        return (
            "use more intervals or a scheme with more modes, or name neither, so that plan chooses"
        )
    limited = solution.problem is not None and solution.problem.has_limits
    way = "try" if limited else "set limits or try"
    return f"{way} another initial guess, more starts or smooth"

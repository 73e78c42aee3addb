"""The motion of a method's result."""

from __future__ import annotations

from typing import Any

from hovi.discrete.trajectory import Trajectory
from hovi.planning.solver.limits.row_forces import at_instants
from hovi.planning.solver.methods.method import MethodResult
from hovi.planning.solver.nodal_momenta import accumulated_momenta


def motion_of(result: MethodResult) -> Trajectory:
    """The motion with its momenta and metadata."""
    problem = result.problem
    metadata: dict[str, Any] = {
        "cost": result.cost,
        "status": str(result.status),
        "n_neg": result.n_neg,
    }
    if problem.limits is not None and problem.limited:
        parts = problem.limits.with_excused_parts.parts
        if parts:  # under another name: `limits` are those of the whole motion
            metadata["segment_limits"] = [each.to_dict() for each in parts]
        else:
            metadata["limits"] = problem.limits.to_dict()
    if problem.clearance is not None and problem.clearance.wanted:
        metadata["clearance"] = problem.clearance.to_dict()
    ld = at_instants(problem, result.instants).ld
    derivatives = ld.derivatives(result.path, result.forces, result.jets)
    momenta = accumulated_momenta(derivatives)
    return problem.motion(result.path, momenta, metadata)

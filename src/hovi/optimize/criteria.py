"""When a minimisation ends: tolerances, and limits on steps and time."""

from __future__ import annotations

import dataclasses

from hovi.system.dataclass import dataclass

ROOM = 2e-7
"""Distance by which bounds are moved inwards while a nearby solution is followed, and by which
outputs may miss them at the end, relative to the range."""
MAX_ITERATIONS = 500
"""Maximum number of steps of a solve where none is given."""
ROUGH_BARRIER, ROUGH_DECREASE = 1e-2, 1e-3
"""Last barrier parameter of a rough solve, relative to the mean density of the objective, and the
predicted decrease at which it ends, relative to the value."""


@dataclass(frozen=True)
class Criteria:
    """When a minimisation ends, and what it aims at on the way.

    decrease: stop when a Newton step predicts a smaller decrease, relative to the value; what
        remains after it is of the order of its square.
    step: stop when a Newton step is smaller than this, relative to the data.
    max_iterations: number of steps, rejected ones included. time_limit: in [s], or None.
    radius: first radius of the trust region, in the metric; with bounds: Program.radii.
    escape_saddles: leave a saddle along negative curvature; False stops there.
    exact: stop only where rounding alone remains, after a Newton step of an exact model.
    barrier: its last parameter, relative to the mean density of the objective.
    enough: with bounds, stop within them where a whole Newton step predicts a smaller decrease,
        relative to the value, even if it would be cut short.
    stalled: without bounds, stop where some steps decrease the value by a smaller fraction.
    """

    decrease: float = 1e-11
    step: float = 1e-13
    max_iterations: int = MAX_ITERATIONS
    time_limit: float | None = None
    radius: float = 10.0
    escape_saddles: bool = True
    exact: bool = False
    barrier: float = 1e-10
    enough: float = 0.0
    stalled: float = 0.0

    def rough(self) -> Criteria:
        """The same for a solve that is to come near a solution only."""
        return dataclasses.replace(self, barrier=ROUGH_BARRIER, decrease=ROUGH_DECREASE)

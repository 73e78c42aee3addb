"""The columns of plans.parquet, and the row of a plan."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import Any, Self

from hovi.system.dataclass import dataclass

REFUSED, UNREACHABLE, FAILED = "refused", "unreachable", "failed"
"""What became of a cell that was not planned: its scene is invalid, no configuration reaches its
goal, or an error that hovi does not raise on purpose."""


@dataclass(frozen=True)
class PlanRow:
    """The result of a plan, without what depends on the machine or the time.

    status: of the Solution, or one of the words above. success, reason: of the Solution.
    warnings: what was warned of, in one text. cautions: of the motion, each after its word and a
        colon. excused: which limits the start exceeds, each as a text. Both are None in plans by
        earlier versions.
    cost, effort, error_estimate, nit, n_neg: of the Solution.
    duration: of the motion, in [s]. intervals: of its grid.
    peak_v, peak_a, peak_tau: largest |v|, |a| and |tau| of each joint.
    margin: the smallest distance to a limit, as a fraction of its range; negative beyond one, None
        without limits. least_distance: to obstacles and between links, in [m], None without.
    q_start, q_goal: first and last configuration.
    reproducible: False if the time that a plan takes on this machine may have changed it.
    parent: the key of the plan from whose motion it started; None for its own guess.
    version: of hovi.
    """

    status: str
    success: bool = False
    reason: str = ""
    warnings: str = ""
    cautions: list[str] | None = None
    excused: list[str] | None = None
    cost: float | None = None
    effort: float | None = None
    error_estimate: float | None = None
    nit: int | None = None
    n_neg: int | None = None
    duration: float | None = None
    intervals: int | None = None
    peak_v: list[float] | None = None
    peak_a: list[float] | None = None
    peak_tau: list[float] | None = None
    margin: float | None = None
    least_distance: float | None = None
    q_start: list[float] | None = None
    q_goal: list[float] | None = None
    reproducible: bool = True
    parent: str | None = None
    version: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Any) -> Self:
        """From JSON. Raises TypeError or KeyError for anything else."""
        known = {"cautions": None, "excused": None} | data
        return cls(**{each.name: known[each.name] for each in fields(cls)})

"""Task: all that a person says before a motion can be planned."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.tolerance import Tolerance
from hovi.scene.scene import Scene
from hovi.schemes import by_name

MOST_INTERVALS = 1_000_000


@dataclass(frozen=True, eq=False)
class Task:
    """A planning task, valid once built.

    scene: the robot and the effects that act on it.
    start, goal: the two ends of the motion, q in [rad] or [m], v per second; the goal may be one
        of a frame. via: what the motion passes through.
    duration: length of the motion, in [s], or the bounds of a free one. time_weight: cost of a
        second of a free duration.
    scheme: name of the scheme, as in `hovi.schemes.by_name`.
    intervals: number N of intervals of equal length.
    starts: number of guesses that are tried.
    seed: seed of the random guesses.
    limits: what `hovi.plan` takes: "urdf", "none", a Limits, or a mapping as as_limits takes it.
    clearance: what the robot keeps away from.
    tolerance: what `hovi.plan` takes: in place of the scheme, the error that is allowed.
    name: what the task is called in reports.
    """

    scene: Scene
    start: State
    goal: State | FrameGoal
    duration: float | tuple[float, float]
    scheme: str = "galerkin-2"
    intervals: int = 16
    starts: int = 1
    seed: int = 0
    limits: str | Limits | Mapping[str, Any] = "urdf"
    tolerance: float | str | None = None
    name: str = "task"
    via: tuple[Via, ...] = ()
    time_weight: float = 0.0
    clearance: Clearance = field(default_factory=Clearance)

    def __post_init__(self) -> None:
        """Refuse numbers that make no task, limits that do not fit, and unknown schemes."""
        ends = self.duration if isinstance(self.duration, tuple) else (self.duration,)
        if not all(math.isfinite(each) and each > 0 for each in ends):
            raise InputError(f"duration must be a positive number of seconds, not {self.duration}.")
        if not 1 <= self.intervals <= MOST_INTERVALS:
            raise InputError(
                f"intervals must be from 1 to {MOST_INTERVALS:,}, not {self.intervals}."
            )
        if self.starts < 1:
            raise InputError(f"starts must be 1 or more, not {self.starts}.")
        if self.seed < 0:
            raise InputError(f"seed must be 0 or more, not {self.seed}.")
        as_limits(self.scene.robot, self.limits)
        by_name(self.scheme)
        if self.tolerance is not None:
            Tolerance.of(self.tolerance, self.scene.robot)

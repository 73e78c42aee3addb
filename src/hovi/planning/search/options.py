"""The options of a plan: every one is named, explained, given its default and checked here."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.planning.clearance.clearance import DEFAULT_MARGIN, Clearance
from hovi.planning.clearance.obstacles import Obstacle
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.problem.values import seconds
from hovi.planning.search.option_fields import (
    SceneKey,
    explain,
    keep_whole_numbers,
    option,
    require_known,
    whole_number,
)
from hovi.robot.robot import Robot
from hovi.schemes import Scheme, by_name

MOST_INTERVALS = 1_000_000
_CLEARANCE = ("obstacles", "margin", "self_collision")


def _always(options: PlanOptions) -> bool:
    return True


def _where_kept(options: PlanOptions) -> bool:
    return options.clearance.wanted


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanOptions:
    """How a motion is planned: what `hovi.plan` takes by keyword. Valid once built.

    {options}
    Raises InputError, or SchemeError for an unknown scheme.
    """

    time_weight: float = option(
        0.0,
        "cost per [s] of a duration that is free.",
        SceneKey("a number, 0 or more: the cost of a second"),
        least=0,
    )
    via: Sequence[Via] = option((), "what the motion passes through at given times.")
    scheme: str | Scheme = option(
        "galerkin-2", "how the action is discretised: a name as by_name takes it, or a Scheme."
    )
    intervals: int = whole_number(
        16, "N of equal length; limits may split them.", least=1, most=MOST_INTERVALS
    )
    limits: str | Limits | Mapping[str, Any] = option(
        "urdf",
        'on q, v, a and tau, holding everywhere along the motion: "urdf" (those of the URDF), '
        '"none", a Limits, or a mapping as as_limits takes it.',
    )
    starts: int = whole_number(
        1,
        "number of solves from seeded random perturbations; all minima found are refined on the "
        "grid that was asked for and ranked after that.",
        least=1,
        key=SceneKey("a whole number, 1 or more", written=_always),
    )
    seed: int = whole_number(
        0,
        "of the perturbations.",
        least=0,
        key=SceneKey("a whole number, 0 or more", written=_always),
    )
    tolerance: float | str | Tolerance | None = option(
        None,
        "the largest error over the whole motion, in place of a scheme: a number is relative in "
        'the cost, "0.1 mm" at the robot\'s tip_frame, "0.1 mm at tool0" at another frame, '
        '"0.01 deg" or "1e-4 rad" in the joints. The grid to begin with has the `intervals`, up '
        "to 60, or two thirds of them where nothing makes kinks; the solution's `accuracy` says "
        "what was reached.",
    )
    obstacles: Sequence[Obstacle] = option(
        (),
        "what the robot's collision shapes keep a distance of `margin` from, all along the "
        "motion: hovi.Sphere, hovi.Capsule and hovi.Box.",
    )
    margin: float = option(
        DEFAULT_MARGIN,
        "the distance that is kept, in [m]: see Clearance.",
        SceneKey("a length of 0 or more, in metres", written=_where_kept),
        least=0,
    )
    self_collision: bool = option(
        False,
        "whether the robot's links keep that distance from each other, too.",
        SceneKey("true or false", written=_where_kept),
    )
    guess: str | Trajectory = option("cubic", '"cubic", "minimum-jerk" or a Trajectory.')
    turns: Mapping[str, int | Sequence[int]] | None = option(
        None, "full turns that the guess makes on top of the shortest way, by joint: see State."
    )
    weight: npt.ArrayLike | None = option(
        None, "weight of each joint's torque in the cost, shape (nv,)."
    )
    max_iterations: int = whole_number(
        500,
        "of one solve; with limits of every round of it, of which a small number only makes more.",
        least=1,
    )
    time_limit: float | str | None = option(
        None, 'of everything, in [s] or as "2 min"; returns the best so far.'
    )
    processes: int | None = whole_number(
        None, "for the starts; all processors by default.", least=1
    )
    continuation: bool = option(
        True,
        "where no start ends in a minimum, solve easier problems that lead to this one, in "
        "inertia, gravity, duration, intervals and limits; the message says which led there.",
    )

    def __post_init__(self) -> None:
        keep_whole_numbers(self)
        via, most = self.via, self.most_seconds
        if not isinstance(via, Sequence) or not all(isinstance(each, Via) for each in via):
            raise InputError(f"via is a list of hovi.Via(time, goal), not {via!r}.")
        if most is not None and not most > 0:
            raise InputError(f"time_limit must be positive, in seconds, got {self.time_limit}.")
        object.__setattr__(self, "via", tuple(via))
        object.__setattr__(self, "obstacles", self.clearance.obstacles)
        expect(self.table, Scheme, "a name such as 'galerkin-2' as the scheme")

    @property
    def most_seconds(self) -> float | None:
        """The time limit, in [s]."""
        return None if self.time_limit is None else seconds(self.time_limit, "time_limit")

    @property
    def table(self) -> Scheme:
        """The scheme as its table."""
        return by_name(self.scheme) if isinstance(self.scheme, str) else self.scheme

    @property
    def scheme_name(self) -> str:
        """The name of the scheme."""
        return self.scheme if isinstance(self.scheme, str) else self.scheme.name

    @cached_property
    def clearance(self) -> Clearance:
        """What the robot keeps away from."""
        return Clearance(self.obstacles, self.margin, self.self_collision)

    def with_changes(self, **changes: Any) -> Self:
        """These options, some of them changed.

        Raises InputError for an unknown option, and what makes no options.
        """
        require_known(type(self), changes)
        options = dataclasses.replace(self, **changes)
        if not changes.keys() & set(_CLEARANCE):  # for which the distances were built already
            options.__dict__["clearance"] = self.clearance
        return options

    def on(self, robot: Robot) -> Self:
        """These options with limits and a tolerance of this robot in the place of their words.

        Raises InputError for what does not fit the robot.
        """
        wanted = None if self.tolerance is None else Tolerance.of(self.tolerance, robot)
        return self.with_changes(limits=as_limits(robot, self.limits), tolerance=wanted)


explain(PlanOptions, PlanOptions)

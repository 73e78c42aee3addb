"""The options of a plan, with their defaults, descriptions and checks."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.units import as_time_limit
from hovi.conditions.asked import as_conditions
from hovi.conditions.condition import Condition
from hovi.discrete.guess import require_guess
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect, nearest
from hovi.optimize.criteria import MAX_ITERATIONS
from hovi.planning.clearance.clearance import DEFAULT_MARGIN, Clearance
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.preparation import prepared_within
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.notation.objective import IN_WORDS, require_objective, with_objective
from hovi.planning.problem.notation.via_points import as_via
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.search.option_fields import (
    SceneKey,
    check_numbers,
    explain,
    option,
    require_known,
    whole_number,
)
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene, without_inertia
from hovi.schemes import Scheme, by_name
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.conditions.kept.keep import Keep
    from hovi.planning.obstacles.grasped import Grasped

DEFAULT_TOLERANCE = 1e-3
"""Relative tolerance of the cost if neither scheme, intervals nor tolerance are named."""
DEFAULT_SCHEME = "galerkin-2"
"""Scheme if only the intervals are named."""
LIMITED_SCHEME = "galerkin-2x8"
"""The same for a motion with limits."""
DEFAULT_INTERVALS = 16
"""Number of intervals if only the scheme is named, and of the first grid of a refinement."""
TOLERANCE_AND_SCHEME = "tolerance chooses the scheme and the intervals; leave them out."
"""The message where a tolerance and a scheme are given together."""
INTERVALS_TWICE = "`intervals` and `scheme.intervals` are the same: leave one of them out."
"""The message where the number of intervals is given twice."""
MAX_INTERVALS = 1_000_000
"""Maximum number of intervals that may be requested."""
MAX_CYCLES = 1_000
"""Largest number of repetitions of a cycle."""
_CHECKED_HERE = (
    *(
        "repeat",
        "via",
        "conditions",
        "keep",
        "scheme",
        "intervals",
        "starts",
        "seed",
        "obstacles",
        "grasped",
    ),
    *("margin", "max_iterations", "time_limit", "processes"),
)
"""Options whose own checks say more than their annotations."""
_EXCLUSIVE = "scheme", "tolerance"
"""Options of which at most one may be given."""
_CLEARANCE_OPTIONS = ("obstacles", "grasped", "margin", "self_collision")


def _always(options: PlanOptions) -> bool:
    return True


def _if_clearance(options: PlanOptions) -> bool:
    return options.clearance.wanted or options.margin != DEFAULT_MARGIN


@check_arguments_except(*_CHECKED_HERE)
@dataclass(frozen=True, kw_only=True, eq=False)
class PlanOptions:
    """The options of `hovi.plan`, which takes them by keyword. Valid once built.

    {options}
    Raises InputError, or SchemeError for an unknown scheme.
    """

    time_weight: float = option(
        0.0,
        "cost per [s] of a free duration.",
        SceneKey("a number, 0 or more: the cost per second"),
        least=0,
    )
    repeat: int = whole_number(
        1,
        "how often the motion runs its cycle, which is planned once and ends in the state in which "
        "it starts; times are those of one cycle, and the cost is that of all.",
        least=1,
        most=MAX_CYCLES,
        key=SceneKey("a whole number, 1 or more"),
    )
    via: Sequence[Via] = option(
        (), "goals that the motion reaches at given times: Via, or tables as in a scene file."
    )
    conditions: Sequence[Condition[Any, Any]] = option(
        (),
        "hovi.Condition: bounds of functions of q, v, a, tau and t along the whole motion, such as "
        'hovi.Condition("tau * v", hovi.Between(-80, 80), name="power"), or their values at given '
        "times.",
    )
    keep: Sequence[Keep | Mapping[str, Any]] = option(
        (),
        "what the whole motion keeps: members of hovi.conditions, such as "
        'hovi.conditions.Upright("tool0"), or tables as in a scene file.',
    )
    scheme: str | Scheme | None = option(
        None,
        "discretisation of the action: a name as for by_name, or a Scheme. Naming a scheme or a "
        'number of intervals fixes the grid; "galerkin-2" if only `intervals` are named, or '
        '"galerkin-2x8" within limits.',
    )
    intervals: int | None = whole_number(
        None,
        "number of equal intervals; limits may split them. 16 if only a scheme is named.",
        least=1,
        most=MAX_INTERVALS,
    )
    limits: str | Limits | Mapping[str, Any] = option(
        "urdf",
        'bounds on q, v, a and tau along the whole motion: "urdf" (those of the URDF), "soft" '
        '(with those of its safety controllers), "none", the name of an arm of hovi.limit_sets, a '
        "Limits, or a mapping as for as_limits.",
    )
    strict: bool = option(
        False,
        "whether a start outside its limits, or that cannot but leave them, is refused; otherwise "
        "it is led back from up to 2 % beyond, which the solution's `excused` reports.",
        SceneKey("true or false"),
    )
    starts: int = whole_number(
        1,
        "number of solves from seeded random perturbations, with a free duration from others "
        "between its bounds first; the best minima found are refined on the requested grid and "
        "ranked there.",
        least=1,
        key=SceneKey("a whole number, 1 or more", written=_always),
    )
    seed: int = whole_number(
        0,
        "random seed of the perturbations.",
        least=0,
        key=SceneKey("a whole number, 0 or more", written=_always),
    )
    tolerance: float | str | Tolerance | None = option(
        None,
        "the largest error over the whole motion, instead of a scheme: a number is relative to "
        'the cost, "0.1 mm" applies to the robot\'s tip_frames, "0.1 mm at tool0" to another '
        'frame, "0.01 deg" or "1e-4 rad" to the joints. 1e-3 if neither scheme, intervals nor '
        "tolerance are named. The first grid has the `intervals`, up to 60, or two thirds of them "
        "for smooth motions; the solution's `accuracy` reports the estimated error.",
    )
    obstacles: Sequence[Obstacle] = option(
        (),
        "hovi.Sphere, hovi.Box or other obstacles, or tables as in a scene file, from which the "
        "robot's collision shapes keep a distance of `margin` along the whole motion.",
    )
    grasped: Sequence[Grasped] = option(
        (),
        "hovi.Grasped, or tables as in a scene file: objects that links of the robot carry along "
        "the whole motion, with mass, shape, and names of what they may touch.",
    )
    margin: float = option(
        DEFAULT_MARGIN,
        "minimum distance to obstacles, in [m]: see Clearance.",
        SceneKey("a length of 0 or more, in metres", written=_if_clearance),
        least=0,
    )
    self_collision: bool | None = option(
        None,
        "whether the robot's links keep this distance from each other, too: if None, wherever it "
        "has collision shapes. With False links may meet.",
        SceneKey("true or false"),
    )
    guess: str | Trajectory = option(
        "cubic",
        '"cubic", "minimum-jerk" or a Trajectory.',
        SceneKey('"cubic" or "minimum-jerk"'),
    )
    turns: Mapping[str, int | Sequence[int]] | None = option(
        None, "full turns of the guess beyond the shortest path, by joint: see State."
    )
    weight: npt.ArrayLike | None = option(
        None,
        "weight of each joint's torque in the cost, shape (nv,), in place of that of the scene's "
        "effect EffortWeight, if it has one, which the message says then.",
    )
    objective: str = option(
        "effort",
        'what is minimised: "effort", by the effects of the scene as they are; "acceleration" or '
        '"jerk", the integral of half its square, which needs no torques; "time", the least '
        "duration between two bounds. An objective is nothing but effects with their weights, "
        "which `hovi info` prints.",
        SceneKey(IN_WORDS),
    )
    smooth: bool = option(
        False,
        "whether to add a cost on the jerk, whose weight follows from inertia and duration, so "
        "that accelerations are zero at both ends, or as given, and torques are continuous.",
        SceneKey("true or false"),
    )
    group: str | None = option(
        None,
        "a group of joints of the robot's SRDF, which alone move: the others are locked where they "
        "are at the start, and the motion is that of a robot without them.",
    )
    max_iterations: int = whole_number(
        MAX_ITERATIONS,
        "maximum number of steps of a solve; with limits, of each of its rounds.",
        least=1,
        key=SceneKey("a whole number, 1 or more"),
    )
    time_limit: float | str | None = option(
        None,
        'of the whole plan, in [s] or as "2 min"; the best motion so far is returned.',
        SceneKey('a positive number of seconds, or a text such as "2 min"'),
    )
    processes: int | None = whole_number(
        None, "number of processes for the starts; all processors by default.", least=1
    )
    continuation: bool = option(
        True,
        "if no start ends in a minimum and the best one ran out of iterations, go on from its "
        "motion; if none found a way past obstacles within limits, begin with more time. The "
        "message says so.",
        SceneKey("true or false"),
    )

    def __post_init__(self) -> None:
        if isinstance(self.scheme, Mapping):
            self._take_scheme_table(self.scheme)
        check_numbers(self)
        require_objective(self.objective)
        if isinstance(self.guess, str):
            require_guess(self.guess)
        _ = self.time_limit_seconds  # raises for one that is not positive
        via = self.via
        if not isinstance(via, Sequence) or isinstance(via, str):
            raise InputError(f"via must be a list of hovi.Via(time, goal), got {via!r}.")
        object.__setattr__(self, "via", tuple(as_via(each, i) for i, each in enumerate(via)))
        object.__setattr__(self, "conditions", as_conditions(self.conditions))
        if not isinstance(self.keep, tuple) or self.keep:
            from hovi.conditions.kept.kinds import as_kept  # 10 ms

            object.__setattr__(self, "keep", as_kept(self.keep))
        if not isinstance(self.grasped, tuple) or self.grasped:
            from hovi.planning.obstacles.grasped import as_grasped  # 10 ms

            object.__setattr__(self, "grasped", as_grasped(self.grasped))
        object.__setattr__(self, "obstacles", self.clearance.obstacles)
        expect(self.table, Scheme, "a name such as 'galerkin-2' as the scheme")
        if self.tolerance is not None and self.scheme is not None:
            raise InputError(TOLERANCE_AND_SCHEME)

    def _take_scheme_table(self, table: Mapping[str, Any]) -> None:
        """Set scheme and intervals from a table as in a scene file. Raises InputError."""
        for key in table:
            if key not in ("name", "intervals"):
                hint = nearest(str(key), ("name", "intervals"))
                raise InputError(f"unknown key `scheme.{key}`; {hint}")
        if self.intervals is not None and "intervals" in table:
            raise InputError(INTERVALS_TWICE)
        object.__setattr__(self, "scheme", table.get("name"))
        if "intervals" in table:
            object.__setattr__(self, "intervals", table["intervals"])

    @property
    def time_limit_seconds(self) -> float | None:
        """The time limit, in [s]."""
        return as_time_limit(self.time_limit)

    @property
    def names_grid(self) -> bool:
        """Whether a scheme or a number of intervals is named, and no tolerance."""
        named = self.scheme is not None or self.intervals is not None
        return named and self.tolerance is None

    @property
    def table(self) -> Scheme:
        """The scheme as a Scheme, the default one if none is named."""
        scheme = self._scheme
        return by_name(scheme) if isinstance(scheme, str) else scheme

    @property
    def scheme_name(self) -> str:
        """The name of the scheme, or of the default one."""
        return self._scheme if isinstance(self._scheme, str) else self._scheme.name

    @property
    def _scheme(self) -> str | Scheme:
        if self.scheme is not None:
            return self.scheme
        return LIMITED_SCHEME if self._limited else DEFAULT_SCHEME

    @property
    def _limited(self) -> bool:
        """Whether a motion has bounds, between which more points leave it less room."""
        if self.conditions or self.keep:
            return True
        if isinstance(self.limits, Limits):
            return bool(self.limits.bounded.any() or self.limits.conditions)
        return self.limits != "none"

    @property
    def interval_count(self) -> int:
        """The number of intervals, the default one if none is named."""
        return DEFAULT_INTERVALS if self.intervals is None else self.intervals

    @property
    def effective_tolerance(self) -> float | str | Tolerance | None:
        """The tolerance, named or by default; None for a named grid."""
        by_default = self.tolerance is None and not self.names_grid
        return DEFAULT_TOLERANCE if by_default else self.tolerance

    @cached_property
    def clearance(self) -> Clearance:
        """Obstacles and self-collision, with their margin; without it where it is not decided."""
        touching = [(each.name, other) for each in self.grasped for other in each.may_touch]
        with prepared_within(self.time_limit_seconds):
            return Clearance(self.obstacles, self.margin, bool(self.self_collision), touching)

    def with_changes(self, **changes: Any) -> Self:
        """These options with some of them changed; a tolerance replaces a scheme, and vice versa.

        Raises InputError for unknown options and invalid values.
        """
        require_known(type(self), changes)
        options = dataclasses.replace(self, **_withdrawn(changes), **changes)
        if not changes.keys() & set(_CLEARANCE_OPTIONS):  # keep its cached distances
            options.__dict__["clearance"] = self.clearance
        elif self.clearance.during:
            return options.carrying(self.clearance.during)
        return options

    def decided(self, robot: Robot) -> Self:
        """These options with self-collision kept, or not, for a robot with what it holds."""
        if self.self_collision is not None:
            return self
        from hovi.planning.clearance.self_collisions import can_keep_apart  # 10 ms

        kept = can_keep_apart(robot, tuple(self.clearance.may_touch))
        return self.with_changes(self_collision=kept)

    def leaving_out(self, pairs: Sequence[tuple[str, str]]) -> Self:
        """These options with some pairs of links that are not kept apart."""
        if not pairs:
            return self
        options = dataclasses.replace(self)
        clearance = dataclasses.replace(self.clearance, left_out=pairs)
        options.__dict__["clearance"] = clearance
        return options

    def carrying(self, during: Sequence[tuple[str, float, float]]) -> Self:
        """These options with links that are kept clear in parts of the motion: see Clearance."""
        options = dataclasses.replace(self)
        options.__dict__["clearance"] = dataclasses.replace(self.clearance, during=during)
        return options

    def holding(self, scene: Scene) -> Scene:
        """The scene with a robot that holds what is grasped."""
        if not self.grasped:
            return scene
        from hovi.planning.obstacles.grasped import scene_holding  # 10 ms

        return scene_holding(scene, tuple(self.grasped))

    def aiming(self, scene: Scene) -> Scene:
        """The scene with the effects of the objective. Raises InputError as with_objective does."""
        return with_objective(scene, self.objective, self.weight is not None)

    def on(self, scene: Scene) -> Self:
        """These options with limits and tolerance resolved for a scene's robot, with defaults.

        Raises InputError for values that do not fit the robot.
        """
        tolerance, limits = self.effective_tolerance, self.limits_on(scene, self.limits)
        if tolerance is not None:
            tolerance = Tolerance.of(tolerance, scene.robot)
        return self.with_changes(limits=limits, tolerance=tolerance)

    def limits_on(self, scene: Scene, given: Any) -> Limits:
        """Limits of a scene's robot, without those on torques if it has no inertia.

        given: as for `as_limits`. Raises InputError for limits that do not fit the robot.
        """
        order = 3 if self.smooth or self.objective == "jerk" else scene.order
        limits = as_limits(scene.robot, given, order)
        massless = without_inertia(scene) if limits.on_torques or limits.conditions else ""
        for each in limits.conditions:
            if massless and "tau" in each.y.needs:
                raise InputError(
                    f"limits on the {each.name} need torques, and joints of this robot have no "
                    f"inertia ({massless}): leave `{each.name}` out of the limits, or give the "
                    "links their masses."
                )
        return limits.without_torques if massless else limits


def _withdrawn(changes: Mapping[str, Any]) -> dict[str, Any]:
    """The scheme as None if changes name a tolerance but no scheme, and the reverse."""
    named = [name for name in _EXCLUSIVE if changes.get(name) is not None]
    return {name: None for name in _EXCLUSIVE if named and name not in changes}


explain(PlanOptions, PlanOptions)

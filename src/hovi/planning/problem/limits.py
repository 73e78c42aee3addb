"""Limits: bounds on q, v, a and tau, on the jerk and on d tau / dt of every joint coordinate."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, check_arguments_except
from hovi.checks.kinds import shown
from hovi.checks.shapes import require_shape
from hovi.conditions.condition import Inequality, scales, with_function
from hovi.conditions.joint_quantity import QUANTITIES
from hovi.conditions.named import NAMED
from hovi.conditions.sets import Between
from hovi.errors import InputError, nearest, warn
from hovi.planning.problem.arms.limit_set import NAMES as ARMS
from hovi.planning.problem.arms.limit_set import OF_ORDER_3, is_limit_set, limit_set
from hovi.planning.problem.arms.urdf_ranges import position_ranges, require_ranges
from hovi.planning.problem.notation.limit_entries import Base, entries, number_in
from hovi.planning.problem.notation.summaries import LimitsSummary
from hovi.planning.problem.way_back.excused import Excused, widening
from hovi.robot.robot import Robot
from hovi.robot.space.angle_ranges import ranges_in_degrees, speeds_in_degrees
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.segmented_lagrangian import segments_within
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Range = tuple[Array, Array]

KINDS = tuple(QUANTITIES)
"""The limited quantities, in the order of the rows of Limits."""
NAMES = "urdf", "soft", "none", *ARMS
"""Limits that have a name."""
FIRST_KINDS = len(KINDS) - len(OF_ORDER_3)
"""Number of those that motions of order 2 have; the others, which come last, need order 3."""
UNBOUNDED = 1e15
"""Absolute value above which a bound counts as no bound."""
MIN_RANGE = 1e-12
"""Minimum range upper - lower, relative to the bounds where they are larger than one."""
TOLERANCE = 1e-6
"""Fraction of its range by which a limit may be exceeded between the quadrature points."""
WINDOW = 0.05
"""Fraction of a motion in which a start outside its limits is led back, if it can be so slowly."""


@check_arguments
@dataclass(frozen=True, eq=False, repr=False)
class Limits(LimitsSummary):
    """lower <= (q, v, a, tau, jerk, d tau / dt) <= upper; infinite where there is no limit.

    lower, upper: shape (6, nv), one row per kind, in [rad], [rad/s], [rad/s^2], [N m], [rad/s^3]
        and [N m/s] (metres and newtons for sliding joints); or only the first four rows, (4, nv).
        Limits on the jerk and on d tau / dt need a Lagrangian of order 3.
    tolerance: fraction of its range by which a limit may be exceeded anywhere.
    parts, ends: of a motion in segments, see `of_segments`.
    strict: whether a start outside its limits, or that cannot but leave them, is refused.
    window: least fraction of the motion in which it is led back otherwise.
    excused: of a motion, what its start exceeds until when; `TrajectoryProblem` sets it.
    conditions: bounds of other quantities, such as the power, which `as_limits` makes.
    Raises InputError for NaN and for a range that is empty to rounding.
    """

    lower: Array
    upper: Array
    tolerance: float = TOLERANCE
    parts: tuple[Limits, ...] = ()
    ends: tuple[float, ...] = ()
    strict: bool = False
    window: float = WINDOW
    excused: tuple[Excused, ...] = ()
    conditions: tuple[Inequality, ...] = ()

    def __post_init__(self) -> None:
        few = self.lower.shape[:1] == (FIRST_KINDS,)
        require_shape("lower", self.lower, FIRST_KINDS if few else len(KINDS), None)
        require_shape("upper", self.upper, *self.lower.shape)
        if np.isnan(self.lower).any() or np.isnan(self.upper).any():
            raise InputError("a limit is not a number; use -inf or inf for no bound.")
        for k, i in np.argwhere(self._empty):
            raise InputError(
                f"the {QUANTITIES[KINDS[k]]} range of joint coordinate {i} is empty: "
                f"[{self.lower[k, i]:g}, {self.upper[k, i]:g}]; lower must be less than upper."
            )
        if not (np.isfinite(self.tolerance) and self.tolerance > 0):
            raise InputError(f"the tolerance of limits must be positive, got {self.tolerance}.")
        for each in self.conditions:
            if each.name not in NAMED or each.on.varies or len(each.of) != each.y.size:
                raise InputError(
                    f"limits have conditions on the {' and '.join(NAMED)} alone, which `as_limits` "
                    f"makes: give condition {each.name!r} by `conditions`."
                )

    @classmethod
    def of_segments(cls, parts: Sequence[Limits], ends: Sequence[float]) -> Limits:
        """Limits that differ between the segments of a motion.

        lower, upper are then the loosest finite bounds of any segment, in whose ranges an excess is
        measured, and the tolerance the smallest of any.
        parts: of each segment. ends: times at which all but the last end, ascending, in [s].
        Raises InputError for another number of ends, or limits of different sizes.
        """
        if len(parts) == 0 or len(ends) != len(parts) - 1:
            raise InputError(
                f"there must be limits, or None, for each of the {len(ends) + 1} segments, got "
                f"{len(parts)}."
            )
        if any(len(each.kinds) == len(KINDS) for each in parts):
            parts = [_with_all_kinds(each) for each in parts]
        for each in parts:
            require_shape("the limits of a segment", each.lower, *parts[0].lower.shape)
            if each._named_bounds != parts[0]._named_bounds:
                words = " and ".join(sorted({x.name for p in parts for x in p.conditions}))
                raise InputError(
                    f"limits on the {words} must be the same in all segments: give each of them "
                    "the same ones."
                )
        lower = np.stack([each.lower for each in parts])
        upper = np.stack([each.upper for each in parts])
        low = np.min(np.where(np.isfinite(lower), lower, np.inf), axis=0)
        high = np.max(np.where(np.isfinite(upper), upper, -np.inf), axis=0)
        high[np.isinf(high)] = np.inf
        low[np.isinf(low) | (low >= high)] = -np.inf  # one-sided bounds of different segments
        tolerance, strict = min(each.tolerance for each in parts), any(x.strict for x in parts)
        known = parts[0].window, (), parts[0].conditions
        return cls(low, high, tolerance, tuple(parts), tuple(ends), strict, *known)

    def on(self, nodes: Array) -> Range:
        """Lower and upper bounds in each interval, (N or 1, kinds, nv): 1 without segments.

        nodes: their times, shape (N + 1,), in [s].
        """
        require_shape("nodes", nodes, None)
        return self.at(nodes[1:] / 2 + nodes[:-1] / 2)

    def at(self, t: Array) -> Range:
        """The same at times inside of segments, (P or 1, kinds, nv)."""
        if not self.parts:
            return self.lower[None], self.upper[None]
        part = np.searchsorted(np.array(self.ends), t)
        lower, upper = (np.stack([getattr(p, x) for p in self.parts]) for x in ("lower", "upper"))
        return lower[part], upper[part]

    @property
    def with_excused_parts(self) -> Limits:
        """The same, whose first part knows what is excused of the start as well."""
        if not (self.parts and self.excused):
            return self
        first = dataclasses.replace(self.parts[0], excused=self.excused)
        return dataclasses.replace(self, parts=(first, *self.parts[1:]))

    def wider(self, side: int, t: Array) -> Array:
        """By how much bounds are wider at times, (*t.shape, kinds, nv), for what is excused.

        side: 1 for upper bounds, -1 for lower ones. t: of any shape, in [s].
        """
        return widening(self.excused, side, t, self.lower.shape)

    @property
    def at_ends(self) -> tuple[Limits, Limits]:
        """The limits at the start and at the goal."""
        return (self.parts[0], self.parts[-1]) if self.parts else (self, self)

    def within(self, begin: float, end: float) -> Limits:
        """Those of the segments between two times, by a clock that starts at the first, in [s]."""
        if not self.parts:
            return self
        chosen, ends = segments_within(self.ends, begin, end)
        parts = self.parts[chosen]
        return Limits.of_segments(parts, ends) if ends else parts[0]

    def until(self, time: float) -> Limits:
        """The limits just before a time, in [s]: those of its segment, or these."""
        return self.parts[int(np.searchsorted(np.array(self.ends), time))] if self.parts else self

    def with_conditions_of(self, whole: Limits) -> Limits:
        """The same, and conditions of other limits on what these do not name."""
        own = {each.name for each in self.conditions}
        more = tuple(each for each in whole.conditions if each.name not in own)
        return dataclasses.replace(self, conditions=(*self.conditions, *more)) if more else self

    @property
    def _named_bounds(self) -> list[tuple[object, ...]]:
        """Name, joints and bounds of every condition, which are alike in all segments."""
        sides = [(each, each.on.lower, each.on.upper) for each in self.conditions]
        return [(x.name, x.of, *(np.asarray(side).tolist() for side in s)) for x, *s in sides]

    @property
    def _empty(self) -> npt.NDArray[np.bool_]:
        """Where a range is empty to rounding, or beyond UNBOUNDED altogether, (kinds, nv)."""
        size = np.maximum(1.0, np.minimum(np.abs(self.lower), np.abs(self.upper)))
        size[np.isinf(size)] = 1.0
        beyond = (self.lower > UNBOUNDED) | (self.upper < -UNBOUNDED)
        return np.asarray((self.lower + MIN_RANGE * size >= self.upper) | beyond)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of the rows: the first four, or all of KINDS."""
        return KINDS[: len(self.lower)]

    @cached_property
    def on_rates(self) -> bool:
        """Whether there is a limit on the jerk or on d tau / dt, which needs order 3."""
        return bool(self.bounded[FIRST_KINDS:].any())

    def require_order(self, order: int) -> None:
        """Raise InputError for limits that a Lagrangian of this order does not have."""
        if self.on_rates and order != 3:
            raise InputError(
                "limits on the jerk and on the torque rate need a Lagrangian of order 3: add the "
                "effect jerk_cost to the scene, set smooth = true, or leave them out."
            )

    @property
    def on_torque_rate(self) -> bool:
        """Whether there is a limit on d tau / dt."""
        return self.on_rates and bool(self.bounded[KINDS.index("torque_rate")].any())

    @property
    def on_torques(self) -> bool:
        """Whether there is a limit on tau or on d tau / dt."""
        return bool(self.bounded[KINDS.index("tau")].any()) or self.on_torque_rate

    @property
    def without_torques(self) -> Limits:
        """The same without limits on tau and on d tau / dt."""
        of = np.isin(self.kinds, ("tau", "torque_rate"))[:, None]
        return self._between(np.where(of, -np.inf, self.lower), np.where(of, np.inf, self.upper))

    @property
    def first_kinds(self) -> Limits:
        """The limits on q, v, a and tau alone."""
        return self._between(self.lower[:FIRST_KINDS], self.upper[:FIRST_KINDS])

    def _between(self, lower: Array, upper: Array) -> Limits:
        """The same between other bounds."""
        return dataclasses.replace(self, lower=lower, upper=upper)

    @property
    def bounded(self) -> npt.NDArray[np.bool_]:
        """Which outputs have at least one bound, shape (kinds, nv)."""
        return np.isfinite(self.lower) | np.isfinite(self.upper)

    @property
    def ranges(self) -> Array:
        """Scale of each output: its range, or the size of its only bound, (kinds, nv)."""
        both = self.upper - self.lower
        one = np.where(np.isfinite(self.lower), self.lower, self.upper)
        single = np.maximum(1.0, np.abs(np.where(np.isfinite(one), one, 1.0)))
        return np.where(np.isfinite(both), both, single)

    def to_dict(self) -> dict[str, Any]:
        """The limits as JSON-able data; None for no bound. Raises InputError for segments."""
        if self.parts:
            raise InputError("limits of segments are written one by one: use those of its `parts`.")
        rows = {
            name: [[float(x) if np.isfinite(x) else None for x in row] for row in bound]
            for name, bound in (("lower", self.lower), ("upper", self.upper))
        }
        excused = [each.to_dict() for each in self.excused]
        conditions = {
            each.name: {
                joint: [x if np.isfinite(x) else None for x in pair]
                for joint, pair in pairs_of(each).items()
            }
            for each in self.conditions
        }
        more = {"excused": excused, "conditions": conditions}
        known = {key: value for key, value in more.items() if value}
        return {**rows, "tolerance": self.tolerance, **known}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], on: Coordinates | None = None) -> Limits:
        """The inverse of to_dict. Raises InputError for other data.

        on: the robot, which limits on the power need.
        """
        try:
            lower, upper = (
                np.array([[free if x is None else x for x in row] for row in data[name]], float)
                for name, free in (("lower", -np.inf), ("upper", np.inf))
            )
            known = tuple(Excused.from_dict(x, lower.shape[1]) for x in data.get("excused", ()))
            tolerance = float(data["tolerance"])
            named = _named_from(data.get("conditions", {}), tolerance, on)
            return cls(lower, upper, tolerance, excused=known, conditions=named)
        except (
            AttributeError,
            KeyError,
            TypeError,
            ValueError,
            OverflowError,
            IndexError,
        ) as error:
            raise InputError(
                f"expected the limits that `to_dict` returns, got data with {error!r}."
            ) from error

    def without(self, *kinds: str) -> Limits:
        """The same limits but for those of some kinds, which are unbounded."""
        if self.parts:
            return Limits.of_segments([part.without(*kinds) for part in self.parts], self.ends)
        rows = [row for row, kind in enumerate(self.kinds) if kind in kinds]
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[rows], upper[rows] = -np.inf, np.inf
        return self._between(lower, upper)

    def excess(self, outputs: Array) -> Array:
        """Distance of each output outside its range, as a fraction of the range; negative inside.

        outputs: in the order of `kinds`, shape (..., kinds, nv).
        """
        if outputs.ndim < 2 or outputs.shape[-2:] != self.lower.shape:
            raise InputError(
                f"outputs must have shape (..., {', '.join(map(str, self.lower.shape))}), got "
                f"{outputs.shape}."
            )
        outside = np.maximum(self.lower - outputs, outputs - self.upper)
        return np.asarray(outside / self.ranges)

    def with_margin(self, margin: float) -> Limits:
        """Limits tightened by a fraction of their ranges on both sides. Raises InputError."""
        if not (np.isfinite(margin) and 0 <= margin < 0.5):
            raise InputError(f"a margin must be a fraction of the range in [0, 0.5), got {margin}.")
        shift = margin * self.ranges
        if self.parts:
            return Limits.of_segments([p.with_margin(margin) for p in self.parts], self.ends)
        inside = tuple(_tightened(each, margin) for each in self.conditions)
        tightened = self._between(self.lower + shift, self.upper - shift)
        return dataclasses.replace(tightened, conditions=inside)


def limited_columns(order: int, nv: int) -> npt.NDArray[np.intp]:
    """The columns of (q, q', ..., q^(k), outputs) of all entries of KINDS, (kinds nv,).

    Jerk is the fourth of the jet, torques are the first outputs, and their rates the next.
    order: k; below 3 there is no jerk.
    """
    blocks = np.array([0, 1, 2, order + 1, 3, order + 2])
    return np.asarray((blocks[:, None] * nv + np.arange(nv)).ravel())


def no_limits(coordinates: Coordinates) -> Limits:
    """Limits without any bound."""
    shape = (FIRST_KINDS, coordinates.nv)
    return Limits(np.full(shape, -np.inf), np.full(shape, np.inf))


def urdf_limits(robot: Robot, soft: bool = False) -> Limits:
    """Position, velocity and effort limits of the URDF; 0 or a missing value means no limit.

    An empty range of positions counts as missing, too.
    soft: whether positions have the soft limits of safety controllers. InputError without any.
    """
    shape = (FIRST_KINDS, robot.nv)
    lower, upper = np.full(shape, -np.inf), np.full(shape, np.inf)
    lower[0], upper[0] = position_ranges(robot, soft)
    for row, size in ((1, robot.velocity_limit), (3, robot.effort_limit)):
        bound = np.where(size > 0, size, np.inf)
        lower[row], upper[row] = -bound, bound
    lower[lower < -UNBOUNDED], upper[upper > UNBOUNDED] = -np.inf, np.inf
    return Limits(lower, upper)


@check_arguments_except("limits")
def as_limits(
    coordinates: Coordinates, limits: str | Limits | Mapping[str, Any], order: int = 2
) -> Limits:
    """Limits from a name or a mapping, as `plan` and scene files accept them.

    limits: "urdf" (of a robot), "soft" (the same, with the soft limits of its safety controllers),
        "none", the name of an arm of `hovi.limit_sets`, a Limits, or a mapping with any of `base`
        (one of these names, "urdf" by default), `q`, `v`, `a`, `tau`, `jerk`, `torque_rate`,
        `power` (of tau v, in [W]), `margin` and `tolerance`. A kind is a number x for -x and x, a
        text such as "50 %" for that fraction of the base's limits (not of positions or the power),
        a list of these or of pairs (lower, upper), or a mapping from joint names to any of them.
    order: of the motion. What an arm's set says of jerk and torque rate applies from order 3 on.
    Raises InputError for unknown keys or joints and for bounds that do not fit the coordinates.
    Warns of ranges of angles that look like degrees.
    """
    if isinstance(limits, Limits):
        return limits
    if not isinstance(limits, str | Mapping):
        raise InputError(
            "limits are 'urdf', 'soft', 'none', the name of an arm, a mapping or a hovi.Limits, "
            f"not {shown(limits)}."
        )
    if not isinstance(limits, Mapping):
        return _warned_of_degrees(coordinates, _by_name(coordinates, limits, order, ()))
    keys = ("base", *KINDS, *NAMED, "margin", "tolerance")
    for key in limits:
        if key not in keys:
            raise InputError(f"unknown key `limits.{key}`; {nearest(str(key), keys)}")
    name, own = limits.get("base", "urdf"), entries(coordinates, "q", limits.get("q", {}))
    base = _by_name(coordinates, name, order, own)
    if not limits.keys().isdisjoint(OF_ORDER_3):
        base = _with_all_kinds(base)
    lower, upper = base.lower.copy(), base.upper.copy()
    for row, kind in enumerate(base.kinds):
        of = Base(name, base.lower[row], base.upper[row])
        for i, pair in entries(coordinates, kind, limits.get(kind, {}), of).items():
            lower[row, i], upper[row, i] = pair
    lower[lower < -UNBOUNDED], upper[upper > UNBOUNDED] = -np.inf, np.inf
    margin, tolerance = number_in(limits, "margin", 0.0), number_in(limits, "tolerance", TOLERANCE)
    named = {kind: entries(coordinates, kind, limits.get(kind, {})) for kind in NAMED}
    conditions = named_conditions(coordinates, named, tolerance)
    chosen = Limits(lower, upper, tolerance, conditions=conditions).with_margin(margin)
    return _warned_of_degrees(coordinates, chosen)


def named_conditions(
    coordinates: Coordinates, given: Mapping[str, dict[int, tuple[float, float]]], tolerance: float
) -> tuple[Inequality, ...]:
    """The conditions on NAMED quantities. given: bounds by index in v. tolerance: at least 1e-6."""
    found = []
    for name, bounds in given.items():
        if bounds:
            made, least = NAMED[name](coordinates, bounds), max(tolerance, TOLERANCE)
            condition = dataclasses.replace(made, tolerance=least)
            found.append(cast(Inequality, with_function(condition, coordinates)))
    return tuple(found)


def pairs_of(given: Inequality) -> dict[str, tuple[float, float]]:
    """The bounds of a condition that limits have, by joint."""
    lower, upper = (side[0].tolist() for side in given.on.at(np.zeros(1), len(given.of)))
    return dict(zip(given.of, zip(lower, upper, strict=True), strict=True))


def _named_from(data: Any, tolerance: float, on: Coordinates | None) -> tuple[Inequality, ...]:
    """The conditions of `Limits.to_dict`. Raises InputError, or as Limits.from_dict does."""
    if not data:
        return ()
    if on is None:
        raise InputError(f"limits on the {' and '.join(data)} need the robot: give it as `on`.")
    free = -np.inf, np.inf
    given = {
        name: {
            on.coordinate_names.index(joint): (
                free[0] if pair[0] is None else float(pair[0]),
                free[1] if pair[1] is None else float(pair[1]),
            )
            for joint, pair in bounds.items()
        }
        for name, bounds in data.items()
    }
    in_order = {name: dict(sorted(bounds.items())) for name, bounds in given.items()}
    return named_conditions(on, in_order, tolerance)


def _tightened(given: Inequality, margin: float) -> Inequality:
    """A condition between bounds that are tightened by a fraction of its scales."""
    if margin == 0:
        return given
    low, high = (side[0] for side in given.on.at(np.zeros(1), given.y.size))
    shift = margin * scales(given)
    return dataclasses.replace(given, on=Between(low + shift, high - shift))


def _warned_of_degrees(coordinates: Coordinates, limits: Limits) -> Limits:
    """The limits, after a warning if those of angles or of their velocities look like degrees."""
    angles = coordinates.coordinate_names, ~coordinates.sliding
    known = (
        coordinates.velocity_limit if isinstance(coordinates, Robot) else np.zeros(angles[1].size)
    )
    for suspicion in (
        ranges_in_degrees(*angles, limits.lower[0], limits.upper[0]),
        speeds_in_degrees(*angles, limits.upper[1], known),
    ):
        if suspicion:
            warn(f"{suspicion}; limits are in radians.")
    return limits


def _by_name(coordinates: Coordinates, name: Any, order: int, own: Collection[int]) -> Limits:
    """Limits that have a name. own: indices in v of joints whose ranges the user gives."""
    if name == "none":
        return no_limits(coordinates)
    if is_limit_set(name):
        return _of_arm(coordinates, name, order)
    if name not in ("urdf", "soft"):
        hint = f": {nearest(name, NAMES)}" if isinstance(name, str) else "."
        raise InputError(
            "limits are 'urdf', 'soft', 'none', the name of an arm or given by kind, not "
            f"{name!r}{hint}"
        )
    if not isinstance(coordinates, Robot):
        raise InputError(f"{coordinates.owner} has no URDF: limits need base = 'none' here.")
    require_ranges(coordinates, own)
    return urdf_limits(coordinates, name == "soft")


def _of_arm(coordinates: Coordinates, name: str, order: int) -> Limits:
    """Those of a limit set; joints that its arm does not have keep the limits of the URDF."""
    base = urdf_limits(coordinates) if isinstance(coordinates, Robot) else no_limits(coordinates)
    base = base if order < 3 else _with_all_kinds(base)
    lower, upper = base.lower.copy(), base.upper.copy()
    bounds = limit_set(name).on(coordinates)
    for row, kind in enumerate(base.kinds):
        for joint, pair in bounds[kind].items():
            i = coordinates.coordinate_names.index(joint)
            lower[row, i], upper[row, i] = pair
    return Limits(lower, upper)


def _with_all_kinds(limits: Limits) -> Limits:
    """The limits with rows for the jerk and the torque rate, without bounds if they had none."""
    if len(limits.kinds) == len(KINDS):
        return limits
    more = np.full((len(KINDS) - len(limits.kinds), limits.lower.shape[1]), np.inf)
    lower, upper = np.concatenate([limits.lower, -more]), np.concatenate([limits.upper, more])
    return dataclasses.replace(limits, lower=lower, upper=upper)

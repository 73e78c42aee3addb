"""The trajectory problem: boundary data, via points, limits and obstacles of a motion."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.conditions.asked import (
    along_of,
    asked_at_nodes,
    bounded_of,
    checked,
    require_parts,
    require_ranges,
)
from hovi.conditions.condition import (
    Condition,
    Equation,
    EquationAlong,
    Inequality,
    equation,
)
from hovi.conditions.state_difference import StateDifference
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import Curve, Ends, named_curve
from hovi.discrete.output.stored_torque import StoredTorque
from hovi.discrete.path_on_grid import moved, path_on_grid, with_fixed
from hovi.discrete.state import Periodic, State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, warn
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.within_reach import distances_within_reach, with_gaps
from hovi.planning.problem.along_nodes import NodeState, equations_at_nodes, sizes_of
from hovi.planning.problem.clock import SAME_LENGTH, Clock, Lengths
from hovi.planning.problem.conserved_momentum import Stop, kept_in_free_fall
from hovi.planning.problem.detours import through_frames
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via, goal_state
from hovi.planning.problem.hessian_structure import ActionStructure
from hovi.planning.problem.limits import Limits, no_limits
from hovi.planning.problem.notation.goal_turns import turns_to
from hovi.planning.problem.notation.summaries import ProblemSummary
from hovi.planning.problem.notation.supported import (
    require_dynamics,
    require_free,
    require_supported,
)
from hovi.planning.problem.seams import Hold, ViaPoints, curve_through, holding
from hovi.planning.problem.torque_moments import TorqueMoments
from hovi.planning.problem.way_back.end_state import EndState
from hovi.planning.problem.way_back.led_back import led_back
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.jerk_lagrangian import JerkLagrangian
from hovi.scene.scene import Scene
from hovi.scene.segment_scenes import SegmentScenes
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.schemes import require_regular
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NEGLIGIBLE_TORQUE = 1e-6
"""Torques whose cost counts as none, relative to `TrajectoryProblem.torque_scale`."""
SMALL_DISPLACEMENT = 0.01
"""Displacement whose torque is a scale of torques, in [rad] or [m]."""


@check_arguments
@dataclass(frozen=True, eq=False, repr=False)
class TrajectoryProblem(ProblemSummary):
    """Make the discrete action stationary between two given states.

    The discrete Euler-Lagrange equations D1 L_d(k) + D3 L_d(k-1) = 0 and
    D2 L_d(k) + D4 L_d(k-1) = 0 at the inner nodes are its first-order conditions.
    [ColomboFerraroMartin2016, section 3]

    ld: the discrete Lagrangian on a grid: of the effort of a scene, or any other.
    start: state at t = 0. goal: state at t = T, a task-space goal, or Periodic.
    limits: bounds along the motion; none if None. via: via points, at nodes of the grid.
    clearance: obstacles and their margin; none if None. time_weight: w of J + w T.
    conditions: of functions of the motion: see `hovi.Condition`.
    ends: (q, q', ..., q^(k-1)) at the start and at the goal, k arrays of two rows; initial guesses
        in free components.
    free_ends: which of (q, q', ..., q^(k-1)) are free at the start and at the goal, shape
        (2, k, nv).
    equations: at nodes. along: those at all times, whose part at nodes is among `equations`.
    holds: what is fixed where segments meet.
    unreachable: why the goal cannot be reached, or "".
    turns: full turns of the guess beyond the shortest path, after the last seam if there are any,
        rotation vectors over 2 pi, (nv,).
    Raises InputError, ModelError or SchemeError if the input defines no problem.
    """

    ld: DiscreteLagrangian
    start: State
    goal: State | FrameGoal | Periodic
    limits: Limits | None = None
    via: tuple[Via, ...] = ()
    clearance: Clearance | None = None
    time_weight: float = 0.0
    conditions: Sequence[Condition[Any, Any]] = ()
    ends: tuple[Array, ...] = field(init=False, repr=False)
    free_ends: Mask = field(init=False, repr=False)
    equations: tuple[Equation, ...] = field(init=False, repr=False)
    along: tuple[EquationAlong, ...] = field(init=False, repr=False)
    holds: tuple[Hold, ...] = field(init=False, repr=False)
    unreachable: str = field(init=False, repr=False)
    turns: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for scheme, _ in self.grid.groups:
            require_regular(scheme)
        if self.periodic and (self.via or len(self.passive) > 0):
            raise InputError("periodic motions have no via points or passive joints: omit them.")
        object.__setattr__(self, "conditions", checked(self.conditions, self.coordinates))
        require_ranges(self.bounds, self.grid.duration)
        require_parts(self.conditions, self.grid)
        require_supported(self, self.ld.k)
        of, limits = self.ld.lagrangian, self.limits
        if limits is not None and limits.on_torque_rate and isinstance(of, JerkLagrangian):
            object.__setattr__(self, "ld", DiscreteLagrangian(of.with_torque_rates(), self.grid))
        require_dynamics(self)
        if len(self.passive) > 0 and len(self.ld.lagrangian.output_weight) == 0:
            raise InputError("passive joints need a Lagrangian of torques: leave them out.")
        first, last = self.start, self.goal
        if isinstance(last, Periodic):
            first, last = last.ends(first, self.coordinates, self.ld.k, self.ld.lagrangian.timed)
        self._set_conditions(first, last)

    def _set_conditions(self, first: State, last: State | FrameGoal) -> None:
        """Set the boundary data and the conditions at nodes, from both ends and the via points."""
        coordinates, limits = self.coordinates, self.limits
        start, at_end = first.on(coordinates, "start")[0], limits and limits.at_ends[1]
        free = (*first.free, *(joint for scene in self.scenes for joint in scene.passive))
        passed = ViaPoints.of(self.via, self.grid, coordinates, first, limits, free)
        near = passed.holds[-1].q if passed.holds else start
        end = goal_state(last, "goal", coordinates, near, at_end, free)
        last_node = self.grid.intervals, float(self.grid.t[-1])
        equations = [equation(each, *last_node) for each in end.differences]
        unreachable = end.reason or passed.reason
        asked = asked_at_nodes(self.conditions, self.grid)
        object.__setattr__(self, "equations", (*equations, *passed.equations, *asked))
        object.__setattr__(self, "along", along_of(self.conditions))
        object.__setattr__(self, "holds", passed.holds)
        self._set_ends(first, end.state)
        require_free(asked, self)
        if self.about_robot and not self.periodic and self.ld.k > 1:
            unreachable = unreachable or self._leave_out_what_is_conserved()
        if limits is not None and limits.bounded.any() and not self.periodic:
            excused, refused = led_back(self.end_state(0), limits.strict)
            unreachable = unreachable or refused
            if excused != limits.excused:
                object.__setattr__(self, "limits", dataclasses.replace(limits, excused=excused))
        if self.along:
            known = self.grid, self._given_at_nodes(), self.equations
            more, reason = equations_at_nodes(self.along, *known, self.along_sizes)
            object.__setattr__(self, "equations", (*self.equations, *more))
            unreachable = unreachable or reason
        object.__setattr__(self, "unreachable", unreachable)
        if self.clearance is not None:  # raises for missing collision shapes
            ends = self.ends[0], self.free_ends, self.grid.duration
            object.__setattr__(self, "clearance", with_gaps(self.robot, self.clearance, *ends))

    @property
    def given_between(self) -> list[tuple[int, Mask]]:
        """Nodes between the ends, and which of (q, q', ...) is given at seams and via points."""
        rest = self.ld.k - 2, self.coordinates.nv
        found = [
            (each.node, np.concatenate([each.fixed, np.full(rest, each.higher is not None)]))
            for each in self.holds
        ]
        for each in self.equations:
            if isinstance(each.y, StateDifference) and each.where.node < self.grid.intervals:
                found.append((each.where.node, each.y.held))
        return found

    def _given_at_nodes(self) -> dict[int, NodeState]:
        """What is given at the nodes at both ends, at seams, and where equations are asked."""
        (q0, q1), (v0, v1), N = self.ends[0], self.ends[1], self.grid.intervals
        free, given = np.ones_like(self.free_ends[0, :2]), dict[int, NodeState]()
        for each in self.equations:
            jet = each.y.jet if isinstance(each.y, StateDifference) else (q0, v0)
            v = jet[1] if len(jet) > 1 else v0
            name = f"the motion at t = {each.where.time:.4g} s"
            given[each.where.node] = NodeState(name, jet[0], v, free)
        for time in {t for part in self.along for t in part.during or ()}:
            node = int(np.argmin(np.abs(self.grid.t - time)))  # where two of them may meet
            given.setdefault(node, NodeState("", q0, v0, free))
        for hold in self.holds:
            name = f"the goal at t = {hold.time:.4g} s"
            given[hold.node] = NodeState(name, hold.q, hold.v, ~hold.fixed)
        given[0] = NodeState("the start", q0, v0, self.free_ends[0, :2])
        given[N] = NodeState("the goal", q1, v1, self.free_ends[1, :2])
        return given

    def _leave_out_what_is_conserved(self) -> str:
        """Free what conserved momenta imply at seams and the goal; why they forbid these, or ""."""
        (q0, q1), (v0, v1) = self.ends[:2]
        inner = [Stop(each.time, each.q, each.v, ~each.fixed) for each in self.holds]
        start, goal = Stop(0.0, q0, v0, self.free_ends[0][:2]), self.free_ends[1]
        stops = [start, *inner, Stop(self.grid.duration, q1, v1, goal[:2])]
        lagrangian = self.ld.lagrangian
        ends = lagrangian.ends if isinstance(lagrangian, SegmentedLagrangian) else ()
        reason, free = kept_in_free_fall(self.scenes, ends, stops)
        freed = np.stack([self.free_ends[0], np.concatenate([free[-1], goal[2:]])])
        object.__setattr__(self, "free_ends", freed)
        pairs = zip(self.holds, free[1:], strict=False)
        holds = tuple(dataclasses.replace(each, fixed=~left) for each, left in pairs)
        object.__setattr__(self, "holds", holds)
        return reason

    def end_state(self, end: int) -> EndState:
        """The start, 0, or the goal, 1, with its limits."""
        assert self.limits is not None
        jet = [x[end] for x in self.ends]
        T, ends, limits = self.grid.duration, self.limits.ends, self.limits.at_ends[end]
        span = (ends[0] if end == 0 else T - ends[-1]) if ends else T
        scene = self.scenes[-end] if self.about_robot else None
        known = self.coordinates, limits, jet, ~self.free_ends[end], span, self.limits.window * span
        return EndState.of(*known, scene, end * T)

    def _set_ends(self, start: State, goal: State) -> None:
        """Set what both ends prescribe and leave free."""
        coordinates, k = self.coordinates, self.ld.k
        named = (start, "start"), (goal, "goal")
        free = [state.free_on(coordinates, name, k) for state, name in named]
        for state, name in named:
            state.require_order(k, name)
        jets = [state.jet_on(coordinates, name)[:k] for state, name in named]
        object.__setattr__(self, "ends", tuple(map(np.stack, zip(*jets, strict=True))))
        object.__setattr__(self, "free_ends", np.stack(free))
        (q0, q1), last = self.ends[0], start
        if self.holds:
            q0, last = self.holds[-1].q, self.holds[-1].start
        object.__setattr__(self, "turns", turns_to(goal, last, coordinates, q0, q1))

    @classmethod
    def of_segments(
        cls,
        segments: Sequence[DiscreteLagrangian],
        start: State,
        goal: State | FrameGoal | Periodic,
        limits: Sequence[Limits | None] | None = None,
        via: tuple[Via, ...] = (),
        clearance: Clearance | None = None,
        conditions: Sequence[Condition[Any, Any]] = (),
    ) -> Self:
        """The problem of one motion in several segments, which share the nodes between them.

        segments: two or more, each with its own Lagrangian and grid, one after the other in time;
            a Lagrangian that depends on time sees the time from the start of the motion.
        limits: of each segment; none if None. Other arguments as of the problem.
        Raises InputError for segments of different orders or joints.
        """
        grid = Grid.joined([each.grid for each in segments])
        nodes = np.cumsum([each.grid.intervals for each in segments])[:-1]
        ends = tuple(float(t) for t in grid.t[nodes])
        lagrangian = SegmentedLagrangian(tuple(each.lagrangian for each in segments), ends)
        bounds = None
        if limits is not None:
            none = no_limits(lagrangian.coordinates)
            bounds = Limits.of_segments([none if each is None else each for each in limits], ends)
        ld = DiscreteLagrangian(lagrangian, grid)
        return cls(ld, start, goal, bounds, via, clearance, conditions=conditions)

    @cached_property
    def structure(self) -> ActionStructure:
        """Block structure of the action's Hessian on this grid."""
        free = self.free_ends if self.free_ends.any() or self.periodic else None
        return ActionStructure(self.grid, self.coordinates.nv, free, self.periodic, self.holds)

    def on(self, grid: Grid) -> TrajectoryProblem:
        """The same problem on another grid."""
        return self._with(DiscreteLagrangian(self.ld.lagrangian, grid))

    def lasting(self, clock: Clock, now: Lengths, lengths: Lengths) -> TrajectoryProblem:
        """The same problem with other lengths of its parts. now: its own, in [s]."""
        grid = clock.grid(self.grid, now, lengths)
        ld = DiscreteLagrangian(clock.lagrangian(self.ld.lagrangian, now, lengths), grid)
        limits = None if self.limits is None else clock.limits(self.limits, now, lengths)
        via = clock.via(self.via, now, lengths)
        asked, clear = clock.conditions(self.conditions, now, lengths), self.clearance
        clear = None if clear is None else clock.clearance(clear, now, lengths)
        changes: dict[str, Any] = {"limits": limits, "via": via, "conditions": asked}
        return dataclasses.replace(self, ld=ld, clearance=clear, **changes)

    def _with(self, ld: DiscreteLagrangian) -> TrajectoryProblem:
        grid, T = ld.grid, self.grid.duration
        if self.equations or self.holds or abs(grid.duration - T) > SAME_LENGTH * T:
            return dataclasses.replace(self, ld=ld)
        for scheme, _ in grid.groups:
            require_regular(scheme)
        problem = copy.copy(self)  # nothing else depends on the grid
        object.__setattr__(problem, "ld", ld)
        for name in ("structure", "torque_moments", "finer"):
            problem.__dict__.pop(name, None)
        return problem

    def with_clearance(self, clearance: Clearance | None) -> TrajectoryProblem:
        """The same problem with another clearance, or none, sharing what was built for this one."""
        other = copy.copy(self)  # only its finer one depends on it, too
        object.__setattr__(other, "clearance", clearance)
        other.__dict__.pop("finer", None)
        return other

    @cached_property
    def centered(self) -> TrajectoryProblem:
        """The same problem with the middles of narrow bounds in their place."""
        return dataclasses.replace(self, conditions=[each.centered for each in self.conditions])

    @cached_property
    def finer(self) -> TrajectoryProblem:
        """The same problem with more inner modes, for error estimates."""
        finer = self._with(self.ld.finer)
        if self.structure.grid is self.grid:  # not that of another duration
            object.__setattr__(finer, "structure", self.structure.finer)
        return finer

    def between(self, start: State, goal: State | FrameGoal | Periodic) -> TrajectoryProblem:
        """The same problem between other states, sharing what was built for this one."""
        if isinstance(goal, State) and isinstance(self.goal, State):  # only conditions depend on it
            problem = object.__new__(type(self))
            given = {x.name: getattr(self, x.name) for x in dataclasses.fields(self) if x.init}
            vars(problem).update(given, start=start, goal=goal)
            problem._set_conditions(start, goal)
        else:
            problem = dataclasses.replace(self, start=start, goal=goal)
        masks = [(x.free_ends, *(hold.fixed for hold in x.holds)) for x in (problem, self)]
        same = all(map(np.array_equal, *masks))
        if problem.periodic == self.periodic and same:
            object.__setattr__(problem, "structure", self.structure)
        return problem

    def path(self, curve: Curve) -> DiscretePath:
        """A curve sampled on the grid, with the problem's data in fixed components."""
        ends = self._with_fixed(curve(np.array([0.0, self.grid.duration]))[: self.ld.k])
        path = path_on_grid(curve, self.grid, ends, self.coordinates)
        return holding(path, self.grid, self.holds, self.coordinates)

    def moved(self, path: DiscretePath) -> DiscretePath:
        """A path plus the cubic, or Hermite polynomial, that moves its ends to the problem's."""
        ends = [x[[0, -1]] for x in (path.q, *np.moveaxis(path.rates, 1, 0))]
        return self._moved(path, self._with_fixed(ends))

    def moved_to_guesses(self, path: DiscretePath) -> DiscretePath:
        """As `moved`, with the problem's own initial guesses in free components, too."""
        return self._moved(path, self.ends)

    def _moved(self, path: DiscretePath, ends: Ends) -> DiscretePath:
        on = self.coordinates
        return holding(moved(path, self.grid, ends, on), self.grid, self.holds, on)

    def _with_fixed(self, ends: Ends) -> tuple[Array, ...]:
        """Two ends with the problem's own data in fixed components."""
        return with_fixed(self.coordinates, ends, self.ends, self.free_ends, self.periodic)

    def guess(self, name: str) -> DiscretePath:
        """The guess with a name, past the frames of via points.

        For orders other than 2 it is always the Hermite polynomial.
        """
        known = self.coordinates, self.ends, self.grid.duration
        if self.holds:
            curve = curve_through(name, *known, self.holds, self.turns)
        else:
            curve = named_curve(name, *known, self.turns)
        on, grid = self.coordinates, self.grid
        return self.path(through_frames(curve, self.via, on, self.limits, grid))

    def trajectory(self, path: DiscretePath) -> Trajectory:
        """A path on the grid as a trajectory without momenta, for sampling."""
        return self.motion(path, np.zeros((path.intervals + 1, self.ld.k, path.v.shape[1])), {})

    def motion(self, path: DiscretePath, momenta: Array, metadata: dict[str, Any]) -> Trajectory:
        """A path on the grid as a trajectory; arguments as for Trajectory."""
        turns = self.start.turns_made(self.coordinates, path.q[0])
        if self.ld.segments is not None and self.about_robot:
            segments = SegmentScenes(self.scenes, tuple(np.bincount(self.ld.segments).tolist()))
            return Trajectory(self.grid, path, momenta, None, metadata, None, segments, turns)
        if self.about_robot:
            return Trajectory(self.grid, path, momenta, self.scene, metadata, turns=turns)
        metadata = {**metadata, "coordinates": list(self.coordinates.coordinate_names)}
        if self.coordinates.curved_space is not None:
            metadata["space"] = list(self.coordinates.space.parts)
        none = StoredTorque.none(self.grid.intervals)
        return Trajectory(self.grid, path, momenta, None, metadata, none, turns=turns)

    @property
    def goals(self) -> tuple[State, ...]:
        """The goals of the seams, and that of the motion if it is a State."""
        last = (self.goal,) if isinstance(self.goal, State) else ()
        return (*(each.goal for each in self.holds), *last)

    @property
    def end_velocities(self) -> Array:
        """v at the start and at the goal, shape (2, nv); zero for order 1."""
        return self.ends[1] if self.ld.k > 1 else np.zeros((2, self.coordinates.nv))

    @property
    def boundary(self) -> tuple[Array, ...]:
        """(q0, v0, q1, v1); use `ends`, which has more derivatives for higher orders."""
        warn("`boundary` is now `ends`, k arrays of two rows: use it.", DeprecationWarning)
        (q0, q1), (v0, v1) = self.ends[0], self.end_velocities
        return q0, v0, q1, v1

    @property
    def end_jets(self) -> tuple[Array, ...]:
        """`ends`, for orders other than 2."""
        warn("`end_jets` is now `ends`, of every order: use it.", DeprecationWarning)
        return () if self.ld.k == 2 else self.ends

    @cached_property
    def inertial_torque(self) -> float:
        """max diag M(q0)/T^2, in [N m] or [N]: torque scale of a motion by 1 rad or 1 m, or 0."""
        if not self.about_robot:
            return 0.0
        mass = MassMatrix(self.scene.model)(self.ends[0][:1])[0]
        return float(np.max(np.diag(mass))) / self.grid.duration**2

    @cached_property
    def stiffness(self) -> float:
        """max_i sum_j |d tau_i / d q_j| at rest at the ends, in [N m/rad]; 0 without torques.

        Where torques cancel, as at an equilibrium under gravity, their rounding errors are left,
        of this size times that of rounding.
        """
        if not (self.about_robot and len(self.ld.lagrangian.output_weight) > 0):
            return 0.0
        q, rest = self.ends[0], np.zeros((2, self.coordinates.nv))
        times = np.array([0.0, self.grid.duration])
        scenes = self.scenes[0], self.scenes[-1]
        slopes = [scene.torques.linearize(q, rest, rest, times)[1] for scene in scenes]
        return float(np.abs(np.stack(slopes)[..., : rest.shape[1]]).sum(axis=-1).max())

    @property
    def torque_scale(self) -> float:
        """The inertial torque, or that of a small displacement if it is larger, in [N m]."""
        return max(self.inertial_torque, SMALL_DISPLACEMENT * self.stiffness)

    @property
    def negligible_cost(self) -> float:
        """Cost that counts as none: that of torques of a small fraction of `torque_scale`."""
        torque = NEGLIGIBLE_TORQUE * self.torque_scale
        return self.mean_output_weight * torque**2 * self.grid.duration

    @property
    def mean_output_weight(self) -> float:
        """The mean weight of outputs in the cost, passive joints left out; 1 without any."""
        weights = np.delete(self.ld.lagrangian.output_weight, self.passive)
        weights = weights[weights > 0]
        return float(weights.mean()) if len(weights) > 0 else 1.0

    @property
    def passive(self) -> npt.NDArray[np.intp]:
        """Indices in v of the passive joints."""
        return self.scene.passive_coordinates if self.about_robot else np.zeros(0, np.intp)

    @cached_property
    def along_sizes(self) -> list[Array]:
        """The factors of the equations along the motion: see `sizes_of`."""
        (q0, q1), on, T = self.ends[0], self.coordinates, self.grid.duration
        q = np.stack([q0, on.integrate(q0, 0.5 * on.difference(q0, q1)), q1])
        v, t = (
            np.stack([self.ends[1][0], on.difference(q0, q1) / T, self.ends[1][1]]),
            T * np.arange(3) / 2,
        )
        return [sizes_of(each, (q, v, np.zeros_like(v)), t) for each in self.along]

    @cached_property
    def torque_moments(self) -> TorqueMoments | None:
        """How passive torques vanish in an interval: as moments; None if at all points."""
        return TorqueMoments.of(self.ld, self.passive)

    @property
    def constrained(self) -> bool:
        """Whether there are equality constraints: at nodes, at all times, or passive joints."""
        modes = [scheme.inner_modes for scheme, _ in self.grid.groups]
        moments = any(r + each.where.level > 0 for r in modes for each in self.along)
        return bool(self.equations) or moments or len(self.passive) > 0

    @property
    def plain(self) -> bool:
        """Whether the ends alone are fixed, wholly, and there are no equality constraints."""
        return not (self.constrained or self._has_free_ends or self.periodic or self.holds)

    @property
    def periodic(self) -> bool:
        """Whether the motion ends as it starts, up to a displacement."""
        return isinstance(self.goal, Periodic)

    @cached_property
    def _has_free_ends(self) -> bool:
        return bool(self.free_ends.any())

    @property
    def bounds(self) -> tuple[Inequality, ...]:
        """The conditions that hold at all times, those of the limits included."""
        of_limits = () if self.limits is None else self.limits.conditions
        return (*bounded_of(self.conditions), *of_limits)

    @property
    def has_limits(self) -> bool:
        """Whether there are limits; distances are none."""
        return self.limits is not None and bool(self.limits.bounded.any())

    @property
    def limited(self) -> bool:
        """Whether there are limits, obstacles or conditions at all times."""
        return self.has_limits or bool(self.bounds) or self.distances is not None

    @property
    def distances(self) -> Distances | None:
        """Distances to obstacles that can come near and between links; None without any."""
        known = self.clearance
        return None if known is None else distances_within_reach(self.robot, known)

    @property
    def grid(self) -> Grid:
        """The grid of the motion."""
        return self.ld.grid

    @cached_property
    def _scene(self) -> Scene | None:
        scene = getattr(self.ld.lagrangian, "scene", None)
        return scene if isinstance(scene, Scene) else None

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """The scene of every segment, one where there is a single one; none without a robot."""
        lagrangian = self.ld.lagrangian
        if isinstance(lagrangian, SegmentedLagrangian):
            return lagrangian.scenes
        return () if self._scene is None else (self._scene,)

    @property
    def about_robot(self) -> bool:
        """Whether the Lagrangian belongs to a scene, and so to a robot."""
        return self._scene is not None

    @property
    def scene(self) -> Scene:
        """The scene of the Lagrangian, or of the first segment. InputError if there is no robot."""
        if self._scene is not None:
            return self._scene
        raise InputError(
            "frames, obstacles, passive joints and tolerances in lengths need a robot, and this "
            "problem's Lagrangian is about none: use one of a Scene."
        )

    @property
    def robot(self) -> Robot:
        """The robot of the scene. Raises InputError as `scene` does."""
        return self.scene.robot

    @property
    def coordinates(self) -> Coordinates:
        """The robot, or the coordinates of a Lagrangian that is about none."""
        return self.scene.robot if self.about_robot else self.ld.lagrangian.coordinates

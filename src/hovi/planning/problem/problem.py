"""The trajectory problem: which boundary data a motion of least action has to meet."""

from __future__ import annotations

import copy
import dataclasses
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import Boundary, Curve, path_on_grid
from hovi.discrete.state import State
from hovi.errors import InputError, ModelError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.problem.conserved_momentum import free_fall_contradiction, without_redundancy
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via, met, via_conditions
from hovi.planning.problem.hessian_structure import ActionStructure
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.node_conditions import NodeCondition
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.model import check_mass_matrix
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene, require_known_joints
from hovi.schemes import require_regular

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MORE_MODES = 2
"""Inner modes that the problem by which errors are estimated has more: with one more the costs of
both may be off by as much to the same side, and their difference would say nothing."""


@dataclass(frozen=True, eq=False)
class TrajectoryProblem:
    """Make the discrete action stationary between two given states.

    The discrete Euler-Lagrange equations D1 L_d(k) + D3 L_d(k-1) = 0 and
    D2 L_d(k) + D4 L_d(k-1) = 0 at the inner nodes are its first-order conditions.
    [ColomboFerraroMartin2016, section 3]

    ld: the discrete Lagrangian on a grid; its Lagrangian belongs to a scene.
    start: state at t = 0. goal: state at t = T, or a goal of a frame.
    limits: bounds that hold along the motion; none when None.
    via: what the motion passes through, at nodes of the grid.
    clearance: what the robot keeps away from along the motion; nothing when None.
    boundary: (q0, v0, q1, v1) of the two ends, first guesses where they are free.
    free_ends: which of (q, v) are free at the start and at the goal, shape (2, 2, nv).
    conditions: what has to hold at nodes besides. unreachable: why the goal cannot be met, or "".
    turns: rotation vectors over 2 pi by which the first guess goes beyond the shortest way, (nv,).
    Raises InputError, ModelError or SchemeError when no motion can be planned.
    """

    ld: DiscreteLagrangian
    start: State
    goal: State | FrameGoal
    limits: Limits | None = None
    via: tuple[Via, ...] = ()
    clearance: Clearance | None = None
    boundary: Boundary = field(init=False, repr=False)
    free_ends: Mask = field(init=False, repr=False)
    conditions: tuple[NodeCondition, ...] = field(init=False, repr=False)
    unreachable: str = field(init=False, repr=False)
    turns: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for scheme, _ in self.grid.groups:
            require_regular(scheme)
        require_plannable(self.scene)
        robot, N = self.robot, self.grid.intervals
        start = self.start.on(robot, "start")
        end = met(self.goal, "goal", robot, start[0], self.limits)
        goal = end.state.on(robot, "goal")
        conditions = [NodeCondition(N, condition) for condition in end.conditions]
        unreachable = end.reason
        for via in self.via:
            passed = met(via.goal, f"via point at {via.time:g} s", robot, start[0], self.limits)
            node = self.grid.node_at(via.time)
            conditions += [NodeCondition(node, each) for each in via_conditions(via, passed, robot)]
            unreachable = unreachable or passed.reason
        free = self.start.free_on(robot, "start"), end.state.free_on(robot, "goal")
        object.__setattr__(self, "boundary", (*start, *goal))
        object.__setattr__(self, "free_ends", np.stack(free))
        object.__setattr__(self, "conditions", tuple(conditions))
        unreachable = unreachable or free_fall_contradiction(
            self.scene, self.boundary, self.free_ends, self.grid.duration
        )
        object.__setattr__(self, "unreachable", unreachable)
        object.__setattr__(
            self, "free_ends", without_redundancy(self.scene, goal[1], self.free_ends)
        )
        object.__setattr__(self, "turns", end.state.turns_on(robot, "goal"))
        _ = self.distances  # shapes that are missing speak before any work is done

    @cached_property
    def structure(self) -> ActionStructure:
        """What the action's Hessian looks like on this grid."""
        free = self.free_ends if self.free_ends.any() else None
        return ActionStructure(self.grid, self.robot.nv, free)

    def on(self, grid: Grid) -> TrajectoryProblem:
        """The same problem on another grid."""
        ld = DiscreteLagrangian(self.ld.lagrangian, grid)
        T = self.grid.duration
        if self.conditions or abs(grid.duration - T) > 1e-12 * T:
            return dataclasses.replace(self, ld=ld)
        for scheme, _ in grid.groups:
            require_regular(scheme)
        problem = copy.copy(self)  # nothing else depends on the grid, and was checked already
        object.__setattr__(problem, "ld", ld)
        for name in ("structure", "finer"):
            problem.__dict__.pop(name, None)
        return problem

    @cached_property
    def finer(self) -> TrajectoryProblem:
        """The same problem with more inner modes, by which errors are estimated."""
        return self.on(self.grid.enriched(MORE_MODES))

    def between(self, start: State, goal: State | FrameGoal) -> TrajectoryProblem:
        """The same problem between other states, with everything that was built for this one."""
        problem = dataclasses.replace(self, start=start, goal=goal)
        if np.array_equal(problem.free_ends, self.free_ends):
            object.__setattr__(problem, "structure", self.structure)
        return problem

    def path(self, curve: Curve) -> DiscretePath:
        """A curve on the grid, its ends those of the problem as far as they are not free."""
        q, v, _ = curve(np.array([0.0, self.grid.duration]))
        return path_on_grid(curve, self.grid, self.ends(q, v), self.robot)

    def ends(self, q: Array, v: Array) -> Boundary:
        """The boundary data, with what is free taken from the ends of q (M, nq) and v (M, nv)."""
        q0, v0, q1, v1 = self.boundary
        if not self._has_free_ends:
            return self.boundary
        robot, free = self.robot, self.free_ends
        q = np.stack(
            [
                robot.integrate(a, np.where(free[i, 0], robot.difference(a, b), 0.0))
                for i, (a, b) in enumerate(((q0, q[0]), (q1, q[-1])))
            ]
        )
        v = np.where(free[:, 1], v[[0, -1]], np.stack([v0, v1]))
        return q[0], v[0], q[1], v[1]

    @cached_property
    def inertial_torque(self) -> float:
        """The largest inertia of a joint at the start, over T^2: one [rad/s^2] or [m/s^2] T^2."""
        mass = MassMatrix(self.scene.model)(self.boundary[0][None])[0]
        return float(np.max(np.diag(mass))) / self.grid.duration**2

    @property
    def passive(self) -> npt.NDArray[np.intp]:
        """Places in v of the joints that carry no torque."""
        return self.scene.passive_coordinates

    @property
    def constrained(self) -> bool:
        """Whether the motion has to meet equations besides its boundary data."""
        return bool(self.conditions) or len(self.passive) > 0

    @property
    def plain(self) -> bool:
        """Whether both ends are fixed and no equation has to be met."""
        return not self.constrained and not self._has_free_ends

    @cached_property
    def _has_free_ends(self) -> bool:
        return bool(self.free_ends.any())

    @property
    def limited(self) -> bool:
        """Whether anything is bounded, or has to be kept away from."""
        bounded = self.limits is not None and bool(self.limits.bounded.any())
        return bounded or self.distances is not None

    @property
    def distances(self) -> Distances | None:
        """Distances to what the robot keeps away from; None where there is nothing."""
        if self.clearance is None or not self.clearance.wanted:
            return None
        return distances_between(self.robot, self.clearance)

    @property
    def grid(self) -> Grid:
        """The grid of the motion."""
        return self.ld.grid

    @property
    def scene(self) -> Scene:
        """The scene that the Lagrangian belongs to."""
        scene = getattr(self.ld.lagrangian, "scene", None)
        if isinstance(scene, Scene):
            return scene
        raise InputError("a trajectory problem needs the effort Lagrangian of a Scene.")

    @property
    def robot(self) -> Robot:
        """The robot of the scene."""
        return self.scene.robot


@lru_cache(maxsize=64)
def require_plannable(scene: Scene) -> None:
    """Raise ModelError for a robot on which motions cannot be planned."""
    robot = scene.robot
    require_known_joints(robot)
    if robot.nv == 0:
        raise ModelError(f"robot {robot.name!r} has no joint that moves; nothing can be planned.")
    check_mass_matrix(scene.model)

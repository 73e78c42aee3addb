"""The trajectory problem: which boundary data a motion of least action has to meet."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from hovi.action_structure import ActionStructure
from hovi.discrete_lagrangian import DiscreteLagrangian
from hovi.errors import InputError, ModelError
from hovi.grid import Grid
from hovi.guess import Boundary
from hovi.lagrangian import EffortLagrangian
from hovi.limits import Limits
from hovi.robot import Robot
from hovi.robot_model import check_mass_matrix
from hovi.scene import Scene, require_vector_joints
from hovi.schemes import require_regular
from hovi.state import State

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TrajectoryProblem:
    """Make the discrete action stationary between two given states.

    The discrete Euler-Lagrange equations D1 L_d(k) + D3 L_d(k-1) = 0 and
    D2 L_d(k) + D4 L_d(k-1) = 0 at the inner nodes are its first-order conditions.
    [ColomboFerraroMartin2016, section 3]

    ld: the discrete Lagrangian of a scene's effort on a grid.
    start, goal: states at t = 0 and t = T.
    limits: bounds that hold along the motion; none when None.
    boundary: (q0, v0, q1, v1) of the two states.
    Raises InputError, ModelError or SchemeError when no motion can be planned.
    """

    ld: DiscreteLagrangian
    start: State
    goal: State
    limits: Limits | None = None
    boundary: Boundary = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for scheme, _ in self.grid.groups:
            require_regular(scheme)
        require_plannable(self.scene)
        start, goal = self.start.on(self.robot, "start"), self.goal.on(self.robot, "goal")
        object.__setattr__(self, "boundary", (*start, *goal))

    @cached_property
    def structure(self) -> ActionStructure:
        """What the action's Hessian looks like on this grid."""
        return ActionStructure(self.grid, self.robot.nv)

    def on(self, grid: Grid) -> TrajectoryProblem:
        """The same problem on another grid."""
        ld = DiscreteLagrangian(self.ld.lagrangian, grid)
        return TrajectoryProblem(ld, self.start, self.goal, self.limits)

    def between(self, start: State, goal: State) -> TrajectoryProblem:
        """The same problem between other states, with everything that was built for this one."""
        problem = TrajectoryProblem(self.ld, start, goal, self.limits)
        object.__setattr__(problem, "structure", self.structure)
        return problem

    @property
    def limited(self) -> bool:
        """Whether anything is bounded."""
        return self.limits is not None and bool(self.limits.bounded.any())

    @property
    def grid(self) -> Grid:
        """The grid of the motion."""
        return self.ld.grid

    @property
    def scene(self) -> Scene:
        """The scene whose effort is minimised."""
        lagrangian = self.ld.lagrangian
        if isinstance(lagrangian, EffortLagrangian) and isinstance(lagrangian.scene, Scene):
            return lagrangian.scene
        raise InputError("a trajectory problem needs the effort Lagrangian of a Scene.")

    @property
    def robot(self) -> Robot:
        """The robot of the scene."""
        return self.scene.robot


@lru_cache(maxsize=64)
def require_plannable(scene: Scene) -> None:
    """Raise ModelError for a robot on which motions cannot be planned."""
    robot = scene.robot
    require_vector_joints(robot)
    if robot.nv == 0:
        raise ModelError(f"robot {robot.name!r} has no joint that moves; nothing can be planned.")
    check_mass_matrix(scene.model)

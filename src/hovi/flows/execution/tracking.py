"""Executes a plan on a scene with more effects, and measures the deviation."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.flows.execution.controllers import Controller, controller
from hovi.flows.simulator import Simulation, simulate
from hovi.robot.frame_distance import FrameDistance
from hovi.robot.space.joint_table import with_angles
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

STEPS_PER_SECOND = 400
"""Default number of steps of the execution of a plan, per [s]."""


@dataclass(frozen=True, eq=False)
class Tracking:
    """A plan and its execution.

    plan: the planned motion. simulation: the executed motion. controller: the torques.
    """

    plan: Trajectory
    simulation: Simulation
    controller: Controller

    @property
    def t(self) -> Array:
        """Times of the nodes, shape (N + 1,), in [s]."""
        return self.simulation.t

    @property
    def joint_deviation(self) -> Array:
        """Executed minus planned configuration, shape (N + 1, nv), in [rad] or [m]."""
        planned = self.plan.configurations(np.clip(self.t, 0.0, self.plan.duration))
        return self.simulation.scene.robot.difference(planned, self.simulation.q)

    @property
    def tip_deviation(self) -> Array:
        """The largest distance of the tip_frames from the plan, shape (N + 1,), in [m]."""
        return self.tip_distance.largest

    @cached_property
    def tip_distance(self) -> FrameDistance:
        """Distance of executed and planned position of each of the robot's tip_frames."""
        robot, q = self.simulation.scene.robot, self.simulation.q
        planned = self.plan.configurations(np.clip(self.t, 0.0, self.plan.duration))
        return FrameDistance.between(robot, planned, q)

    @property
    def torque(self) -> Array:
        """u at the nodes, shape (N + 1, nv), in [N m] or [N]."""
        return self.controller.evaluate(self.simulation.q, self.simulation.v, self.t)[0]

    @property
    def feedback_torque(self) -> Array:
        """u minus the planned torque, shape (N + 1, nv), in [N m] or [N]."""
        more = self.torque - self.controller.planned(self.t).tau
        more[:, self.simulation.scene.passive_coordinates] = 0.0
        return more


@check_arguments_except("plan")
def play(
    scene: Scene,
    plan: Trajectory,
    feedback: str = "none",
    *,
    bandwidth: float = 10.0,
    intervals: int | None = None,
    inner_modes: int = 1,
) -> Tracking:
    """Execute the torques of a plan on a scene, and measure the deviation.

    scene: the simulated scene, with the robot of the plan.
    plan: a motion with its torques, which may come from a simpler scene.
    feedback: "none", "pd" or "computed-torque": see `controllers`.
    bandwidth: of the feedback, in [rad/s].
    intervals: number of steps of the simulation, by default from `steps_on_nodes`.
    inner_modes: as `simulate`.
    Raises InputError if the plan is for another robot, or if the steps are too long.
    """
    expect(plan, Trajectory, "the trajectory of a solution")
    names = scene.robot.coordinate_names
    if plan.coordinate_names != names:
        raise InputError(
            f"the plan moves {', '.join(plan.coordinate_names)}, but the scene's robot "
            f"{scene.robot.name!r} has {', '.join(names)}; use a scene of the plan's robot."
        )
    drive = controller(plan, feedback, scene, bandwidth)
    count = intervals or steps_on_nodes(plan)
    angles = plan.positions(0.0)[0]
    start = State(with_angles(plan.q[0], angles, scene.robot), plan.v[0])
    motion = simulate(scene, start, plan.duration, drive, intervals=count, inner_modes=inner_modes)
    return Tracking(plan, motion, drive)


def steps_on_nodes(plan: Trajectory) -> int:
    """A number of steps, at least 400 per second, that hits every node of the plan.

    Torques jump at nodes, and a step across a jump is of first order for any integrator. If the
    nodes are no multiples of the shortest interval, 400 steps per second.
    """
    count = max(1, math.ceil(STEPS_PER_SECOND * plan.duration))
    multiples = plan.t / plan.grid.steps.min()
    if np.abs(multiples - np.round(multiples)).max() > 1e-6:
        return count
    units = round(float(multiples[-1]))
    return units * math.ceil(count / units)

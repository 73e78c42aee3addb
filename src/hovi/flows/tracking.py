"""Plan simply, check richly: a plan's torques played on a scene with more effects."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.flows.controllers import Controller, controller
from hovi.flows.simulator import Simulation, simulate
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

STEPS_PER_SECOND = 400


@dataclass(frozen=True, eq=False)
class Tracking:
    """A plan and what became of it.

    plan: what was wanted. simulation: what happened. controller: what drove it.
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
        """What happened minus what was wanted, shape (N + 1, nv), in [rad] or [m]."""
        wanted = self.plan.configurations(np.clip(self.t, 0.0, self.plan.duration))
        return self.simulation.scene.robot.difference(wanted, self.simulation.q)

    @property
    def tip_deviation(self) -> Array:
        """Distance between the two places of the robot's tip frame, shape (N + 1,), in [m]."""
        robot = self.simulation.scene.robot
        wanted = self.plan.configurations(np.clip(self.t, 0.0, self.plan.duration))
        places = (robot.frame_position(robot.tip_frame, q) for q in (wanted, self.simulation.q))
        return np.asarray(np.linalg.norm(np.subtract(*places), axis=1))

    @property
    def torque(self) -> Array:
        """u at the nodes, shape (N + 1, nv), in [N m] or [N]."""
        return self.controller.evaluate(self.simulation.q, self.simulation.v, self.t)[0]

    @property
    def feedback_torque(self) -> Array:
        """u less the planned torque, shape (N + 1, nv), in [N m] or [N]."""
        more = self.torque - self.controller.planned(self.t).tau
        more[:, self.simulation.scene.passive_coordinates] = 0.0
        return more


def play(
    scene: Scene,
    plan: Trajectory,
    feedback: str = "none",
    *,
    bandwidth: float = 10.0,
    intervals: int | None = None,
    inner_modes: int = 1,
) -> Tracking:
    """Play a plan's torques on a scene, and see how far it strays.

    scene: what is simulated, of the plan's robot.
    plan: a motion with its torques, which may come from a simpler scene.
    feedback: "none", "pd" or "computed-torque": see `controllers`.
    bandwidth: of the feedback, in [rad/s].
    intervals: steps of the simulation, from `steps_on_nodes` when not given.
    inner_modes: as `simulate`.
    Raises InputError when the plan is another robot's, or the steps are too long to be solved.
    """
    expect(plan, Trajectory, "the trajectory of a solution")
    names = scene.robot.coordinate_names
    if plan.coordinate_names != names:
        raise InputError(
            f"the plan moves {', '.join(plan.coordinate_names)}, but the scene's robot "
            f"{scene.robot.name!r} has {', '.join(names)}; play it on a scene of its own robot."
        )
    drive = controller(plan, feedback, scene, bandwidth)
    count = intervals or steps_on_nodes(plan)
    start = State(plan.q[0], plan.v[0])
    motion = simulate(scene, start, plan.duration, drive, intervals=count, inner_modes=inner_modes)
    return Tracking(plan, motion, drive)


def steps_on_nodes(plan: Trajectory) -> int:
    """At least 400 steps a second that end at every node of the plan, where its torques jump.

    A step across a jump is of first order, whatever the integrator. Where the nodes are no
    multiples of the shortest interval, just that many steps.
    """
    wanted = max(1, math.ceil(STEPS_PER_SECOND * plan.duration))
    places = plan.t / plan.grid.steps.min()
    if np.abs(places - np.round(places)).max() > 1e-6:
        return wanted
    units = round(float(places[-1]))
    return units * math.ceil(wanted / units)

"""Planned torques played back in MuJoCo: another simulator's mass matrix and integrator."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.exchange.libraries import library
from hovi.exchange.mujoco_model import angles, controls, left_out, mjcf, mujoco_scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

TOLERANCE = 1e-3
"""Largest deviation of a joint that counts as following the plan, in [rad] or [m]."""
MAX_STEPS = 10_000_000


@dataclass(frozen=True, eq=False)
class MujocoReplay:
    """A motion as MuJoCo moved it.

    names: of the joints. times: of the steps, shape (M,), in [s].
    q: simulated positions, shape (M, nv). planned: those of the plan.
    left_out: keys of effects that MuJoCo's model does not have, nor its controls.
    """

    names: tuple[str, ...]
    times: Array
    q: Array
    planned: Array
    left_out: tuple[str, ...]

    @property
    def error(self) -> Array:
        """Largest deviation of each joint along the motion, shape (nv,), in [rad] or [m]."""
        return np.asarray(np.abs(self.q - self.planned).max(axis=0))

    @property
    def success(self) -> bool:
        """Whether every joint stays within TOLERANCE of the plan."""
        return bool((self.error <= TOLERANCE).all())  # NaN where the simulation diverges


@check_arguments_except("trajectory")
def replay_in_mujoco(trajectory: Trajectory, step: float = 1e-4) -> MujocoReplay:
    """Apply the planned torques to MuJoCo's model of the robot, without feedback.

    Every interval of the motion is divided into equal steps, as torques may jump at its ends. The
    controls of a step are their mean over it (Simpson's rule), and the integrator is MuJoCo's
    Runge-Kutta method of order 4: errors fall with the square of the step. An unstable motion, such
    as a swing-up, leaves the plan by itself, since small errors grow exponentially.
    step: the longest, in [s].
    Raises InputError for a step that is not positive or gives more than MAX_STEPS, and for a motion
    that MuJoCo's model cannot hold; DisplayError if MuJoCo is missing.
    """
    expect(trajectory, Trajectory, "the trajectory of a solution")
    if not (step > 0 and trajectory.duration / step <= MAX_STEPS):
        raise InputError(
            f"the step must be positive and give at most {MAX_STEPS:,} steps, got {step:g} s."
        )
    scene = mujoco_scene(trajectory)
    mujoco = library("mujoco", "mujoco", "the check in MuJoCo")
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(mjcf(scene), encoding="unicode"))
    steps = trajectory.grid.steps
    k = np.repeat(np.arange(len(steps)), np.ceil(steps / step * (1 - 1e-12)).astype(int))
    count = np.bincount(k)  # of the steps in each interval
    first = np.repeat(np.cumsum(count) - count, count)
    s = (np.arange(len(k)) - first) / count[k]
    driven = np.setdiff1d(np.arange(scene.robot.nv), scene.passive_coordinates)
    parts = (
        controls(scene, *trajectory.jet_intervals(k, np.minimum(s + c / count[k], 1.0)))
        for c in (0.0, 0.5, 1.0)
    )
    mean = np.average(list(parts), axis=0, weights=(1, 4, 1))
    times = np.append(trajectory.t[k] + s * steps[k], trajectory.duration)
    planned = angles(trajectory, trajectory.configurations(times))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = planned[0], trajectory.v[0]
    simulated = _simulate(mujoco, model, data, mean[:, driven], steps[k] / count[k])
    names = scene.robot.coordinate_names
    return MujocoReplay(names, times, simulated, planned, left_out(scene))


def _simulate(mujoco: Any, model: Any, data: Any, tau: Array, steps: Array) -> Array:
    """Positions at the start and after every step, (M + 1, nv). tau: (M, nu). steps: (M,)."""
    positions = np.empty((len(tau) + 1, model.nq))
    positions[0] = data.qpos
    for i, control in enumerate(tau):
        model.opt.timestep = steps[i]
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        positions[i + 1] = data.qpos
    return positions

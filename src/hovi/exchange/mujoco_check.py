"""Planned torques played back in MuJoCo: another simulator's mass matrix and integrator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.exchange.libraries import library
from hovi.exchange.mujoco_model import angles, controls, left_out, mjcf, mujoco_scene
from hovi.system.summary import Summarized, Summary

Array = npt.NDArray[np.float64]

TOLERANCE = 1e-3
"""Largest deviation of a joint that counts as following the plan, in [rad] or [m]."""
MAX_STEPS = 10_000_000


@dataclass(frozen=True, eq=False, repr=False)
class MujocoReplay(Summarized):
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

    def _summary(self) -> Summary:
        worst = int(np.argmax(self.error))  # the first NaN, if there is one
        deviation = f"at most {self.error[worst]:.2e} rad or m, of joint {self.names[worst]!r}"
        rows = [("follows", str(self.success)), ("deviation", deviation)]
        return Summary(f"MujocoReplay in {len(self.times) - 1:,} steps", tuple(rows))


@check_arguments_except("trajectory")
def replay_in_mujoco(trajectory: Trajectory, step: float = 1e-4) -> MujocoReplay:
    """Apply the planned torques to MuJoCo's model of the robot, without feedback.

    Every interval of the motion is divided into equal steps, as torques may jump at its ends.
    MuJoCo's accelerations are integrated by the classical Runge-Kutta method, with the controls of
    each stage: errors fall with the fourth power of the step. Those of an unstable motion grow
    exponentially.
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
    stages = np.stack([part[:, driven] for part in parts], axis=1)  # (M, 3, nu)
    times = np.append(trajectory.t[k] + s * steps[k], trajectory.duration)
    planned = angles(trajectory, trajectory.configurations(times))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = planned[0], trajectory.v[0]
    with np.errstate(over="ignore", invalid="ignore"):  # where the simulation diverges
        simulated = _simulate(mujoco, model, data, stages, steps[k] / count[k])
    names = scene.robot.coordinate_names
    return MujocoReplay(names, times, simulated, planned, left_out(scene))


def _simulate(mujoco: Any, model: Any, data: Any, tau: Array, steps: Array) -> Array:
    """Positions at the start and after every step, (M + 1, nv).

    tau: at the beginning, in the middle and at the end of every step, (M, 3, nu). steps: (M,).
    """
    q, v = data.qpos.copy(), data.qvel.copy()
    positions = np.empty((len(tau) + 1, model.nq))
    positions[0] = q

    def acceleration(q: Array, v: Array, control: Array) -> Array:
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, control
        mujoco.mj_forward(model, data)
        return np.array(data.qacc)

    for i, (h, (first, middle, last)) in enumerate(zip(steps, tau, strict=True)):
        a = acceleration(q, v, first)
        v2 = v + 0.5 * h * a
        a2 = acceleration(q + 0.5 * h * v, v2, middle)
        v3 = v + 0.5 * h * a2
        a3 = acceleration(q + 0.5 * h * v2, v3, middle)
        v4 = v + h * a3
        a4 = acceleration(q + h * v3, v4, last)
        q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v = v + h / 6 * (a + 2 * a2 + 2 * a3 + a4)
        positions[i + 1] = q
    return positions

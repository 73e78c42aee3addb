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
from hovi.exchange.mujoco_model import controls, left_out, mjcf, mujoco_scenes
from hovi.scene.scene import require_inertia
from hovi.system.dataclass import dataclass
from hovi.system.summary import Summarized, Summary

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

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

    Every interval of the motion is divided into equal steps, as torques may jump at its ends, and
    every segment has a model of its own, since bodies may be grasped and released. MuJoCo's
    accelerations are integrated by the classical Runge-Kutta method, with the controls of each
    stage: errors fall with the fourth power of the step. Those of an unstable motion grow
    exponentially.
    step: the longest, in [s].
    Raises InputError for a step that is not positive or gives more than MAX_STEPS, and for a motion
    that MuJoCo's model cannot hold; ModelError for a robot without inertia; DisplayError
    if MuJoCo is missing.
    """
    expect(trajectory, Trajectory, "the trajectory of a solution")
    if not (step > 0 and trajectory.duration / step <= MAX_STEPS):
        raise InputError(
            f"the step must be positive and give at most {MAX_STEPS:,} steps, got {step:g} s."
        )
    scenes = mujoco_scenes(trajectory)
    for scene, _ in scenes:
        require_inertia(scene, "the check in MuJoCo")
    mujoco = library("mujoco", "mujoco", "the check in MuJoCo")
    lengths = trajectory.grid.steps
    counts = np.ceil(lengths / step * (1 - 1e-12)).astype(np.intp)  # of the steps in each interval
    ends = np.cumsum([0, *(intervals for _, intervals in scenes)])
    q, v = trajectory.positions(0.0)[0], trajectory.v[0]
    simulated = [q[None]]
    for (scene, _), first, last in zip(scenes, ends[:-1], ends[1:], strict=True):
        k, s = _steps(counts[first:last], first)
        driven = np.setdiff1d(np.arange(scene.robot.nv), scene.passive_coordinates)
        stages = (
            controls(scene, *trajectory.jet_intervals(k, np.minimum(s + c / counts[k], 1.0)))
            for c in (0.0, 0.5, 1.0)
        )
        tau = np.stack([each[:, driven] for each in stages], axis=1)  # (M, 3, nu)
        model = mujoco.MjModel.from_xml_string(
            ElementTree.tostring(mjcf(scene), encoding="unicode")
        )
        with np.errstate(over="ignore", invalid="ignore"):  # where the simulation diverges
            positions, v = _simulate(mujoco, model, (q, v), tau, lengths[k] / counts[k])
        simulated.append(positions)
        q = positions[-1]
    k, s = _steps(counts, 0)
    times = np.append(trajectory.t[k] + s * lengths[k], trajectory.duration)
    planned = trajectory.positions(times)
    missing = tuple(dict.fromkeys(key for scene, _ in scenes for key in left_out(scene)))
    names = scenes[0][0].robot.coordinate_names
    return MujocoReplay(names, times, np.concatenate(simulated), planned, missing)


def _steps(counts: Index, first: int) -> tuple[Index, Array]:
    """The interval of every step, and where in it the step begins, from 0 to 1.

    counts: of the steps in successive intervals, of which `first` is the first.
    """
    k = np.repeat(np.arange(len(counts)), counts)
    before = np.cumsum(counts) - counts
    return k + first, (np.arange(len(k)) - before[k]) / counts[k]


def _simulate(
    mujoco: Any, model: Any, state: tuple[Array, Array], tau: Array, steps: Array
) -> tuple[Array, Array]:
    """Positions after every step, (M, nv), and the last velocity, from a position and velocity.

    tau: at the beginning, in the middle and at the end of every step, (M, 3, nu). steps: (M,).
    """
    data = mujoco.MjData(model)
    q, v = state
    positions = np.empty((len(tau), model.nq))

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
        positions[i] = q
    return positions, v

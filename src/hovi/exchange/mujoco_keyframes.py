"""A motion for MuJoCo: the robot, and a keyframe with positions, velocities and controls a sample.

`mj_resetDataKeyframe` sets one; the viewer lists them.
"""

from __future__ import annotations

import os
import re
from xml.etree import ElementTree

import numpy as np

from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.exchange.mujoco_model import controls, left_out, mjcf, mujoco_scene
from hovi.exchange.samples import times_of
from hovi.exchange.whole_export import whole_export


def write_mujoco(trajectory: Trajectory, path: str | os.PathLike[str], rate: float = 50.0) -> None:
    """Write one MJCF file. MuJoCo is not needed for it.

    Controls are the torques of the planned motion that belong to this model: rigid bodies, armature
    and viscous friction; comments name the effects that it does not have, and have the motion's
    cautions. Passive joints have no motor. The robot is drawn by bars, without its meshes.
    rate: keyframes per second.
    Raises InputError for an invalid rate and for a motion that a MuJoCo model cannot hold,
    DisplayError when the file cannot be written.
    """
    times, scene = times_of(trajectory, rate), mujoco_scene(trajectory)
    q, v, a = trajectory.jet(times)
    driven = np.setdiff1d(np.arange(scene.robot.nv), scene.passive_coordinates)
    root, tau = mjcf(scene), controls(scene, q, v, a)[:, driven]
    keys = ElementTree.SubElement(root, "keyframe")
    for t, x, rates, control in zip(times, trajectory.positions(times), v, tau, strict=True):
        ElementTree.SubElement(
            keys, "key", name=f"t={t:.9g}", time=repr(float(t)), qpos=_text(x), qvel=_text(rates),
            ctrl=_text(control),
        )  # fmt: skip
    missing = ", ".join(left_out(scene)) or "none"
    root.insert(0, ElementTree.Comment(f" effects that are not in this model: {missing} "))
    for each in caution_lines([trajectory.metadata]):
        root.insert(0, ElementTree.Comment(f" {re.sub('-+', '-', each)} "))
    ElementTree.indent(root)
    with whole_export(path, "MuJoCo model") as stream:
        stream.write(ElementTree.tostring(root) + b"\n")


def _text(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    return " ".join(map(repr, values.tolist()))

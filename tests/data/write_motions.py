"""Writes the motions of this folder: `PYTHONPATH=tests python tests/data/write_motions.py FOLDER`.

They were written once, by commit 52293327, and are read ever since: such files have to load,
whatever plans motions later. All but one are without meshes. Their samples are in samples.json as
plain numbers: q, v, a and tau at 9 equally spaced times, the costates at the nodes, and the cost.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

import hovi
from samples.mesh_package import mesh_package

STEPS = 8
"""Between the times at which a motion is sampled."""


def two_link(*effects: hovi.effects.Effect) -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), list(effects))


def free(**options: Any) -> hovi.Solution:
    """Without limits, on intervals of one scheme, with friction and a weight of the torques."""
    e = hovi.effects
    scene = two_link(e.Gravity(), e.ViscousFriction(0.3), e.EffortWeight((1.0, 2.0)))
    grid = {"scheme": "galerkin-2", "intervals": 12, "limits": "none"}
    ends = hovi.State([0.2, -0.4], [0.5, 0.0]), hovi.State([1.8, 0.9])
    return hovi.plan(scene, *ends, 1.2, **grid, **options)


def limited(**options: Any) -> hovi.Solution:
    """A UR5 along limits of its speeds and torques, on the grid that a tolerance asked for."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start, goal = [0.0, -1.2, 1.5, -0.3, 0.5, 0.0], [1.6, -0.8, 1.0, 0.4, -0.3, 1.0]
    limits = {"v": 2.0, "tau": [140.0, 90.0, 90.0, 25.0, 25.0, 25.0]}
    return hovi.plan(scene, start, goal, 1.2, limits=limits, self_collision=False, **options)


def smooth(**options: Any) -> hovi.Solution:
    """With a cost on the jerk: a Lagrangian of order 3, and accelerations at the ends."""
    ends = hovi.State([0.0, 0.0]), hovi.State([1.5, 0.6])
    limits = {"base": "none", "v": 2.2}
    return hovi.plan(
        two_link(hovi.effects.Gravity()), *ends, 1.2, smooth=True, limits=limits, **options
    )


def group(**options: Any) -> hovi.Solution:
    """A flying body that turns over once."""
    return hovi.plan_task(hovi.load_task(hovi.example("flying_body_flip")), **options)


def sequence(**options: Any) -> hovi.Solution:
    """An arm that reaches for a load, carries it, and returns without it."""
    return hovi.plan_task(hovi.load_task(hovi.example("two_link_pick")), **options)


def model(**options: Any) -> hovi.Solution:
    """A robot that is a Pinocchio model, so that its file has torques instead of a scene.

    Its first joint is continuous, and starts a full turn further than its cosine and sine say.
    """
    turning = pin.Model()
    turning.name = "turning"
    at = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.3]))
    body = pin.Inertia(1.0, np.array([0.1, 0.0, 0.2]), np.diag([0.02, 0.03, 0.01]))
    for name, joint in (("turn", pin.JointModelRUBY()), ("bend", pin.JointModelRX())):
        parent = turning.njoints - 1
        place = at if parent else pin.SE3.Identity()
        turning.appendBodyToJoint(
            turning.addJoint(parent, joint, place, name), body, pin.SE3.Identity()
        )
    scene = hovi.Scene(hovi.load_robot(turning), [hovi.effects.Gravity()])
    start, goal = {"turn": 7.0, "bend": 0.3}, {"turn": 8.5, "bend": -0.5}
    grid = {"scheme": "galerkin-3", "intervals": 8, "limits": "none"}
    return hovi.plan(scene, start, goal, 1.0, **grid, **options)


def meshes(folder: Path) -> hovi.Solution:
    """An arm whose links are drawn by meshes of a package in a folder, which its file keeps."""
    scene = hovi.Scene(hovi.load_robot(mesh_package(folder)), [hovi.effects.Gravity()])
    start, goal = [0.0, 0.3, 0.5, 0.0, 0.4, 0.0], [0.9, -0.3, 0.9, 0.5, 0.8, -0.5]
    return hovi.plan(scene, start, goal, 1.5, limits="none")


MOTIONS: dict[str, Callable[..., hovi.Solution]] = {
    each.__name__: each for each in (free, limited, smooth, group, sequence, model)
}


def numbers_of(found: hovi.Solution) -> dict[str, Any]:
    """A motion as numbers that need no file format of hovi."""
    motion = found.trajectory
    t = np.linspace(0.0, motion.duration, STEPS + 1)
    sample = motion.sample(t)
    arrays = {"t": t, **sample._asdict(), "nodes": motion.t, "momenta": motion.momenta}
    plain: dict[str, Any] = {name: each.tolist() for name, each in arrays.items()}
    return {"cost": found.cost, **plain}


def main(folder: Path) -> None:
    samples = {}
    with tempfile.TemporaryDirectory() as package:
        for name, planned in {**MOTIONS, "meshes": lambda: meshes(Path(package))}.items():
            found = planned()
            assert found.success, found.message
            found.trajectory.save(folder / f"{name}.npz", meshes=name == "meshes")
            samples[name] = numbers_of(found)
    (folder / "samples.json").write_text(json.dumps(samples) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

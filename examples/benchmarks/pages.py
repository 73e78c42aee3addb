"""Sizes of the replay pages of arms, next to those of the mesh files that they draw."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
from measuring import print_table

import hovi

ROBOTS = ("ur5", "panda", "ur10", "xarm7", "kinova", "z1", "tiago", "solo12")


def motion_of(name: str) -> hovi.Trajectory:
    """All joints turn by 0.5 rad in 2 s."""
    robot = hovi.load_robot(name)
    start = robot.neutral()
    goal = pin.integrate(robot.model, start, np.full(robot.nv, 0.5))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    known = {"limits": "none", "self_collision": False, "intervals": 6, "max_iterations": 1}
    with warnings.catch_warnings():  # of a motion that is no minimum
        warnings.simplefilter("ignore")
        return hovi.plan(scene, start, goal, 2.0, **known).trajectory


def row(name: str) -> list[str]:
    motion = motion_of(name)
    assert motion.robot is not None
    assert motion.robot.visual is not None
    drawn = motion.robot.visual.geometryObjects
    shapes = [each for each in drawn if Path(each.meshPath).is_file()]
    files = {each.meshPath for each in shapes}
    triangles = sum(each.geometry.num_tris for each in shapes)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        hovi.replay(motion, html=Path(folder) / "page.html")
        hovi.write_report(motion, Path(folder) / "report.html")
        page, report = (Path(folder) / f"{each}.html" for each in ("page", "report"))
        sizes = [page.stat().st_size, report.stat().st_size]
    kept = sum(Path(each).stat().st_size for each in files)
    numbers = [f"{x / 1e6:.1f}" for x in (kept, *sizes)]
    return [name, str(motion.robot.nv), f"{triangles:,}", *numbers]


def main() -> None:
    columns = ["robot", "joints", "triangles", "mesh files [MB]", "page [MB]", "report [MB]"]
    print_table(columns, [row(name) for name in ROBOTS])


if __name__ == "__main__":
    main()

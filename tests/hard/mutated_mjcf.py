"""Mutated MJCFs; those that load have the masses that MuJoCo reads, where it reads them."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import numpy as np

from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict, judge
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from samples.mjcf_family import mjcf

TOKENS = (
    *(b"<body>", b"</body>", b"<frame>", b"<worldbody>", b"</worldbody>", b"<joint/>", b"<geom/>"),
    *(b'<include file="robot.xml"/>', b'<!DOCTYPE a [<!ENTITY b "c">]>', b"&b;", b"<replicate/>"),
    *(b"nan", b"inf", b"-1", b"1e400", b"0 0 0", b"", b" ", b"\0", b"\xff", b"1_0", b"class="),
    *(b'mass="-1"', b'type="ball"', b'type="free"', b"<freejoint/>", b"<equality>", b"<default>"),
)
NUMBER = re.compile(rb"(?<![\w.-])-?\d+\.\d+")
NOT_A_MASS = (
    b"nan",
    b"inf",
    b"-inf",
    b"1e400",
    b"1,5",
    b"1_0",
    b"0x10",
    b"1 2",
    b"",
    b"-1",
    b"abc",
)


def mutate(random: Random) -> Mutant:
    """A random robot: as it is, with changed bytes or numbers, or with an error."""
    text, kind = mjcf(random).encode(), random.random()
    if kind < 0.2:
        return Mutant(text)
    if kind < 0.5:
        return Mutant(mutated_bytes(text, random, TOKENS))
    if kind < 0.7:
        found = random.choice([*NUMBER.finditer(text)])
        return Mutant(text[: found.start()] + random.choice(TOKENS) + text[found.end() :])
    body = b'<body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
    wrong, reason = random.choice(
        (
            (body.replace(b'"1"', b'"%s"' % random.choice(NOT_A_MASS)), "a mass is no mass"),
            (body.replace(b"1 1 1", b"1 1 -1"), "a principal inertia is negative"),
            (body.replace(b"<joint", b'<joint axis="0 0 0"'), "an axis has no direction"),
            (body.replace(b"<joint", b'<joint type="screw"'), "a joint is of no known type"),
            (body.replace(b"mass=", b"mas="), "an attribute is misspelt"),
            (b"<body>" * 500 + b"</body>" * 500, "it is nested too deep"),
            (body * 1_100, "it has too many bodies"),
            (b'<include file="robot.xml"/>', "it includes itself"),
            (b'<composite type="cable"/>', "it has bodies that are not read"),
        )
    )
    return Mutant(text.replace(b"</worldbody>", wrong + b"</worldbody>", 1), reason)


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`."""
    path = folder / "robot.xml"
    path.write_bytes(mutant.content)
    return judge(lambda: load_robot(path), lambda robot: _error_in(robot, path), mutant.reason)


def _error_in(robot: Robot, path: Path) -> str:
    robot.describe()
    numbers = [x for each in robot.model.inertias for x in each.toDynamicParameters()]
    numbers += [x for place in robot.model.jointPlacements for x in place.homogeneous.ravel()]
    if not np.isfinite(numbers).all():
        return "it holds numbers that are not finite"
    masses = sum(each.mass for each in robot.model.inertias)
    return _difference(masses, path)


def _difference(mass: float, path: Path) -> str:
    """In what MuJoCo's model differs; "" where it reads none, or is not installed."""
    try:
        import mujoco

        peer = mujoco.MjModel.from_xml_path(str(path))
    except (ImportError, ValueError):
        return ""
    theirs = float(peer.body_mass.sum())
    return "" if abs(mass - theirs) <= 1e-9 * max(mass, 1.0) else f"{mass} kg, MuJoCo: {theirs} kg"

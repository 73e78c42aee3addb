"""A planar chain of n equal links as a URDF: a family of test problems of any size."""

from __future__ import annotations

import os
from pathlib import Path

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError
from hovi.robot.urdf.check import MAX_DOF
from hovi.system.files import whole_file

MAX_SIZE = 1e6
"""Largest length in [m] and mass in [kg] of a link."""

_COLORS = ("0.16 0.44 0.74 1", "0.95 0.55 0.15 1")

_LINK = """
  <link name="link{i}">
    <inertial>
      <origin xyz="{middle!r} 0 0" rpy="0 0 0"/>
      <mass value="{mass!r}"/>
      <inertia ixx="{along!r}" ixy="0" ixz="0" iyy="{across!r}" iyz="0" izz="{across!r}"/>
    </inertial>
    <visual>
      <origin xyz="{middle!r} 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="{radius!r}" length="{length!r}"/></geometry>
      <material name="color{parity}"><color rgba="{color}"/></material>
    </visual>
    <visual>
      <geometry><sphere radius="{ball!r}"/></geometry>
      <material name="joint"><color rgba="0.25 0.27 0.30 1"/></material>
    </visual>
  </link>
  <joint name="joint{i}" type="revolute">
    <parent link="{parent}"/>
    <child link="link{i}"/>
    <origin xyz="{offset!r} 0 0" rpy="0 0 0"/>
    <axis xyz="0 -1 0"/>
    <limit lower="-1000" upper="1000" effort="1000" velocity="1000"/>
  </joint>"""


@check_arguments_except("n")
def chain(n: int, *, length: float = 1.0, mass: float = 1.0) -> str:
    """The URDF of a serial chain of n uniform rods in the vertical plane x-z.

    Joints "joint1" ... rotate about -y: at zero angles the chain lies along +x, and positive angles
    lift it against gravity. The frame "tip" is the end of the last rod.

    n: number of links, 1 to 250.
    length: of each link, in [m].
    mass: of each link, in [kg].
    Raises InputError for anything else.
    """
    if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= MAX_DOF:
        raise InputError(f"a chain has 1 to {MAX_DOF} links, not {n!r}.")
    if not (0.0 < length <= MAX_SIZE and 0.0 < mass <= MAX_SIZE):
        raise InputError(
            f"a chain needs a positive length and mass of at most {MAX_SIZE:g} m and kg, not "
            f"{length!r}, {mass!r}."
        )
    links = "".join(_link(i, float(length), float(mass)) for i in range(1, n + 1))
    return (
        f'<?xml version="1.0"?>\n<robot name="chain_{n}">\n  <link name="base"/>{links}\n'
        '  <link name="tip"/>\n  <joint name="tip_mount" type="fixed">\n'
        f'    <parent link="link{n}"/>\n    <child link="tip"/>\n'
        f'    <origin xyz="{float(length)!r} 0 0" rpy="0 0 0"/>\n  </joint>\n</robot>\n'
    )


def write_chain(path: str | os.PathLike[str], n: int, **options: float) -> Path:
    """Write `chain(n, **options)` to a file and return its path."""
    target = Path(path)
    with whole_file(target) as stream:
        stream.write(chain(n, **options).encode())
    return target


def _link(i: int, length: float, mass: float) -> str:
    """Rod i: a solid cylinder whose radius is a thirtieth of its length."""
    radius = length / 30.0
    return _LINK.format(
        i=i,
        parent="base" if i == 1 else f"link{i - 1}",
        offset=0.0 if i == 1 else length,
        middle=length / 2.0,
        length=length,
        mass=mass,
        radius=radius,
        ball=1.6 * radius,
        along=mass * radius**2 / 2.0,
        across=mass * (length**2 / 12.0 + radius**2 / 4.0),
        parity=i % 2,
        color=_COLORS[i % 2],
    )

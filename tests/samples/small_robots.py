"""Small robots with limits and collision shapes, of one kind of joint each, as URDFs."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import hovi

LENGTH, RADIUS = 0.4, 0.08
"""Of a link and of the ball in its middle, in [m]."""
LINK = f"""<link name="{{0}}"><inertial><origin xyz="{LENGTH / 2} 0 0"/><mass value="0.5"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="{LENGTH / 2} 0 0"/>
<geometry><sphere radius="{RADIUS}"/></geometry></collision>
</link>"""
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>
<origin xyz="{4} 0 0"/><axis xyz="{5}"/>
<limit lower="-2.5" upper="2.5" velocity="6" effort="30"/></joint>"""
AXES = "0 1 0", "0 0 1", "1 0 0"


@cache
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def arm(name: str, kinds: Sequence[str], free_flyer: bool = False) -> hovi.Robot:
    """A chain of links l0, l1, ... with joints j1, j2, ... of URDF's kinds, which turn in turn."""
    parts = [LINK.format("l0")]
    for i, kind in enumerate(kinds, start=1):
        at = LENGTH if i > 1 or free_flyer else 0.0
        parts += [
            LINK.format(f"l{i}"),
            JOINT.format(f"j{i}", kind, f"l{i - 1}", f"l{i}", at, AXES[(i - 1) % 3]),
        ]
    path = _folder() / f"{name}.urdf"
    path.write_text(f'<robot name="{name}">{"".join(parts)}</robot>')
    return hovi.load_robot(path, free_flyer=free_flyer or None)


BALL = 0.05
"""Radius of the collision shapes of `with_shapes`, in [m]."""


@cache
def with_shapes(model: str, base: str = "", above: float = 0.0) -> hovi.Robot:
    """A model of the project, with a ball as the collision shape of every link of its own mass.

    base: a link without a mass that gets one, too, at a height above its origin, in [m].
    """
    ball = f'<geometry><sphere radius="{BALL}"/></geometry></collision>'
    text = Path(hovi.example(model)).read_text()
    text = text.replace("</inertial>", f"</inertial><collision>{ball}")
    shaped = f'<link name="{base}"><collision><origin xyz="0 0 {above}"/>{ball}'
    text = text.replace(f'<link name="{base}">', shaped) if base else text
    path = _folder() / f"{base}{model}"
    path.write_text(text)
    return hovi.load_robot(path)

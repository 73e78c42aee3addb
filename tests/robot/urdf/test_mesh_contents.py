"""A mesh without usable contents is left out by name, and the other shapes stay."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from hovi import plan
from hovi.errors import ModelError
from hovi.planning.clearance.obstacles import Sphere
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.viewing.replay_session import replay

CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
LINK = """<link name="{name}"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="{mesh}"/></geometry></visual>
<collision><geometry><mesh filename="{mesh}"/></geometry></collision></link>"""
URDF = """<robot name="two"><link name="base"/>{first}{second}
<joint name="one" type="revolute"><parent link="base"/><child link="first"/>
<limit lower="-1" upper="1" effort="9" velocity="9"/></joint>
<joint name="two" type="revolute"><parent link="first"/><child link="second"/>
<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>"""


def binary_stl(size: float) -> bytes:
    """A tetrahedron, one corner of which is `size` away."""
    corners = [
        tuple(size * x for x in corner) if i == 1 else corner for i, corner in enumerate(CORNERS)
    ]
    data = bytes(80) + struct.pack("<I", len(FACES))
    for face in FACES:
        data += struct.pack("<12fH", 0, 0, 1, *(x for i in face for x in corners[i]), 0)
    return data


def obj(size: str) -> bytes:
    lines = ["v 0 0 0", f"v {size} 0 0", "v 0 1 0", "v 0 0 1"]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]
    return "\n".join(lines).encode()


GOOD = binary_stl(1.0)
UNREADABLE: Mapping[str, bytes] = {
    "empty.stl": b"",
    "text.stl": b"this is no mesh",
    "cut.stl": GOOD[:100],
    "xml.dae": b"<COLLADA>",
    "points.obj": b"v 1 0 0\nv 0 1 0\n",
    "unknown.xyz": b"what",
}
UNUSABLE: Mapping[str, bytes] = {
    "nan.stl": binary_stl(float("nan")),
    "inf.stl": binary_stl(float("inf")),
    "huge.stl": binary_stl(3e38),
    "nan.obj": obj("nan"),
}


def robot_with(mesh: str, data: bytes, folder: Path) -> Robot:
    """Two links with a mesh each, the second of which is `mesh`."""
    (folder / "good.stl").write_bytes(GOOD)
    (folder / mesh).write_bytes(data)
    urdf = folder / "two.urdf"
    first, second = (
        LINK.format(name=name, mesh=file)
        for name, file in (("first", "good.stl"), ("second", mesh))
    )
    urdf.write_text(URDF.format(first=first, second=second))
    return load_robot(urdf)


@pytest.mark.parametrize("mesh", [*UNREADABLE, *UNUSABLE])
@pytest.mark.parametrize("kind", ["visual", "collision"])
def test_a_mesh_without_usable_contents_is_left_out_by_name(
    kind: str, mesh: str, tmp_path: Path
) -> None:
    robot = robot_with(mesh, (UNREADABLE | UNUSABLE)[mesh], tmp_path)
    shapes, problem = getattr(robot, kind), getattr(robot, f"{kind}_problem")
    assert [item.name for item in shapes.geometryObjects] == ["first_0"]
    assert problem.startswith(f"robot 'two.urdf' lacks {kind} shapes: link 'second': mesh '{mesh}'")
    assert "\n" not in problem
    assert "assimp" not in problem
    assert "/project/" not in problem


def test_good_meshes_are_kept(tmp_path: Path) -> None:
    robot = robot_with("other.obj", obj("1"), tmp_path)
    assert robot.collision_problem == robot.visual_problem == ""
    assert robot.collision is not None
    assert robot.collision.ngeoms == 2


@pytest.mark.parametrize("mesh", ["text.stl", "nan.stl"])
def test_what_needs_every_shape_says_which_is_missing(mesh: str, tmp_path: Path) -> None:
    robot = robot_with(mesh, (UNREADABLE | UNUSABLE)[mesh], tmp_path)
    with pytest.raises(ModelError, match=f"need every collision shape: .*mesh '{mesh}'"):
        plan(Scene(robot), np.zeros(2), np.full(2, 0.1), 1.0, obstacles=[Sphere([9, 9, 9], 0.1)])


def test_a_replay_shows_the_shapes_that_are_left(tmp_path: Path) -> None:
    robot = robot_with("nan.stl", UNUSABLE["nan.stl"], tmp_path)
    motion = plan(Scene(robot), np.zeros(2), np.full(2, 0.1), 1.0, intervals=4).trajectory
    replay(motion, html=tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size > 0

"""No mesh ends the process or lasts: it is read with its own volume, or refused in a sentence."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.errors import HoviError, HoviWarning
from samples.mesh_files import CUBE, CUBE_FACES, WRITERS, collada, obj, off, ply_big, ply_text
from samples.meshes import mesh_arm

POINT = b"0.0 0.0 0.0 7\n"
NODE = '<node id="a"><instance_geometry url="#g"/><instance_node url="#a"/></node>'
LAUGHS = '<node id="n0"><instance_geometry url="#g"/></node>' + "".join(
    f'<node id="n{k}">' + f'<instance_node url="#n{k - 1}"/>' * 10 + "</node>" for k in range(1, 30)
)
STAR = [
    [(1 + k % 2) * math.cos(1e-3 * k), (1 + k % 2) * math.sin(1e-3 * k), 0.0] for k in range(2_000)
]
BEYOND = [[0, 2, 10**9, 1], *CUBE_FACES[1:]]
HOSTILE = {
    "vertices that it does not have.ply": ply_text(CUBE, BEYOND),
    "vertices that it does not have, binary.ply": ply_big(CUBE, BEYOND),
    "negative vertices.off": off(CUBE, [[0, -2, 3, 1], *CUBE_FACES[1:]]),
    "a cycle of nodes.dae": collada(CUBE, CUBE_FACES, NODE),
    "nodes shown without end.dae": collada(CUBE, CUBE_FACES, LAUGHS),
    "deep nodes.dae": collada(CUBE, CUBE_FACES, "<node>" * 10**5 + "</node>" * 10**5),
    "1e9 vertices.ply": ply_text(CUBE, CUBE_FACES).replace(b"vertex 8", b"vertex 1000000000"),
    "1e9 vertices.off": off(CUBE, CUBE_FACES).replace(b"8 6 0", b"1000000000 6 0"),
    "1e9 facets.stl": bytes(80) + (10**9).to_bytes(4, "little") + bytes(50),
    "fewer vertices.ply": ply_text(CUBE, CUBE_FACES).replace(POINT, b"", 1),
    "one more vertex.ply": ply_text(CUBE, CUBE_FACES).replace(b"vertex 8", b"vertex 9"),
    "many corners.obj": obj(STAR, [list(range(len(STAR)))]),
    "not a number.obj": obj([[math.nan, 0.0, 0.0], *CUBE[1:]], CUBE_FACES),
    "another shape than the text.stl": b"solid a\nfacet\nendsolid a\n",
    "no faces.ply": ply_text(CUBE, []),
    "words.obj": b"v a b c\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
}
RUN = """
import sys, hovi
mesh, urdf = sys.argv[1:]
try:
    hovi.Mesh(mesh)
except hovi.errors.HoviError as error:
    print(error)
print(hovi.load_robot(urdf).collision_problem)
"""


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_mesh_is_refused_by_name(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(HOSTILE[name])
    with pytest.raises(HoviError, match=rf"^mesh '{name}' [^\n]*\.$"):
        hovi.Mesh(path)
    robot = hovi.load_robot(mesh_arm(tmp_path, name))
    assert robot.collision is None
    assert f"link 'rod': mesh '{name}' " in robot.collision_problem


def test_a_pipe_a_device_and_a_folder_are_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ply")
    (tmp_path / "device.stl").symlink_to("/dev/zero")
    (tmp_path / "folder.obj").mkdir()
    for name in ("pipe.ply", "device.stl", "folder.obj"):
        command = [sys.executable, "-c", RUN, str(tmp_path / name), str(mesh_arm(tmp_path, name))]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        assert done.stdout.count(name) == 2, done.stdout


@pytest.mark.parametrize("way", WRITERS)
def test_the_same_mesh_is_the_same_obstacle_in_every_format(way: str, tmp_path: Path) -> None:
    """A ball is equally far from it; the same is true of the link that has it as its shape."""
    suffix, write = WRITERS[way]
    path = tmp_path / f"cube{suffix}"
    path.write_bytes(write(CUBE, CUBE_FACES))
    with warnings.catch_warnings():
        warnings.simplefilter("error", HoviWarning)  # a hull that fills more than the mesh
        (body,) = hovi.Mesh(path).bodies()
    corners = np.array(body.shape.points())
    np.testing.assert_allclose(np.unique(np.round(corners, 6), axis=0), sorted(CUBE))
    shapes = hovi.load_robot(mesh_arm(tmp_path, path.name)).collision
    assert shapes is not None
    vertices = np.array(shapes.geometryObjects[0].geometry.vertices())
    np.testing.assert_allclose(np.unique(np.round(vertices, 6), axis=0), sorted(CUBE))

"""A ROS package with an arm of six axes, whose links are drawn by meshes of several formats."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

from samples.mesh_files import CUBE, CUBE_FACES, Points, collada, obj, ply_little, stl_binary
from samples.meshes import textured

PACKAGE = "own_arm"
LENGTH, WIDTH = 0.25, 0.08
"""Of a link, in [m]."""
BAR: Points = [[WIDTH * (x - 0.5), WIDTH * (y - 0.5), LENGTH * z] for x, y, z in CUBE]
PLATE: Points = [[0.2 * x - 0.1, 0.02 * y, 0.15 * z] for x, y, z in CUBE]
AXES = "0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"
LIBRARY = "newmtl paint\nKd 0.1 0.4 0.9\nmap_Kd ../textures/wood.png\n"
_SHAPE = """<{kind}><origin xyz="{at}"/><geometry>
<mesh filename="package://own_arm/meshes/{mesh}" scale="{scale}"/></geometry>{color}</{kind}>"""
_LINK = """<link name="l{i}"><inertial><origin xyz="0 0 0.12"/><mass value="{mass}"/>
<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>{shapes}</link>"""
_JOINT = """<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/>
<origin xyz="0 0 {z}"/><axis xyz="{axis}"/>
<limit lower="-2.8" upper="2.8" velocity="4" effort="200"/></joint>"""
DRAWN = "bar.stl", "plate.obj", "bar.dae", "flag.dae", "bar.ply", "same bar.stl"
"""The visual mesh of each link."""
FILES = (*(f"meshes/{each}" for each in DRAWN), "meshes/paint.mtl", "textures/wood.png")


def picture(size: int = 16) -> bytes:
    """A PNG of red and yellow stripes."""
    row = b"\0" + b"".join(b"\xd0\x20\x10" if x % 4 < 2 else b"\xf0\xd0\x10" for x in range(size))
    parts = (
        (b"IHDR", struct.pack(">2I5B", size, size, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(row * size)),
        (b"IEND", b""),
    )
    chunks = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def mesh_package(folder: Path) -> Path:
    """Write the package into a folder; returns the path of its URDF."""
    package = folder / PACKAGE
    for name in ("meshes", "textures", "urdf"):
        (package / name).mkdir(parents=True)
    (package / "package.xml").write_text(f"<package><name>{PACKAGE}</name></package>")
    bar = stl_binary(BAR, CUBE_FACES)
    contents = {
        "meshes/bar.stl": bar,
        "meshes/same bar.stl": bar,
        "meshes/plate.obj": b"mtllib paint.mtl\nusemtl paint\n" + obj(PLATE, CUBE_FACES),
        "meshes/bar.dae": collada(BAR, CUBE_FACES),
        "meshes/flag.dae": textured("../textures/wood.png").encode(),
        "meshes/bar.ply": ply_little(BAR, CUBE_FACES),
        "meshes/paint.mtl": LIBRARY.encode(),
        "textures/wood.png": picture(),
    }
    for name, content in contents.items():
        (package / name).write_bytes(content)
    urdf = package / "urdf" / "arm.urdf"
    urdf.write_text(_urdf())
    return urdf


def _urdf() -> str:
    parts = ['<robot name="own_arm"><link name="base"/>']
    for i, (axis, mesh) in enumerate(zip(AXES, DRAWN, strict=True), start=1):
        scale = "0.3 0.3 0.3" if mesh == "flag.dae" else "1 1 1"
        color = f'<material name="m{i}"><color rgba="{0.15 * i} 0.5 {1 - 0.15 * i} 1"/></material>'
        shown = _SHAPE.format(kind="visual", at="0 0 0", mesh=mesh, scale=scale, color=color)
        solid = _SHAPE.format(
            kind="collision", at="0 0 0.1", mesh="bar.stl", scale="0.5 0.5 0.4", color=""
        )
        shapes = shown + solid
        parent, z = ("base", 0.0) if i == 1 else (f"l{i - 1}", LENGTH)
        parts.append(_LINK.format(i=i, mass=3.0 / i, shapes=shapes))
        parts.append(_JOINT.format(i=i, parent=parent, z=z, axis=axis))
    return "".join([*parts, "</robot>"])

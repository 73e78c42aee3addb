"""The same surface in every format and way of writing that hovi reads."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from samples.meshes import NAMESPACE

Points = Sequence[Sequence[float]]
Faces = Sequence[Sequence[int]]

CUBE: Points = [[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
CUBE_FACES: Faces = [
    *([0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4]),
    *([2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]),
]
"""A cube of 1 m, whose faces have four corners and turn outwards."""
U_SHAPE: Points = [
    [x, y, z]
    for z in (0.0, 1.0)
    for x, y in ((0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2))
]
U_FACES: Faces = [
    [7, 6, 5, 4, 3, 2, 1, 0],
    [8, 9, 10, 11, 12, 13, 14, 15],
    *([i, (i + 1) % 8, (i + 1) % 8 + 8, i + 8] for i in range(8)),
]
"""A prism of 5 m^3 with two faces of eight corners that are not convex."""


def triangles(faces: Faces) -> list[list[int]]:
    """Faces in triangles that begin at their first corners."""
    return [[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)]


def stl_text(points: Points, faces: Faces) -> bytes:
    lines = ["solid s"]
    for face in triangles(faces):
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {_text(points[i])}" for i in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid s\n"]).encode()


def stl_binary(points: Points, faces: Faces) -> bytes:
    data = b"solid" + bytes(75) + struct.pack("<I", len(triangles(faces)))
    for face in triangles(faces):
        data += struct.pack("<12fH", 0, 0, 0, *(x for i in face for x in points[i]), 0)
    return data


def obj(points: Points, faces: Faces) -> bytes:
    lines = ["# a comment", "o s", *(f"v {_text(p)}" for p in points), "vn 0 0 1"]
    lines += ["f " + " ".join(f"{i + 1}//1" for i in face) for face in faces]
    return "\n".join([*lines, ""]).encode()


def obj_counted_back(points: Points, faces: Faces) -> bytes:
    lines = [*(f"v {_text(p)} 0.5 0.5 0.5" for p in points), "vt 0 0"]
    lines += ["f " + " \\\n".join(f"{i - len(points)}/1" for i in face) for face in faces]
    return "\r\n".join([*lines, ""]).encode()


def off(points: Points, faces: Faces) -> bytes:
    lines = ["OFF # a comment", f"{len(points)} {len(faces)} 0", *map(_text, points)]
    return "\n".join([*lines, *(f"{len(f)} {_text(f)} 255 0 0" for f in faces), ""]).encode()


def _ply_header(form: str, points: Points, faces: Faces) -> bytes:
    lines = ["ply", f"format {form} 1.0", "comment made by hand", f"element vertex {len(points)}"]
    lines += [f"property double {axis}" for axis in "xyz"] + ["property uchar red"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join([*lines, ""]).encode()


def ply_text(points: Points, faces: Faces) -> bytes:
    lines = [*(f"{_text(p)} 7" for p in points), *(f"{len(f)} {_text(f)}" for f in faces), ""]
    return _ply_header("ascii", points, faces) + "\n".join(lines).encode()


def ply_little(points: Points, faces: Faces) -> bytes:
    return _ply_binary("<", "binary_little_endian", points, faces)


def ply_big(points: Points, faces: Faces) -> bytes:
    return _ply_binary(">", "binary_big_endian", points, faces)


def _ply_binary(order: str, form: str, points: Points, faces: Faces) -> bytes:
    data = _ply_header(form, points, faces)
    for point in points:
        data += struct.pack(f"{order}3dB", *point, 7)
    for face in faces:
        data += struct.pack(f"{order}B{len(face)}i", len(face), *face)
    return data


def collada(points: Points, faces: Faces, nodes: str = "", unit: float = 1.0) -> bytes:
    """A file of Collada with one <polylist>. nodes: in place of one that shows the geometry."""
    corners = " ".join(f"{i} 0" for face in faces for i in face)
    counts = " ".join(str(len(face)) for face in faces)
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA {NAMESPACE} version="1.4.1"><asset><unit name="u" meter="{unit}"/>
<up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="{3 * len(points)}">{" ".join(map(_text, points))}
</float_array><technique_common><accessor source="#pa" count="{len(points)}" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<source id="n"><float_array id="na" count="3">0 0 1</float_array><technique_common>
<accessor source="#na" count="1" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="{len(faces)}"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="NORMAL" source="#n" offset="1"/><vcount>{counts}</vcount><p>{corners}</p>
</polylist></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s">
{nodes or '<node id="top"><instance_geometry url="#g"/></node>'}
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
""".encode()


def collada_in_nodes(points: Points, faces: Faces) -> bytes:
    """The same by nodes whose transforms undo each other, and in millimetres."""
    placed = [[1e3 * (x - 1.0), 1e3 * y, 1e3 * z] for x, y, z in points]
    nodes = """<node id="a"><translate>1000 0 0</translate><rotate>0 0 1 90</rotate>
<node id="b"><matrix>0 1 0 0 -1 0 0 0 0 0 1 0 0 0 0 1</matrix><scale>1 1 1</scale>
<instance_geometry url="#g"/></node></node>"""
    return collada(placed, faces, nodes, 0.001)


Writer = Callable[[Points, Faces], bytes]
WRITERS: dict[str, tuple[str, Writer]] = {
    "stl as text": (".stl", stl_text),
    "stl": (".stl", stl_binary),
    "obj": (".obj", obj),
    "obj counted back": (".obj", obj_counted_back),
    "off": (".off", off),
    "ply as text": (".ply", ply_text),
    "ply, little endian": (".ply", ply_little),
    "ply, big endian": (".ply", ply_big),
    "collada": (".dae", collada),
    "collada in nodes": (".dae", collada_in_nodes),
}
"""Type of file and writer by name."""


def _text(numbers: Sequence[float]) -> str:
    return " ".join(repr(number) for number in numbers)

"""Small meshes and a robot that shows one."""

from __future__ import annotations

from pathlib import Path

NAMESPACE = 'xmlns="http://www.collada.org/2005/11/COLLADASchema"'

TRIANGLE = (
    "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    "endfacet\nendsolid t\n"
)

_ARM = """<robot name="mesh_arm"><link name="base"/><link name="rod">
<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<visual><geometry><mesh filename="{mesh}"/></geometry></visual>
<collision><geometry><mesh filename="{mesh}"/></geometry></collision></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>"""

_SOURCE = """<source id="{id}"><float_array id="{id}a" count="{count}">{numbers}</float_array>
<technique_common><accessor source="#{id}a" count="3" stride="{stride}">{names}</accessor>
</technique_common></source>"""
_POINTS = _SOURCE.format(
    id="p",
    count=9,
    stride=3,
    numbers="0 0 0 1 0 0 0 1 0",
    names="".join(f'<param name="{x}" type="float"/>' for x in "XYZ"),
)
_PLACES = _SOURCE.format(
    id="u",
    count=6,
    stride=2,
    numbers="0 0 1 0 0 1",
    names="".join(f'<param name="{x}" type="float"/>' for x in "ST"),
)
_COLLADA = (
    """<?xml version="1.0" encoding="utf-8"?>
<COLLADA {namespace} version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_images><image id="i" name="i">{name}</image></library_images>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="t"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="c"><lambert><diffuse><texture texture="t" texcoord="UV"/></diffuse></lambert>
</technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>"""
    + _POINTS
    + _PLACES
    + """<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="mm"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#u" offset="1" set="0"/><p>0 0 1 1 2 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="vs"><node id="n"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="mm" target="#m">
<bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="0"/></instance_material>
</technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>"""
)


def collada(name: str, namespace: str = NAMESPACE) -> str:
    """A triangle with a texture. name: the element that names it, such as <init_from>."""
    return _COLLADA.format(name=name, namespace=namespace)


def textured(texture: str) -> str:
    """A triangle with this texture, as a Collada file."""
    return collada(f"<init_from>{texture}</init_from>")


def obj(line: str) -> str:
    """Triangles as an OBJ file that begins with this line."""
    triangles = "".join(f"v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nf -1 -2 -3\n" for i in range(40))
    return f"{line}\n# points and faces\n{triangles}"


def mesh_arm(folder: Path, mesh: str) -> Path:
    """A URDF in this folder whose moving link has this mesh as its visual and collision shape."""
    path = folder / "arm.urdf"
    path.write_text(_ARM.format(mesh=mesh))
    return path


WEDGE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
"""An OBJ file of a tetrahedron."""


def channel(size: float = 0.1) -> str:
    """An OBJ file of a U-shaped channel, 3 x 2 sizes in x and y and 1 in z, closed all around.

    Its volume is 5 of the 6 cubes of its hull; the missing one is at 1 < x < 2, 1 < y.
    """
    outline = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
    caps = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 5), (0, 5, 7), (5, 6, 7)]
    lines = [f"v {x * size} {y * size} {z * size}" for z in (0, 1) for x, y in outline]
    faces = [(c, b, a) for a, b, c in caps] + [(a + 8, b + 8, c + 8) for a, b, c in caps]
    for i in range(8):
        j = (i + 1) % 8
        faces += [(i, j, j + 8), (i, j + 8, i + 8)]
    return "\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]) + "\n"

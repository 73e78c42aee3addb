"""Meshes on pages: few bytes, in the colors of their files, near the shapes of their files."""

from __future__ import annotations

import dataclasses
import html as html_text
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import cKDTree

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limits import as_limits
from hovi.robot.meshes.collada import painted_collada
from hovi.scene.scene import Scene
from hovi.viewing.meshes.page_mesh import DEVIATION, MESH_NOTE, PageMesh, page_mesh
from oracles.headless_browser import CHROMIUM, headless_browser
from oracles.offline_pages import messages_of
from samples.cubic_motion import cubic_motion

Array = npt.NDArray[np.float64]

ROBOTS = "ur5", "panda", "xarm7", "z1"
ONE = np.ones(3)

DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_effects><effect id="paint"><profile_COMMON><technique sid="common"><phong>
<diffuse><color>1 0.5 0 1</color></diffuse></phong></technique></profile_COMMON></effect>
<effect id="other"><profile_COMMON><technique sid="common"><lambert><diffuse>{other}</diffuse>
</lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="orange"><instance_effect url="#paint"/></material>
<material id="second"><instance_effect url="#other"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
<technique_common><accessor source="#a" count="4" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="m1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1</p>
</triangles><triangles count="2" material="m2"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 1 3 0 3 2</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><scale>{scale}</scale>
<instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="m1" target="#orange"/><instance_material symbol="m2" target="#second"/>
</technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""

ARM = """<robot name="arm"><link name="base"/><joint name="j" type="revolute"><parent link="base"/>
<child link="link"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="link"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="link.dae"/></geometry></visual></link></robot>"""


def dae(other: str = "<color>0 0 1 1</color>", scale: str = "1 1 1") -> bytes:
    return DAE.format(other=other, scale=scale).encode()


def test_triangles_have_the_colors_of_their_materials() -> None:
    mesh, paint = painted_collada(dae())
    assert paint is not None
    np.testing.assert_allclose(paint, [[1, 0.5, 0], [0, 0, 1], [0, 0, 1]])
    drawn = page_mesh(Path("a.dae"), dae(), ONE, plain=False)
    assert drawn is not None
    colors = drawn.geometry.colors[drawn.geometry.triangles]
    np.testing.assert_allclose(colors, np.repeat(paint[:, None], 3, axis=1), atol=1e-4)
    assert len(mesh.triangles) == 3


def test_a_mirrored_part_is_not_inside_out() -> None:
    """The normals of a tetrahedron's face point away from the corner that it lacks."""
    for scale, sign in (("1 1 1", 1.0), ("-1 1 1", -1.0)):
        mesh, _ = painted_collada(dae(scale=scale))
        a, b, c = mesh.vertices[mesh.triangles[0]]
        assert np.cross(b - a, c - a)[2] < 0
        assert np.sign(mesh.vertices[:, 0].sum()) == sign


def test_a_mesh_with_a_picture_is_drawn_from_its_file() -> None:
    pictured = dae("<texture texture='t' texcoord='u'/>")
    assert painted_collada(pictured)[1] is None
    assert page_mesh(Path("a.dae"), pictured, ONE, plain=False) is None
    assert isinstance(page_mesh(Path("a.dae"), pictured, ONE, plain=True), PageMesh)


def test_the_deviation_is_in_meters_whatever_the_unit_of_the_file() -> None:
    """A step of 2 in a file in millimetres is left, one of 0.2 is not."""
    for height, left in ((2.0, 2), (0.2, 1)):
        text = f"v 0 0 0\nv 99 0 0\nv 0 99 0\nv 0 {height} {height}\nf 1 2 3\nf 1 2 4\n"
        mesh = page_mesh(Path("a.obj"), text.encode(), 1e-3 * ONE, plain=True)
        assert isinstance(mesh, PageMesh)
        assert len(mesh.triangles) == left


@pytest.fixture(scope="module", params=ROBOTS)
def motion(request: pytest.FixtureRequest) -> Trajectory:
    return cubic_motion(Scene(hovi.load_robot(request.param)), seed=1)[0]


def test_the_page_of_an_arm_has_less_than_three_megabytes_and_its_shape(
    motion: Trajectory, tmp_path: Path
) -> None:
    """Every corner of its meshes is as near to what is drawn as the page says."""
    assert motion.robot is not None
    assert motion.robot.visual is not None
    hovi.replay(motion, html=tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert len(text.encode()) < 3_000_000
    assert html_text.escape(MESH_NOTE) in text
    drawn = {}
    for each in messages_of(text):
        for given in each.get("object", {}).get("geometries", []):
            attributes = given.get("data", {}).get("attributes", {})
            if "normal" in attributes:
                points = np.frombuffer(attributes["position"]["array"].data, np.float32)
                index = given["data"]["index"]
                kind = {"Uint16Array": np.uint16, "Uint32Array": np.uint32}[index["type"]]
                triangles = np.frombuffer(index["array"].data, kind).reshape(-1, 3)
                drawn[each["path"].split("/")[-1]] = points.reshape(-1, 3)[triangles]
    shapes = [each for each in motion.robot.visual.geometryObjects if each.meshPath]
    assert len(drawn) == len(shapes) > 0
    for shape in shapes:
        corners = np.asarray(shape.geometry.vertices())
        triangles = drawn[shape.name].astype(float) * shape.meshScale
        far = cKDTree(triangles.reshape(-1, 3)).query(corners)[0] > DEVIATION
        for corner in corners[far]:  # not near a corner: near a triangle
            assert distance(corner, triangles) <= 1.05 * DEVIATION


def test_the_yellow_copies_of_links_at_a_limit_are_packed_once(tmp_path: Path) -> None:
    robot = hovi.load_robot("xarm7")
    motion = cubic_motion(Scene(robot), seed=1)[0]
    limits = as_limits(robot, {"base": "none", "v": 1e-3}).to_dict()
    limited = dataclasses.replace(motion, metadata={"limits": limits})
    sizes = []
    for each in (motion, limited):
        hovi.replay(each, html=tmp_path / "page.html")
        sizes.append((tmp_path / "page.html").stat().st_size)
    assert sum("at its limit" in str(x) for x in messages_of((tmp_path / "page.html").read_text()))
    assert sizes[1] < 1.1 * sizes[0]


def distance(point: Array, triangles: Array) -> float:
    """From the nearest of some triangles, (K, 3, 3)."""
    a, b, c = np.swapaxes(triangles, 0, 1)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    height = np.vecdot(point - a, normal) / np.where(size > 0, size, 1.0)
    inside = size > 0
    least = np.inf
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= np.vecdot(np.cross(q - p, point - p), normal) >= 0
        along = np.vecdot(point - p, q - p) / np.maximum(np.vecdot(q - p, q - p), 1e-30)
        nearest = p + np.clip(along, 0, 1)[:, None] * (q - p)
        least = min(least, float(np.linalg.norm(point - nearest, axis=1).min()))
    return min(least, float(np.abs(height[inside]).min(initial=np.inf)))


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
def test_a_page_draws_the_colors_of_its_meshes(tmp_path: Path) -> None:
    """Two triangles of each color, on both sides of a robot that is one link."""
    (tmp_path / "link.dae").write_bytes(dae())
    (tmp_path / "arm.urdf").write_text(ARM)
    still = cubic_motion(Scene(hovi.load_robot(tmp_path / "arm.urdf")), seed=1)[0]
    hovi.replay(still, html=tmp_path / "page.html", trace=False)
    with headless_browser() as tab:
        tab.open((tmp_path / "page.html").as_uri())
        tab.until("typeof viewer == 'object' && viewer.animator.actions.length > 0")
        tab.value("controls.seek(0); stage.look_from([1, -1, -0.8]); viewer.render(); 1")
        below = tab.screenshot()
        tab.value("stage.look_from([-1, -1, 0.3]); viewer.render(); 1")
        beside = tab.screenshot()
        assert not tab.errors
    for picture, color in ((below, [1, 0.5, 0]), (beside, [0, 0, 1])):
        shade = picture[:600, :800].astype(float)
        share = shade / np.maximum(shade.max(axis=2, keepdims=True), 1.0)
        near = (np.abs(share - color).max(axis=2) < 0.2) & (shade.max(axis=2) > 50)
        assert near.mean() > 0.002

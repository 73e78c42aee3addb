"""Files that a mesh names outside its package are never opened, as the kernel reports it."""

from __future__ import annotations

import base64
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.urdf import mesh_files
from hovi.scene.scene import Scene
from hovi.viewing.replay_session import replay
from oracles.opened_files import opened_files
from samples.cubic_motion import cubic_motion
from samples.meshes import TRIANGLE, collada, mesh_arm, obj, textured

PICTURE = b"not a picture, but read as one"
OUTSIDE = "../outside/secret.png"
TEXTURES = {
    "relative": f"<init_from>{OUTSIDE}</init_from>",
    "absolute": "<init_from>{outside}/secret.png</init_from>",
    "through a folder": "<init_from>textures/../../outside/secret.png</init_from>",
    "by a link": "<init_from>link.png</init_from>",
    "by a linked folder": "<init_from>links/secret.png</init_from>",
    "back through a linked folder": "<init_from>links/../outside/secret.png</init_from>",
    "around by a link": "<init_from>../alias/textures/wood.png</init_from>",
    "as character data": f"<init_from><![CDATA[{OUTSIDE}]]></init_from>",
    "with a comment": "<init_from>../out<!-- c -->side/secret.png</init_from>",
    "by references": "<init_from>&#46;&#x2e;/outside/secret.png</init_from>",
    "before an element": f"<init_from>{OUTSIDE}<x/>.png</init_from>",
    "in a longer tag": f"<an_init_from_>{OUTSIDE}</an_init_from_>",
    "in another namespace": f'<c:init_from xmlns:c="c">{OUTSIDE}</c:init_from>',
}
LIBRARIES = {
    "plainly": "mtllib ../outside/secret.mtl",
    "after a tab": "mtllib\t../outside/secret.mtl",
    "with backslashes": "mtllib ..\\outside\\secret.mtl",
    "on the next line": "mtllib \\\n../outside/secret.mtl",
    "after a form feed": "mtllib \\\fx\n../outside/secret.mtl",
    "in a broken word": "mtl\\\nlib ../outside/secret.mtl",
    "after a carriage return": "o a\rmtllib ../outside/secret.mtl",
    "after a zero": "o a\0mtllib ../outside/secret.mtl",
    "by a link": "mtllib link.mtl",
    "by the end of a name": "mtllib gone/away/link.mtl",
    "by the end of a name with a backslash": "mtllib gone\\link.mtl",
    "by the cut end of a name": "mtllib gone/link.mtlx/abcdefg",
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A ROS package beside a folder with secrets, with links to them."""
    folder, outside = tmp_path / "package", tmp_path / "outside"
    (folder / "textures").mkdir(parents=True)
    outside.mkdir()
    (folder / "package.xml").write_text("<package/>")
    (folder / "textures" / "wood.png").write_bytes(PICTURE)
    for name in ("secret.png", "secret.mtl"):
        (outside / name).write_text("newmtl a\nKd 1 0 0\n")
    (folder / "link.png").symlink_to(outside / "secret.png")
    (folder / "link.mtl").symlink_to(outside / "secret.mtl")
    (folder / "links").symlink_to(outside)
    (tmp_path / "alias").symlink_to(folder)
    return folder


def assert_left_out(package: Path, mesh: str, why: str) -> None:
    """The shapes with this mesh are left out, the robot is not, and nothing outside is opened."""
    outside = package.parent / "outside"
    robot = load_robot(mesh_arm(package, mesh))
    with opened_files(outside) as opened:
        shapes = robot.visual, robot.collision
        replay(cubic_motion(Scene(robot))[0], html=package / "page.html")
    assert opened == set()
    assert shapes == (None, None)
    for problem in (robot.visual_problem, robot.collision_problem):
        assert "link 'rod'" in problem
        assert why in problem


@pytest.mark.parametrize("way", TEXTURES)
def test_a_texture_outside_the_package_is_never_opened(package: Path, way: str) -> None:
    element = TEXTURES[way].format(outside=package.parent / "outside")
    (package / "rod.dae").write_text(collada(element))
    assert_left_out(package, "rod.dae", "lies outside")


@pytest.mark.parametrize("way", LIBRARIES)
def test_a_library_outside_the_package_is_never_opened(package: Path, way: str) -> None:
    (package / "rod.obj").write_bytes(obj(LIBRARIES[way]).encode())
    assert_left_out(package, "rod.obj", "lies outside")


@pytest.mark.parametrize("namespace", ["", 'xmlns="http://www.collada.org/2008/03/COLLADASchema"'])
@pytest.mark.parametrize("name", [OUTSIDE, f"<ref>{OUTSIDE}</ref>"])
def test_collada_files_of_any_namespace_are_checked(
    package: Path, namespace: str, name: str
) -> None:
    (package / "rod.dae").write_text(collada(f"<init_from>{name}</init_from>", namespace))
    assert_left_out(package, "rod.dae", "lies outside")


def test_the_library_that_is_opened_in_place_of_a_missing_one_is_checked(package: Path) -> None:
    (package / "rod.mtl").symlink_to(package.parent / "outside" / "secret.mtl")
    (package / "rod.obj").write_text(obj("mtllib gone.mtl"))
    assert_left_out(package, "rod.obj", "lies outside")


def test_the_kernel_reports_a_texture_that_is_opened_and_no_library(package: Path) -> None:
    (package / "meshes").mkdir()
    (package / "meshes" / "rod.dae").write_text(textured("../textures/wood.png"))
    (package / "textures" / "wood.mtl").write_text("newmtl a\n")
    (package / "rod.obj").write_text(obj("mtllib textures/wood.mtl"))
    seen = []
    for mesh in ("meshes/rod.dae", "rod.obj"):
        with opened_files(package / "textures") as opened:
            page_of(load_robot(mesh_arm(package, mesh)))
        seen.append(opened)
    assert seen == [{"wood.png"}, set()]


def page_of(robot: Robot) -> str:
    """The messages of a page with this robot, one after the other."""
    assert robot.visual is not None, robot.visual_problem
    folder = Path(robot.source.folder)
    shown = replay(cubic_motion(Scene(robot))[0], html=folder / "page.html")
    return "".join(each.packed.decode(errors="replace") for each in shown.page.messages.all())


def test_a_texture_inside_the_package_is_on_the_page(package: Path) -> None:
    (package / "meshes").mkdir()
    (package / "meshes" / "rod.dae").write_text(textured("../textures/wood.png"))
    robot = load_robot(mesh_arm(package, "meshes/rod.dae"))
    assert base64.b64encode(PICTURE).decode() in page_of(robot)
    assert robot.collision is not None


@pytest.mark.parametrize("name", ["gone.png", "", "http://127.0.0.1:9/wood.png", "textures"])
def test_a_mesh_without_its_texture_collides_but_is_not_shown(package: Path, name: str) -> None:
    (package / "rod.dae").write_text(textured(name or "<x/>"))
    robot = load_robot(mesh_arm(package, "rod.dae"))
    assert robot.visual is None
    assert f"names {name!r}, which cannot be read" in robot.visual_problem
    if name not in ("", "textures"):
        assert robot.collision is not None, robot.collision_problem


def test_a_mesh_without_its_library_is_shown(package: Path) -> None:
    (package / "rod.obj").write_text(obj("mtllib gone.mtl"))
    assert load_robot(mesh_arm(package, "rod.obj")).visual is not None


def test_a_pipe_as_a_library_is_not_waited_for(package: Path) -> None:
    os.mkfifo(package / "pipe.mtl")
    (package / "rod.obj").write_text(obj("mtllib pipe.mtl"))
    code = f"""if True:
        from hovi.robot.loading import load_robot
        print(load_robot({str(mesh_arm(package, "rod.obj"))!r}).visual_problem)"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert "names 'pipe.mtl', which cannot be read (it is not a regular file)" in done.stdout


UNREADABLE = {
    "of another type": ("rod.gltf", b"{}", "not of a type that hovi reads (.dae, .obj"),
    "without a type": ("rod", TRIANGLE.encode(), "not of a type"),
    "not XML": ("rod.dae", b"<COLLADA>", "is not well-formed XML"),
    "with a DOCTYPE": ("rod.dae", b'<!DOCTYPE a [<!ENTITY b "c">]><a/>', "has a DOCTYPE"),
    "too large": ("rod.stl", TRIANGLE.encode() * 9, "it has 0.0 MB, and at most"),
}


@pytest.mark.parametrize("what", UNREADABLE)
def test_an_unreadable_mesh_is_left_out(
    package: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, content, why = UNREADABLE[what]
    if what == "too large":
        monkeypatch.setattr(mesh_files, "MAX_MESH_BYTES", 500)
    (package / name).write_bytes(content)
    assert_left_out(package, name, why)


@pytest.mark.parametrize("name", ["rod.dae", "rod.obj"])
def test_a_mesh_that_is_not_text_is_not_shown(package: Path, name: str) -> None:
    text = textured("textures/wood.png") if name == "rod.dae" else obj("o a")
    encoded = text.replace('encoding="utf-8"', 'encoding="latin-1"').replace("o a", "o ä")
    content = encoded.replace("</COLLADA>", "<!-- ä --></COLLADA>").encode("latin-1")
    (package / name).write_bytes(content)
    robot = load_robot(mesh_arm(package, name))
    assert "is not UTF-8 text" in robot.visual_problem


@pytest.mark.parametrize("name", ["rod.stl", "rod.STL", "rod.dae", "rod.obj", "rod.off", "rod.ply"])
def test_meshes_of_every_type_are_shown(package: Path, name: str) -> None:
    points, face = "0 0 0\n1 0 0\n0 1 0\n", "3 0 1 2\n"
    header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (package / name).write_text(
        {
            ".stl": TRIANGLE,
            ".dae": textured("textures/wood.png"),
            ".obj": obj("o rod"),
            ".off": f"OFF\n3 1 0\n{points}{face}",
            ".ply": f"ply\nformat ascii 1.0\n{header}{points}{face}",
        }[Path(name).suffix.lower()]
    )
    assert page_of(load_robot(mesh_arm(package, name)))


def test_a_mesh_whose_points_are_not_finite_is_left_out_by_name(package: Path) -> None:
    (package / "rod.obj").write_text(obj("v 1e99 0 0\nv 0 0 0\nv 0 1 0\nf 1 2 3"))
    robot = load_robot(mesh_arm(package, "rod.obj"))
    assert robot.visual is None
    assert "'rod.obj' has coordinates that are not finite" in str(robot.visual_problem)


# Textures of the URDF itself


def test_a_texture_of_the_urdf_is_never_opened(package: Path) -> None:
    secret = package.parent / "outside" / "secret.png"
    (package / "rod.stl").write_text(TRIANGLE)
    urdf = mesh_arm(package, "rod.stl")
    inner = f'<material name="a"><texture filename="{secret}"/></material></visual>'
    outer = f'<material name="b"><texture filename="{secret}"/></material></robot>'
    text = urdf.read_text().replace("</visual>", inner).replace("</robot>", outer)
    urdf.write_text(text)
    robot = load_robot(urdf)
    with opened_files(secret.parent) as opened:
        page_of(robot)
    assert opened == set()
    assert robot.visual is not None
    assert [shape.meshTexturePath for shape in robot.visual.geometryObjects] == [""]


def test_a_texture_without_a_name_does_not_hide_a_robot() -> None:
    robot = load_robot("icub")
    assert robot.visual is not None
    assert robot.visual_problem == ""

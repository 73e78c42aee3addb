"""A saved motion of a robot of one's own brings its meshes, and is drawn by them anywhere."""

from __future__ import annotations

import hashlib
import json
import shutil
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import HoviWarning, ModelError
from oracles.opened_files import opened_files
from samples.mesh_files import CUBE, CUBE_FACES, collada, stl_binary
from samples.mesh_package import DRAWN, FILES, PACKAGE, mesh_package
from samples.meshes import mesh_arm, textured

START, GOAL = [0.0, 0.3, 0.5, 0.0, 0.4, 0.0], [0.9, -0.3, 0.9, 0.5, 0.8, -0.5]


def planned(urdf: Path) -> hovi.Trajectory:
    scene = hovi.Scene(hovi.load_robot(urdf), effects=[hovi.effects.Gravity(9.81)])
    return hovi.plan(scene, START, GOAL, 1.5, limits="urdf", intervals=12).trajectory


def page(motion: hovi.Trajectory, folder: Path) -> bytes:
    hovi.replay(motion, html=folder / "page.html")
    return (folder / "page.html").read_bytes()


def report(motion: hovi.Trajectory, folder: Path) -> bytes:
    hovi.write_report(motion, folder / "report.html")
    return (folder / "report.html").read_bytes()


def corners(motion: hovi.Trajectory) -> list[tuple[str, int, int]]:
    """The name of each mesh of the links, and its numbers of vertices and triangles."""
    assert motion.robot is not None
    found = []
    for shapes in (motion.robot.visual, motion.robot.collision):
        assert shapes is not None
        for item in shapes.geometryObjects:
            mesh = item.geometry
            found.append((item.name, mesh.num_vertices, mesh.num_tris))
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a motion, what was shown of it and the files of its meshes; no package."""
    here, elsewhere = tmp_path_factory.mktemp("here"), tmp_path_factory.mktemp("elsewhere")
    motion = planned(mesh_package(here))
    motion.save(here / "motion.npz")
    motion.save(elsewhere / "bare.npz", meshes=False)
    (elsewhere / "page before").write_bytes(page(motion, here))
    stored = hovi.Trajectory.load(elsewhere / "bare.npz", [here])  # with the versions of libraries
    (elsewhere / "report before").write_bytes(report(stored, here))
    (elsewhere / "corners").write_text(json.dumps(corners(motion)))
    shutil.move(here / "motion.npz", elsewhere / "motion.npz")
    shutil.move(here / PACKAGE, elsewhere / "gone")
    return elsewhere


@pytest.fixture
def moved(folder: Path) -> hovi.Trajectory:
    return hovi.Trajectory.load(folder / "motion.npz")


def test_page_and_report_are_those_of_the_robot_itself(
    folder: Path, moved: hovi.Trajectory, tmp_path: Path
) -> None:
    assert page(moved, tmp_path) == (folder / "page before").read_bytes()
    assert report(moved, tmp_path) == (folder / "report before").read_bytes()
    assert [list(each) for each in corners(moved)] == json.loads((folder / "corners").read_text())
    assert moved.robot is not None
    assert moved.robot.visual_problem == moved.robot.collision_problem == ""
    bare = hovi.Trajectory.load(folder / "bare.npz")
    assert page(bare, tmp_path) != (folder / "page before").read_bytes()


def test_commands_draw_the_meshes(folder: Path, tmp_path: Path) -> None:
    motion, shown = str(folder / "motion.npz"), tmp_path / "page.html"
    assert main(["replay", motion, "--html", str(shown)]) == 0
    assert shown.read_bytes() == (folder / "page before").read_bytes()
    assert main(["report", motion, "--html", str(tmp_path / "report.html")]) == 0
    assert (tmp_path / "report.html").read_bytes() == (folder / "report before").read_bytes()


def test_a_folder_of_packages_shows_what_a_motion_has_not_kept(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder / "gone", tmp_path / PACKAGE)
    shown, given = tmp_path / "page.html", ["--package-dir", str(tmp_path)]
    assert main(["replay", str(folder / "bare.npz"), "--html", str(shown), *given]) == 0
    assert shown.read_bytes() == (folder / "page before").read_bytes()
    found = hovi.Trajectory.load(folder / "bare.npz", [tmp_path])
    assert page(found, tmp_path) == (folder / "page before").read_bytes()
    found.save(tmp_path / "kept.npz")
    assert (tmp_path / "kept.npz").read_bytes() == (folder / "motion.npz").read_bytes()
    assert found.scene is not None
    scene = hovi.Scene.from_dict(found.scene.to_dict(), package_dirs=tmp_path)
    assert scene.robot.visual_problem == ""
    with pytest.raises(ModelError, match="holds the files of every user"):
        hovi.Trajectory.load(folder / "bare.npz", "/")


def test_each_content_is_there_once_and_is_that_of_the_file(folder: Path) -> None:
    """The library of the OBJ file is no part of what is drawn."""
    files = [folder / "gone" / each for each in FILES if not each.endswith(".mtl")]
    contents = {hashlib.sha256(each.read_bytes()).hexdigest(): each for each in files}
    assert len(contents) == len(files) - 1
    with np.load(folder / "motion.npz") as arrays:
        kept = {name[5:]: arrays[name] for name in arrays.files if name.startswith("mesh-")}
        header = json.loads(bytes(arrays["header"]))
    assert kept.keys() == contents.keys()
    for name, file in contents.items():
        assert zlib.decompress(kept[name].tobytes()) == file.read_bytes()
    assert header["version"] == 2
    (names,) = header["meshes"]["robots"].values()
    assert list(names) == sorted(f"package://{PACKAGE}/meshes/{each}" for each in DRAWN)


def test_a_motion_is_planned_among_the_meshes_that_it_brought(
    folder: Path, moved: hovi.Trajectory
) -> None:
    again = hovi.plan(moved.scene, START, GOAL, 1.5, limits="urdf", intervals=12)
    assert again.success
    np.testing.assert_array_equal(again.trajectory.q, moved.q)
    assert again.trajectory.metadata["clearance"] == moved.metadata["clearance"]


def test_saving_again_gives_the_same_bytes(
    folder: Path, moved: hovi.Trajectory, tmp_path: Path
) -> None:
    moved.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == (folder / "motion.npz").read_bytes()


def test_robots_with_a_name_and_without_meshes_are_saved_as_before(tmp_path: Path) -> None:
    """Those of example-robot-data are found by their names; files of version 1 stay readable."""
    for robot in ("ur5", hovi.load_robot(shapes(tmp_path))):
        scene = hovi.Scene(hovi.load_robot(robot) if isinstance(robot, str) else robot)
        q = np.zeros(scene.robot.nq)
        hovi.simulate(scene, q, 0.1, intervals=4).trajectory.save(tmp_path / "motion.npz")
        with np.load(tmp_path / "motion.npz") as arrays:
            assert not any(name.startswith("mesh-") for name in arrays.files)
            assert json.loads(bytes(arrays["header"]))["version"] == 1
        assert hovi.Trajectory.load(tmp_path / "motion.npz").robot is not None


def shapes(folder: Path) -> Path:
    """The URDF of an arm with a box in place of a mesh."""
    urdf = mesh_arm(folder, "rod.stl")
    urdf.write_text(urdf.read_text().replace('<mesh filename="rod.stl"/>', '<box size="1 1 1"/>'))
    return urdf


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package with a visual mesh whose texture takes more than 20 MB, and a small solid."""
    folder = tmp_path_factory.mktemp("large") / PACKAGE
    folder.mkdir()
    (folder / "large.png").write_bytes(np.random.default_rng(0).bytes(21_000_000))
    (folder / "large.dae").write_text(textured("large.png"))
    (folder / "small.stl").write_bytes(stl_binary(CUBE, CUBE_FACES))
    urdf = mesh_arm(folder, f"package://{PACKAGE}/small.stl")
    text = urdf.read_text()
    urdf.write_text(text.replace("small.stl", "large.dae", 1))
    return urdf


def test_beyond_20_mb_names_and_hashes_are_kept(large: Path, tmp_path: Path) -> None:
    scene = hovi.Scene(hovi.load_robot(large))
    motion = hovi.simulate(scene, [0.0], 0.1, intervals=4).trajectory
    file = tmp_path / "motion.npz"
    with pytest.warns(HoviWarning, match="1 of the robot's meshes take more than 20 MB"):
        motion.save(file)
    assert file.stat().st_size < 100_000
    robot = robot_in(file)
    assert robot.visual is None
    assert (
        "is not in the file of its motion, whose meshes are too large, and was not"
        in robot.visual_problem
    )
    assert "--package-dir" in robot.visual_problem
    assert robot.collision is not None
    assert robot.collision_problem == ""
    found = robot_in(file, large.parents[1])
    assert found.visual_problem == ""
    assert found.visual is not None
    other = tmp_path / "other" / PACKAGE
    other.mkdir(parents=True)
    (other / "large.dae").write_bytes(collada(CUBE, CUBE_FACES))
    assert (
        "is another file than the one of the motion" in robot_in(file, other.parent).visual_problem
    )


def robot_in(file: Path, *package_dirs: Path) -> hovi.Robot:
    robot = hovi.Trajectory.load(file, package_dirs).robot
    assert robot is not None
    return robot


def test_studies_do_not_store_meshes_with_each_motion(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    urdf = mesh_package(tmp_path)
    (tmp_path / "scene.toml").write_text(
        f'robot = "{urdf}"\nduration = 1.5\nintervals = 12\nself_collision = false\n'
        f"start.q = {START}\ngoal.q = {GOAL}\neffects.gravity.acceleration = 9.81\n"
    )
    (tmp_path / "study.toml").write_text(
        'scene = "scene.toml"\n[[vary]]\nfield = "duration"\nvalues = [1.4, 1.5]\n'
    )
    out, file = tmp_path / "out", tmp_path / "motion.npz"
    options = ["--out", str(out), "--workers", "1"]
    assert main(["study", "run", str(tmp_path / "study.toml"), *options]) == 0
    assert b"mesh-" not in b"".join(each.read_bytes() for each in out.rglob("*") if each.is_file())
    assert main(["study", "motion", str(out), "0", "--out", str(file)]) == 0
    assert robot_in(file).visual is None
    given = ["--package-dir", str(tmp_path)]
    assert main(["study", "motion", str(out), "0", "--out", str(file), *given]) == 0
    shutil.rmtree(tmp_path / PACKAGE)
    assert robot_in(file).visual_problem == ""


NAMES = "{}/secret.dae", "file://{}/secret.dae", "../../secret.dae", "link.dae", "..", "\u200b.dae"


@pytest.mark.filterwarnings("ignore:the file has no SHA-256")
@pytest.mark.parametrize("name", NAMES)
def test_no_name_in_a_motion_is_a_path(
    name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a file says is drawn, or left out; its names are neither opened nor written."""
    outside, inside = tmp_path / "outside", tmp_path / "inside" / "deep"
    outside.mkdir()
    inside.mkdir(parents=True)
    for place in (outside, tmp_path):
        (place / "secret.dae").write_text("secret")
    (inside / "link.dae").symlink_to(outside / "secret.dae")
    old, new = f"package://{PACKAGE}/meshes/flag.dae", name.format(outside)
    file = inside / "motion.npz"
    rewrite(folder / "motion.npz", file, old, new)
    before = {each: each.stat().st_mtime_ns for each in tmp_path.rglob("*")}
    monkeypatch.chdir(inside)
    with opened_files(outside) as opened, opened_files(tmp_path) as above:
        robot = robot_in(file)
        shown = page(hovi.Trajectory.load(file), folder)
    assert opened == above == set()
    assert {each: each.stat().st_mtime_ns for each in tmp_path.rglob("*")} == before
    if new.endswith(".dae"):
        assert robot.visual_problem == ""
        assert shown == (folder / "page before").read_bytes()
    else:
        assert "lacks visual shapes: link 'l4'" in robot.visual_problem


def rewrite(source: Path, target: Path, old: str, new: str) -> None:
    """Copy a motion with another name for one of its meshes, in its URDF and its table."""
    with np.load(source) as arrays:
        entries = {name: arrays[name] for name in arrays.files}
    header: dict[str, Any] = json.loads(bytes(entries["header"]))
    robot = header["scene"]["robot"]
    robot["urdf"] = robot["urdf"].replace(old, new)
    robot["sha256"] = hashlib.sha256(robot["urdf"].encode()).hexdigest()
    canonical = json.dumps(header["scene"], sort_keys=True).encode()
    header["scene_sha256"] = hashlib.sha256(canonical).hexdigest()
    (names,) = header["meshes"]["robots"].values()
    names[new] = names.pop(old)
    header["meshes"]["robots"] = {robot["sha256"]: names}
    del header["sha256"]
    entries["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(target, **entries)


def test_a_motion_in_segments_brings_its_meshes_once(tmp_path: Path) -> None:
    urdf = mesh_package(tmp_path)
    scene = hovi.Scene(hovi.load_robot(urdf), effects=[hovi.effects.Gravity(9.81)])
    load = hovi.effects.Payload(frame="l6", mass=0.5)
    segments = [hovi.Segment(GOAL, 1.5), hovi.Segment(START, 1.5, effects=[load])]
    motion = hovi.plan_sequence(scene, START, segments, limits="urdf").trajectory
    motion.save(tmp_path / "motion.npz")
    before = page(motion, tmp_path)
    shutil.rmtree(tmp_path / PACKAGE)
    assert page(hovi.Trajectory.load(tmp_path / "motion.npz"), tmp_path) == before
    with np.load(tmp_path / "motion.npz") as arrays:
        assert len([name for name in arrays.files if name.startswith("mesh-")]) == len(FILES) - 2


def test_workers_and_grippers_take_the_meshes_along(folder: Path, moved: hovi.Trajectory) -> None:
    """A robot that holds something, or comes back from a worker process, is drawn by them, too."""
    assert moved.robot is not None
    ball = hovi.Grasped(hovi.Sphere([0.0, 0.0, 0.3], 0.03), "l6", mass=0.2, name="ball")
    held = hovi.holding(moved.robot, ball)
    assert held.visual_problem == held.collision_problem == ""
    found = hovi.plan(
        moved.scene, START, GOAL, 1.5, limits="none", self_collision=False, starts=2, processes=2
    ).trajectory
    assert found.robot is not None
    assert found.robot.visual_problem == ""

"""Meshes as obstacles: hulls and convex parts against the triangles of the file."""

from __future__ import annotations

import json
import re
import warnings
from importlib.util import find_spec
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import HoviWarning, InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.obstacles import convex_parts, mesh
from hovi.planning.obstacles.triangle_mesh import read_mesh
from oracles.world_distances import Placed, shape_distance
from samples.meshes import TRIANGLE, WEDGE, channel

needs_coacd = pytest.mark.skipif(find_spec("coacd") is None, reason="needs the extra `convex`")
RPY, AT = [0.4, -0.2, 0.7], [0.2, 0.1, -0.3]
PLACED = pin.SE3(pin.rpy.rpyToMatrix(*RPY), np.array(AT))


@pytest.fixture
def u_shape(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of a channel, and a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = tmp_path / "channel.obj"
    file.write_text(channel())
    return file


def ball(radius: float, at: np.ndarray) -> Placed:
    return coal.Sphere(radius), pin.SE3(np.eye(3), at)


def least(obstacle: hovi.Mesh, at: np.ndarray) -> float:
    return min(shape_distance(ball(0.01, at), tuple(body)) for body in obstacle.bodies())


def outside(at: np.ndarray, parts: int = 3) -> np.ndarray:
    """Points around the placed mesh, shape (P, 3)."""
    random = np.random.default_rng(0)
    return np.array([at.act(x) for x in random.uniform(-0.2, 0.5, (parts * 100, 3))])


def test_a_mesh_that_is_not_convex_warns_of_its_hull(u_shape: Path) -> None:
    with pytest.warns(HoviWarning, match=r"'channel.obj' is taken as its convex hull, 1.2 times"):
        hovi.Mesh(u_shape)


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
def test_a_hull_is_nowhere_farther_than_the_triangles(u_shape: Path) -> None:
    """And equally far from points that see only its convex sides."""
    obstacle = hovi.Mesh(u_shape, AT, RPY, scale=2.0)
    triangles = coal.MeshLoader().load(str(u_shape), np.full(3, 2.0))
    equal = 0
    for x in outside(PLACED):
        d, bound = least(obstacle, x), shape_distance(ball(0.01, x), (triangles, PLACED))
        assert d <= bound + 1e-8  # Coal's own reader rounds to single precision
        equal += abs(d - bound) < 1e-8
    assert equal > 50
    in_gap = PLACED.act(np.array([0.3, 0.35, 0.1]))
    assert least(obstacle, in_gap) < 0.0


@needs_coacd
def test_convex_parts_leave_the_gap_free_and_cover_the_mesh(u_shape: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        obstacle = hovi.Mesh(u_shape, AT, RPY, convex_parts=True)
    assert len(obstacle.bodies()) == 3
    triangles = coal.MeshLoader().load(str(u_shape), np.ones(3))
    for x in outside(PLACED):
        d, bound = least(obstacle, x), shape_distance(ball(0.01, x), (triangles, PLACED))
        assert d <= bound + 1e-9
        if d > 0:
            assert bound - d < 2e-3
    assert least(obstacle, PLACED.act(np.array([0.15, 0.15, 0.05]))) > 0.03


@needs_coacd
def test_parts_come_from_the_cache_the_second_time(
    u_shape: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the mesh's hash: a copy under another name has the same, another mesh does not."""
    first = convex_parts.convex_parts(read_mesh(str(u_shape)))
    monkeypatch.setattr(convex_parts, "_WORKER", tmp_path / "missing")
    copy = tmp_path / "copy.obj"
    copy.write_text(channel())
    again = convex_parts.convex_parts(read_mesh(str(copy)))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)
    copy.write_text(channel(0.2))
    with pytest.raises(InputError, match=r"'copy.obj' cannot be divided into convex parts"):
        convex_parts.convex_parts(read_mesh(str(copy)))


@needs_coacd
@pytest.mark.parametrize("part", [None, np.zeros((4, 2)), np.full((4, 3), np.nan)])
def test_a_damaged_file_in_the_cache_is_made_again(
    u_shape: Path, tmp_path: Path, part: np.ndarray | None
) -> None:
    first = convex_parts.convex_parts(read_mesh(str(u_shape)))
    (kept,) = (tmp_path / "cache" / "hovi" / "convex_parts").iterdir()
    if part is None:
        kept.write_bytes(b"PK damaged")
    else:
        np.savez(kept, part_0=part)
    again = convex_parts.convex_parts(read_mesh(str(u_shape)))
    assert len(again) == len(first)


@pytest.fixture
def endless(u_shape: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A mesh whose division takes more than a minute, and ends then."""
    worker = (tmp_path / "endless").with_suffix(".py")
    worker.write_text("import time\ntime.sleep(100)\n")
    monkeypatch.setattr(convex_parts, "_WORKER", worker)
    monkeypatch.setattr(convex_parts, "find_spec", lambda name: True)
    u_shape.write_text(channel(0.3))  # which no other test has divided
    return u_shape


LATE = r"the time limit of 0\.5 s passed before the obstacles were ready: give more time once"


def test_a_time_limit_bounds_the_division_of_a_mesh(endless: Path, two_link: hovi.Robot) -> None:
    table = {"kind": "mesh", "file": str(endless), "convex_parts": True}
    with pytest.raises(InputError, match=LATE):
        hovi.plan(
            *(hovi.Scene(two_link), [0.0, 0.0], [0.3, 0.7], 1.0),
            **{"obstacles": [table], "time_limit": 0.5},
        )


@pytest.mark.parametrize("limits", [("0.5", ""), ("", "0.5"), ("100.0", "0.5")])
def test_a_time_limit_of_a_file_or_command_bounds_the_division_of_a_mesh(
    endless: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], limits: tuple[str, str]
) -> None:
    obstacle = f'[[obstacles]]\nkind = "mesh"\nfile = {str(endless)!r}\nconvex_parts = true\n'
    key = f"time_limit = {limits[0]}\n" if limits[0] else ""
    scene = tmp_path / "scene.toml"
    scene.write_text(key + hovi.example("two_link_reach.toml").read_text() + obstacle)
    flags = ["--time-limit", limits[1]] if limits[1] else []
    assert main(["plan", str(scene), *flags]) == 2
    assert re.search(LATE, capsys.readouterr().err)


def test_without_coacd_the_sentence_names_the_extra(
    u_shape: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(convex_parts, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'hovi\[convex\]'"):
        hovi.Mesh(u_shape, convex_parts=True)


def test_parts_that_leave_a_corner_outside_are_reported(u_shape: Path) -> None:
    """The hull of the first two thirds: its far corner is a diagonal of 0.1 m away."""
    whole = read_mesh(str(u_shape))
    part = whole.vertices[whole.vertices[:, 0] < 0.25]
    assert convex_parts.uncovered(whole, (part,)) == pytest.approx(0.1 * 2**0.5)
    assert convex_parts.uncovered(whole, (whole.vertices,)) == 0.0


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
def test_a_recorded_mesh_needs_no_file(u_shape: Path) -> None:
    clearance = Clearance([hovi.Mesh(u_shape, AT, RPY, scale=[1, 2, 3], name="u")])
    stored = json.loads(json.dumps(clearance.to_dict()))
    (before,) = clearance.obstacles
    x = outside(PLACED, 1)[0]
    distance = least(before, x)
    u_shape.unlink()
    (again,) = Clearance.from_dict(stored).obstacles
    assert again.name == "u"
    assert min(shape_distance(ball(0.01, x), tuple(b)) for b in again.bodies()) == distance


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda folder: hovi.Mesh(folder / "none.stl"), "there is no mesh '.*none.stl'"),
        (lambda folder: hovi.Mesh(folder / "flat.stl"), "'flat.stl' has no convex hull"),
        (lambda folder: hovi.Mesh(folder / "text.stl"), "mesh 'text.stl' is no STL: line 2"),
        (lambda folder: hovi.Mesh(folder / "mesh.blend"), "'mesh.blend' is not of a type"),
        (lambda folder: hovi.Mesh("a\0b.stl"), "no file can have that path|there is no mesh"),
        (lambda folder: hovi.Mesh(folder / "flat.stl", scale=0.0), "`scale` of a mesh must be po"),
        (lambda folder: hovi.Mesh(folder / "wedge.obj", scale=1e-300), "must be at least 1e-09"),
        (lambda folder: hovi.ConvexParts([]), "`parts` of convex parts must be 1 to 200"),
        (lambda folder: hovi.ConvexParts([[[0, 0, 0]]]), "must span a volume"),
        (lambda folder: hovi.ConvexParts(7), "`parts` of convex parts must be 1 to 200"),
    ],
)
def test_an_unusable_mesh_is_refused_in_one_sentence(
    make: object, words: str, tmp_path: Path
) -> None:
    (tmp_path / "flat.stl").write_text(TRIANGLE)
    (tmp_path / "wedge.obj").write_text(WEDGE)
    (tmp_path / "text.stl").write_text("solid\nno facets\n")
    (tmp_path / "mesh.blend").write_text("BLENDER")
    with pytest.raises(InputError, match=words):
        make(tmp_path)  # type: ignore[operator]


def test_the_volume_of_a_closed_mesh_is_known(u_shape: Path, tmp_path: Path) -> None:
    assert read_mesh(str(u_shape)).volume() == pytest.approx(5e-3)
    (tmp_path / "open.stl").write_text(TRIANGLE)
    assert read_mesh(str(tmp_path / "open.stl")).volume() is None
    assert mesh.FILLED > 1.0

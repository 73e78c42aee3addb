"""Hulls from the cache are those of the mesh, whatever is in the cache."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import coal
import numpy as np
import pytest

from hovi.errors import ModelError
from hovi.planning.clearance import mesh_hulls
from hovi.planning.clearance.mesh_hulls import mesh_hull
from hovi.robot.robot import Robot

POINTS = np.random.default_rng(0).normal(size=(60, 3))
SCALE = [1.0, 0.5, 2.0]


def mesh(points: np.ndarray = POINTS) -> bytes:
    """An OBJ file whose triangles use all points."""
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    faces = [f"f {k} {k + 1} {k + 2}" for k in range(1, len(points) - 1)]
    return "\n".join(rows + faces).encode()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of hulls in an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "hovi" / "hulls"


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of vertices of which hulls were computed."""
    calls, compute = list[int](), mesh_hulls.hull_of

    def hull_of(vertices: np.ndarray) -> coal.ConvexBase | None:
        calls.append(len(vertices))
        return compute(vertices)

    monkeypatch.setattr(mesh_hulls, "hull_of", hull_of)
    return calls


def hull(content: bytes | None = None, scale: list[float] = SCALE) -> coal.Convex:
    return mesh_hull(Path("a.obj"), mesh() if content is None else content, scale)


def assert_equal(first: coal.Convex, second: coal.Convex) -> None:
    """Points and their neighbors are the same to the last bit."""
    np.testing.assert_array_equal(np.array(first.points()), np.array(second.points()))
    for k in range(first.num_points):
        assert list(first.neighbors(k)) == list(second.neighbors(k))


def test_the_second_hull_is_read_and_equal(cache: Path, counted: list[int]) -> None:
    assert_equal(hull(), hull())
    assert len(counted) == 1
    assert len(list(cache.iterdir())) == 1


def test_another_mesh_scale_or_type_has_another_hull(cache: Path, counted: list[int]) -> None:
    first = np.array(hull().points())
    doubled = np.array(hull(scale=[2.0, 1.0, 4.0]).points())
    last = np.vstack([POINTS[:-1], [[9.0, 9.0, 9.0]]])
    drawn_out = np.array(hull(mesh(last)).points())
    np.testing.assert_allclose(doubled, 2.0 * first, rtol=1e-12)
    np.testing.assert_allclose(drawn_out.max(axis=0), 9.0 * np.array(SCALE), rtol=1e-12)
    with pytest.raises(ModelError):
        mesh_hull(Path("a.stl"), mesh(), SCALE)
    assert len(counted) == 3


@pytest.mark.parametrize("fault", ["empty", "cut", "bit", "longer", "of another mesh", "writable"])
def test_what_is_not_this_hull_is_computed_again(
    cache: Path, counted: list[int], fault: str
) -> None:
    first = hull()
    (file,) = cache.iterdir()
    content = bytearray(file.read_bytes())
    if fault == "of another mesh":
        hull(mesh(3.0 * POINTS))
        (other,) = set(cache.iterdir()) - {file}
        content = bytearray(other.read_bytes())
    elif fault == "bit":
        content[70] ^= 1
    file.write_bytes(
        {"empty": b"", "cut": content[:-5], "longer": content + b"\0"}.get(fault, bytes(content))
    )
    if fault == "writable":
        file.chmod(0o666)
    counted.clear()
    assert_equal(first, hull())
    assert len(counted) == 1
    assert_equal(first, hull())
    assert len(counted) == 1


@pytest.mark.parametrize("where", ["a file", "/proc/hovi"])
def test_without_a_folder_to_write_to_hulls_are_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, counted: list[int], where: str
) -> None:
    (tmp_path / "a file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / where))
    assert_equal(hull(), hull())
    assert len(counted) == 2


def test_processes_at_once_leave_one_hull_that_is_read(cache: Path, counted: list[int]) -> None:
    program = (
        "import sys; from pathlib import Path\n"
        "from hovi.planning.clearance.mesh_hulls import mesh_hull\n"
        "content = Path(sys.argv[1]).read_bytes()\n"
        "for _ in range(20): mesh_hull(Path('a.obj'), content, [1.0, 0.5, 2.0])\n"
    )
    given = cache.parents[1] / "given.obj"
    given.write_bytes(mesh())
    command = [sys.executable, "-c", program, str(given)]
    running = [subprocess.Popen(command) for _ in range(2)]
    assert [each.wait(timeout=60) for each in running] == [0, 0]
    hull()
    assert counted == []
    assert len(list(cache.iterdir())) == 1


def test_a_flat_mesh_is_refused_and_not_kept(cache: Path) -> None:
    with pytest.raises(ModelError, match=r"'a.obj' has no convex hull: use a mesh with volume"):
        hull(mesh(POINTS * [1.0, 1.0, 0.0]))
    assert not cache.exists() or not list(cache.iterdir())


def test_pairs_of_a_robot_put_no_triangles_into_trees(
    ur5: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor is a visual mesh read: both would go through this function."""
    from hovi.planning.clearance.self_collisions import self_collision_pairs
    from hovi.robot.loading import load_robot

    def no_tree(*_: object) -> None:
        raise AssertionError("a mesh was put into a tree")

    monkeypatch.setattr("hovi.robot.meshes.mesh_shape.bvh_of", no_tree)
    assert self_collision_pairs(load_robot("ur5")) == self_collision_pairs(ur5)

"""Every reader gives the surface that was written, as Assimp reads it, or says what is wrong."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pytest

from hovi.errors import ModelError
from hovi.robot.meshes.reading import MESH_TYPES, triangles_in
from hovi.robot.meshes.triangles import Triangles
from samples.mesh_files import CUBE, CUBE_FACES, U_FACES, U_SHAPE, WRITERS, collada, ply_text
from samples.mesh_files import obj as obj_of

SHAPES = {"cube": (CUBE, CUBE_FACES, 1.0, 6.0), "u": (U_SHAPE, U_FACES, 5.0, 2 * 5.0 + 12.0)}
"""Corners, faces, volume and area."""


def volume(mesh: Triangles) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.vecdot(a, np.cross(b, c)).sum() / 6.0)


def area(mesh: Triangles) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


@pytest.mark.parametrize("way", WRITERS)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_surface_is_read_as_it_was_written(way: str, shape: str) -> None:
    points, faces, wanted, surface = SHAPES[shape]
    suffix, write = WRITERS[way]
    mesh = triangles_in(Path(f"mesh{suffix}"), write(points, faces))
    assert volume(mesh) == pytest.approx(wanted, rel=1e-6)
    if not way.startswith("stl"):  # the writer cuts faces of STL without regard to their shape
        assert area(mesh) == pytest.approx(surface, rel=1e-6)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), np.min(points, axis=0), atol=1e-6)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), np.max(points, axis=0), atol=1e-6)


# Coal's loader hangs at a comment in OFF, and does not read the unit of Collada.
@pytest.mark.parametrize("way", [way for way in WRITERS if way not in ("off", "collada in nodes")])
def test_assimp_reads_the_same_triangles(way: str, tmp_path: Path) -> None:
    suffix, write = WRITERS[way]
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(write(CUBE, CUBE_FACES))
    peer = coal.MeshLoader().load(str(path), np.ones(3))
    mesh = triangles_in(path, path.read_bytes())
    assert len(mesh.triangles) == peer.num_tris
    theirs = np.array(peer.vertices())
    for side in (np.min, np.max):
        np.testing.assert_allclose(side(mesh.vertices, 0), side(theirs, 0), atol=1e-4)


def test_strips_and_fans_of_collada_are_triangles() -> None:
    text = collada([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2]]).decode()
    begin, end = text.index("<polylist"), text.index("</polylist>") + len("</polylist>")
    inputs = '<input semantic="VERTEX" source="#v" offset="0"/>'
    for tag, corners in (("tristrips", "0 1 2 3"), ("trifans", "0 1 3 2"), ("polygons", "0 1 3 2")):
        part = f'<{tag} count="1">{inputs}<p>{corners}</p></{tag}>'
        mesh = triangles_in(Path("a.dae"), (text[:begin] + part + text[end:]).encode())
        assert area(mesh) == pytest.approx(1.0)
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


def test_vertices_that_are_no_corners_are_left_out() -> None:
    mesh = triangles_in(Path("a.ply"), ply_text([*CUBE, [9.0, 9.0, 9.0]], CUBE_FACES))
    assert mesh.vertices.max() == 1.0


def test_a_fourth_coordinate_of_obj_divides_the_others() -> None:
    text = b"v 2 0 0 2\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"
    assert triangles_in(Path("a.obj"), text).vertices[0].tolist() == [1.0, 0.0, 0.0]


def test_a_texture_index_is_not_a_vertex() -> None:
    text = obj_of(CUBE, CUBE_FACES).replace(b"//1", b"/99/99")
    assert len(triangles_in(Path("a.obj"), text).triangles) == 12


@pytest.mark.parametrize("suffix", MESH_TYPES)
@pytest.mark.parametrize("content", [b"", b"\0", b"text", b"<", b"\n" * 100, b"9" * 5_000])
def test_what_is_no_mesh_is_refused_in_a_sentence(suffix: str, content: bytes) -> None:
    with pytest.raises(ModelError, match=r"^mesh 'a\.\w+' .*\.$"):
        triangles_in(Path(f"a{suffix}"), content)

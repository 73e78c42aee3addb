"""Mutated contents of meshes in every format, as an obstacle and as a shape of a robot.

A mesh that loads unchanged has the volume that was written. One with an error is refused with the
same sentence as an obstacle and as a link's shape.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np

from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict, judge
from hovi.errors import InputError, ModelError
from hovi.planning.obstacles.hull import hull_of
from hovi.planning.obstacles.triangle_mesh import TriangleMesh, read_mesh
from hovi.robot.loading import load_robot
from samples.mesh_files import CUBE, CUBE_FACES, U_FACES, U_SHAPE, WRITERS, Faces, Points
from samples.meshes import mesh_arm

TOKENS = (
    *(b"nan", b"inf", b"-1", b"1e999", b"1e38", b"0", b"9" * 5_000, b"1_0", b"\0", b"\xff", b"#"),
    *(b"\n", b"\r", b"\\\n", b" ", b"f ", b"v ", b"f 1 2 3 4 5 6 7 8 7 6 5 4 3\n", b"3 0 1 2\n"),
    *(b"facet ", b"vertex ", b"endsolid", b"solid a\n", b"element vertex 1000000000\n"),
    *(b"property list uint float x\n", b"end_header\n", b"<node>", b"</node>", b"<p>", b"</mesh>"),
    *(b'<instance_node url="#top"/>', b"<matrix>0 0 0 0</matrix>", b"<skew/>", b"<!--", b"]]>"),
    *(
        b'<!DOCTYPE a [<!ENTITY b "c">]>',
        b"&b;",
        b"\x7f\xff\xff\xff",
        b"\xff\xff\xff\xff",
        b"1e-320",
    ),
)
NAME = re.compile(rb"^(\.\w+) ([\d.e+-]+|\?)\n")
"""First line of an input: the type of the file, and the volume that it must have, or "?"."""


def mutate(random: Random) -> Mutant:
    """A mesh: as it is, with changed bytes, or with an error that must be refused."""
    points, faces = _surface(random)
    suffix, write = WRITERS[random.choice(sorted(WRITERS))]
    kind = random.random()
    if kind < 0.15:
        return Mutant(
            b"%s %.9g\n" % (suffix.encode(), _volume(points, faces)) + write(points, faces)
        )
    if kind < 0.55:
        content = mutated_bytes(write(points, faces), random, TOKENS)
        return Mutant(b"%s ?\n" % suffix.encode() + content)
    change = random.choice(_CHANGES)
    suffix, content = change(points, faces, random)
    reason = (change.__doc__ or "").split("\n")[0]
    return Mutant(b"%s ?\n" % suffix.encode() + content, reason)


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Read it as an obstacle's mesh, and as that of a robot's link."""
    head = NAME.match(mutant.content)
    if head is None:
        return Verdict.REFUSED, "not a mesh"
    path = folder / f"mesh{head[1].decode()}"
    path.write_bytes(mutant.content[head.end() :])
    robot = load_robot(mesh_arm(folder, path.name))

    def load() -> TriangleMesh:
        try:
            mesh = read_mesh(str(path))
        except InputError as error:
            assert robot.collision is None, "it is the shape of a link"
            if str(error) not in robot.collision_problem:
                raise AssertionError(f"a link's shape has {robot.collision_problem!r}") from None
            raise ModelError(str(error)) from None
        assert robot.collision is not None, robot.collision_problem
        hull_of(mesh.vertices)
        return mesh

    return judge(load, lambda mesh: _error_in(mesh, head[2]), mutant.reason)


def _error_in(mesh: TriangleMesh, volume: bytes) -> str:
    if not np.isfinite(mesh.vertices).all():
        return "it has coordinates that are not finite"
    if mesh.triangles.size and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(
        mesh.vertices
    ):
        return "it has triangles without vertices"
    if volume == b"?":
        return ""
    found = mesh.volume()
    if found is None or abs(found - float(volume)) > 1e-4 * float(volume):
        return f"its volume is {found}, and {volume.decode()} was written"
    return ""


def _surface(random: Random) -> tuple[Points, Faces]:
    """A stretched cube or U."""
    points, faces = random.choice(((CUBE, CUBE_FACES), (U_SHAPE, U_FACES)))
    a, b, c, d = (random.uniform(0.1, 3.0) for _ in range(4))
    return [[a * x + d, b * y, c * z] for x, y, z in points], faces


def _volume(points: Points, faces: Faces) -> float:
    array = np.array(points)
    total = 0.0
    for face in faces:
        for k in range(1, len(face) - 1):
            total += float(np.linalg.det(array[[face[0], face[k], face[k + 1]]])) / 6.0
    return abs(total)


# Errors that must be refused; the docstring is the reason

Change = Callable[[Points, Faces, Random], tuple[str, bytes]]


def _any(points: Points, faces: Faces, random: Random, *without: str) -> tuple[str, bytes]:
    suffix, write = WRITERS[
        random.choice([each for each in sorted(WRITERS) if each not in without])
    ]
    return suffix, write(points, faces)


def _beyond(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """a face uses a vertex that does not exist"""
    index = random.choice((len(points), -2 - len(points), 10**8, 2**31 - 1, -(2**31)))
    broken = [list(face) for face in faces]
    random.choice(broken)[random.randrange(3)] = index
    ways = ("off", "obj", "ply as text", "ply, little endian", "ply, big endian", "collada")
    suffix, write = WRITERS[random.choice(ways)]
    return suffix, write(points, broken)


def _not_finite(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """a coordinate is not finite, or beyond what a mesh may have"""
    broken = [list(point) for point in points]
    broken[faces[0][0]][random.randrange(3)] = random.choice((math.nan, math.inf, -math.inf, 1e30))
    return _any(broken, faces, random)


def _cut(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """the file ends before its last face"""
    suffix, content = _any(points, faces, random, "obj", "obj counted back")
    return suffix, content[: random.randrange(0, len(content) - 12)]


def _no_faces(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """it has no faces"""
    return _any(points, random.choice(([], [[0, 1], [2]])), random, "stl as text")


def _declared(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """it declares other numbers than it has"""
    count = random.choice((-1, 0, 10**9, 2**32 - 1, 2**63, len(points) + 1, len(points) - 1))
    name = random.choice(("stl", "off", "ply as text", "ply, little endian", "collada"))
    suffix, write = WRITERS[name]
    content = write(points, faces)
    if name == "stl":
        return suffix, content[:80] + (count % 2**32).to_bytes(4, "little") + content[84:]
    place = {
        "off": rb"(?<=\n)%d(?= %d 0)" % (len(points), len(faces)),
        "collada": rb'(?<=polylist count=")\d+',
    }.get(name, random.choice((rb"(?<=element vertex )\d+", rb"(?<=element face )\d+")))
    found = re.search(place, content)
    assert found is not None
    count = count if count != int(found[0]) else 10**9
    return suffix, content[: found.start()] + b"%d" % count + content[found.end() :]


def _cycle(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """nodes are inside themselves, nested without end, or shown too often"""
    kind, many = random.randrange(4), random.choice((300, 5_000))
    shown = '<instance_geometry url="#g"/>'
    if kind == 0:
        nodes = f'<node id="a">{shown}<instance_node url="#a"/></node>'
    elif kind == 1:
        nodes = '<node id="a"><instance_node url="#b"/></node>'
        nodes += f'<node id="b">{shown}<node id="c"><instance_node url="#a"/></node></node>'
    elif kind == 2:
        nodes = "<node>" * many + shown + "</node>" * many
    else:
        nodes = f'<node id="n0">{shown}</node>' + "".join(
            f'<node id="n{k}">' + f'<instance_node url="#n{k - 1}"/>' * 10 + "</node>"
            for k in range(1, 12)
        )
    return ".dae", WRITERS["collada"][1](points, faces).replace(
        b'<node id="top"><instance_geometry url="#g"/></node>', nodes.encode()
    )


def _corners(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """a face that is not convex has too many corners"""
    count = random.choice((1_000, 5_000))
    ring = [
        [(1.0 + k % 2) * math.cos(0.006 * k), (1.0 + k % 2) * math.sin(0.006 * k), 0.0]
        for k in range(count)
    ]
    suffix, write = WRITERS[random.choice(("obj", "off", "collada"))]
    return suffix, write(ring, [list(range(count))])


def _entities(points: Points, faces: Faces, random: Random) -> tuple[str, bytes]:
    """entities of XML are expanded"""
    lines = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    doctype = f'<!DOCTYPE a [<!ENTITY l0 "0 ">{lines}]>'.encode()
    content = WRITERS["collada"][1](points, faces)
    return ".dae", content.replace(b"?>", b"?>" + doctype, 1).replace(b"<p>", b"<p>&l9;")


_CHANGES: tuple[Change, ...] = (
    *(_beyond, _beyond, _not_finite, _cut, _no_faces, _declared, _declared, _cycle, _corners),
    _entities,
)

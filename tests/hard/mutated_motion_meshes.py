"""Mutated trajectory files with meshes, whose names and contents must not lead anywhere.

A motion that loads is drawn. It has the properties of any motion, and no file is written for it.
"""

from __future__ import annotations

import hashlib
import io
import json
import tempfile
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import hovi
from hard import mutated_motion
from hard.mutated_bytes import mutated_bytes
from hard.mutated_motion import TOKENS, UNUSUAL_VALUES, Entries, edit, packed, rehash, unpacked
from hard.verdict import Mutant, Verdict, judge
from hovi.discrete.trajectory import Trajectory
from hovi.viewing.replay_session import page_of
from samples.mesh_package import picture
from samples.meshes import TRIANGLE, mesh_arm, textured

PREFIX = "mesh-"
NAMES = ("rod.dae", "../rod.stl", "/etc/passwd", "/etc/hostname.stl", "..", "", "a/", "\0.stl", "~")
BOMB = 300_000_000
"""Bytes of a content that is larger than all that a motion may bring."""


@cache
def original() -> bytes:
    """The file of a motion of an arm with a textured Collada mesh, and an STL as its solid."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rod.stl").write_text(TRIANGLE)
        (folder / "rod.dae").write_text(textured("wood.png"))
        (folder / "wood.png").write_bytes(picture())
        urdf = mesh_arm(folder, "rod.stl")
        urdf.write_text(urdf.read_text().replace("rod.stl", "rod.dae", 1))
        scene = hovi.Scene(hovi.load_robot(urdf))
        begin = hovi.State([0.0], [1.0])
        hovi.simulate(scene, begin, 0.1, intervals=4).trajectory.save(folder / "m.npz")
        return (folder / "m.npz").read_bytes()


def mutate(random: Random) -> Mutant:
    """A changed file: in its bytes, in its table of meshes, or in their contents."""
    if random.random() < 0.2:
        return Mutant(mutated_bytes(original(), random, TOKENS))
    entries = unpacked(original())
    change = random.choice((*_CHANGES, *INVALIDATING_CHANGES))
    change(entries, random)
    rehash(entries, random)
    reason = (change.__doc__ or "").split("\n")[0] if change in INVALIDATING_CHANGES else ""
    return Mutant(packed(entries, random), reason)


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`, and draw it."""
    path = folder / "motion.npz"
    path.write_bytes(mutant.content)
    return judge(lambda: Trajectory.load(path), lambda m: _error_in(m, folder), mutant.reason)


def _error_in(motion: Trajectory, folder: Path) -> str:
    if motion.robot is not None:
        page_of(motion)
        _ = motion.robot.collision
    if {each.name for each in folder.iterdir()} - {"motion.npz", "copy.npz"}:
        return "a file was written"
    return mutated_motion.error_in(motion, folder)


def _meshes(entries: Entries) -> list[str]:
    return [name for name in entries if name.startswith(PREFIX)]


def _content(entries: Entries, name: str) -> bytes:
    return bytes(np.lib.format.read_array(io.BytesIO(entries[name])).tobytes())


def _put(entries: Entries, name: str, content: bytes) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.frombuffer(content, np.uint8))
    entries[name] = stream.getvalue()


def _table(header: dict[str, Any]) -> dict[str, Any]:
    """The names of the meshes of the robot."""
    (names,) = header["meshes"]["robots"].values()
    found: dict[str, Any] = names
    return found


# Changes after which the file may or may not be valid


def _value(entries: Entries, random: Random) -> None:
    def change(header: dict[str, Any]) -> None:
        table = header["meshes"]
        while True:
            key = random.choice(list(table))
            if not isinstance(table[key], dict) or not table[key] or random.random() < 0.2:
                break
            table = table[key]
        if random.random() < 0.2:
            del table[key]
        else:
            table[key] = random.choice((*UNUSUAL_VALUES, {"a": 1}, ["0" * 64]))

    edit(entries, change)


def _name(entries: Entries, random: Random) -> None:
    new = random.choice(NAMES)

    def change(header: dict[str, Any]) -> None:
        names, robot = _table(header), header["scene"]["robot"]
        old = random.choice(list(names))
        names[new] = names.pop(old)
        robot["urdf"] = robot["urdf"].replace(f'"{old}"', json.dumps(new))
        robot["sha256"] = hashlib.sha256(robot["urdf"].encode()).hexdigest()
        header["meshes"]["robots"] = {robot["sha256"]: names}
        text = json.dumps(header["scene"], sort_keys=True)
        header["scene_sha256"] = hashlib.sha256(text.encode()).hexdigest()

    edit(entries, change)


def _texture(entries: Entries, random: Random) -> None:
    def change(header: dict[str, Any]) -> None:
        mesh = _table(header)["rod.dae"]
        mesh["textures"] = random.choice(
            ({}, {"/etc/passwd": mesh["sha256"]}, {"../wood.png": mesh["sha256"]}, UNUSUAL_VALUES)
        )

    edit(entries, change)


def _other_content(entries: Entries, random: Random) -> None:
    """Another content with its own hash, as whoever writes the file can have it."""
    name = random.choice(_meshes(entries))
    content = mutated_bytes(zlib.decompress(_content(entries, name)), random, (b"nan", b"9" * 99))
    replace(entries, name, hashlib.sha256(content).hexdigest(), zlib.compress(content))


def replace(entries: Entries, name: str, sha256: str, content: bytes) -> None:
    """Put another mesh into the place of one. content: compressed."""
    del entries[name]
    _put(entries, PREFIX + sha256, content)
    old = name.removeprefix(PREFIX)

    def change(header: dict[str, Any]) -> None:
        header["meshes"] = json.loads(json.dumps(header["meshes"]).replace(old, sha256))

    edit(entries, change)


def _array(entries: Entries, random: Random) -> None:
    name = random.choice(_meshes(entries))
    entries[name] = mutated_bytes(entries[name], random, TOKENS)


_CHANGES: tuple[Callable[[Entries, Random], None], ...] = (
    *(_value, _value, _name, _name, _texture, _other_content, _other_content, _array),
)

# Changes that make the file invalid; the docstring is the reason


def _swapped(entries: Entries, random: Random) -> None:
    """a mesh does not have its hash"""
    name = random.choice(_meshes(entries))
    content = zlib.decompress(_content(entries, name))
    _put(entries, name, zlib.compress(random.choice((content + b" ", content[:-1], b""))))


def _cut(entries: Entries, random: Random) -> None:
    """a mesh is not complete, or followed by something"""
    name = random.choice(_meshes(entries))
    content = _content(entries, name)
    _put(entries, name, random.choice((content[:-1], content[:7], b"", content + b"\0")))


def _bomb(entries: Entries, random: Random) -> None:
    """a mesh is larger than all that a motion may bring"""
    replace(entries, random.choice(_meshes(entries)), *_large())


@cache
def _large() -> tuple[str, bytes]:
    """The hash of a content, and the content compressed."""
    content = bytes(BOMB)
    return hashlib.sha256(content).hexdigest(), zlib.compress(content, 1)


def _too_large(entries: Entries, random: Random) -> None:
    """the meshes take more than 20 MB"""
    _put(entries, random.choice(_meshes(entries)), bytes(21_000_000))


def _removed(entries: Entries, random: Random) -> None:
    """a mesh is missing"""
    del entries[random.choice(_meshes(entries))]


def _numbers(entries: Entries, random: Random) -> None:
    """a mesh is not one of bytes"""
    name = random.choice(_meshes(entries))
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.ones(8, random.choice((np.float64, np.int8, np.uint16))))
    entries[name] = stream.getvalue()


def _many(entries: Entries, random: Random) -> None:
    """there are more meshes than a motion may have"""
    hashes = [hashlib.sha256(str(i).encode()).hexdigest() for i in range(5_001)]
    edit(entries, lambda header: header["meshes"].update(kept=hashes))


def _many_names(entries: Entries, random: Random) -> None:
    """there are more names of meshes than a motion may have"""
    mesh = {"sha256": "0" * 64, "textures": {}}
    edit(entries, lambda header: _table(header).update({str(i): mesh for i in range(5_001)}))


INVALIDATING_CHANGES: dict[Callable[[Entries, Random], None], str] = {
    _swapped: "does not have its sha256",
    _cut: "is not complete",
    _bomb: "its meshes take more than 256 MB",
    _too_large: "more than 20000000",
    _removed: "lacks the entry 'mesh-",
    _numbers: "expected uint8 in C order",
    _many: "no list of at most 5,000 hashes",
    _many_names: "it names more than 5,000 meshes",
}
"""With a part of the sentence that refuses the file."""

"""Mutated trajectory files of motions in segments; what loads has the properties of any motion."""

from __future__ import annotations

import hashlib
import json
import tempfile
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import hovi
from hard import mutated_urdf
from hard.mutated_bytes import mutated_bytes
from hard.mutated_motion import TOKENS, UNUSUAL_VALUES, edit, packed, rehash, unpacked, verdict
from hard.verdict import Mutant
from hovi.schemes import galerkin

__all__ = ["mutate", "verdict"]


@cache
def original() -> bytes:
    """The file of a motion of the two-link arm, with a payload from half way on."""
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scenes = hovi.Scene(robot), hovi.Scene(robot, [hovi.effects.Payload(frame="tip", mass=1.0)])
    grid = hovi.Grid.uniform(0.5, 2, galerkin(2))
    segments = [hovi.DiscreteLagrangian(each.effort_lagrangian(), grid) for each in scenes]
    ends = hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7])
    solution = hovi.solve(hovi.TrajectoryProblem.of_segments(segments, *ends))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.npz"
        solution.trajectory.save(path)
        return path.read_bytes()


def mutate(random: Random) -> Mutant:
    """A changed file: in its bytes, or in its tables `scenes` and `segments`."""
    if random.random() < 0.2:
        return Mutant(mutated_bytes(original(), random, TOKENS))
    entries = unpacked(original())
    change, reason = random.choice(_CHANGES)
    edit(entries, lambda header: change(header, random))
    rehash(entries, random)
    return Mutant(packed(entries, random), reason)


def _update_hash(header: dict[str, Any]) -> None:
    """Recompute the hashes of the scenes, as an attacker can."""
    for scene in header["scenes"]:
        urdf = scene["robot"]["urdf"]
        scene["robot"]["sha256"] = hashlib.sha256(urdf.encode()).hexdigest()
    text = json.dumps(header["scenes"], sort_keys=True)
    header["scenes_sha256"] = hashlib.sha256(text.encode()).hexdigest()


def _value(header: dict[str, Any], random: Random) -> None:
    key = random.choice(("scenes", "segments", "scenes_sha256", "scene", "scene_sha256"))
    header[key] = random.choice((*UNUSUAL_VALUES, [[0, 2], [1, 2]], [[0, 4]], [{}, {}]))


def _removed(header: dict[str, Any], random: Random) -> None:
    del header[random.choice(("scenes", "segments", "scenes_sha256"))]


def _counts(header: dict[str, Any], random: Random) -> None:
    which, entry = random.randrange(2), random.randrange(2)
    values = (-1, 0, 2, 3, 5, 10**9, 10**30, 1.0, True, None, "1", [1])
    header["segments"][which][entry] = random.choice(values)


def _robot(header: dict[str, Any], random: Random) -> None:
    urdf = mutated_urdf.mutate(random).content.decode(errors="replace")
    header["scenes"][random.randrange(2)]["robot"]["urdf"] = urdf
    _update_hash(header)


def _payload(header: dict[str, Any], random: Random) -> None:
    text = json.dumps(header["scenes"][1]).replace(
        "1.0", random.choice(("2.0", "1e400", "-1", "{}"))
    )
    header["scenes"][1] = json.loads(text)
    _update_hash(header)


def _unhashed(header: dict[str, Any], random: Random) -> None:
    robot = header["scenes"][0]["robot"]
    robot["urdf"] = robot["urdf"].replace("0.375", random.choice(("0.376", "NaN", "-1")))


def _too_few(header: dict[str, Any], random: Random) -> None:
    header["segments"] = random.choice(([[0, 2]], [[0, 2], [1, 1]], [[0, 2], [1, 2], [0, 1]], []))


def _no_scene(header: dict[str, Any], random: Random) -> None:
    header["segments"] = random.choice(([[0, 2], [2, 2]], [[0, 4]], [[1, 2], [-1, 2]]))


_CHANGES = (
    *((each, "") for each in (_value, _counts, _robot, _payload)),
    (_removed, "a table is missing"),
    (_unhashed, "a scene is not the one whose hash is written"),
    (_too_few, "the segments do not cover the intervals"),
    (_no_scene, "the segments are not those of the scenes"),
)

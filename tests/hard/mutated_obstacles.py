"""Mutated tables and files of obstacles; those that load have finite bodies and a name.

A table is stored as JSON. What loads comes back from the data that a motion records.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict, judge
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.compiled_distances import core_of
from hovi.planning.clearance.obstacles import obstacle_from_dict
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.obstacle_files import load_obstacles
from samples.meshes import channel
from samples.world_files import PLANNING_SCENE

CORNERS = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
TABLES: tuple[dict[str, Any], ...] = (
    {"kind": "sphere", "position": [1.0, 0.0, 0.0], "radius": 0.1, "name": "ball"},
    {"kind": "capsule", "ends": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "radius": 0.1},
    {"kind": "box", "size": [1.0, 2.0, 3.0], "position": [0.0] * 3, "rpy": [0.1] * 3},
    {"kind": "cylinder", "radius": 0.1, "length": 1.0, "position": [0.0] * 3},
    {
        **{"kind": "sphere", "position": [0.0] * 3, "radius": 0.1},
        "path": {"times": [0.0, 1.0, 2.0], "positions": CORNERS[:3], "rpy": CORNERS[1:]},
    },
    {"kind": "half_space", "normal": [0.0, 0.0, 1.0]},
    {"kind": "convex_hull", "points": CORNERS},
    {"kind": "convex_parts", "parts": [CORNERS, CORNERS], "radius": 0.01},
    {"kind": "mesh", "file": "channel.obj", "scale": 2.0},
    {"kind": "point_cloud", "points": CORNERS, "radius": 0.01, "cell": 0.05},
)
VALUES = (
    *(float("nan"), float("inf"), "1", "", True, None, [], {}, 0, -1, 1, 10**30, 1e308, 1e-308),
    *(
        [0.0],
        [0.0] * 3,
        [[0.0] * 3] * 9,
        [[0.0] * 3, "x"],
        {"x": 1.0},
        "none",
        "a" * 10_000,
        "a\nb",
    ),
    *(
        0.2,
        3,
        [0.1, 0.2, 0.3],
        [1, 2, 3],
        [[0, 0, 0], [0, 0, 1]],
        CORNERS,
        [CORNERS],
        "post",
        False,
    ),
    *({"times": [0.0, 1.0], "positions": CORNERS[:2]}, {"times": [1.0, 0.0]}, {"times": [[]]}),
    *("../../etc/passwd", "x\0y", "\ud800", "box", -0.0, 5e-324, [1.0, 2.0, 3.0, 4.0], [[[]]]),
)
TOKENS = (
    *(
        b"nan",
        b".inf",
        b"-1",
        b"1e999",
        b"[" * 200,
        b"{" * 200,
        b"- " * 100,
        b"&a ",
        b"*a",
        b"<<: ",
    ),
    *(
        b"!!python/object:os.system ",
        b"!!binary ",
        b"|\n",
        b">",
        b"? ",
        b"--- ",
        b"...\n",
        b"%YAML",
    ),
    *(
        b"\t",
        b"\0",
        b"\xff",
        b"\xef\xbb\xbf",
        b"'",
        b'"',
        b"#",
        b": ",
        b"null",
        b"0x10",
        b"9" * 5_000,
    ),
)
Change = Callable[[dict[str, Any], Random], None]


def mutate(random: Random) -> Mutant:
    """A changed planning scene, or a changed table."""
    if random.random() < 0.4:
        if random.random() < 0.5:
            return Mutant(mutated_bytes(PLANNING_SCENE.encode(), random, TOKENS))
        words = PLANNING_SCENE.split(" ")
        for _ in range(random.randint(1, 3)):
            k = random.choice([k for k, word in enumerate(words) if any(map(str.isdigit, word))])
            words[k] = random.choice(("0,", "1,", "-1", "0.5,", "2]", "[3,", "1e3", ".nan", "x"))
        return Mutant(" ".join(words).encode())
    table = json.loads(json.dumps(random.choice(TABLES)))
    if random.random() < 0.6:
        for _ in range(random.randint(1, 3)):
            table[random.choice([*table, "name", "rpy", "position", "path"])] = random.choice(
                VALUES
            )
        return Mutant(json.dumps(table).encode())
    change = random.choice((_unknown_key, _missing_key, _not_finite, _negative))
    change(table, random)
    return Mutant(json.dumps(table).encode(), (change.__doc__ or "").split("\n")[0])


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`, or as a table."""
    (folder / "channel.obj").write_text(channel())
    if not mutant.content.startswith(b'{"') or b"world" in mutant.content:
        path = folder / "scene.yaml"
        path.write_bytes(mutant.content)
        return judge(lambda: load_obstacles(path), _error_in, mutant.reason)
    table = json.loads(mutant.content)
    if table.get("file") == "channel.obj":
        table["file"] = str(folder / table["file"])
    return judge(lambda: (obstacle_from_dict(table),), _error_in, mutant.reason)


def _error_in(obstacles: tuple[Obstacle, ...]) -> str:
    """The error in loaded obstacles; "" if there is none."""
    for each in obstacles:
        if not isinstance(each.name, str):
            return "a name is no text"
        if each.motion is not None and not np.isfinite(each.motion.poses([-1.0, 0.3, 9.0])).all():
            return "a path has poses that are not finite"
        for body in (*each.bodies(), *each.drawn()):
            at = np.append(body.placement.translation, body.placement.rotation)
            if not np.isfinite(np.append(at, core_of(body.shape).sphere)).all():
                return f"a {each.kind} has numbers that are not finite"
    stored = Clearance(obstacles).to_dict() if _have_own_names(obstacles) else None
    if (
        stored is not None
        and Clearance.from_dict(json.loads(json.dumps(stored))).to_dict() != stored
    ):
        return "they do not come back from what a motion records"
    return ""


def _have_own_names(obstacles: tuple[Obstacle, ...]) -> bool:
    return len({each.name for each in obstacles}) == len(obstacles)


def _unknown_key(table: dict[str, Any], random: Random) -> None:
    """It has a key that no obstacle has."""
    table[random.choice(("sise", "", "Position", "radius_", "mass"))] = 1.0


def _missing_key(table: dict[str, Any], random: Random) -> None:
    """It lacks a key that it needs."""
    key = {"capsule": "ends", "box": "size", "half_space": "normal", "convex_hull": "points"}
    table.pop(key.get(table["kind"], "kind"))


def _not_finite(table: dict[str, Any], random: Random) -> None:
    """Its position is not finite."""
    table["position"] = [0.0, random.choice((float("nan"), float("inf"), 1e300)), 0.0]
    table.pop("ends", None)


def _negative(table: dict[str, Any], random: Random) -> None:
    """A length is not positive."""
    key = {"box": "size", "half_space": "normal", "mesh": "scale", "convex_hull": "points"}
    table[key.get(table["kind"], "radius")] = -1.0

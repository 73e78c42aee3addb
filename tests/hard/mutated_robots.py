"""Changes of a scene's robot and of its group, and the files that such a scene finds."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

from hovi.robot.bundled_models import example

SRDF = """<robot name="two_link">
<group name="upper"><joint name="shoulder"/></group>
<group name="fore"><link name="forearm"/></group>
<group name="both"><group name="upper"/><chain base_link="base" tip_link="tip"/></group>
<group name="none"/><group name="round"><group name="round"/></group>
<group_state name="bent" group="both"><joint name="elbow" value="1.2"/></group_state>
</robot>"""
"""Groups of the two-link arm: of one joint, of all, of none, and one that is in itself."""


def placed(content: bytes, folder: Path) -> Path:
    """The path of the scene: beside the URDFs, or alone, where those that ship with hovi are found.

    An SRDF is in both folders.
    """
    alone = folder / "alone"
    if not alone.exists():
        alone.mkdir()
        for urdf in example("two_link.urdf").parent.glob("*.urdf"):
            (folder / urdf.name).write_text(urdf.read_text())
        for each in (folder, alone):
            (each / "two_link.srdf").write_text(SRDF)
    path = (alone if len(content) % 3 == 0 else folder) / "scene.toml"
    path.write_bytes(content)
    return path


def grouped(scene: dict[str, Any], random: Random) -> None:
    """A group of the two-link arm, whose goal is a table that leaves joints out."""
    numbers = (0.1, 0.2, 0, -1.5, 1e308, float("nan"), "1", True, [0.0], [])
    names = ("shoulder", "elbow", "elbow", "wrist", "")
    joints = random.sample(names, random.randint(0, 2))
    table: Any = {joint: random.choice(numbers[: random.choice((3, 10))]) for joint in joints}
    whole = ({"shoulder": 0.1, "elbow": 0.2}, [0.1, 0.2], "bent", {"elbow": 0.2})
    scene |= {"robot": "two_link.urdf", "srdf": "two_link.srdf", "start": {"q": whole[0]}}
    scene["group"] = random.choice(("upper", "upper", "fore", "both", "none", "round", "arm", ""))
    if random.random() < 0.3:
        tip = {"frame": "tip", "position": [0.6, 0.0, 0.3]}
        scene["start"] = random.choice(({"q": random.choice(whole)}, tip))
    goal = {"q": table, "v": random.choice(({"elbow": 0.0}, [0.0, 0.1], [0.0]))}
    if random.random() < 0.7:
        del goal["v"]
    parts = scene.get("segments")
    ends = [part for part in parts if isinstance(part, dict)] if isinstance(parts, list) else []
    for owner in ends or [scene]:
        owner["goal"] = goal


def shipped(scene: dict[str, Any], random: Random) -> None:
    """A robot that ships with hovi, or one that only looks like it."""
    files = ("two_link.urdf", "pendulum.urdf", "cart_pole.urdf", "spacecraft_arm.urdf")
    around = ("{}", "./{}", "../{}", "alone/{}", "/{}", "{}/", "{}\n", " {}", "{}.urdf", "**/{}")
    scene["robot"] = random.choice(around).format(random.choice((*files, "two_link_reach.toml")))


def no_robot(scene: dict[str, Any], random: Random) -> None:
    """no such URDF is beside the scene, and none of this name ships with hovi"""
    names = ("no.urdf", ".urdf", "*.urdf", "no/two_link.urdf", "two_link.URDF", "Two_link.urdf")
    scene["robot"] = random.choice((*names, "two_link_reach.toml", "two_link.urdf\0", "a" * 300))


def half_a_group(scene: dict[str, Any], random: Random) -> None:
    """the group is unknown, or the goal leaves out one of its joints"""
    table = {"shoulder": 0.1, "elbow": 0.2}
    scene |= {"robot": "two_link.urdf", "srdf": "two_link.srdf", "start": {"q": dict(table)}}
    group, lacks = random.choice((("upper", "shoulder"), ("fore", "elbow"), ("arm", ""), ("", "")))
    scene["group"] = group
    table.pop(lacks, None)
    scene["goal"] = {"q": table}
    if random.random() < 0.5 and lacks:
        scene["group"] = "both"

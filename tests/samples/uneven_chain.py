"""Planar chains with links of different masses, for extreme mass ratios."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain as joined
from pathlib import Path

from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.urdf.planar_chain import chain


def uneven_chain(masses: Sequence[float], path: Path) -> Robot:
    """Rods of one metre with given masses in [kg]; with proportional inertias."""
    text = chain(len(masses), mass=1.0)
    for tag, attributes in (("mass", ["value"]), ("inertia", ["ixx", "iyy", "izz"])):
        parts = re.split(rf"(<{tag} [^>]*/>)", text)
        scaled = [_scaled(part, attributes, m) for part, m in zip(parts[1::2], masses, strict=True)]
        text = "".join(joined.from_iterable(zip(parts[0::2], [*scaled, ""], strict=True)))
    path.write_text(text, encoding="utf-8")
    return load_robot(path)


def _scaled(element: str, attributes: Sequence[str], factor: float) -> str:
    def times(found: re.Match[str]) -> str:
        return f'{found[1]}="{float(found[2]) * factor!r}"'

    return re.sub(rf'({"|".join(attributes)})="([^"]*)"', times, element)

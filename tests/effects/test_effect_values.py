"""What is wrong with an effect for every robot is refused when it is made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hovi.effects import (
    Drag,
    DryFriction,
    Effect,
    EffortWeight,
    Gravity,
    JointLimitPotential,
    MovingBase,
    Payload,
    PowerCost,
    ReferenceCost,
    Wrench,
)
from hovi.errors import SceneError
from hovi.planning.task_file.reading import load_task

TIP = "tip"


AT_ONCE: dict[str, Callable[[], Effect]] = {
    "a mass": lambda: Payload(TIP, mass=-2),
    "a mass with a point": lambda: Payload(TIP, mass=-2.0),
    "a center": lambda: Payload(TIP, 1.0, (0.0, np.inf, 0.0)),
    "gravity": lambda: Gravity(-9.81),
    "a direction": lambda: Gravity(direction=(0, 0, 0)),
    "an area": lambda: Drag(TIP, area=-1),
    "a width": lambda: DryFriction(0.1, width=0),
    "a range": lambda: JointLimitPotential({"panda_joint2": (1, 0)}),
    "a weight": lambda: ReferenceCost({"panda_joint2": 0.0}, weight=-1),
    "a width of power": lambda: PowerCost(1.0, width=0),
    "two weights": lambda: EffortWeight(1.0, from_urdf=True),
    "axes": lambda: Wrench(TIP, (1.0, 0.0, 0.0), axes="tool"),
    "a formula": lambda: MovingBase(position=("x", 0.0, 0.0)),
}


@pytest.mark.parametrize("case", AT_ONCE)
def test_what_is_wrong_for_every_robot_is_refused_at_once(case: str) -> None:
    with pytest.raises(SceneError, match=r"^effect '[a-z_]+'"):
        AT_ONCE[case]()


def test_a_file_and_python_refuse_a_mass_in_the_same_words(models: Path, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    text = (models / "two_link_reach.toml").read_text()
    path.write_text(f'{text}\n[effects.payload]\nframe = "tip"\nmass = -2\n')
    with pytest.raises(SceneError) as in_file:
        load_task(path)
    with pytest.raises(SceneError) as in_python:
        Payload("tip", mass=-2)
    assert str(in_file.value).endswith(f": {in_python.value}")

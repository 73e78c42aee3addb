"""What a plan minimises, by name: nothing but effects of the scene, with their weights."""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from typing import Any

from hovi.errors import InputError, nearest
from hovi.scene.scene import Scene, without_inertia

OBJECTIVES = "effort", "acceleration", "jerk", "time"
"""Names of what is minimised."""
IN_WORDS = '"effort", "acceleration", "jerk" or "time"'


def require_objective(given: Any) -> None:
    """Raise InputError for anything but the name of an objective."""
    if not isinstance(given, str):
        raise InputError(f"`objective` must be {IN_WORDS}, but it is {given!r}.")
    if given not in OBJECTIVES:
        raise InputError(f"there is no objective {given!r}: {nearest(given, OBJECTIVES)}")


@lru_cache(maxsize=64)
def with_objective(scene: Scene, objective: str, weighted: bool = False) -> Scene:
    """The scene with the effects that an objective stands for, the same one for the same scene.

    effort: none; R = 1 where the scene has no effort_weight.
    acceleration, jerk: effort_weight = 0, and acceleration_cost or jerk_cost = 1 unless the scene
        has that effect, with weights of its own.
    time: those of effort, or of acceleration for a robot without inertia.
    weighted: whether torques have weights that the scene does not know.
    Raises InputError for weights of torques that are all zero.
    """
    if objective == "time":
        objective = "acceleration" if without_inertia(scene) else "effort"
    if objective == "effort":
        return scene
    from hovi.effects.effort_weight import EffortWeight  # here: most plans minimise effort
    from hovi.effects.motion_cost import AccelerationCost, JerkCost

    cost = AccelerationCost(1.0) if objective == "acceleration" else JerkCost(1.0)
    _require_free_torques(scene, objective, weighted)
    keys = {each.key for each in scene.effects}
    added = [each for each in (EffortWeight(0.0), cost) if each.key not in keys]
    return dataclasses.replace(scene, effects=[*scene.effects, *added])


def _require_free_torques(scene: Scene, objective: str, weighted: bool) -> None:
    """Raise InputError where a scene, or an option, gives torques a weight."""
    from hovi.effects.effort_weight import EffortWeight  # as above

    own = next((each for each in scene.effects if isinstance(each, EffortWeight)), None)
    named = own is not None and (bool(own.matrix) or own.effort_weight(scene.robot).any())
    if weighted or named:
        what = "the option weight" if weighted else "the scene's effect effort_weight"
        raise InputError(
            f'objective = "{objective}" gives torques no weight, and {what} gives them one: leave '
            "one of the two out."
        )


def describe_objective(scene: Scene, objective: str) -> str:
    """The effects of an objective other than effort with their weights, as one line."""
    chosen = with_objective(scene, objective)
    costs = ("effort_weight", "acceleration_cost", "jerk_cost")
    parts = [each.describe() for each in chosen.effects if each.key in costs]
    if objective == "time":
        parts = ["time_weight doubled until the duration stays the same", *parts]
    return f"objective {objective}: {'; '.join(parts)}"

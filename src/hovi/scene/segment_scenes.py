"""The scenes of a motion's segments, and the torques of each interval by its own scene."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.errors import InputError
from hovi.robot.meshes.stored_meshes import StoredMeshes
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@check_arguments
@dataclass(frozen=True, eq=False)
class SegmentScenes:
    """The scene of every segment of a motion, all of one robot.

    scenes: one per segment. intervals: the number of intervals of each, one or more.
    Raises InputError for other lengths, and for scenes of different joints.
    """

    scenes: tuple[Scene, ...]
    intervals: tuple[int, ...]

    def __post_init__(self) -> None:
        if len(self.scenes) == 0 or len(self.scenes) != len(self.intervals):
            raise InputError(
                f"segments need a scene and a number of intervals each, got {len(self.scenes)} "
                f"scenes and {len(self.intervals)} numbers."
            )
        if min(self.intervals) < 1:
            raise InputError(f"every segment needs one interval or more, got {self.intervals}.")
        for each in self.scenes:
            names = each.robot.coordinate_names
            if names != self.robot.coordinate_names or each.robot.space.parts != self.parts:
                raise InputError("the scenes of all segments must move the same joints.")

    @property
    def robot(self) -> Robot:
        """The robot of the first segment; the others have the same joints."""
        return self.scenes[0].robot

    @property
    def parts(self) -> tuple[int | str, ...]:
        """The parts of the configuration space."""
        return tuple(self.robot.space.parts)

    def inverse_dynamics(self, k: Index, jet: tuple[Array, Array, Array], t: Array) -> Array:
        """tau at M points (q, v, a) of the intervals k (M,) at times t (M,), shape (M, nv)."""
        ends = np.cumsum(self.intervals)
        segment = np.searchsorted(ends, k, side="right")
        tau = np.empty_like(jet[1])
        for s in np.unique(segment):
            here = segment == s
            tau[here] = self.scenes[s].inverse_dynamics(*(x[here] for x in jet), t[here])
        return tau

    def to_tables(self) -> dict[str, Any]:
        """`scenes`, each once, `segments` of [scene, intervals], and the hash of the scenes."""
        known: list[Scene] = []
        for scene in self.scenes:
            if not any(scene is each for each in known):
                known.append(scene)
        numbers = [next(i for i, s in enumerate(known) if s is scene) for scene in self.scenes]
        scenes = [scene.to_dict() for scene in known]
        segments = [list(pair) for pair in zip(numbers, self.intervals, strict=True)]
        return {"scenes": scenes, "segments": segments, "scenes_sha256": _digest(scenes)}

    @classmethod
    def from_tables(
        cls,
        tables: dict[str, Any],
        package_dirs: Iterable[str | Path] = (),
        meshes: Mapping[str, StoredMeshes] | None = None,
    ) -> Self:
        """The inverse of `to_tables`. Raises InputError for anything else.

        package_dirs, meshes: see `Scene.from_dict`.
        """
        missing = {"scenes", "segments", "scenes_sha256"} - set(tables)
        if missing:
            raise InputError(f"a motion in segments lacks {min(missing)!r}")
        scenes, segments = tables["scenes"], tables["segments"]
        if not isinstance(scenes, list) or _digest(scenes) != tables["scenes_sha256"]:
            raise InputError("its scenes do not match the stored SHA-256")
        if not isinstance(segments, list) or not all(_is_segment(s, len(scenes)) for s in segments):
            raise InputError("its segments are not a list of [number of a scene, intervals]")
        if {number for number, _ in segments} != set(range(len(scenes))):
            raise InputError("its segments do not use every one of its scenes")
        known = [Scene.from_dict(scene, package_dirs, meshes) for scene in scenes]
        numbers, counts = zip(*segments, strict=True)
        return cls(tuple(known[i] for i in numbers), tuple(counts))


def _is_segment(given: Any, scenes: int) -> bool:
    """Whether a value is [number of a scene, number of intervals]."""
    if not isinstance(given, list) or len(given) != 2 or any(type(x) is not int for x in given):
        return False
    return bool(0 <= given[0] < scenes and 0 < given[1] < 2**31)


def _digest(scenes: list[Any]) -> str:
    """SHA-256 of the scenes as canonical JSON, in hexadecimal."""
    return hashlib.sha256(json.dumps(scenes, sort_keys=True).encode()).hexdigest()

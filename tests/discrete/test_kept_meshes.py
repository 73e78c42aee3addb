"""Meshes in the file of a motion are checked before they are used."""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from hard.mutated_motion import Entries, packed, rehash, unpacked
from hard.mutated_motion_meshes import INVALIDATING_CHANGES, PREFIX, original, replace
from hovi.discrete.trajectory import Trajectory
from hovi.errors import TrajectoryFileError


def changed(folder: Path, change: Callable[[Entries, Random], None], seed: int = 0) -> Path:
    entries, random = unpacked(original()), Random(seed)
    change(entries, random)
    rehash(entries, random)
    path = folder / "motion.npz"
    path.write_bytes(packed(entries, random))
    return path


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("change", INVALIDATING_CHANGES, ids=lambda change: change.__name__)
def test_wrong_meshes_are_refused_in_one_sentence(
    change: Callable[[Entries, Random], None], seed: int, tmp_path: Path
) -> None:
    with pytest.raises(TrajectoryFileError, match=INVALIDATING_CHANGES[change]) as refused:
        Trajectory.load(changed(tmp_path, change, seed))
    assert str(refused.value).startswith("trajectory file 'motion.npz'")
    assert str(refused.value).count("\n") == 0


@pytest.mark.filterwarnings("ignore:the file has no SHA-256")
def test_another_content_with_its_own_hash_is_a_mesh_like_any_other(tmp_path: Path) -> None:
    """Whoever writes the file says what is drawn; what is no mesh is left out with a sentence."""

    def change(entries: Entries, random: Random) -> None:
        del random
        solid = next(
            name
            for name in entries
            if name.startswith(PREFIX) and b"facet" in zlib.decompress(entries[name][128:])
        )
        content = b"solid words\nfacet\n"
        replace(entries, solid, hashlib.sha256(content).hexdigest(), zlib.compress(content))

    robot = Trajectory.load(changed(tmp_path, change, seed=1)).robot
    assert robot is not None
    assert robot.visual_problem == ""
    assert "mesh 'rod.stl' is no STL" in robot.collision_problem

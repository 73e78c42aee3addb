"""Guesses of cells that start from each other's motions."""

from __future__ import annotations

import tempfile
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import stretched
from hovi.discrete.path_on_grid import moved, path_on_grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.discrete.trajectory_file import read_arrays, require_unchanged, schemes_of
from hovi.errors import HoviError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.task_file.task import Task
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.study.storage.journal import Stored
from hovi.system.dataclass import dataclass

MAX_MOTIONS = 256
"""Motions that a worker keeps; those that were not used for the longest time are dropped."""
_PATH = ("q", "v", "z", "inner", "higher")
_ARRAYS = ("steps", "q", "v", "z", "inner", "momenta")
Array = npt.NDArray[np.float64]


@dataclass(eq=False)
class Motions:
    """Motions that a worker has planned or read, since most guesses are among them."""

    folder: Path
    _kept: OrderedDict[Stored, Trajectory] = field(default_factory=OrderedDict)

    def put(self, stored: Stored, motion: Trajectory) -> None:
        """Keep a motion."""
        self._kept[stored] = motion
        self._kept.move_to_end(stored)
        while len(self._kept) > MAX_MOTIONS:
            self._kept.popitem(last=False)

    def get(self, stored: Stored, scene: Scene) -> Trajectory | None:
        """A stored motion as a guess; None if it is that of another robot.

        scene: in which it will be a guess, so that the one that was stored need not be built.
        Raises OSError, ValueError and TrajectoryFileError.
        """
        if stored not in self._kept:
            read = _motion_in(stored.read(self.folder), scene)
            if read is None:
                return None
            self.put(stored, read)
        kept = self._kept[stored]
        same = kept.q.shape[1] == scene.robot.nq and kept.v.shape[1] == scene.robot.nv
        return kept if same else None


def _motion_in(content: bytes, scene: Scene) -> Trajectory | None:
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        file.write(content)
        file.flush()
        header, arrays = read_arrays(file.name, _ARRAYS, optional=["higher"])
    require_unchanged(header, arrays)
    if arrays["q"].shape[1] != scene.robot.nq or arrays["v"].shape[1] != scene.robot.nv:
        return None
    grid = Grid(arrays["steps"], schemes_of(header["schemes"], arrays["inner"].shape))
    path = DiscretePath(*(arrays[name] for name in _PATH if name in arrays))
    return Trajectory(grid, path, arrays["momenta"], scene)


@dataclass(eq=False)
class GuessCosts:
    """The costs of guesses whose ends were moved to those of a task, by the action it has."""

    _action: DiscreteLagrangian | None = None

    def cheapest(self, task: Task, guesses: Sequence[Trajectory]) -> int:
        """Which guess costs least."""
        if len(guesses) < 2:
            return 0
        return int(np.argmin([self.of(task, guess) for guess in guesses]))

    def of(self, task: Task, guess: Trajectory) -> float:
        """1/2 integral |tau|^2 of the guess plus the cubic that moves its ends, or infinity.

        Where an end of the task is a frame's target, the end of the guess stays.
        """
        scene, grid, path = task.planned_scene, guess.grid, guess.path
        try:
            robot = scene.robot
            each = _end(task.start, guess, 0, robot), _end(task.goal, guess, -1, robot)
            ends = [np.stack(pair) for pair in zip(*each, strict=True)]
            T = guess.duration if isinstance(task.duration, tuple) else task.duration
            if guess.duration != T:
                grid = grid.stretched(T)
                path = path_on_grid(stretched(guess, T), grid, ends, scene.robot)
            action = self._on(scene.effort_lagrangian(task.options.weight), grid)
            cost = action.values(moved(path, grid, ends, scene.robot)).sum()
        except HoviError:
            return np.inf
        return float(cost) if np.isfinite(cost) else np.inf

    def _on(self, lagrangian: Lagrangian, grid: Grid) -> DiscreteLagrangian:
        """The action, that of the guess before if it is the same one."""
        known = self._action
        if known is None or known.lagrangian is not lagrangian or not known.grid.equals(grid):
            self._action = known = DiscreteLagrangian(lagrangian, grid)
        return known


def _end(end: State | FrameGoal, guess: Trajectory, node: int, robot: Robot) -> tuple[Array, Array]:
    """q and v of an end of the task, of the guess where it is a frame's target."""
    if isinstance(end, State):
        return end.on(robot, "an end")
    return guess.q[node], guess.v[node]

"""Scenes and problems shared by the hard cases."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hovi import Solution
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.urdf.planar_chain import write_chain
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from samples.paper_arm import HANG, REACH_Q, REACH_V
from samples.uneven_chain import uneven_chain

Array = npt.NDArray[np.float64]

START, REACH, UP = State(HANG), State(REACH_Q, REACH_V), State(-HANG)
REACH_JET = np.concatenate([REACH_Q, REACH_V])
HANG_JET, UP_JET = np.array([*HANG, 0.0, 0.0]), np.array([*-HANG, 0.0, 0.0])


@cache
def arm(gravity: bool = True) -> Scene:
    """The paper's two-link arm."""
    robot = load_robot(example("two_link.urdf"))
    return Scene(robot, [Gravity(9.8)] if gravity else [])


@cache
def links(count: int) -> Scene:
    """A chain of equal links."""
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(write_chain(Path(folder) / "chain.urdf", count))
    return Scene(robot, [Gravity(9.8)])


@cache
def uneven(masses: tuple[float, ...]) -> Scene:
    """A chain of one-metre rods with given masses."""
    with tempfile.TemporaryDirectory() as folder:
        robot = uneven_chain(masses, Path(folder) / "chain.urdf")
    return Scene(robot, [Gravity(9.8)])


def hanging(scene: Scene) -> Array:
    """The configuration hanging straight down."""
    q = np.zeros(scene.robot.nv)
    q[0] = -np.pi / 2
    return q


def problem(
    scene: Scene,
    start: State,
    goal: State,
    duration: float,
    intervals: int,
    scheme: str = "galerkin-2",
) -> TrajectoryProblem:
    """A problem without limits."""
    grid = Grid.uniform(duration, intervals, by_name(scheme))
    return TrajectoryProblem(DiscreteLagrangian(scene.effort_lagrangian(), grid), start, goal)


def summary(solutions: Sequence[Solution]) -> str:
    """Costs, inertias and steps in a few words."""
    parts = [f"{s.status}, J = {s.cost:.6g}, n_neg = {s.n_neg}, {s.nit} steps" for s in solutions]
    return "; ".join(parts)

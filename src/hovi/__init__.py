"""hovi: higher-order variational integrators for planning and replaying robot motion."""

from __future__ import annotations

import importlib
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hovi import effects as effects
    from hovi import schemes as schemes
    from hovi.chain_urdf import chain as chain
    from hovi.discrete_lagrangian import DiscreteLagrangian as DiscreteLagrangian
    from hovi.errors import HoviError as HoviError
    from hovi.export import write_csv as write_csv
    from hovi.grid import DiscretePath as DiscretePath
    from hovi.grid import Grid as Grid
    from hovi.model_files import example as example
    from hovi.planner import plan as plan
    from hovi.playback import replay as replay
    from hovi.plotting import plot as plot
    from hovi.problem import TrajectoryProblem as TrajectoryProblem
    from hovi.robot import Robot as Robot
    from hovi.robot import load_robot as load_robot
    from hovi.scene import Scene as Scene
    from hovi.solver import Solution as Solution
    from hovi.solver import Status as Status
    from hovi.solver import solve as solve
    from hovi.state import State as State
    from hovi.task_file import Task as Task
    from hovi.task_file import load_task as load_task
    from hovi.trajectory import Trajectory as Trajectory

try:
    __version__ = version("hovi")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0+unknown"

_PLACES = {
    "DiscreteLagrangian": "hovi.discrete_lagrangian",
    "DiscretePath": "hovi.grid",
    "Grid": "hovi.grid",
    "HoviError": "hovi.errors",
    "Robot": "hovi.robot",
    "Scene": "hovi.scene",
    "Solution": "hovi.solver",
    "State": "hovi.state",
    "Status": "hovi.solver",
    "Task": "hovi.task_file",
    "Trajectory": "hovi.trajectory",
    "TrajectoryProblem": "hovi.problem",
    "chain": "hovi.chain_urdf",
    "example": "hovi.model_files",
    "load_robot": "hovi.robot",
    "load_task": "hovi.task_file",
    "plan": "hovi.planner",
    "plot": "hovi.plotting",
    "replay": "hovi.playback",
    "solve": "hovi.solver",
    "write_csv": "hovi.export",
}
_SUBPACKAGES = ("effects", "schemes")

__all__ = ["__version__", *sorted(_PLACES), *_SUBPACKAGES]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that `hovi --version` answers at once."""
    if name in _SUBPACKAGES:
        return importlib.import_module(f"hovi.{name}")
    if name in _PLACES:
        value = getattr(importlib.import_module(_PLACES[name]), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'hovi' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)

"""hovi: higher-order variational integrators for planning and replaying robot motion."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hovi import accuracy as accuracy
    from hovi import effects as effects
    from hovi import schemes as schemes
    from hovi.certificate import Certificate as Certificate
    from hovi.certificate import certify as certify
    from hovi.chain_urdf import chain as chain
    from hovi.clearance import Clearance as Clearance
    from hovi.discrete_lagrangian import DiscreteLagrangian as DiscreteLagrangian
    from hovi.error_estimate import estimate_error as estimate_error
    from hovi.errors import HoviError as HoviError
    from hovi.euler_lagrange import discrete_hamiltonian_flow as discrete_hamiltonian_flow
    from hovi.euler_lagrange import discrete_lagrangian_map as discrete_lagrangian_map
    from hovi.euler_lagrange import euler_lagrange_residual as euler_lagrange_residual
    from hovi.euler_lagrange import regularity as regularity
    from hovi.exact_discrete_lagrangian import ExactDiscreteLagrangian as ExactDiscreteLagrangian
    from hovi.exact_discrete_lagrangian import conjugate_time as conjugate_time
    from hovi.export import write_csv as write_csv
    from hovi.frame_goal import FrameGoal as FrameGoal
    from hovi.goals import Via as Via
    from hovi.grid import DiscretePath as DiscretePath
    from hovi.grid import Grid as Grid
    from hovi.lagrangian import CasadiLagrangian as CasadiLagrangian
    from hovi.lagrangians import mechanics as mechanics
    from hovi.lagrangians import riemannian_cubic as riemannian_cubic
    from hovi.lagrangians import spline as spline
    from hovi.legendre_transforms import hamiltonian as hamiltonian
    from hovi.legendre_transforms import inverse_legendre_minus as inverse_legendre_minus
    from hovi.legendre_transforms import inverse_legendre_plus as inverse_legendre_plus
    from hovi.legendre_transforms import legendre as legendre
    from hovi.legendre_transforms import legendre_minus as legendre_minus
    from hovi.legendre_transforms import legendre_plus as legendre_plus
    from hovi.limits import Limits as Limits
    from hovi.model_files import example as example
    from hovi.motion_error import MotionError as MotionError
    from hovi.obstacles import Box as Box
    from hovi.obstacles import Capsule as Capsule
    from hovi.obstacles import Sphere as Sphere
    from hovi.planner import plan as plan
    from hovi.playback import replay as replay
    from hovi.plotting import plot as plot
    from hovi.problem import TrajectoryProblem as TrajectoryProblem
    from hovi.robot import Robot as Robot
    from hovi.robot import load_robot as load_robot
    from hovi.scene import Scene as Scene
    from hovi.segment_lagrangian import SchemeLagrangian as SchemeLagrangian
    from hovi.simulator import Simulation as Simulation
    from hovi.simulator import simulate as simulate
    from hovi.solver import Solution as Solution
    from hovi.solver import solve as solve
    from hovi.state import State as State
    from hovi.stepper import Flow as Flow
    from hovi.stepper import flow as flow
    from hovi.symmetry import Symmetry as Symmetry
    from hovi.symmetry import base_rotation as base_rotation
    from hovi.symmetry import base_translation as base_translation
    from hovi.task_file import Task as Task
    from hovi.task_file import load_task as load_task
    from hovi.task_plan import plan_task as plan_task
    from hovi.tolerance import Accuracy as Accuracy
    from hovi.tolerance import Tolerance as Tolerance
    from hovi.tracking import Tracking as Tracking
    from hovi.tracking import play as play
    from hovi.trajectory import Trajectory as Trajectory
    from hovi.variational_error import variational_order as variational_order
    from hovi.verdict import Status as Status

    __version__: str

_PLACES = {
    "Accuracy": "hovi.tolerance",
    "Box": "hovi.obstacles",
    "Capsule": "hovi.obstacles",
    "CasadiLagrangian": "hovi.lagrangian",
    "Certificate": "hovi.certificate",
    "Clearance": "hovi.clearance",
    "DiscreteLagrangian": "hovi.discrete_lagrangian",
    "DiscretePath": "hovi.grid",
    "ExactDiscreteLagrangian": "hovi.exact_discrete_lagrangian",
    "Flow": "hovi.stepper",
    "FrameGoal": "hovi.frame_goal",
    "Grid": "hovi.grid",
    "HoviError": "hovi.errors",
    "Limits": "hovi.limits",
    "MotionError": "hovi.motion_error",
    "Robot": "hovi.robot",
    "Scene": "hovi.scene",
    "SchemeLagrangian": "hovi.segment_lagrangian",
    "Simulation": "hovi.simulator",
    "Solution": "hovi.solver",
    "Sphere": "hovi.obstacles",
    "State": "hovi.state",
    "Status": "hovi.verdict",
    "Symmetry": "hovi.symmetry",
    "Task": "hovi.task_file",
    "Tolerance": "hovi.tolerance",
    "Tracking": "hovi.tracking",
    "Trajectory": "hovi.trajectory",
    "TrajectoryProblem": "hovi.problem",
    "Via": "hovi.goals",
    "base_rotation": "hovi.symmetry",
    "base_translation": "hovi.symmetry",
    "certify": "hovi.certificate",
    "chain": "hovi.chain_urdf",
    "conjugate_time": "hovi.exact_discrete_lagrangian",
    "discrete_hamiltonian_flow": "hovi.euler_lagrange",
    "discrete_lagrangian_map": "hovi.euler_lagrange",
    "estimate_error": "hovi.error_estimate",
    "euler_lagrange_residual": "hovi.euler_lagrange",
    "example": "hovi.model_files",
    "flow": "hovi.stepper",
    "hamiltonian": "hovi.legendre_transforms",
    "inverse_legendre_minus": "hovi.legendre_transforms",
    "inverse_legendre_plus": "hovi.legendre_transforms",
    "legendre": "hovi.legendre_transforms",
    "legendre_minus": "hovi.legendre_transforms",
    "legendre_plus": "hovi.legendre_transforms",
    "load_robot": "hovi.robot",
    "load_task": "hovi.task_file",
    "mechanics": "hovi.lagrangians",
    "plan": "hovi.planner",
    "play": "hovi.tracking",
    "plan_task": "hovi.task_plan",
    "plot": "hovi.plotting",
    "regularity": "hovi.euler_lagrange",
    "replay": "hovi.playback",
    "riemannian_cubic": "hovi.lagrangians",
    "simulate": "hovi.simulator",
    "solve": "hovi.solver",
    "spline": "hovi.lagrangians",
    "variational_order": "hovi.variational_error",
    "write_csv": "hovi.export",
}
_SUBPACKAGES = ("accuracy", "effects", "schemes")

__all__ = ["__version__", *sorted(_PLACES), *_SUBPACKAGES]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that `hovi --version` answers at once."""
    if name in _SUBPACKAGES:
        return importlib.import_module(f"hovi.{name}")
    if name == "__version__":
        globals()[name] = _version()
        return globals()[name]
    if name in _PLACES:
        value = getattr(importlib.import_module(_PLACES[name]), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'hovi' has no attribute {name!r}")


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("hovi")
    except PackageNotFoundError:  # a source tree that was never installed
        return "0+unknown"


def __dir__() -> list[str]:
    return sorted(__all__)

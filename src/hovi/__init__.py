"""hovi: higher-order variational integrators for planning and replaying robot motion."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hovi import accuracy as accuracy
    from hovi import effects as effects
    from hovi import schemes as schemes
    from hovi.discrete.discrete_lagrangian import DiscreteLagrangian as DiscreteLagrangian
    from hovi.discrete.grid import DiscretePath as DiscretePath
    from hovi.discrete.grid import Grid as Grid
    from hovi.discrete.motion_error import MotionError as MotionError
    from hovi.discrete.state import State as State
    from hovi.discrete.trajectory import Trajectory as Trajectory
    from hovi.errors import HoviError as HoviError
    from hovi.flows.euler_lagrange import discrete_hamiltonian_flow as discrete_hamiltonian_flow
    from hovi.flows.euler_lagrange import discrete_lagrangian_map as discrete_lagrangian_map
    from hovi.flows.euler_lagrange import euler_lagrange_residual as euler_lagrange_residual
    from hovi.flows.euler_lagrange import regularity as regularity
    from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian as ExactDiscreteLagrangian
    from hovi.flows.exact_lagrangian import conjugate_time as conjugate_time
    from hovi.flows.legendre_transforms import hamiltonian as hamiltonian
    from hovi.flows.legendre_transforms import inverse_legendre_minus as inverse_legendre_minus
    from hovi.flows.legendre_transforms import inverse_legendre_plus as inverse_legendre_plus
    from hovi.flows.legendre_transforms import legendre as legendre
    from hovi.flows.legendre_transforms import legendre_minus as legendre_minus
    from hovi.flows.legendre_transforms import legendre_plus as legendre_plus
    from hovi.flows.order_of_accuracy import variational_order as variational_order
    from hovi.flows.scheme_lagrangian import SchemeLagrangian as SchemeLagrangian
    from hovi.flows.simulator import Simulation as Simulation
    from hovi.flows.simulator import simulate as simulate
    from hovi.flows.stepper import Flow as Flow
    from hovi.flows.stepper import flow as flow
    from hovi.flows.symmetry import Symmetry as Symmetry
    from hovi.flows.symmetry import base_rotation as base_rotation
    from hovi.flows.symmetry import base_translation as base_translation
    from hovi.flows.tracking import Tracking as Tracking
    from hovi.flows.tracking import play as play
    from hovi.planning.clearance.clearance import Clearance as Clearance
    from hovi.planning.clearance.obstacles import Box as Box
    from hovi.planning.clearance.obstacles import Capsule as Capsule
    from hovi.planning.clearance.obstacles import Sphere as Sphere
    from hovi.planning.problem.frame_goal import FrameGoal as FrameGoal
    from hovi.planning.problem.goals import Via as Via
    from hovi.planning.problem.limits import Limits as Limits
    from hovi.planning.problem.problem import TrajectoryProblem as TrajectoryProblem
    from hovi.planning.problem.tolerance import Accuracy as Accuracy
    from hovi.planning.problem.tolerance import Tolerance as Tolerance
    from hovi.planning.refinement.certificate import Certificate as Certificate
    from hovi.planning.refinement.certificate import certify as certify
    from hovi.planning.refinement.error_estimate import estimate_error as estimate_error
    from hovi.planning.search.planner import plan as plan
    from hovi.planning.solver.solver import Solution as Solution
    from hovi.planning.solver.solver import solve as solve
    from hovi.planning.solver.status import Status as Status
    from hovi.planning.task_file.reading import load_task as load_task
    from hovi.planning.task_file.task import Task as Task
    from hovi.planning.task_file.task_plan import plan_task as plan_task
    from hovi.robot.bundled_models import example as example
    from hovi.robot.loading import load_robot as load_robot
    from hovi.robot.robot import Robot as Robot
    from hovi.robot.urdf.planar_chain import chain as chain
    from hovi.scene.casadi_lagrangian import CasadiLagrangian as CasadiLagrangian
    from hovi.scene.scene import Scene as Scene
    from hovi.scene.standard_lagrangians import mechanics as mechanics
    from hovi.scene.standard_lagrangians import riemannian_cubic as riemannian_cubic
    from hovi.scene.standard_lagrangians import spline as spline
    from hovi.viewing.csv_table import write_csv as write_csv
    from hovi.viewing.playback import replay as replay
    from hovi.viewing.plotting import plot as plot

    __version__: str

_PLACES = {
    "Accuracy": "hovi.planning.problem.tolerance",
    "Box": "hovi.planning.clearance.obstacles",
    "Capsule": "hovi.planning.clearance.obstacles",
    "CasadiLagrangian": "hovi.scene.casadi_lagrangian",
    "Certificate": "hovi.planning.refinement.certificate",
    "Clearance": "hovi.planning.clearance.clearance",
    "DiscreteLagrangian": "hovi.discrete.discrete_lagrangian",
    "DiscretePath": "hovi.discrete.grid",
    "ExactDiscreteLagrangian": "hovi.flows.exact_lagrangian",
    "Flow": "hovi.flows.stepper",
    "FrameGoal": "hovi.planning.problem.frame_goal",
    "Grid": "hovi.discrete.grid",
    "HoviError": "hovi.errors",
    "Limits": "hovi.planning.problem.limits",
    "MotionError": "hovi.discrete.motion_error",
    "Robot": "hovi.robot.robot",
    "Scene": "hovi.scene.scene",
    "SchemeLagrangian": "hovi.flows.scheme_lagrangian",
    "Simulation": "hovi.flows.simulator",
    "Solution": "hovi.planning.solver.solver",
    "Sphere": "hovi.planning.clearance.obstacles",
    "State": "hovi.discrete.state",
    "Status": "hovi.planning.solver.status",
    "Symmetry": "hovi.flows.symmetry",
    "Task": "hovi.planning.task_file.task",
    "Tolerance": "hovi.planning.problem.tolerance",
    "Tracking": "hovi.flows.tracking",
    "Trajectory": "hovi.discrete.trajectory",
    "TrajectoryProblem": "hovi.planning.problem.problem",
    "Via": "hovi.planning.problem.goals",
    "base_rotation": "hovi.flows.symmetry",
    "base_translation": "hovi.flows.symmetry",
    "certify": "hovi.planning.refinement.certificate",
    "chain": "hovi.robot.urdf.planar_chain",
    "conjugate_time": "hovi.flows.exact_lagrangian",
    "discrete_hamiltonian_flow": "hovi.flows.euler_lagrange",
    "discrete_lagrangian_map": "hovi.flows.euler_lagrange",
    "estimate_error": "hovi.planning.refinement.error_estimate",
    "euler_lagrange_residual": "hovi.flows.euler_lagrange",
    "example": "hovi.robot.bundled_models",
    "flow": "hovi.flows.stepper",
    "hamiltonian": "hovi.flows.legendre_transforms",
    "inverse_legendre_minus": "hovi.flows.legendre_transforms",
    "inverse_legendre_plus": "hovi.flows.legendre_transforms",
    "legendre": "hovi.flows.legendre_transforms",
    "legendre_minus": "hovi.flows.legendre_transforms",
    "legendre_plus": "hovi.flows.legendre_transforms",
    "load_robot": "hovi.robot.loading",
    "load_task": "hovi.planning.task_file.reading",
    "mechanics": "hovi.scene.standard_lagrangians",
    "plan": "hovi.planning.search.planner",
    "play": "hovi.flows.tracking",
    "plan_task": "hovi.planning.task_file.task_plan",
    "plot": "hovi.viewing.plotting",
    "regularity": "hovi.flows.euler_lagrange",
    "replay": "hovi.viewing.playback",
    "riemannian_cubic": "hovi.scene.standard_lagrangians",
    "simulate": "hovi.flows.simulator",
    "solve": "hovi.planning.solver.solver",
    "spline": "hovi.scene.standard_lagrangians",
    "variational_order": "hovi.flows.order_of_accuracy",
    "write_csv": "hovi.viewing.csv_table",
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

"""The package is a tower: a module imports only from the floors below its own."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import hovi

SOURCE = Path(hovi.__file__).parent

# From the ground up. A package stands here as one module, and may import within itself.
FLOORS = [
    {
        "blas_threads",
        "bounded_file",
        "errors",
        "interruption",
        "newton",
        "conditions",
        "budget",
        "whole_file",
        "skeleton",
        "meshcat_page",
        "json_numbers",
        "rebuilt_model",
    },
    {
        "obstacles",
        "schemes",
        "optimize",
        "compiled",
        "configuration",
        "lie_groups",
        "urdf_rules",
        "robot_source",
        "coupled_model",
        "srdf",
        "example_robots",
    },
    {
        "carried_momenta",
        "clearance",
        "mass_matrix",
        "configuration_space",
        "point_function",
        "rigid_body",
        "urdf_check",
        "grid",
        "regularized",
        "model_files",
        "meshcat_server",
        "figure_file",
        "aligned_axes",
    },
    {
        "interval_batch",
        "plain_urdf",
        "stored_torque",
        "finer_grid",
        "trajectory_file",
        "effort_term",
        "segment",
        "tangent",
        "unwrapped",
        "mimic_joints",
        "mimic_kernel",
    },
    {"chain_urdf", "robot_model", "torque_model", "chart"},
    {
        "robot_geometry",
        "robot_reading",
        "robot_report",
        "chart_expansion",
        "moving_base_torque",
        "continuity",
    },
    {"robot"},
    {"state", "lagrangian", "effects", "limits"},
    {"frame_goal", "joint_condition", "convex_shapes", "point_outputs"},
    {"inverse_kinematics", "distances"},
    {"goals", "scene_account", "scene_terms"},
    {"scene"},
    {"free_fall", "discrete_lagrangian", "lagrangians"},
    {"action_structure", "charted_lagrangian"},
    {"trajectory", "segment_lagrangian", "clearance_outputs", "carried_efforts"},
    {"guess", "legendre_transforms", "motion_error", "refinement", "clearance_check"},
    {
        "goal_clearance",
        "limit_check",
        "saturation",
        "imposed_clearance",
        "limit_bands",
        "problem",
        "euler_lagrange",
        "exact_discrete_lagrangian",
        "symmetry",
    },
    {
        "multipliers",
        "non_finite",
        "tolerance",
        "stepper",
        "variational_error",
        "contradictions",
        "highlights",
        "nodal_hamiltonian",
        "dynamics_replay",
        "distance_panel",
    },
    {"trajectory_objective"},
    {"limited_action", "equality_rounds", "predictor"},
    {"penalized_action", "limited_outcome"},
    {"limited_solver"},
    {"verdict"},
    {"solver", "task_file", "simulator", "controllers"},
    {"nearby_minimum", "multistart", "free_duration", "tracking", "easing"},
    {"finer_solution", "continuation"},
    {"error_estimate"},
    {"known_error", "certificate", "ladder", "inactive_limits"},
    {"next_grid"},
    {"adaptive", "free_to_tolerance"},
    {"planner", "effect_candidates"},
    {"task_plan"},
    {"effect_study"},
    {"effect_study_table"},
    {"playback", "plotting", "export", "accuracy"},
    {"work_precision_plot", "peers"},
    {"cli"},
    {"__main__"},
]
FLOOR_OF = {module: floor for floor, modules in enumerate(FLOORS) for module in modules}
FILES = sorted(path for path in SOURCE.rglob("*.py") if path != SOURCE / "__init__.py")


def module_of(path: Path) -> str:
    return path.relative_to(SOURCE).with_suffix("").parts[0]


def imported_modules(tree: ast.Module) -> set[str]:
    """The parts of hovi that are named in imports, wherever in the file they stand."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name.split(".")[1] for name in names if name.startswith("hovi.")}


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_a_module_imports_only_from_lower_floors(path: Path) -> None:
    module = module_of(path)
    assert module in FLOOR_OF, f"{module} has no floor: give it one in {Path(__file__).name}"
    for imported in imported_modules(ast.parse(path.read_text())) - {module, "__version__"}:
        assert FLOOR_OF[imported] < FLOOR_OF[module], f"{module} imports {imported} from above"


def test_the_tower_has_no_floor_without_a_module() -> None:
    assert set(FLOOR_OF) - {module_of(path) for path in FILES} == set()

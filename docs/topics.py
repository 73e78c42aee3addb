"""The topics of the reference page, and the public names of each; others are listed at its end."""

TOPICS = {
    "Plan a motion": [
        *("plan", "PlanOptions", "Solution", "Iterate", "Status", "Tolerance", "Accuracy"),
        *("plan_task", "Task", "load_task", "save_task", "load_motion_plan_request", "example"),
    ],
    "Robots and scenes": ["load_robot", "Robot", "Scene", "chain", "inverse_kinematics"],
    "Starts, goals and segments": [
        *("State", "FrameGoal", "Via", "Periodic", "plan_sequence", "Segment"),
    ],
    "Limits": ["Limits", "as_limits", "limit_sets", "LimitSet", "LimitSource"],
    "Conditions": ["Condition", "Between", "Equal", "AtTimes", "Function", "Points"],
    "Obstacles and what is grasped": [
        *("Box", "Sphere", "Capsule", "Cylinder", "HalfSpace", "ConvexHull", "Mesh"),
        *("ConvexParts", "PointCloud", "ObstaclePath", "Clearance", "load_obstacles"),
        *("Grasped", "holding"),
    ],
    "Motions, and seeing them": [
        *("Trajectory", "replay", "write_report", "plot", "write_csv", "extremes"),
        *("Extremes", "Extreme"),
    ],
    "How accurate it is": ["certify", "Certificate", "estimate_error", "MotionError"],
    "Simulation and execution": ["simulate", "Simulation", "play", "Tracking"],
    "The parts behind plan": [
        *("Grid", "DiscreteLagrangian", "TrajectoryProblem", "solve", "DiscretePath"),
        *("CasadiLagrangian", "ChartedLagrangian", "mechanics", "spline", "riemannian_cubic"),
    ],
    "Discrete mechanics": [
        *("SchemeLagrangian", "ExactDiscreteLagrangian", "Flow", "flow", "discrete_lagrangian_map"),
        *("discrete_hamiltonian_flow", "euler_lagrange_residual", "regularity", "legendre"),
        *("legendre_minus", "legendre_plus", "inverse_legendre_minus", "inverse_legendre_plus"),
        *("hamiltonian", "variational_order", "conjugate_time", "Symmetry", "base_rotation"),
        *("base_translation",),
    ],
    "Errors": ["HoviError"],
}

"""States, goals, limits and tolerances, put together as a `TrajectoryProblem`."""

"""The motion of `task.py` by Drake: a spline of shortest path."""

import numpy as np
from pydrake.multibody.inverse_kinematics import PositionConstraint
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.planning import KinematicTrajectoryOptimization
from pydrake.solvers import Solve
from task import GOAL, HOME, URDF, T

plant = MultibodyPlant(0.0)
Parser(plant).AddModels(URDF)
plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
plant.Finalize()
context = plant.CreateDefaultContext()
world, tool = plant.world_frame(), plant.GetFrameByName("tool")
reach = PositionConstraint(plant, world, GOAL, GOAL, tool, np.zeros(3), context)
motion = KinematicTrajectoryOptimization(plant.num_positions(), 10)
motion.AddDurationConstraint(T, T)
motion.AddPathPositionConstraint(HOME, HOME, 0)
motion.AddPathPositionConstraint(reach, 1)
still = np.zeros((4, 1))
motion.AddPathVelocityConstraint(still, still, 0)
motion.AddPathVelocityConstraint(still, still, 1)
motion.AddPositionBounds(plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits())
motion.AddVelocityBounds(plant.GetVelocityLowerLimits(), plant.GetVelocityUpperLimits())
motion.AddPathLengthCost()
motion.SetInitialGuess(motion.ReconstructTrajectory(Solve(motion.prog())))
result = Solve(motion.prog())
assert result.is_success()
curve = motion.ReconstructTrajectory(result)
t = np.linspace(0.0, T, 601)
q = curve.vector_values(t).T

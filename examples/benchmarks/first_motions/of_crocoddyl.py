"""The motion of `task.py` by Crocoddyl: least torque by DDP, all else as costs."""

import crocoddyl
import numpy as np
import pinocchio as pin
from task import GOAL, HOME, URDF, T

model = pin.buildModelFromUrdf(URDF)
state = crocoddyl.StateMultibody(model)
actuation = crocoddyl.ActuationModelFull(state)
reach = crocoddyl.ResidualModelFrameTranslation(state, model.getFrameId("tool"), np.array(GOAL))
goal = crocoddyl.CostModelResidual(state, reach)
torque = crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state))
at_rest = crocoddyl.ActivationModelWeightedQuad(np.array([0.0] * 4 + [1.0] * 4))
rest = crocoddyl.CostModelResidual(state, at_rest, crocoddyl.ResidualModelState(state))
top = np.concatenate([model.upperPositionLimit, model.velocityLimit])
bottom = np.concatenate([model.lowerPositionLimit, -model.velocityLimit])
bounds = crocoddyl.ActivationModelQuadraticBarrier(crocoddyl.ActivationBounds(bottom, top))
limits = crocoddyl.CostModelResidual(state, bounds, crocoddyl.ResidualModelState(state))
running, final = crocoddyl.CostModelSum(state), crocoddyl.CostModelSum(state)
running.addCost("torque", torque, 1e-1)
running.addCost("limits", limits, 1e5)
final.addCost("goal", goal, 1e6)
final.addCost("rest", rest, 1e4)
free, dt = crocoddyl.DifferentialActionModelFreeFwdDynamics, 0.01
step = crocoddyl.IntegratedActionModelEuler(free(state, actuation, running), dt)
last = crocoddyl.IntegratedActionModelEuler(free(state, actuation, final), 0.0)
start = np.concatenate([HOME, np.zeros(4)])
problem = crocoddyl.ShootingProblem(start, [step] * round(T / dt), last)
solver = crocoddyl.SolverFDDP(problem)
solver.solve([], [], 500)
t = dt * np.arange(len(solver.xs))
q = [x[:4] for x in solver.xs]

"""Crocoddyl on a scene, loaded by serve.py in a Python environment with Crocoddyl.

The running cost is the squared torque. The goal is a terminal cost of large weight, whose target is
then shifted by the remaining error (method of multipliers), so that the penalty leaves no bias.
Starting with a smaller weight would lead away from a near guess. With torque limits the solver is
BoxFDDP, which bounds the control and has no limits on positions and velocities.
"""

from __future__ import annotations

from typing import Any

import crocoddyl as cr
import numpy as np
import pinocchio as pin

TERMINAL_WEIGHT = 1e6
TARGET_SHIFTS = 2
STOP_TOLERANCE = 1e-7
MAX_ITERATIONS = 300
CONVERGENCE_TOLERANCE = 1e-6
GOAL_TOLERANCE = 1e-6
"""Largest error of the goal state, in [rad] and [rad/s], of a successful solve."""


class Arm:
    """The scene, checked against torques that hovi computed."""

    def __init__(self, scene: dict[str, Any]) -> None:
        self.model = pin.buildModelFromXML(scene["urdf"])
        self.model.gravity.linear = np.array(scene["gravity"])
        self.model.armature = np.array(scene["armature"])
        self.T = scene["duration"]
        q0, v0, q1, v1 = (np.array(x) for x in scene["ends"])
        self.start, self.goal = np.concatenate([q0, v0]), np.concatenate([q1, v1])
        self.control = scene["options"]["control"]
        self.torque_limits = scene["options"].get("torque_limits")
        self.state = cr.StateMultibody(self.model)
        self.actuation = cr.ActuationModelFull(self.state)
        self._check(scene["check"])

    def _check(self, check: dict[str, Any]) -> None:
        """Incompatible binary packages of Crocoddyl and Pinocchio silently ignore gravity."""
        running = self.dynamics(cr.CostModelSum(self.state, self.model.nv))
        data = running.createData()
        for q, v, a, tau in zip(*(np.array(check[k]) for k in ("q", "v", "a", "tau")), strict=True):
            running.calc(data, np.concatenate([q, v]), tau)
            error = np.abs(data.xout - a).max()
            if not error < 1e-8 * max(1.0, np.abs(a).max()):
                raise RuntimeError(
                    f"an acceleration of Crocoddyl {cr.__version__} with pin {pin.__version__} is "
                    f"wrong by {error:.2g}: the two packages are not compatible"
                )

    def dynamics(self, cost: Any) -> Any:
        """Forward dynamics with a running cost."""
        return cr.DifferentialActionModelFreeFwdDynamics(self.state, self.actuation, cost)

    def torques(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Inverse dynamics at M points, shape (M, n)."""
        data = self.model.createData()
        return np.array([pin.rnea(self.model, data, *x) for x in zip(q, v, a, strict=True)])


class Solve:
    """A shooting problem on N intervals, and the initial guess of every solve."""

    def __init__(self, arm: Arm, intervals: int, guess: dict[str, Any]) -> None:
        nu, state = arm.model.nv, arm.state
        effort = cr.CostModelResidual(state, cr.ResidualModelControl(state, nu))
        running = cr.CostModelSum(state, nu)
        running.addCost("effort", effort, 1.0)
        self.terminal = cr.CostModelSum(state, nu)
        goal = cr.CostModelResidual(state, cr.ResidualModelState(state, arm.goal, nu))
        self.terminal.addCost("goal", goal, TERMINAL_WEIGHT)
        rk4, step = cr.RKType.four, arm.T / intervals
        held = cr.ControlParametrizationModelPolyZero(nu)
        curved = cr.ControlParametrizationModelPolyTwoRK(nu, rk4)
        control = held if arm.control == "zero" else curved
        stage = cr.IntegratedActionModelRK(arm.dynamics(running), control, rk4, step)
        last = cr.IntegratedActionModelEuler(arm.dynamics(self.terminal), 0.0)
        self.problem = cr.ShootingProblem(arm.start, [stage] * intervals, last)
        self.problem.nthreads = 1  # like all measured methods
        bounded = arm.torque_limits is not None
        if bounded:
            stage.u_ub = np.tile(arm.torque_limits, stage.nu // nu)
            stage.u_lb = -stage.u_ub
        self.solver = (cr.SolverBoxFDDP if bounded else cr.SolverFDDP)(self.problem)
        self.solver.th_stop = STOP_TOLERANCE
        self.goal = arm.goal
        q, v, a = (np.array(guess[k]) for k in "qva")
        tau = arm.torques(q, v, a)
        self.xs = [np.concatenate(x) for x in zip(q[::2], v[::2], strict=True)]
        self.xs[0] = arm.start
        if arm.control == "zero":
            self.us = list(tau[1::2])
        else:
            stages = tau[:-1:2], tau[1::2], tau[2::2]
            self.us = [np.concatenate(u) for u in zip(*stages, strict=True)]

    def run(self) -> None:
        """One solve from the guess."""
        self.steps, self.target = 0, self.goal.copy()
        self._solve(self.xs, self.us, False)
        for _ in range(TARGET_SHIFTS):
            self._shift()

    def replan(self, goal: list[float]) -> None:
        """A solve with another goal (q, v) from the last motion; shifts end at the tolerance."""
        self.target = self.target + goal - self.goal
        self.steps, self.goal = 0, np.array(goal)
        self._solve(*self.found, self.solver.isFeasible)
        for _ in range(TARGET_SHIFTS):
            if self.missed > GOAL_TOLERANCE:
                self._shift()

    @property
    def missed(self) -> float:
        """The error of the final state."""
        return float(np.abs(self.found[0][-1] - self.goal).max())

    def _shift(self) -> None:
        """Shift the target by the remaining error, and solve again."""
        self.target = self.target + self.goal - self.found[0][-1]
        self._solve(*self.found, self.solver.isFeasible)

    def _solve(self, xs: list[np.ndarray], us: list[np.ndarray], feasible: bool) -> None:
        """Solve with the current target."""
        self.terminal.costs["goal"].cost.residual.reference = self.target
        self.done = self.solver.solve(xs, us, MAX_ITERATIONS, feasible, 1e-9)
        self.steps += self.solver.iter
        self.found = list(self.solver.xs), list(self.solver.us)

    def answer(self) -> dict[str, Any]:
        """The result of the last solve."""
        self.problem.calc(*self.found)
        x = np.array([np.array(each) for each in self.found[0]])
        n = x.shape[1] // 2
        converged = bool(self.done) or self.solver.stop < CONVERGENCE_TOLERANCE
        return {
            "success": converged and self.missed < GOAL_TOLERANCE,
            "message": f"stop {self.solver.stop:.1e}, goal missed by {self.missed:.1e}",
            "cost": float(sum(data.cost for data in self.problem.runningDatas)),
            "steps": self.steps,
            "q": x[:, :n].tolist(),
            "v": x[:, n:].tolist(),
        }

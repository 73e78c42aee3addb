"""Crocoddyl on a scene: loaded by serve.py in a Python that has it.

The torques are squared in the running cost; the goal is a heavy terminal
cost whose target is then shifted by what is still missed (method of multipliers), so that the
penalty leaves no bias. A lighter weight to begin with leads away from a guess that is near.
"""

from __future__ import annotations

from typing import Any

import crocoddyl as cr
import numpy as np
import pinocchio as pin

WEIGHT = 1e6
SHIFTS = 2
STOP = 1e-7
STEPS = 300
CONVERGED = 1e-6
REACHED = 1e-6
"""Largest miss of the goal, in [rad] and [rad/s], with which a motion counts as found."""


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
        self.state = cr.StateMultibody(self.model)
        self.actuation = cr.ActuationModelFull(self.state)
        self._check(scene["check"])

    def _check(self, check: dict[str, Any]) -> None:
        """Wheels that do not fit Pinocchio's lose gravity without a word."""
        running = self.dynamics(cr.CostModelSum(self.state, self.model.nv))
        data = running.createData()
        for q, v, a, tau in zip(*(np.array(check[k]) for k in ("q", "v", "a", "tau")), strict=True):
            running.calc(data, np.concatenate([q, v]), tau)
            off = np.abs(data.xout - a).max()
            if not off < 1e-8 * max(1.0, np.abs(a).max()):
                raise RuntimeError(
                    f"Crocoddyl {cr.__version__} beside pin {pin.__version__} is off by {off:.2g} "
                    "in an acceleration: the two packages do not fit together"
                )

    def dynamics(self, cost: Any) -> Any:
        """Forward dynamics with a running cost."""
        return cr.DifferentialActionModelFreeFwdDynamics(self.state, self.actuation, cost)

    def torques(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Inverse dynamics at M points, shape (M, n)."""
        data = self.model.createData()
        return np.array([pin.rnea(self.model, data, *x) for x in zip(q, v, a, strict=True)])


class Solve:
    """A shooting problem on N intervals, and the guess that every solve starts from."""

    def __init__(self, arm: Arm, intervals: int, guess: dict[str, Any]) -> None:
        nu, state = arm.model.nv, arm.state
        effort = cr.CostModelResidual(state, cr.ResidualModelControl(state, nu))
        running = cr.CostModelSum(state, nu)
        running.addCost("effort", effort, 1.0)
        self.terminal = cr.CostModelSum(state, nu)
        goal = cr.CostModelResidual(state, cr.ResidualModelState(state, arm.goal, nu))
        self.terminal.addCost("goal", goal, WEIGHT)
        rk4, step = cr.RKType.four, arm.T / intervals
        held = cr.ControlParametrizationModelPolyZero(nu)
        curved = cr.ControlParametrizationModelPolyTwoRK(nu, rk4)
        control = held if arm.control == "zero" else curved
        stage = cr.IntegratedActionModelRK(arm.dynamics(running), control, rk4, step)
        last = cr.IntegratedActionModelEuler(arm.dynamics(self.terminal), 0.0)
        self.problem = cr.ShootingProblem(arm.start, [stage] * intervals, last)
        self.problem.nthreads = 1  # as everything that is measured
        self.solver = cr.SolverFDDP(self.problem)
        self.solver.th_stop = STOP
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
        xs, us, self.steps, feasible = self.xs, self.us, 0, False
        reference = self.terminal.costs["goal"].cost.residual
        target = self.goal.copy()
        for shift in range(SHIFTS + 1):
            if shift:
                target = target + self.goal - np.array(xs[-1])
            reference.reference = target
            self.done = self.solver.solve(xs, us, STEPS, feasible, 1e-9)
            self.steps += self.solver.iter
            xs, us = list(self.solver.xs), list(self.solver.us)
            feasible = self.solver.isFeasible
        self.found = xs, us

    def answer(self) -> dict[str, Any]:
        """What the last solve found."""
        self.problem.calc(*self.found)
        x = np.array([np.array(each) for each in self.found[0]])
        n = x.shape[1] // 2
        missed = float(np.abs(x[-1] - self.goal).max())
        converged = bool(self.done) or self.solver.stop < CONVERGED
        return {
            "success": converged and missed < REACHED,
            "message": f"stop {self.solver.stop:.1e}, goal missed by {missed:.1e}",
            "cost": float(sum(data.cost for data in self.problem.runningDatas)),
            "steps": self.steps,
            "q": x[:, :n].tolist(),
            "v": x[:, n:].tolist(),
        }

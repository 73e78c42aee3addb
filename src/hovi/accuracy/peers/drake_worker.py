"""Drake's DirectCollocation on a scene, loaded by serve.py in a Python environment with Drake.

Hermite-Simpson defects with piecewise linear torque, whose square is integrated exactly; equal
steps; solved by Ipopt (with an approximate Hessian, since DirectCollocation has first derivatives
only) or by SNOPT.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.all import (
    DirectCollocation,
    IpoptSolver,
    MultibodyForces,
    MultibodyPlant,
    Parser,
    SnoptSolver,
    SolverOptions,
)

OPTIMALITY_TOLERANCE, FEASIBILITY_TOLERANCE = 1e-6, 1e-8
MAX_ITERATIONS = 3000


class Arm:
    """The scene, checked against torques that hovi computed."""

    def __init__(self, scene: dict[str, Any]) -> None:
        plant = MultibodyPlant(0.0)
        Parser(plant).AddModelsFromString(scene["urdf"], "urdf")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("l000"))
        for i, inertia in enumerate(scene["armature"], start=1):
            actuator = plant.AddJointActuator(f"a{i:03d}", plant.GetJointByName(f"j{i:03d}"))
            actuator.set_default_rotor_inertia(inertia)
            actuator.set_default_gear_ratio(1.0)
        plant.mutable_gravity_field().set_gravity_vector(np.array(scene["gravity"]))
        plant.Finalize()
        self.plant, self.context = plant, plant.CreateDefaultContext()
        self.T, self.solver = scene["duration"], scene["options"]["solver"]
        self.longest = scene["longest"]
        self.ends = [np.array(x) for x in scene["ends"]]
        q, v, a, tau = (np.array(scene["check"][k]) for k in ("q", "v", "a", "tau"))
        error = np.abs(self.torques(q, v, a) - tau).max()
        if not error < 1e-8 * max(1.0, np.abs(tau).max()):
            raise RuntimeError(f"Drake's torques differ from hovi's by {error:.2g}")

    def torques(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Inverse dynamics at M points, shape (M, n)."""
        tau = np.empty_like(q)
        for i in range(len(q)):
            self.plant.SetPositions(self.context, q[i])
            self.plant.SetVelocities(self.context, v[i])
            forces = MultibodyForces(self.plant)
            self.plant.CalcForceElementsContribution(self.context, forces)
            tau[i] = self.plant.CalcInverseDynamics(self.context, a[i], forces)
        return tau


class Solve:
    """A program on N intervals, and the initial guess of every solve."""

    def __init__(self, arm: Arm, intervals: int, guess: dict[str, Any]) -> None:
        N, h, n = intervals, arm.T / intervals, arm.plant.num_positions()
        port = arm.plant.get_actuation_input_port().get_index()
        collocation = DirectCollocation(arm.plant, arm.context, N + 1, h, h, input_port_index=port)
        self.prog, self.n = collocation.prog(), n
        for k in range(N):
            self.prog.AddBoundingBoxConstraint(h, h, collocation.time_step(k))
            self.prog.SetInitialGuess(collocation.time_step(k), [h])
        self.x = [collocation.state(k) for k in range(N + 1)]
        u = [collocation.input(k) for k in range(N + 1)]
        q0, v0, q1, v1 = arm.ends
        for state, x in ((self.x[0], (q0, v0)), (self.x[-1], (q1, v1))):
            self.prog.AddBoundingBoxConstraint(np.concatenate(x), np.concatenate(x), state)
        eye = np.eye(n)
        Q = h / 3 * np.block([[eye, eye / 2], [eye / 2, eye]])
        for k in range(N):  # 1/2 z^T Q z = 1/2 integral |u|^2 of a linear u
            z = np.concatenate([u[k], u[k + 1]])
            self.prog.AddQuadraticCost(Q, np.zeros(2 * n), 0.0, z, is_convex=True)
        q, v, a = (np.array(guess[k])[::2] for k in "qva")
        tau = arm.torques(q, v, a)
        for k in range(N + 1):
            self.prog.SetInitialGuess(self.x[k], np.concatenate([q[k], v[k]]))
            self.prog.SetInitialGuess(u[k], tau[k])
        self.guess = self.prog.initial_guess().copy()
        self.solver, self.options = _solver(arm.solver, arm.longest)

    def run(self) -> None:
        """One solve from the guess."""
        self.found = self.solver.Solve(self.prog, self.guess, self.options)

    def answer(self) -> dict[str, Any]:
        """The result of the last solve."""
        x = np.array([self.found.GetSolution(state) for state in self.x])
        return {
            "success": self.found.is_success(),
            "message": str(self.found.get_solution_result()),
            "cost": float(self.found.get_optimal_cost()),
            "steps": -1,
            "q": x[:, : self.n].tolist(),
            "v": x[:, self.n :].tolist(),
        }


def _solver(name: str, longest: float) -> tuple[Any, Any]:
    options = SolverOptions()
    if name == "SNOPT":
        solver = SnoptSolver()
        values: dict[str, Any] = {
            "Major optimality tolerance": OPTIMALITY_TOLERANCE,
            "Major feasibility tolerance": FEASIBILITY_TOLERANCE,
        }
        values |= {"Major iterations limit": MAX_ITERATIONS, "Iterations limit": 2_000_000}
        values |= {"Superbasics limit": 2000, "Time limit (secs)": longest, "Timing level": 3}
    else:
        solver = IpoptSolver()
        values = {
            "tol": OPTIMALITY_TOLERANCE,
            "constr_viol_tol": FEASIBILITY_TOLERANCE,
            "max_iter": MAX_ITERATIONS,
        }
        values |= {"hessian_approximation": "limited-memory", "limited_memory_max_history": 30}
        values |= {"max_wall_time": longest, "acceptable_iter": 0}
    for key, value in values.items():
        options.SetOption(solver.solver_id(), key, value)
    return solver, options

"""Simulates the mechanics of a scene by the discrete Lagrange-d'Alembert equations.

The first-order counterpart (k = 1) of the planner: L = K - V, with the joint torques and the
torques of effects as forces. [MarsdenWest2001, section 3.2]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.discrete.grid import MAX_INTERVALS, DiscretePath, Grid
from hovi.discrete.guess import regularized
from hovi.discrete.state import State, as_state, warn_of_degrees
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.legendre_transforms import hamiltonian, highest_derivative, legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import Flow, flow
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.forces import Drive, ForcedLagrangian, Prescribed, Torque, scene_force
from hovi.scene.scene import Scene, require_inertia
from hovi.scene.standard_lagrangians import mechanics
from hovi.schemes import galerkin
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Simulation:
    """A motion of a scene under given torques.

    scene: the simulated scene. lagrangian: K - V. flow: the discrete motion. turns: full turns of
    continuous joints at the start.
    """

    scene: Scene
    lagrangian: CasadiLagrangian
    flow: Flow
    turns: Mapping[str, int] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Robot, duration and grid, for a terminal."""
        name, N = self.scene.robot.name, len(self.t) - 1
        return f"<Simulation of {name!r}: {self.t[-1]:g} s in {N} intervals, order {self.order}>"

    @property
    def t(self) -> Array:
        """Times of the nodes, shape (N + 1,), in [s]."""
        return self.flow.t

    @property
    def order(self) -> int:
        """Order of the integrator, 2 (r + 1)."""
        assert isinstance(self.flow.ld, SchemeLagrangian | ChartedLagrangian)
        return 2 * (self.flow.ld.scheme.inner_modes + 1)

    @property
    def q(self) -> Array:
        """Configurations, shape (N + 1, nq)."""
        return self.flow.q

    @property
    def momenta(self) -> Array:
        """p = M(q) v at the nodes, shape (N + 1, nv)."""
        return self.flow.p[:, 0]

    @property
    def v(self) -> Array:
        """Velocities M(q)^-1 p, shape (N + 1, nv)."""
        return highest_derivative(self.lagrangian, self.flow.x, self.flow.p)

    @property
    def energy(self) -> Array:
        """K + V at the nodes, shape (N + 1,), in [J]."""
        return hamiltonian(self.lagrangian, self.flow.x, self.flow.p)

    @property
    def work(self) -> tuple[Array, Array]:
        """Work of the torques and of the effects since the start, (N + 1,) each, in [J].

        Integrated at the quadrature points: `energy` changes by their sum, to the order of the
        integrator.
        """
        ld = self.flow.ld
        assert isinstance(ld, SchemeLagrangian | ChartedLagrangian)
        assert isinstance(ld.lagrangian, ForcedLagrangian)
        w = self.flow.z  # for k = 1, z = w
        q, v = ld.jet(self.flow.x[:-1], w, self.flow.inner[:, : ld.scheme.inner_modes])
        t = (self.t[:-1, None] + ld.h * ld.scheme.points).ravel()
        done = []
        for force, sign in ((ld.lagrangian.force.driven, 1), (ld.lagrangian.force.resisted, -1)):
            power = np.sum(sign * force(q, v, t)[0] * v, axis=1)
            gained = ld.h * power.reshape(len(w), -1) @ ld.scheme.weights
            done.append(np.concatenate([[0.0], np.cumsum(gained)]))
        return done[0], done[1]

    @property
    def trajectory(self) -> Trajectory:
        """The motion as a Trajectory: the cubic through (q, v) at the nodes."""
        q, v, h = self.q, self.v, self.flow.ld.h
        N, n = len(q) - 1, v.shape[1]
        grid = Grid(np.full(N, h), (galerkin(0),) * N)
        turned = None if self.scene.robot.vector_joints else h * self.flow.z[:, 0]
        z = regularized(self.scene.robot, grid, q, v, turned)
        path = DiscretePath(q.copy(), v, z, np.zeros((N, 0, n)))
        momenta = np.stack([self.momenta, np.zeros_like(v)], axis=1)
        status = {"status": "simulated"}
        return Trajectory(grid, path, momenta, self.scene, status, turns=self.turns)


@check_arguments
@one_blas_thread
def simulate(
    scene: Scene,
    start: State | npt.ArrayLike,
    duration: float,
    torque: Torque | Trajectory | Drive | None = None,
    *,
    intervals: int = 1000,
    inner_modes: int = 1,
) -> Simulation:
    """The motion of a scene's robot from a state, by a symplectic integrator of order 2 (r + 1).

    scene: the scene; potentials that effects add to the cost are not forces.
    start: a State, or a configuration of shape (nq,) at rest.
    duration: in [s].
    torque: u(t), times (P,) -> (P, nv), in [N m]; a Trajectory for the torques of a plan; a
        Controller for feedback; none when None.
    intervals: N. inner_modes: r, from 0 (the midpoint rule).
    Raises InputError or SceneError for invalid arguments, and for steps that are too long, and
    ModelError for a robot without inertia.
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"the duration must be positive and finite, got {duration} s.")
    if not 1 <= intervals <= MAX_INTERVALS:
        raise InputError(
            f"the number of intervals must be from 1 to {MAX_INTERVALS:,}, got {intervals}."
        )
    require_inertia(scene, "a simulation")
    free = mechanics(scene)
    forced = ForcedLagrangian(free, scene_force(scene, _drive(torque)))
    table, h = galerkin(inner_modes, 1), duration / intervals
    ld: SchemeLagrangian | ChartedLagrangian
    if free.space is None:
        ld = SchemeLagrangian(forced, table, h)
    else:
        ld = ChartedLagrangian(forced, free.space, table, h)
    state = as_state(start, scene.robot, "start")
    q, v = state.on(scene.robot, "start")
    warn_of_degrees(scene.robot, [q])
    x, p = legendre(free, q, v)
    motion = flow(ld, x, p, intervals, force=True)
    return Simulation(scene, free, motion, state.turns_made(scene.robot, motion.q[0]))


def _drive(torque: Torque | Trajectory | Drive | None) -> Drive | None:
    if torque is None or hasattr(torque, "evaluate"):
        return torque
    if not isinstance(torque, Trajectory):
        return Prescribed(torque)
    plan = torque
    return Prescribed(lambda t: plan.sample(np.clip(t, 0.0, plan.duration)).tau)

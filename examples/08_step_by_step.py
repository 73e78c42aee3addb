"""
Planning step by step
=====================

`plan` combines objects that can be used on their own: a Lagrangian of q, v and a, a grid with a
scheme, the discrete Lagrangian, the boundary value problem, and its solution.
"""

# %%
# The Lagrangian of optimal control, L~ = 1/2 |tau(q, v, a)|^2.

import sys
import tempfile
from math import pi
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])
lagrangian = scene.effort_lagrangian()

# %%
# Sixteen equal intervals with two inner modes each, and the discrete Lagrangian on them.

grid = hovi.Grid.uniform(1.0, 16, hovi.schemes.galerkin(inner_modes=2))
ld = hovi.DiscreteLagrangian(lagrangian, grid)

# %%
# The discrete Euler-Lagrange equations with given start and goal, solved by a trust-region Newton
# method. The factorisation gives the inertia of the Hessian, so it stops at minima only.

reach = hovi.TrajectoryProblem(
    ld, start=hovi.State([-pi / 2, 0.0]), goal=hovi.State([0.3, 0.7], [0.5, -0.4])
)
solution = hovi.solve(reach)
print(solution.message)
assert solution.success

# %%
# The momenta of the discrete motion are Pontryagin's costates. With p~ = dL/da = M tau, the
# Hamiltonian H = p v + p~ a - L is constant in time.

trajectory = solution.trajectory
q, v, p = trajectory.q, trajectory.v, trajectory.momenta
hamiltonian = []
for k in range(grid.intervals + 1):
    M = np.column_stack(
        [
            scene.inverse_dynamics(q[[k]], 0 * v[[k]], e[None])[0]
            - scene.inverse_dynamics(q[[k]], 0 * v[[k]], 0 * e[None])[0]
            for e in np.eye(2)
        ]
    )
    tau = np.linalg.solve(M, p[k, 1])
    a = np.linalg.solve(M, tau - scene.inverse_dynamics(q[[k]], v[[k]], 0 * v[[k]])[0])
    hamiltonian.append(p[k, 0] @ v[k] + p[k, 1] @ a - 0.5 * tau @ tau)
print(f"H = {np.mean(hamiltonian):.5f}, spread {np.ptp(hamiltonian):.1e}")
assert np.ptp(hamiltonian) < 1e-3

# %%
# A saddle. Holding the arm horizontal satisfies the equations exactly, but for ten seconds it is
# cheaper to let the arm swing and catch it.

grid = hovi.Grid.uniform(10.0, 40, hovi.schemes.galerkin(inner_modes=2))
hold = hovi.TrajectoryProblem(
    hovi.DiscreteLagrangian(lagrangian, grid), hovi.State([0.0, 0.0]), hovi.State([0.0, 0.0])
)
for escape in (False, True):
    solution = hovi.solve(hold, escape_saddles=escape)
    print(f"{solution.status}: cost {solution.cost:.2f}, n_neg {solution.n_neg}")
assert solution.status == "minimum"
solution.trajectory.save(folder / "hold.npz")

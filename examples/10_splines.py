"""
Splines
=======

For L = 1/2 |a|^2 the examples of the paper have closed forms: two discrete Lagrangians, their
recursions, and the figure of a trajectory with its error.
"""

# %%
# The paper's discrete Lagrangian by Taylor accelerations, and the exact one, which is given by the
# cubic through the end states.

import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
taylor = hovi.schemes.by_name("taylor-trapezoid")
exact = hovi.schemes.galerkin(inner_modes=0)

# %%
# Solving the discrete Euler-Lagrange equations for (q2, v2) gives the recursions of the paper:
# q2 = q0 + 2 h v1, v2 = v0 + 4 (v1 - (q1 - q0)/h), and q2 = 5 q0 - 4 q1 + 2 h (v0 + 2 v1), ...

unit = np.eye(4).reshape(4, 2, 2, 1)  # (q0, v0), (q1, v1), one of them at a time
for scheme in (taylor, exact):
    ld = hovi.SchemeLagrangian(hovi.spline(1), scheme, 1.0)
    _, end = hovi.discrete_lagrangian_map(ld, unit[:, 0], unit[:, 1])
    q2, v2 = end[:, :, 0].T.round(12) + 0.0
    print(f"{scheme.name}: coefficients of q0, v0, q1, v1 at h = 1: q2 {q2}, v2 {v2}")

# %%
# The trajectory of the paper's figure: from (0, 0) with velocity (10, 10) to (10, 0) with velocity
# (10, 20), as a boundary value problem of the spline's Lagrangian.

start, goal = hovi.State([0.0, 0.0], [10.0, 10.0]), hovi.State([10.0, 0.0], [10.0, 20.0])


def solved(scheme: hovi.schemes.Scheme, intervals: int) -> hovi.Trajectory:
    ld = hovi.DiscreteLagrangian(hovi.spline(2), hovi.Grid.uniform(1.0, intervals, scheme))
    return hovi.solve(hovi.TrajectoryProblem(ld, start, goal)).trajectory


motion = solved(taylor, 20)  # 21 nodes
q, v = motion.q, motion.v
phi = np.diff(q, axis=0) * 20 - (v[1:] + v[:-1]) / 2
print(f"phi = (q1 - q0)/h - (v0 + v1)/2 is constant to {np.ptp(phi, axis=0).max():.0e}")
assert np.ptp(phi, axis=0).max() < 1e-10

# %%
# Compared with the cubic that solves the problem exactly, the error is of order h^2.

steps = np.array([10, 20, 40, 80])
errors = []
for N in steps:
    found, true = solved(taylor, int(N)), solved(exact, int(N))  # exact at every h
    errors.append([np.abs(found.q - true.q).max(), np.abs(found.v - true.v).max()])
errors = np.array(errors)
orders = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
print(f"orders: position {orders[0]:.2f}, velocity {orders[1]:.2f}")
assert np.allclose(orders, 2, atol=0.2)

# %%
# Both panels of the paper's figure.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
left.plot(*q.T, "o", markersize=3)
left.quiver(*q.T, *v.T, angles="xy", scale_units="xy", scale=20, width=0.003)
left.margins(0.15)
left.set(xlabel="x", ylabel="y", title="nodes and velocities (scaled)")
right.loglog(1 / steps, errors, "o-", label=["position", "velocity"])
right.set_xticks(1 / steps, [f"1/{N}" for N in steps], minor=False)
right.minorticks_off()
right.set(xlabel="h", ylabel="largest error", title="Taylor accelerations")
right.legend()
figure.savefig(folder / "splines.png", dpi=120)

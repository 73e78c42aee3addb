"""
Orders of the schemes
=====================

A scheme is a table of coefficients that turns a Lagrangian into a discrete Lagrangian. Its order is
the rate at which the error decreases with the number of intervals.
"""

# %%
# A short, smooth motion: the two-link arm reaches a configuration in one second.

import sys
import tempfile
from math import log2, pi
from pathlib import Path

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])
start, goal = hovi.State([-pi / 2, 0.0]), hovi.State([0.3, 0.7], [0.5, -0.4])


def cost(scheme: str, intervals: int) -> float:
    solution = hovi.plan(scene, start, goal, duration=1.0, scheme=scheme, intervals=intervals)
    assert solution.n_neg == 0  # "unresolved" where a coarse grid is more than 1 % off
    return solution.cost


# %%
# The reference: three inner modes, on a grid fine enough for rounding accuracy.

exact = cost("galerkin-3", 48)
print(f"exact cost {exact:.10f}")

# %%
# `taylor-midpoint` is the scheme of the paper. Galerkin schemes with R inner modes have order
# 2 (R + 2) at the nodes.

lines = ["scheme            order   error on 8, 16, 32, 64 intervals"]
for name in ("taylor-midpoint", "taylor-trapezoid", "hermite-simpson", "galerkin-0", "galerkin-1"):
    order = hovi.schemes.by_name(name).order
    errors = [abs(cost(name, N) - exact) for N in (8, 16, 32, 64)]
    observed = log2(errors[-2] / errors[-1])
    lines.append(
        f"{name:17s} {order:5d}   "
        + "  ".join(f"{e:8.1e}" for e in errors)
        + f"   observed order {observed:.2f}"
    )
    assert abs(observed - order) < 0.5
print("\n".join(lines))
(folder / "orders.txt").write_text("\n".join(lines) + "\n")

# %%
# Two natural-looking discrete Lagrangians are degenerate: they do not relate q to v. Planning with
# one raises an error with the reason.

try:
    cost("mean-difference", 16)
except hovi.HoviError as error:
    print(error)

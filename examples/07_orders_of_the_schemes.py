"""
Orders of the schemes
=====================

A scheme is a table of numbers that turns a Lagrangian into a discrete one. Its order says
how fast the error falls with the number of intervals.
"""

# %%
# One motion, smooth and short: the two-link arm reaches a point in one second.

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
    assert solution.success
    return solution.cost


# %%
# The reference: three inner modes, on a grid that is fine enough for round-off.

exact = cost("galerkin-3", 48)
print(f"exact cost {exact:.10f}")

# %%
# `taylor-midpoint` is the paper's. The Galerkin schemes come with any number of inner modes:
# with R of them the nodes have order 2 (R + 2).

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
# Two of the discrete Lagrangians that look natural are no methods: nothing ties q to v in
# them. Asking for a motion with one is refused with the reason.

try:
    cost("mean-difference", 16)
except hovi.HoviError as refusal:
    print(refusal)

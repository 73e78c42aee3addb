"""
The discrete flow
=================

An initial value problem: the discrete Hamiltonian flow propagates (q, v, p, p~), conserves the
momentum maps of symmetries, and bounds the effect of rounding.
"""

# %%
# Mechanics first, with k = 1: the two-link arm falls from the horizontal. The energy error of a
# variational integrator does not grow, not even in 100 seconds.

import sys
import tempfile
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])

fall = hovi.simulate(scene, hovi.State([0.0, 0.0]), duration=100.0, intervals=5000)
error = np.abs(fall.energy - fall.energy[0])
print(f"energy error in the first 25 s {error[:1250].max():.1e} J, in the last 25 s ", end="")
print(f"{error[-1250:].max():.1e} J")
assert error[-1250:].max() < 1.2 * error[:1250].max()
hovi.simulate(scene, hovi.State([0.0, 0.0]), 5.0).trajectory.save(folder / "fall.npz")

# %%
# Optimal control, with k = 2 and L~ = 1/2 |tau|^2. The Legendre transform maps (q, v, a, jerk) to
# momenta. Without gravity, rotating the whole arm is a symmetry: Noether's momentum is conserved to
# rounding.

free = hovi.Scene(robot)
lagrangian = free.effort_lagrangian()
x, p = hovi.legendre(lagrangian, [0.4, -0.3], [0.6, -0.8], [0.5, 0.2], [-0.4, 0.6])
ld = hovi.DiscreteLagrangian(lagrangian, hovi.Grid.uniform(1.0, 100, hovi.schemes.galerkin(2)))
turn = hovi.base_rotation(free, axis=[0, 1, 0])
motion = hovi.flow(ld, x, p, steps=100, symmetries={"turn": turn})
J, H = motion.momentum_maps["turn"], motion.energy
print(f"momentum map {J[0]:.6f}, spread {np.ptp(J):.0e}; H = {H[0]:.6f}, spread {np.ptp(H):.0e}")
assert np.ptp(J) < 1e-12 * abs(J[0])

# %%
# The exact discrete Lagrangian needs only two steps for the same second.

exact = hovi.ExactDiscreteLagrangian(lagrangian, h=0.5)
difference = hovi.flow(exact, x, p, steps=2).q[-1] - motion.q[-1]
print(f"against the exact discrete Lagrangian {np.abs(difference).max():.0e} rad")
assert np.abs(difference).max() < 1e-9

# %%
# The flow of optimal control is unstable forwards and backwards in time. Near the upright position
# rounding errors of the start grow like exp(3.75 t), and the flow raises an error when they are too
# large.

upright = scene.effort_lagrangian()
x, p = hovi.legendre(upright, [np.pi / 2, 0.0], *np.zeros((3, 2)))
try:
    hovi.flow(hovi.SchemeLagrangian(upright, hovi.schemes.galerkin(1), 0.05), x, p, steps=200)
except hovi.HoviError as error:
    print(error)

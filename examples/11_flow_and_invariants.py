"""
The discrete flow
=================

An initial value problem: the discrete Hamiltonian flow steps (q, v, p, p~), keeps what
symmetries conserve, and says how far a motion can be known.
"""

# %%
# Mechanics first, with k = 1: the two-link arm falls from the horizontal. A variational
# integrator does not drift: after 100 seconds its energy is as good as after one.

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
# Optimal control, with k = 2 and L~ = 1/2 |tau|^2. FL turns (q, v, a, jerk) into momenta. Without
# gravity turning the whole arm changes nothing: Noether's momentum is kept to rounding.

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
# The exact discrete Lagrangian takes the same second in two steps.

exact = hovi.ExactDiscreteLagrangian(lagrangian, h=0.5)
difference = hovi.flow(exact, x, p, steps=2).q[-1] - motion.q[-1]
print(f"against the exact discrete Lagrangian {np.abs(difference).max():.0e} rad")
assert np.abs(difference).max() < 1e-9

# %%
# Optimal control is unstable both forwards and backwards in time. Near the upright position
# what rounding makes of the start grows like exp(3.75 t), and the flow refuses to go on.

upright = scene.effort_lagrangian()
x, p = hovi.legendre(upright, [np.pi / 2, 0.0], *np.zeros((3, 2)))
try:
    hovi.flow(hovi.SchemeLagrangian(upright, hovi.schemes.galerkin(1), 0.05), x, p, steps=200)
except hovi.HoviError as refusal:
    print(refusal)

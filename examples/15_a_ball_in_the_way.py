"""
A ball in the way
=================

The collision shapes of a robot keep a distance from obstacles along the whole motion, and
optionally from each other.
"""

# %%
# A UR5 turns about its base. Without the obstacle, the least-torque motion passes through the ball.

import sys
import tempfile
from pathlib import Path

import numpy as np

import hovi
from hovi.planning.clearance.distances import Distances

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot("ur5")
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
start, goal = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.8, -1.0, 1.4, -0.5, 0.3, 0.1]
limits = {"v": 3.14, "tau": [150.0, 150.0, 150.0, 28.0, 28.0, 28.0]}
ball = hovi.Sphere(position=[0.05, 0.35, 0.25], radius=0.1, name="ball")
free = hovi.plan(scene, start, goal, duration=2.0, limits=limits)

# %%
# With the ball as an obstacle the plan keeps 3 cm from it. Obstacles may also be boxes and
# capsules; meshes of the robot are replaced by their convex hulls.

kept = hovi.plan(scene, start, goal, 2.0, limits=limits, obstacles=[ball], margin=0.03)
print(kept.message)
assert kept.success

# %%
# The least distance of each motion. Distances are negative where shapes overlap.

distances = Distances(robot, hovi.Clearance([ball]))
t = np.linspace(0.0, 2.0, 2001)
for name, motion in (("without", free), ("with", kept)):
    d = distances.values(motion.trajectory.configurations(t))
    pair = distances.pairs[int(np.argmin(d.min(axis=0)))]
    print(f"{name} the obstacle: {d.min():7.4f} m between {pair}, cost {motion.cost:.1f}")
assert d.min() >= 0.03
assert kept.cost > free.cost

# %%
# The replay page shows the ball.

hovi.replay(kept.trajectory, html=folder / "kept.html")

# %%
# A goal too close to an obstacle is reported as infeasible, with the names, before any search.

crate = hovi.Box(size=[0.3, 0.3, 0.3], position=[-0.3, 0.55, 0.2], name="crate")
blocked = hovi.plan(scene, start, goal, 2.0, limits=limits, obstacles=[crate])
print(f"{blocked.status}: {blocked.message}")
assert not blocked.success

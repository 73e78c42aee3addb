"""
Pick, carry and return
======================

Several motions, one after the other, are one optimisation: each with its own goal, duration and
payload.
"""

# %%
# A two-link arm reaches for a tool, carries it to where the tip is at a point, and returns. What is
# carried is an effect of the segment that carries it.

import sys
import tempfile
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
scene = hovi.Scene(robot, [hovi.effects.Gravity(9.8)])
tool = hovi.effects.Payload(frame="tip", mass=0.5)
release = hovi.FrameGoal("tip", position=[-0.6, 0.0, 1.4])


def segments(grasp: hovi.State) -> list[hovi.Segment]:
    return [
        hovi.Segment(grasp, 0.6, name="reach"),
        hovi.Segment(release, 0.9, effects=[tool], name="carry"),
        hovi.Segment([0.0, 0.0], 0.8, name="return"),
    ]


# %%
# It stops at every goal that says nothing else. Both ways to bend the elbow at the release are
# compared with what they cost before and after it.

stopping = hovi.plan_sequence(
    scene, [0.0, 0.0], segments(hovi.State([0.7, 0.9])), limits="none", tolerance=1e-6
)
print(stopping.message)
assert stopping.success

# %%
# Grasped in passing, with the velocity that suits both motions best, it costs less.

passing = hovi.State([0.7, 0.9], free_velocity=["all"])
flowing = hovi.plan_sequence(scene, [0.0, 0.0], segments(passing), limits="none", tolerance=1e-6)
print(f"cost {stopping.cost:.1f} with a stop, {flowing.cost:.1f} in passing")
assert flowing.cost < stopping.cost

# %%
# q and v are continuous, and torques jump where the tool comes and goes: they are those of each
# segment's own dynamics.

motion = flowing.trajectory
before, after = motion.sample([0.6 - 1e-9]), motion.sample([0.6 + 1e-9])
print(f"at 0.6 s v = {after.v[0].round(3)}")
print(f"and tau jumps from {before.tau[0].round(2)} to {after.tau[0].round(2)}")
assert np.allclose(before.v, after.v, atol=1e-6)
hovi.plot(motion, folder / "flowing.png")

# %%
# The replay shows all of it, and a saved motion carries its scenes and the names of its segments.

hovi.replay(motion, html=folder / "flowing.html")
motion.save(folder / "flowing.npz")
loaded = hovi.Trajectory.load(folder / "flowing.npz")
assert np.array_equal(loaded.sample([1.0]).tau, motion.sample([1.0]).tau)
print("segments:", ", ".join(loaded.metadata["segment_names"]))

# %%
# Scene files say the same in tables ``[[segments]]``: ``hovi plan two_link_pick``.

task = hovi.load_task(hovi.example("two_link_pick"))
assert [each.name for each in task.segments] == ["reach", "carry", "return"]

"""
Your own URDF
=============

hovi plans motions for any URDF. Here the URDF of a cart with a hanging pole is written as text;
a file from a CAD program or a ROS package works as well.
"""

# %%
# A moving link needs a mass and an inertia; hovi raises an error when one is missing, negative or
# not a number.

import sys
import tempfile
from math import pi
from pathlib import Path

import hovi
from hovi.errors import ModelError

CART_POLE = """
<robot name="cart_pole">
  <link name="rail"/>
  <link name="cart">
    <inertial>
      <mass value="1.0"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="pole">
    <inertial>
      <origin xyz="0 0 -0.5"/>
      <mass value="0.2"/>
      <inertia ixx="0.017" iyy="0.017" izz="0.001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="rail"/> <child link="cart"/>
    <axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="50" velocity="5"/>
  </joint>
  <joint name="hinge" type="revolute">
    <parent link="cart"/> <child link="pole"/>
    <axis xyz="0 1 0"/>
    <limit lower="-7" upper="7" effort="10" velocity="20"/>
    <dynamics damping="0.02"/>
  </joint>
</robot>
"""

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
urdf = folder / "cart_pole.urdf"
urdf.write_text(CART_POLE.strip())
robot = hovi.load_robot(urdf)
print(robot.describe())

# %%
# The URDF has a joint damping. The scene does not list it as an effect, so it is not simulated, and
# `describe` lists it among the effects left out.

scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
print(scene.describe())

# %%
# Swing the pole up in two seconds. Both joints are actuated.

solution = hovi.plan(scene, start=hovi.State([0.0, 0.0]), goal=hovi.State([0.5, pi]), duration=2.0)
print(solution.message)
assert solution.success

# %%
# What does it take? The limits of the URDF are printed, and not enforced yet.

motion = solution.trajectory.sample(solution.trajectory.t)
for i, name in enumerate(robot.coordinate_names):
    force = abs(motion.tau[:, i]).max()
    print(f"{name:6s} peak effort {force:6.2f}, limit {robot.effort_limit[i]:g}")

# %%
# An invalid model raises an error before it is loaded.

urdf.write_text(CART_POLE.replace('mass value="0.2"', 'mass value="0,2"').strip())
try:
    hovi.load_robot(urdf)
except ModelError as error:
    print(error)

"""A pendulum on a cart that slides along x, whose translation is a symmetry."""

from __future__ import annotations

SLIDER = """<robot name="slider">
<link name="base"/>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>
<link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="swing" type="revolute"><parent link="cart"/><child link="bob"/><axis xyz="0 1 0"/>
<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>
<link name="bob"><inertial><origin xyz="0 0 -0.7"/><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""

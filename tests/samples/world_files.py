"""A cupboard as a URDF, and a planning scene of MoveIt."""

from __future__ import annotations

CUPBOARD = """<robot name="cupboard">
<link name="frame">
<collision><origin xyz="0 0 0.5" rpy="0 0 0.3"/><geometry><box size="0.4 0.5 0.02"/></geometry>
</collision>
<collision><origin xyz="0.2 0.2 0.2" rpy="0.1 0.2 0"/>
<geometry><cylinder radius="0.03" length="0.4"/></geometry></collision>
</link>
<link name="door">
<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><origin xyz="0 0.2 0.3" rpy="0 0 0"/><geometry><box size="0.02 0.4 0.4"/></geometry>
</collision>
<collision><origin xyz="-0.05 0.4 0.3"/><geometry><sphere radius="0.03"/></geometry></collision>
<collision><origin xyz="0.1 0.2 0.3" rpy="0.4 0 0"/><geometry><mesh filename="channel.obj"
 scale="1 2 1"/></geometry></collision>
</link>
<joint name="hinge" type="revolute"><origin xyz="-0.2 -0.2 0" rpy="0 0 0"/><parent link="frame"/>
<child link="door"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="9" velocity="9"/></joint>
</robot>"""
"""A board, a post, and a door with a knob and a channel on a hinge; `channel.obj` lies beside."""

PLANNING_SCENE = """
name: kitchen
world:
  collision_objects:
    - id: table
      header: {frame_id: world}
      operation: 0
      primitives:
        - {type: 1, dimensions: [0.6, 1.0, 0.05]}
        - type: cylinder
          dimensions: [0.7, 0.03]
      primitive_poses:
        - position: {x: 0.55, y: 0.0, z: 0.1}
          orientation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}
        - position: [0.3, 0.4, -0.2]
          orientation: [0.5, 0.5, 0.5, 0.5]
    - id: ball
      header: {frame_id: world}
      pose:
        position: {x: 0.1, y: 0.5}
        orientation: {z: 0.7071067811865476, w: 0.7071067811865476}
      primitives: [{type: 2, dimensions: [0.15]}]
      primitive_poses: [{position: {x: 0.1, z: 0.6}}]
    - id: wedge
      header: {frame_id: world}
      meshes:
        - vertices: [{x: 0.0}, {x: 0.3}, {y: 0.2}, {z: 0.4}]
          triangles: [[0, 2, 1], [0, 1, 3], [0, 3, 2], {vertex_indices: [1, 2, 3]}]
      mesh_poses:
        - {position: [-0.4, 0.3, 0.2], orientation: [0, 0, 0, 1]}
"""
"""A table, a ball and a wedge."""

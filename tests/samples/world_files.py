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

JOINT_REQUEST = """
workspace_parameters:
  header: {stamp: {sec: 0, nanosec: 0}, frame_id: panda_link0}
  min_corner: {x: -1.0, y: -1.0, z: -1.0}
  max_corner: {x: 1.0, y: 1.0, z: 1.0}
start_state:
  joint_state:
    header:
      stamp:
        sec: 0
        nanosec: 0
      frame_id: ''
    name: [panda_finger_joint1, panda_joint2, panda_joint1, panda_joint3, panda_joint4,
      panda_joint5, panda_joint6, panda_joint7]
    position: [0.0, -0.785, 0.1, 0.0, -2.356, 0.0, 1.571, 0.785]
    velocity: []
    effort: []
  multi_dof_joint_state: {header: {frame_id: ''}, joint_names: [], transforms: [], twist: []}
  attached_collision_objects: []
  is_diff: false
goal_constraints:
- name: ''
  joint_constraints:
  - {joint_name: panda_joint1, position: 0.5, tolerance_above: 0.001, tolerance_below: 0.001}
  - {joint_name: panda_joint2, position: -0.6, tolerance_above: 0.001, tolerance_below: 0.001}
  - {joint_name: panda_joint4, position: -2.2, tolerance_above: 0.0, tolerance_below: 0.002}
  position_constraints: []
  orientation_constraints: []
  visibility_constraints: []
path_constraints:
  name: ''
  joint_constraints: []
trajectory_constraints:
  constraints: []
reference_trajectories: []
pipeline_id: ompl
planner_id: ''
group_name: arm
num_planning_attempts: 1
allowed_planning_time: 5.0
max_velocity_scaling_factor: 0.4
max_acceleration_scaling_factor: 1.0
cartesian_speed_limited_link: ''
max_cartesian_speed: 0.0
---
"""
"""A request of a Panda as `ros2 topic echo` prints it, of three joints of the group."""

LINK_REQUEST = """
start_state:
  joint_state:
    name: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6,
      panda_joint7]
    position: [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
  is_diff: true
goal_constraints:
- position_constraints:
  - header: {frame_id: panda_link0}
    link_name: panda_link8
    target_point_offset: {x: 0.0, y: 0.0, z: 0.1034}
    constraint_region:
      primitives: [{type: 2, dimensions: [0.0001]}]
      primitive_poses:
      - position: {x: 0.45, y: -0.35, z: 0.15}
        orientation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}
    weight: 1.0
  orientation_constraints:
  - header: {frame_id: panda_link0}
    orientation: {x: 0.9238795325112867, y: -0.3826834323650898, z: 0.0, w: 0.0}
    link_name: panda_link8
    absolute_x_axis_tolerance: 0.001
    absolute_y_axis_tolerance: 0.001
    absolute_z_axis_tolerance: 0.001
    parameterization: 0
    weight: 1.0
group_name: ''
"""
"""A request that the point between a Panda's fingers is at a place, pointing down."""

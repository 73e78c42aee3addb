"""Obstacles: shapes in the world, still or moving, from Python, from files and in a gripper."""

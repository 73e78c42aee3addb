"""Planned torques as executed: forward simulation, feedback controllers, tracking."""

"""Curves over time as numbers: torques of a scheme, and panels of the joints."""

"""Curves over time as numbers: torques of a scheme, and angles without jumps."""

"""Obstacles and distances, and how closely a motion passes them."""

"""Paths around obstacles by a sampling-based planner, as initial guesses."""

"""Motions on a grid: nodes, discrete action, interpolation, files."""

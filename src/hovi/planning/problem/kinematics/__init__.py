"""Orientations of frames, and the configurations in which a frame reaches a goal."""

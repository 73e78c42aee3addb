"""Orientations of frames, and the configurations in which a frame meets a goal."""

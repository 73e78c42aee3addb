"""Checks of what callers pass: arguments by their annotations, and the shapes of arrays."""

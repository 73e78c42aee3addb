"""A robot with effects, and the Lagrangians on T^(k)Q that it defines."""

"""A motion on a grid: nodes, discrete action, interpolant, file."""

"""CasADi expressions and joint values from which effects are built."""

"""CasADi expressions and joint values of which effects are built."""

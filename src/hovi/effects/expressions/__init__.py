"""The CasADi expressions and joint-wise numbers that effects are written with."""

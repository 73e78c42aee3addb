"""A motion of the discrete problem itself, whatever happens between the points of its grid.

For claims about that problem: its equations, its momenta, its costs. Only here do tests know how a
problem is solved on one grid; all others go through `hovi.solve` and `hovi.plan`.
"""

from hovi.planning.solver.solver import solve_on_grid

__all__ = ["solve_on_grid"]

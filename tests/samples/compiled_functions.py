"""A small CasADi function to compile, importable by other processes."""

from __future__ import annotations

import casadi as ca

from hovi.dynamics.function_cache import compiled


def function(factor: float = 2.0) -> ca.Function:
    x = ca.SX.sym("x", 2)
    return ca.Function("f", [x], [factor * x, ca.sin(x[0]) * x[1]])


def value_at_one(made: ca.Function) -> float:
    return float(made([1.0, 1.0])[0][0])


def compile_and_evaluate(factor: float) -> float:
    return value_at_one(compiled(function(factor)))

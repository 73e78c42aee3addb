"""Diagnosis of NaN and infinity in a motion: quantity, joint and time."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.function import Points
from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]


def non_finite_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """The first number that is infinite or NaN, as a clause; "" if all are finite.

    Checked in this order: the nodes; accelerations, torques and costs at the quadrature points;
    the derivatives of the cost; conditions.
    """
    with np.errstate(all="ignore"):
        return (
            _at_nodes(problem, path)
            or _at_points(problem, path)
            or _derivative(problem, path)
            or non_finite_condition(problem, path)
        )


def non_finite_condition(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """The first condition at all times that has no finite value at a point; "" if all have."""
    ld = problem.ld
    for lagrangian, jet, t in zip(ld.lagrangians, ld.jets(path), ld.point_times, strict=True):
        at = Points(jet[0], jet[1], t, jet[2], lagrangian.output(*jet, t=t)[:, : ld.lagrangian.nv])
        for each in problem.bounds:
            index = _first_non_finite(each.y.values(at))
            if index is not None:
                return f"condition {each.name!r} has no finite value at t = {t[index[0]]:.4g} s"
    return ""


def _at_nodes(problem: TrajectoryProblem, path: DiscretePath) -> str:
    for term, values in (("position", path.q), ("velocity", path.v)):
        index = _first_non_finite(values)
        if index is not None:
            k, i = index
            where = f"at node {k} of {path.intervals} (t = {problem.grid.t[k]:.4g} s)"
            return f"the {term} of {_joint(problem, i)} is {values[k, i]} {where}"
    return ""


def _at_points(problem: TrajectoryProblem, path: DiscretePath) -> str:
    jets = problem.ld.jets(path)
    ld = problem.ld
    points = zip(ld.lagrangians, jets, ld.point_times, ld.point_intervals, strict=True)
    for lagrangian, jet, t, numbers in points:
        quantities: list[tuple[str, Array]] = [("acceleration", jet[2])]
        quantities.append((lagrangian.output_name, lagrangian.output(*jet, t=t)))
        quantities.append(("cost", lagrangian.value(*jet, t=t)[:, None]))
        for term, values in quantities:
            index = _first_non_finite(values)
            if index is not None:
                j, i = index
                of = "" if term == "cost" else f" of {_joint(problem, i)}"
                return (
                    f"the {term}{of} is {values[j, i]} at t = {t[j]:.4g} s (interval {numbers[j]})"
                )
    return ""


def _derivative(problem: TrajectoryProblem, path: DiscretePath) -> str:
    expansion = problem.ld.expand(path, "regular")
    for term, values in (("first", expansion.gradient), ("second", expansion.hessian)):
        index = _first_non_finite(values)
        if index is not None:
            k = index[0]
            where = f"in interval {k} (from t = {problem.grid.t[k]:.4g} s)"
            return f"the {term} derivatives of the cost are too large {where}"
    return ""


def _first_non_finite(values: npt.NDArray[Any]) -> tuple[int, ...] | None:
    indices = np.argwhere(~np.isfinite(values))
    return None if len(indices) == 0 else tuple(int(i) for i in indices[0])


def _joint(problem: TrajectoryProblem, i: int) -> str:
    names = problem.coordinates.coordinate_names
    return f"joint {names[min(i, len(names) - 1)]!r}"

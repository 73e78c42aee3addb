"""One task by OMPL and TOPP-RA, in a Python with `ompl`, `toppra` and `pin`, without hovi.

A path by RRT-Connect, simplified and smoothed by OMPL; its fastest motion within the bounds on
velocity and torque by TOPP-RA; and that motion slowed down to the duration of the task, whose
effort is 1/2 integral |tau|^2. Reads a request as JSON from standard input, and writes the answer.
"""

from __future__ import annotations

import json
import logging
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import toppra
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou
from task_world import World, least_clearance, read_world
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, JointTorqueConstraint, JointVelocityConstraint

Array = npt.NDArray[np.float64]

RESOLUTION = 0.005
"""Distance between configurations that are checked, as a fraction of the space's extent."""
EXTRA = 2e-3
"""Clearance beyond the margin that the path keeps, since the spline through it cuts corners."""
PATH_POINTS = 60
GRID = 201
EFFORT_SAMPLES = 2_001
CHECK_SAMPLES = 5_000


class Checked(ob.StateValidityChecker):
    """Whether all pairs keep the margin at a configuration."""

    def __init__(self, info: Any, world: World, space: Coordinates) -> None:
        super().__init__(info)
        self._world, self._space = world, space
        self._data, self._placed = world.model.createData(), world.geometry.createData()
        for request, allowed in zip(self._placed.collisionRequests, world.allowances, strict=True):
            request.security_margin = world.margin + (EXTRA if allowed == 0.0 else -allowed)
            request.break_distance = request.security_margin + 0.05

    def isValid(self, state: Any) -> bool:
        """As OMPL calls it."""
        x = np.array([state[i] for i in range(self._space.size)])
        return self.is_free(self._space.q(x))

    def is_free(self, q: Array) -> bool:
        """The same for a configuration."""
        ends = self._world.model, self._data, self._world.geometry, self._placed
        return not pin.computeCollisions(*ends, q, True)


class Coordinates:
    """Angles and lengths of all joints, also of those without an end, from a configuration on."""

    def __init__(self, model: Any, start: Array) -> None:
        self._model, self._start, self.size = model, start, model.nv

    def x(self, q: Array) -> Array:
        """The coordinates of a configuration."""
        return np.asarray(pin.difference(self._model, self._start, q))

    def q(self, x: Array) -> Array:
        """The configuration at coordinates."""
        return np.asarray(pin.integrate(self._model, self._start, x))


def path_of(world: World, stops: list[Array], lower: Array, upper: Array, given: Any) -> Any:
    """The points of a path through configurations, (M, nv), or None; and their coordinates."""
    space = Coordinates(world.model, stops[0])
    at = [space.x(q) for q in stops]
    bounds = ob.RealVectorBounds(space.size)
    for i in range(space.size):
        wide = not np.isfinite(lower[i])
        bounds.setLow(i, min(x[i] for x in at) - np.pi if wide else float(lower[i]))
        bounds.setHigh(i, max(x[i] for x in at) + np.pi if wide else float(upper[i]))
    real = ob.RealVectorStateSpace(space.size)
    real.setBounds(bounds)
    setup = og.SimpleSetup(real)
    info = setup.getSpaceInformation()
    checked = Checked(info, world, space)
    setup.setStateValidityChecker(checked)
    info.setStateValidityCheckingResolution(RESOLUTION)
    parts = []
    for first, last in pairwise(at):
        setup.clear()
        ends = []
        for x in (first, last):
            state = real.allocState()
            for i in range(space.size):
                state[i] = float(x[i])
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(og.RRTConnect(info))
        status = setup.solve(given["seconds"])
        if not setup.haveExactSolutionPath():
            free = [checked.is_free(space.q(x)) for x in (first, last)]
            return None, f"no path ({status}; ends free: {free})", space
        setup.simplifySolution()
        path = setup.getSolutionPath()
        path.interpolate(PATH_POINTS)
        states = path.getStates()
        parts.append(np.array([[each[i] for i in range(space.size)] for each in states]))
    given["direct"] = all(
        checked.is_free(space.q(x))
        for first, last in pairwise(at)
        for x in np.linspace(first, last, 200)
    )
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])]), "", space


def solved(request: dict[str, Any]) -> dict[str, Any]:
    """The answer to a request; its times are those of this process's processor, in [s]."""
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(request["seed"])
    began = time.process_time()
    world = read_world(Path(request["scene"]), request["files"], hulls=True)
    built = time.process_time() - began
    lower, upper, v, tau = (np.array(request[key]) for key in ("lower", "upper", "v", "tau"))
    stops = [np.array(q) for q in request["stops"]]
    began = time.process_time()
    points, why, space = path_of(world, stops, lower, upper, request)
    taken = time.process_time() - began
    answer: dict[str, Any] = {"built": built, "path_seconds": taken, "success": False, "why": why}
    if points is None:
        return answer
    began = time.process_time()
    motion = fastest(world, points, v, tau, space)
    answer["timing_seconds"] = time.process_time() - began
    if motion is None:
        return answer | {"why": "TOPP-RA finds no motion along the path"}
    T = float(motion.duration)
    answer |= {
        "least_duration": T,
        "direct": request["direct"],
        "effort": effort(world, motion, request["duration"], space),
    }
    t = np.linspace(0.0, T, CHECK_SAMPLES)
    clearance, _ = least_clearance(world, np.array([space.q(x) for x in motion(t)]))
    answer |= {"clearance": clearance, "success": request["duration"] >= T and clearance > 0.0}
    if request["duration"] < T:
        answer["why"] = f"the path takes {T:.2f} s"
    elif clearance <= 0.0:
        answer["why"] = "the spline through the path touches"
    return answer


def fastest(world: World, points: Array, v: Array, tau: Array, space: Coordinates) -> Any:
    """TOPP-RA's motion along the spline through points, or None."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    kept = np.concatenate([[True], np.diff(arc) > 1e-9])
    path = toppra.SplineInterpolator(arc[kept] / arc[-1], points[kept], bc_type="natural")
    data = world.model.createData()

    def torque(x: Array, dx: Array, ddx: Array) -> Array:
        return np.asarray(pin.rnea(world.model, data, space.q(x), dx, ddx)).copy()

    held = JointTorqueConstraint(
        torque,
        np.stack([-tau, tau], axis=1),
        np.zeros(len(tau)),
        discretization_scheme=DiscretizationType.Interpolation,
    )
    constraints = [JointVelocityConstraint(np.stack([-v, v], axis=1)), held]
    grid = np.linspace(0.0, 1.0, GRID)
    method = TOPPRA(constraints, path, gridpoints=grid, solver_wrapper="seidel")
    return method.compute_trajectory(0, 0)


def effort(world: World, motion: Any, duration: float, space: Coordinates) -> float:
    """1/2 integral |tau|^2 of a motion slowed down to a duration."""
    slower, data = duration / float(motion.duration), world.model.createData()
    t = np.linspace(0.0, float(motion.duration), EFFORT_SAMPLES)
    jets = zip(motion(t), motion(t, 1) / slower, motion(t, 2) / slower**2, strict=True)
    tau = np.array([pin.rnea(world.model, data, space.q(x), v, a).copy() for x, v, a in jets])
    return float(np.trapezoid(np.sum(tau**2, axis=1) / 2, t * slower))


if __name__ == "__main__":
    logging.getLogger("toppra").setLevel(logging.ERROR)
    print(json.dumps(solved(json.load(sys.stdin))))

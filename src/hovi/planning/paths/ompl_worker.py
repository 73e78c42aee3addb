"""Paths by OMPL, in a process of its own that reads and writes one JSON object per line.

A request has bounds "lower" and "upper", "start", "goal", "seed" and "motions". Until its answer,
{"path": rows of numbers or null}, the process asks whether it may move straight {"from": x, "to":
y}, and reads 1 or 0. So it needs no robot: this file imports nothing of hovi, and hovi nothing of
this file, since OMPL brings C++ libraries of its own and reports its leaks at exit.
"""

import json
import os
import sys
from typing import Any

from ompl import base, geometric, util

SMOOTHING_STEPS = 3
"""Maximum number of times that a path is smoothed, each by halving its parts."""


class Asked(base.MotionValidator):  # type: ignore[misc]
    """Whether motions are free, as the other process says. count: of those that were asked."""

    def __init__(self, info: Any, size: int) -> None:
        super().__init__(info)
        self.size, self.count = size, 0

    def checkMotion(self, one: Any, other: Any) -> bool:
        """As OMPL calls it."""
        self.count += 1
        x, y = ([state[i] for i in range(self.size)] for state in (one, other))
        print(json.dumps({"from": x, "to": y}), flush=True)
        answer = sys.stdin.readline()
        if not answer:
            os._exit(0)  # nobody waits for the path any more
        return answer.strip() == "1"


class Point(base.StateValidityChecker):  # type: ignore[misc]
    """Whether a configuration is free: a motion from itself to itself."""

    def __init__(self, info: Any, motions: Asked) -> None:
        super().__init__(info)
        self.motions = motions

    def isValid(self, state: Any) -> bool:
        """As OMPL calls it."""
        return self.motions.checkMotion(state, state)


def found(request: dict[str, Any]) -> list[list[float]] | None:
    """The points of a simplified path by RRT-Connect [KuffnerLaValle2000], or None."""
    size = len(request["start"])
    bounds = base.RealVectorBounds(size)
    for i in range(size):
        bounds.setLow(i, request["lower"][i])
        bounds.setHigh(i, request["upper"][i])
    space = base.RealVectorStateSpace(size)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    info = setup.getSpaceInformation()
    motions = Asked(info, size)
    points = Point(info, motions)
    setup.setStateValidityChecker(points)
    info.setMotionValidator(motions)
    ends = []
    for given in (request["start"], request["goal"]):
        state = space.allocState()
        for i in range(size):
            state[i] = given[i]
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(info))
    setup.solve(base.PlannerTerminationCondition(lambda: motions.count > request["motions"]))
    if not setup.haveExactSolutionPath():
        return None
    path, simplifier = setup.getSolutionPath(), geometric.PathSimplifier(info)
    simplifier.reduceVertices(path)
    simplifier.partialShortcutPath(path)
    simplifier.reduceVertices(path)
    simplifier.smoothBSpline(path, SMOOTHING_STEPS)
    return [[state[i] for i in range(size)] for state in path.getStates()]


def main() -> None:
    """Answer requests until standard input is closed."""
    util.setLogLevel(util.LOG_NONE)
    for line in sys.stdin:
        request = json.loads(line)
        util.RNG.setSeed(request["seed"])
        print(json.dumps({"path": found(request)}), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()

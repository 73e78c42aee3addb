"""The final state of a simulation, and the position limits that it exceeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hovi.cli.reports.terminal_table import print_table
from hovi.planning.problem.limits import urdf_limits
from hovi.robot.space.unwrapped_angles import shown_names
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.flows.simulator import Simulation


@dataclass(frozen=True)
class ExceededLimit:
    """A position limit of the URDF, in `unit`, and the first time t that exceeds it, in [s]."""

    joint: str
    limit: float
    unit: str
    t: float


def exceeded_limits(motion: Simulation) -> list[ExceededLimit]:
    """The first limit that each joint exceeds at a node, beyond tolerance, in order of time."""
    robot, found = motion.scene.robot, []
    limits, units = urdf_limits(robot), robot.coordinate_units
    for iq, iv in zip(*robot.space.plain, strict=True):
        low, high = limits.lower[0, iv], limits.upper[0, iv]
        q = motion.q[:, iq]
        margin = np.minimum(q - low, high - q)
        beyond = np.flatnonzero(margin < -limits.tolerance * limits.ranges[0, iv])
        if beyond.size:
            k = beyond[0]
            limit = float(low if q[k] < low else high)
            name = robot.coordinate_names[iv]
            found.append(ExceededLimit(name, limit, units[iv].q, float(motion.t[k])))
    return sorted(found, key=lambda each: each.t)


def limits_sentence(exceeded: list[ExceededLimit]) -> str:
    """One line on the first exceeded limit, with the names of the other joints."""
    first, *others = exceeded
    also = f", as are those of {', '.join(each.joint for each in others)} later" if others else ""
    return (
        f"{first.joint} passes its limit of {first.limit:.4g} {first.unit} at t = {first.t:.4g} s"
        f"{also}: limits are not simulated"
    )


def end_state(motion: Simulation) -> list[dict[str, Any]]:
    """One row per coordinate: joint, q, v and unit at the end, with q as in `positions`."""
    robot = motion.scene.robot
    names = shown_names(robot.space, robot.coordinate_names)
    positions = motion.trajectory.positions(float(motion.t[-1]))[0]
    rows = zip(names, positions, motion.v[-1], strict=True)
    return [
        {"joint": name, "q": q, "v": v, "unit": units.q}
        for (name, q, v), units in zip(rows, robot.coordinate_units, strict=True)
    ]


def print_end(rows: list[dict[str, Any]]) -> None:
    """Print the final state as a table, one joint per line."""
    shown = [
        (each["joint"], f"{each['q']:.4g}", each["unit"], f"{each['v']:.4g}", f"{each['unit']}/s")
        for each in rows
    ]
    print_table(("at the end", "q", "", "v", ""), shown, texts=(0, 2, 4))

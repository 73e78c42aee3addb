"""Planar chains whose joints may turn at 80 % of the largest velocity that they take when free.

From hanging at rest to a bent configuration in 2 s, under gravity, on 16 intervals and with all
defaults. The limit is 80 % of the largest velocity of any joint in the motion without limits that
the same options give. Limits are checked at 50,000 samples.

    python chains.py [LINKS ...] [--time-limit 60]
"""

from __future__ import annotations

import argparse

import numpy as np
import pinocchio as pin
from measuring import alone, print_machine, print_table
from random_arms import largest_excess, timed

import hovi

LINKS = (5, 7, 10, 14)
SETTINGS = {"16 intervals": {"intervals": 16}, "defaults": {}}
FRACTION, DURATION = 0.8, 2.0


def measure(links: int, setting: str, time_limit: float) -> list[str]:
    """One chain, free and within its limit: a row of the table."""
    model = pin.buildModelFromXML(hovi.chain(links))
    scene = hovi.Scene(hovi.load_robot(model), [hovi.effects.Gravity()])
    start, goal = np.zeros(links), np.full(links, 0.3)
    start[0], goal[0] = -np.pi / 2, 0.2
    options = SETTINGS[setting] | {"processes": 1, "time_limit": time_limit}

    def plan(limits: object) -> hovi.Solution:
        return hovi.plan(
            scene, start, goal, DURATION, limits=limits, self_collision=False, **options
        )

    hovi.plan(scene, start, start + 0.01, 1.0, limits={"base": "none", "v": 1.0}, intervals=4)
    seconds, free = timed(lambda: plan("none"))
    peak = float(np.abs(free.trajectory.sample(np.linspace(0.0, DURATION, 5001)).v).max())
    limits = {"base": "none", "v": FRACTION * peak}
    limited_seconds, limited = timed(lambda: plan(limits))
    bounds = hovi.as_limits(scene.robot, limits)
    return [
        f"{links} links, {setting}",
        f"{FRACTION * peak:.3g}",
        f"{seconds:.2g}, {free.nit}, {free.status}",
        f"{limited_seconds:.2g}",
        f"{limited.nit}",
        f"{limited.status}",
        f"{limited.trajectory.grid.intervals}",
        f"{limited.cost:.7g}",
        f"{largest_excess(scene, limited.trajectory, bounds):.0e}",
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("links", nargs="*", type=int)
    parser.add_argument("--time-limit", type=float, default=60.0, help="of a plan, in [s]")
    given = parser.parse_args()
    rows = [
        alone(measure, links, setting, given.time_limit)
        for links in given.links or LINKS
        for setting in SETTINGS
    ]
    print(f"At most {given.time_limit:g} s per plan, one thread.\n")
    columns = ["chain", "largest velocity [rad/s]", "free: CPU s, steps, status", "CPU s", "steps"]
    columns += ["status", "intervals", "cost", "largest excess, of the range"]
    print_table(columns, rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()

"""Orders of motions that keep values: at the nodes, and of what is missed between them.

A line, and a line at a constant speed of the tool (levels 0 and 1), on arms of six and seven
joints: errors of q at the nodes relative to a motion on 64 intervals with four inner modes, and the
largest miss at 2,001 samples by Pinocchio, on N intervals with r inner modes. What is missed shows
its order on finer grids than the nodes do.

    python kept_orders.py [ARM ...]
"""

from __future__ import annotations

import sys
from functools import cache

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from measuring import print_machine, print_table
from random_arms import arm_scene, torque_model

import hovi
from hovi.conditions import Formula

Array = npt.NDArray[np.float64]

STARTS = {
    "ur5": [0.0, -1.2, 1.5, -0.3, 0.5, 0.0],
    "panda": [0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.8],
}
T, SPEED = 1.0, 0.25
NODES, BETWEEN, MODES = (8, 16, 32), (16, 32, 64), (0, 1, 2)
ROTORS = 0.3
"""Inertia of the rotors, in [kg m^2], without which free joints spin."""
SAMPLES = 2001
COARSE = 1.0
"""Tolerance with which coarse grids are accepted."""


class Task:
    """Along y from a start; at a constant speed from its first instant on, if `steady`."""

    def __init__(self, arm: str, steady: bool) -> None:
        self.scene, self.steady = arm_scene(arm, ROTORS), steady
        self.model, self.frame = torque_model(self.scene), self.scene.robot.tip_frames[0]
        self.q0 = np.array(STARTS[arm])
        self.q1 = self._reached(self.q0, SPEED * T)
        self.v0, self.v1 = (self._steady_rate(q) if steady else 0 * q for q in (self.q0, self.q1))

    @cache  # noqa: B019 (as many as there are tasks)
    def solved(self, intervals: int, modes: int) -> hovi.Solution:
        """The motion on a grid."""
        place = self._place(self.q0)
        kept = {f'position["{self.frame}", "{x}"]': place["xyz".index(x)] for x in "xz"}
        if self.steady:
            kept[f'velocity["{self.frame}", "y"]'] = SPEED
        keep = [Formula(each, equals=value, tolerance=COARSE) for each, value in kept.items()]
        found = hovi.plan(
            self.scene,
            hovi.State(self.q0, self.v0),
            hovi.State(self.q1, self.v1),
            T,
            keep=keep,
            limits="none",
            self_collision=False,
            intervals=intervals,
            scheme=f"galerkin-{modes}x{modes + 6}" if modes else "galerkin-0x6",
            processes=1,
        )
        assert found.success, found.message
        return found

    def missed(self, found: hovi.Solution) -> float:
        """Off the line, in [m], or off the speed, in [m/s]: the quantity of the highest level."""
        x = found.trajectory.sample(np.linspace(0.0, T, SAMPLES))
        if self.steady:
            rates = (self._jacobian(q)[1] @ v for q, v in zip(x.q, x.v, strict=True))
            return max(abs(rate - SPEED) for rate in rates)
        places = np.array([self._place(q) for q in x.q])
        return float(np.linalg.norm((places - places[0])[:, [0, 2]], axis=1).max())

    def _place(self, q: Array) -> Array:
        data = self.model.createData()
        pin.framesForwardKinematics(self.model, data, q)
        return data.oMf[self.model.getFrameId(self.frame)].translation.copy()

    def _jacobian(self, q: Array) -> Array:
        data, world = self.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        number = self.model.getFrameId(self.frame)
        return pin.computeFrameJacobian(self.model, data, q, number, world)[:3]

    def _steady_rate(self, q: Array) -> Array:
        return np.linalg.pinv(self._jacobian(q)) @ [0.0, SPEED, 0.0]

    def _reached(self, q: Array, aside: float) -> Array:
        goal = self._place(q) + np.array([0.0, aside, 0.0])
        for _ in range(50):
            q = q + np.linalg.pinv(self._jacobian(q)) @ (goal - self._place(q))
        return q


def orders(arm: str, steady: bool) -> list[list[object]]:
    """A row for each number of modes."""
    task = Task(arm, steady)
    exact, rows = task.solved(64, 4).trajectory, []
    for r in MODES:
        at_nodes = [task.solved(N, r).trajectory for N in NODES]
        errors = [np.abs(x.q - exact.sample(x.grid.t).q).max() for x in at_nodes]
        missed = [task.missed(task.solved(N, r)) for N in BETWEEN]
        level = int(steady)
        rows.append(
            [
                f"`{arm}`, {'line at a speed' if steady else 'line'}",
                r,
                ", ".join(f"{e:.1e}" for e in errors),
                f"{np.log2(errors[-2] / errors[-1]):.1f} of {2 * r + 4}",
                ", ".join(f"{e:.1e}" for e in missed),
                f"{np.log2(missed[-2] / missed[-1]):.1f} of {r + 4 - level}",
            ]
        )
    return rows


def main() -> None:
    """Print the table."""
    arms = sys.argv[1:] or list(STARTS)
    rows = [row for arm in arms for steady in (False, True) for row in orders(arm, steady)]
    nodes, between = (", ".join(map(str, each)) for each in (NODES, BETWEEN))
    columns = ["", "r", f"error of q at the nodes, N = {nodes}", "order"]
    print_table([*columns, f"missed between them [m], [m/s], N = {between}", "order"], rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()

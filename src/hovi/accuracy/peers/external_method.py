"""Tools in Python environments of their own, as methods of a work-precision diagram."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline

from hovi.accuracy import Setting
from hovi.accuracy.method import Answer, Method, Prepared
from hovi.accuracy.peers.bare_urdf import bare_urdf
from hovi.accuracy.peers.supported_scenes import require_supported
from hovi.accuracy.peers.worker_client import Worker
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

_CHECK_POINTS = 5
STARTUP_TIME = 20.0
"""Time allowed for importing a tool, in [s]."""


class ExternalMethod(Method):
    """A tool that answers JSON requests in a process of its own, see serve.py.

    setting: problem and guess. python: of the tool's environment. tool: name of its worker module.
    options: passed to the worker. nearer: start from the nearer guess.
    """

    coarsest = 24

    def __init__(
        self,
        setting: Setting,
        python: Path,
        tool: str,
        name: str,
        family: str,
        order: int | None,
        options: Mapping[str, Any],
        nearer: bool = False,
    ) -> None:
        require_supported(setting)
        self._setting = setting
        self._guess = setting.nearer if nearer else setting.guess
        self.name, self.family, self.order = name, family, order
        scene = scene_request(setting) | {"options": dict(options)}
        self._worker = Worker(python, tool, timeout=2 * setting.longest + STARTUP_TIME)
        try:
            self._worker.ask(scene)
        except BaseException:
            self.close()
            raise

    def prepare(self, intervals: int) -> Prepared:
        """Set up the tool for N intervals, in its own process."""
        T = self._setting.problem.grid.duration
        t = np.linspace(0.0, T, 2 * intervals + 1)
        q, v, a = (x.tolist() for x in self._guess(t))
        guess = {"q": q, "v": v, "a": a}
        answer = self._worker.ask({"prepare": intervals, "guess": guess})
        return Prepared(partial(self._solve, intervals), float(answer["seconds"]))

    def _solve(self, intervals: int) -> Answer:
        answer = self._worker.ask({"solve": intervals})
        q, v = np.array(answer["q"]), np.array(answer["v"])
        t = np.linspace(0.0, self._setting.problem.grid.duration, intervals + 1)
        motion: Callable[[Array], Array] = CubicHermiteSpline(t, q, v)
        report = bool(answer["success"]), str(answer["message"]), float(answer["cost"])
        return Answer(*report, motion, int(answer["steps"]), float(answer["seconds"]))

    def close(self) -> None:
        """Terminate the tool's process."""
        self._worker.close()


@dataclass(frozen=True, eq=False)
class ExternalTool:
    """A tool in an environment of its own, and its measured variants.

    worker: module of this folder that serve.py loads there. family: see Method.
    variants: by name, the order, see Method, and the options for the worker.
    nearer: whether to start from the nearer guess, if the tool otherwise finds other minima.
    """

    worker: str
    family: str
    variants: Mapping[str, tuple[int | None, Mapping[str, Any]]]
    nearer: bool = False

    def peers(self, python: Path) -> list[partial[ExternalMethod]]:
        """One method per variant, for `work_precision(peers=)`, run by the tool's `python`."""
        return [
            partial(
                ExternalMethod,
                python=python,
                tool=self.worker,
                name=f"{self.family}, {name}",
                family=self.family,
                order=order,
                options=options,
                nearer=self.nearer,
            )
            for name, (order, options) in self.variants.items()
        ]


def scene_request(setting: Setting) -> dict[str, Any]:
    """The first request of serve.py: robot and boundary states, and torques to check its model."""
    problem = setting.problem
    model, n = problem.scene.model, problem.robot.nv
    q, v, a = np.random.default_rng(1).uniform(-1, 1, (3, _CHECK_POINTS, n))
    tau = problem.scene.inverse_dynamics(q, v, a)
    check = {"q": q, "v": v, "a": a, "tau": tau}
    return {
        "urdf": bare_urdf(model),
        "gravity": np.asarray(model.gravity.linear).tolist(),
        "armature": np.asarray(model.armature).tolist(),
        "longest": setting.longest,
        "clock": setting.clock,
        "duration": problem.grid.duration,
        "ends": [np.asarray(x).tolist() for x in (x[end] for end in (0, 1) for x in problem.ends)],
        "check": {name: x.tolist() for name, x in check.items()},
    }

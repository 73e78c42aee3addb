"""Collocation with Ipopt as methods of a work-precision diagram."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from hovi.accuracy import Setting
from hovi.accuracy.method import Answer, Method, Prepared, Stopwatch
from hovi.peers.collocation import Collocation
from hovi.peers.collocation_table import NAMES, collocation_table
from hovi.peers.plain_scene import require_plain
from hovi.peers.point_program import PointKernels, compiled, point_kernels
from hovi.rigid_body import casadi_functions

FAMILIES = {True: "Ipopt, compiled", False: "Ipopt, interpreted"}


class CollocationMethod(Method):
    """A collocation whose program Ipopt solves.

    setting: what is planned. scheme: in collocation_table.NAMES. kernels: of its points.
    """

    def __init__(self, setting: Setting, scheme: str, kernels: Kernels) -> None:
        require_plain(setting)
        self._setting, self._table, self._kernels = setting, collocation_table(scheme), kernels
        self.family = FAMILIES[kernels.compiled]
        self.name, self.order = f"{scheme}, {self.family}", self._table.order

    def prepare(self, intervals: int) -> Prepared:
        """The program and its solver; kernels count as if they were made for it alone."""
        problem = self._setting.problem
        kernels, before = self._kernels.of(self._setting)
        watch = Stopwatch()
        it = Collocation(self._table, intervals, problem.grid.duration, problem.robot.nv)
        solver = it.program.solver(kernels)
        w = it.unknowns(self._setting.guess, problem.boundary)
        free = np.where(it.held[:, None], 0.0, np.inf)
        bounds = {"lbx": (w - free).ravel(), "ubx": (w + free).ravel(), "lbg": 0, "ubg": 0}
        arguments = {"x0": w.ravel()} | bounds
        return Prepared(partial(_solve, it, solver, arguments), before + watch.seconds)


class Kernels:
    """Kernels that the collocations of one scene share, with the time that they took.

    compiled: by gcc, or for CasADi's interpreter.
    """

    def __init__(self, compiled: bool) -> None:
        self.compiled = compiled
        self._made: tuple[PointKernels, float] | None = None

    def of(self, setting: Setting) -> tuple[PointKernels, float]:
        """The kernels, and what making them took, in [s]."""
        if self._made is None:
            watch = Stopwatch()
            kernels = point_kernels(casadi_functions(setting.problem.scene.model).inverse_dynamics)
            if self.compiled:
                with tempfile.TemporaryDirectory(prefix="hovi-kernels-") as folder:
                    kernels = compiled(kernels, Path(folder))  # stays loaded without its file
            self._made = kernels, watch.seconds
        return self._made


def ipopt_peers(
    compiled: bool, schemes: tuple[str, ...] = NAMES
) -> list[partial[CollocationMethod]]:
    """All collocations with one kind of kernels, for `work_precision(peers=)`."""
    kernels = Kernels(compiled)
    return [partial(CollocationMethod, scheme=scheme, kernels=kernels) for scheme in schemes]


def _solve(it: Collocation, solver: ca.Function, arguments: dict[str, Any]) -> Answer:
    watch = Stopwatch()
    found = solver(**arguments)
    seconds = watch.seconds
    stats = solver.stats()
    w = found["x"].full().reshape(it.rows, it.joints)
    return Answer(
        success=bool(stats["success"]),
        message=str(stats["return_status"]),
        cost=float(found["f"]),
        configurations=partial(it.configurations, w),
        steps=int(stats["iter_count"]),
        seconds=seconds,
    )

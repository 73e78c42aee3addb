"""Collocation with Ipopt as methods of a work-precision diagram."""

from __future__ import annotations

import hashlib
import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from hovi.accuracy import Setting
from hovi.accuracy.method import CLOCKS, Answer, Method, Prepared, Stopwatch
from hovi.accuracy.peers.collocation import Collocation
from hovi.accuracy.peers.collocation_table import NAMES, collocation_table
from hovi.accuracy.peers.point_program import (
    PointKernels,
    compiled,
    loaded_functions,
    point_kernels,
)
from hovi.accuracy.peers.supported_scenes import require_supported
from hovi.dynamics.symbolic_dynamics import casadi_functions

FAMILIES = {True: "Ipopt, compiled", False: "Ipopt, interpreted"}


class CollocationMethod(Method):
    """Collocation solved by Ipopt.

    setting: problem and guess. scheme: in collocation_table.NAMES. kernels: cost kernels of the
        points.
    """

    def __init__(self, setting: Setting, scheme: str, kernels: Kernels) -> None:
        require_supported(setting)
        self._setting, self._table, self._kernels = setting, collocation_table(scheme), kernels
        self.family = FAMILIES[kernels.compiled]
        self.name, self.order = f"{scheme}, {self.family}", self._table.order

    def prepare(self, intervals: int) -> Prepared:
        """Set up the program and solver; the time includes building the kernels."""
        problem = self._setting.problem
        kernels, before = self._kernels.of(self._setting)
        collocation = Collocation(self._table, intervals, problem.grid.duration, problem.robot.nv)
        w = collocation.unknowns(self._setting.guess, problem.ends)
        watch = Stopwatch(self._setting.clock)
        solver = collocation.program.solver(kernels)
        seconds = before + watch.seconds
        free = np.where(collocation.fixed[:, None], 0.0, np.inf)
        bounds = {"lbx": (w - free).ravel(), "ubx": (w + free).ravel(), "lbg": 0, "ubg": 0}
        arguments = {"x0": w.ravel()} | bounds
        return Prepared(
            partial(_solve, collocation, solver, arguments, self._setting.clock), seconds
        )


class Kernels:
    """Kernels shared by the collocation methods of one scene, and the time of building them.

    compiled: by gcc, or evaluated by CasADi's interpreter.
    folder: cache of compiled kernels and their compile times; None for no cache.
    """

    def __init__(self, compiled: bool, folder: Path | None = None) -> None:
        self.compiled, self._folder = compiled, folder
        self._made: tuple[PointKernels, float] | None = None

    def of(self, setting: Setting) -> tuple[PointKernels, float]:
        """The kernels and the time of building them, in [s]."""
        if self._made is None:
            watch = Stopwatch(setting.clock)
            kernels = point_kernels(casadi_functions(setting.problem.scene.model).inverse_dynamics)
            seconds = watch.seconds
            if self.compiled and self._folder is not None:
                kernels, more = _cached(kernels, self._folder, setting.clock)
                seconds += more
            elif self.compiled:
                with tempfile.TemporaryDirectory(prefix="hovi-kernels-") as folder:
                    kernels = compiled(kernels, Path(folder))  # stays loaded without its file
                seconds = watch.seconds
            self._made = kernels, seconds
        return self._made


def ipopt_peers(
    compiled: bool, schemes: tuple[str, ...] = NAMES, folder: Path | None = None
) -> list[partial[CollocationMethod]]:
    """All collocation methods with one kind of kernels, for `work_precision(peers=)`.

    folder: see Kernels.
    """
    kernels = Kernels(compiled, folder)
    return [partial(CollocationMethod, scheme=scheme, kernels=kernels) for scheme in schemes]


def collocation_peers() -> list[partial[CollocationMethod]]:
    """All collocation methods with both kinds of kernels."""
    return [*ipopt_peers(compiled=True), *ipopt_peers(compiled=False)]


def _cached(kernels: PointKernels, folder: Path, clock: str) -> tuple[PointKernels, float]:
    """Compiled kernels from a cache folder, added if new, and their compile time, in [s]."""
    text = kernels.hessian.serialize().encode()
    entry = folder / hashlib.sha256(text).hexdigest()[:16]
    times = entry / "seconds.json"
    if times.exists():
        functions = (kernels.value, kernels.gradient, kernels.hessian)
        loaded = PointKernels(*loaded_functions(functions, entry))
        return loaded, float(json.loads(times.read_text())[clock])
    entry.mkdir(parents=True, exist_ok=True)
    watches = {name: Stopwatch(name) for name in CLOCKS}
    built = compiled(kernels, entry)
    times.write_text(json.dumps({name: watch.seconds for name, watch in watches.items()}))
    return built, watches[clock].seconds


def _solve(
    collocation: Collocation, solver: ca.Function, arguments: dict[str, Any], clock: str
) -> Answer:
    watch = Stopwatch(clock)
    found = solver(**arguments)
    seconds = watch.seconds
    stats = solver.stats()
    w = found["x"].full().reshape(collocation.rows, collocation.joints)
    return Answer(
        success=bool(stats["success"]),
        message=str(stats["return_status"]),
        cost=float(found["f"]),
        configurations=partial(collocation.configurations, w),
        steps=int(stats["iter_count"]),
        seconds=seconds,
    )

"""Memory and open files of one process over many plans, pages and replans: do they stay flat?

- 1,000 plans of random reaches, of four scenes in turns, every second one within limits;
- 300 live pages, each fetched and listened to by a browser's protocol, then closed;
- 10,000 replans of one motion to goals nearby.

The first quarter warms up. Growth is the slope of the rest, by least squares, times its length:
within 8 MB and no file more, else the exit code is 1.

    python endurance.py [plans|pages|replans ...] [--share 1.0]
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import sys
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from measuring import alone, print_machine, print_table
from replanning import solved
from tornado.websocket import websocket_connect

import hovi

MAX_GROWTH, SAMPLES, WARM_UP = 8.0, 60, 0.25
COUNTS = {"plans": 1_000, "pages": 300, "replans": 10_000}
ROBOTS = ("two_link", "ur5", "z1", "panda")


def plans() -> Iterator[None]:
    """A plan for each item, of a random short reach."""
    random = np.random.default_rng(0)
    scenes = [_scene(name) for name in ROBOTS]
    number = 0
    while True:
        scene, limits = scenes[number % len(scenes)], ("urdf", "none")[number // 4 % 2]
        middle = scene.robot.neutral()
        start, goal = (
            scene.robot.integrate(middle, random.uniform(-0.3, 0.3, scene.robot.nv))
            for _ in range(2)
        )
        options = {"limits": limits, "self_collision": False}
        hovi.plan(scene, start, goal, 1.5, time_limit=5.0, **options)
        number += 1
        yield


def _scene(name: str) -> hovi.Scene:
    source = hovi.load_task(hovi.example("two_link_reach")).scene.robot
    robot = source if name == "two_link" else hovi.load_robot(name)
    return hovi.Scene(robot, [hovi.effects.Gravity()])


def pages() -> Iterator[None]:
    """A live page for each item, opened and closed."""
    motion = hovi.plan_task(hovi.load_task(hovi.example("two_link_reach"))).trajectory
    while True:
        with hovi.replay(motion, announce=_silent) as page:
            with urllib.request.urlopen(page.url, timeout=10) as answer:
                answer.read()
            asyncio.run(_listen(page.url))
        yield


async def _listen(url: str) -> None:
    """Read one message of the page, as a browser does."""
    connection = await websocket_connect("ws" + url.removeprefix("http").removesuffix("view/"))
    await asyncio.wait_for(connection.read_message(), 10)
    connection.close()


def replans() -> Iterator[None]:
    """A replan for each item, from the last motion."""
    solution, home = solved("ur5_reach")
    random = np.random.default_rng(0)
    while True:
        goal = home + random.uniform(-0.05, 0.05, len(home))
        solution = solution.replan(goal=hovi.State(goal))
        assert solution.success, solution.message
        yield


def _silent(_: str) -> None:
    """Say nothing."""


WORK: dict[str, Callable[[], Iterator[None]]] = {"plans": plans, "pages": pages, "replans": replans}


def measure(name: str, count: int) -> tuple[float, float, float, float]:
    """Memory after warming up and at the end in [MB], its growth, and that of open files."""
    memory, files = [], []
    items = WORK[name]()
    for sample in range(SAMPLES):
        for _ in range(count // SAMPLES):
            next(items)
        gc.collect()
        memory.append(_resident())
        files.append(sum(1 for _ in Path("/proc/self/fd").iterdir()))
        print(f"{name}: {sample + 1} of {SAMPLES}, {memory[-1]:.1f} MB", file=sys.stderr)
    first = int(WARM_UP * SAMPLES)
    growth = [_growth(values[first:]) for values in (memory, files)]
    return memory[first], memory[-1], *growth


def _growth(values: list[float]) -> float:
    """Slope of the values times their number."""
    return float(np.polyfit(np.arange(len(values)), values, 1)[0] * len(values))


def _resident() -> float:
    """Resident memory of this process, in [MB]."""
    pages_held = int(Path("/proc/self/statm").read_text().split()[1])
    return pages_held * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("work", nargs="*", choices=[*WORK, []])
    parser.add_argument("--share", type=float, default=1.0)
    args = parser.parse_args()
    rows, flat = [], True
    for name in args.work or WORK:
        count = max(int(args.share * COUNTS[name]), SAMPLES)
        before, after, growth, files = alone(measure, name, count)
        flat = flat and growth <= MAX_GROWTH and files < 0.5
        cells = [f"{before:.1f}", f"{after:.1f}", f"{growth:+.1f}", f"{files:+.1f}"]
        rows.append([f"{count:,} {name}", *cells])
    columns = ["work", "warm [MB]", "at the end [MB]", "growth [MB]", "files"]
    print_table(columns, rows)
    print_machine(threads=1)
    raise SystemExit(not flat)


if __name__ == "__main__":
    main()

"""The suite of models/tasks: hovi at its default settings, and OMPL with TOPP-RA next to it.

    python tasks.py                     # all tasks
    python tasks.py bin panda           # those whose names contain one of these words
    python tasks.py --peer PYTHON       # with OMPL and TOPP-RA, by the Python of an environment
                                        # with `pip install ompl toppra pin`

Every task runs in a process of its own, which ends at a time limit, and leaves its result in a
folder (`--results`), so that an interrupted run goes on where it was; `--again` forgets results.
Clearances are measured at 50,000 times by Pinocchio and Coal alone (task_world.py).
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from measuring import compile_modules, print_machine, print_table
from task_world import least_clearance, read_world

import hovi
from hovi.robot.bundled_models import task_suite
from hovi.robot.example_robots import example_robot

LIMIT = 60.0
"""Time limit of a plan, in [s]."""
GRACE = 120.0
"""What loading and checking may take beyond it before the process is ended, in [s]."""
SAMPLES = 50_000
PATH_SECONDS = 20.0
"""Time limit of a path by OMPL, in [s]."""
BRANCHES = 4
"""Number of configurations at the goal that OMPL tries if hovi found no motion."""
SEED = 1


def robot_files(scene: Path) -> dict[str, Any]:
    """The files of a scene's robot."""
    data = tomllib.loads(scene.read_text())
    name, srdf = data["robot"], data.get("srdf")
    given = None if srdf is None else str((scene.parent / srdf).resolve())
    if name.endswith(".urdf"):
        return {"urdf": str((scene.parent / name).resolve()), "packages": [], "srdf": given}
    example = example_robot(name)
    own = None if example.srdf is None else str(example.srdf)
    packages = [str(example.package_dir)]
    return {"urdf": str(example.urdf), "packages": packages, "srdf": given or own}


def planned(scene: Path, limit: float) -> dict[str, Any]:
    """hovi's result for one task, at its default settings and on one thread, without imports."""
    task = hovi.load_task(scene)
    plan_task = hovi.plan_task  # lazy: this imports the planner before the clock starts
    began = _processor_time()
    try:
        found = plan_task(task, time_limit=limit)
    except hovi.HoviError as error:
        return {"status": type(error).__name__, "message": str(error), "success": False}
    taken = _processor_time() - began
    setup = found.setup_seconds / (found.setup_seconds + found.solve_seconds)
    t = np.linspace(0.0, found.trajectory.duration, SAMPLES)
    q = found.trajectory.configurations(t)
    world = read_world(scene, robot_files(scene))
    clearance, pair = least_clearance(world, q)
    return {
        "status": str(found.status),
        "success": bool(found.success),
        "message": found.message,
        "seconds": taken * (1.0 - setup),
        "setup": taken * setup,
        "steps": found.nit,
        "intervals": found.trajectory.grid.intervals,
        "cost": found.cost,
        "effort": found.effort,
        "clearance": clearance,
        "pair": pair,
        "margin": world.margin,
        "ends": [q[0].tolist(), q[-1].tolist()],
    }


def _processor_time() -> float:
    """Of this process and of those that it has started and that have ended, in [s]."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def requests(scene: Path, known: dict[str, Any] | None) -> list[dict[str, Any]]:
    """What OMPL and TOPP-RA are asked, until one is answered.

    Between the ends of hovi's motion if there is one, else to the branches of the goal.
    """
    task = hovi.load_task(scene)
    robot, options = task.scene.robot, task.options
    if options.grasped:
        robot = hovi.holding(robot, options.grasped)
    limits = hovi.as_limits(robot, options.limits)
    if known is not None and known["success"]:
        ends = [known["ends"]]
    else:
        start = _branches(task, robot, task.start, None)[0]
        ends = [[start, goal] for goal in _branches(task, robot, task.goal, start)]
    asked = []
    for start, goal in ends:
        q = np.asarray(start)
        here = np.asarray(robot.difference(robot.neutral(), q))
        lower, upper = limits.lower, limits.upper
        asked.append(
            {
                "scene": str(scene),
                "files": robot_files(scene),
                "seed": SEED,
                "seconds": PATH_SECONDS,
                "duration": task.duration,
                "stops": [list(map(float, start)), list(map(float, goal))],
                "lower": (lower[0] - here).tolist(),
                "upper": (upper[0] - here).tolist(),
                "v": upper[1].tolist(),
                "tau": np.where(np.isfinite(upper[3]), upper[3], 1e6).tolist(),
            }
        )
    return asked


def _branches(task: hovi.Task, robot: hovi.Robot, end: Any, near: Any) -> list[Any]:
    if isinstance(end, hovi.State):
        return [end.on(robot, "end")[0].tolist()]
    options = task.options
    given = {"obstacles": options.obstacles, "margin": options.margin}
    found = hovi.inverse_kinematics(
        robot, end, near=near, limits=options.limits, self_collision=options.self_collision, **given
    )
    return [q.tolist() for q in found[:BRANCHES]]


def peer(scene: Path, python: str, known: dict[str, Any] | None) -> dict[str, Any]:
    """The result of OMPL and TOPP-RA for one task."""
    script = Path(__file__).with_name("task_peer.py")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    answer: dict[str, Any] = {"success": False, "why": "no configuration at the goal"}
    try:
        asked = requests(scene, known)
    except hovi.HoviError as error:
        return answer | {"why": str(error)}
    for request in asked:
        done = subprocess.run(
            [python, str(script)],
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=PATH_SECONDS + GRACE,
            env=environment,
            check=False,
        )
        if done.returncode != 0:
            return {"success": False, "why": done.stderr.decode()[-400:]}
        answer = json.loads(done.stdout.decode().splitlines()[-1])
        if answer["success"]:
            break
    return answer


def in_its_own_process(words: list[str], limit: float) -> dict[str, Any]:
    """The result of this script for one task, or that its process ended without one."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-W", "ignore", __file__, *words]
    try:
        done = subprocess.run(
            command, capture_output=True, timeout=limit, env=environment, check=False
        )
    except subprocess.TimeoutExpired:
        return {"success": False, "status": "no answer", "why": "no answer", "message": ""}
    try:
        answer = json.loads(done.stdout.decode().splitlines()[-1])
        assert isinstance(answer, dict)
        return answer
    except (IndexError, ValueError):
        text = done.stderr.decode()[-400:]
        return {"success": False, "status": "crash", "why": "crash", "message": text}


def kept(file: Path, again: bool, words: list[str], limit: float) -> dict[str, Any]:
    """The result in a file, or else a new one, which is written there."""
    if not again and file.exists():
        return dict(json.loads(file.read_text()))
    print(" ".join(words), file=sys.stderr, flush=True)
    result = in_its_own_process(words, limit)
    draft = file.with_suffix(".new")
    draft.write_text(json.dumps(result))
    draft.replace(file)
    return result


def row(name: str, ours: dict[str, Any], theirs: dict[str, Any] | None) -> list[str]:
    """A row of the table."""
    cells = [f"`{name}`", _number(ours, "seconds", ".2f"), _number(ours, "setup", ".2f")]
    cells += [ours["status"], _number(ours, "cost", ".5g"), _number(ours, "effort", ".5g")]
    cells.append(_number(ours, "clearance", ".1f", 1e3))
    if theirs is None:
        return cells
    times = [theirs.get("path_seconds"), theirs.get("timing_seconds")]
    taken = sum(each for each in times if each is not None)
    cells += [
        f"{taken:.2f}",
        _number(theirs, "effort", ".5g"),
        _number(theirs, "clearance", ".1f", 1e3),
    ]
    return [*cells, "yes" if theirs["success"] else f"no: {theirs['why']}"]


def _number(result: dict[str, Any], key: str, form: str, scale: float = 1.0) -> str:
    value = result.get(key)
    return "" if value is None else format(value * scale, form)


def summary(results: dict[str, dict[str, Any]], peers: dict[str, dict[str, Any]]) -> str:
    """The figures of all tasks in a paragraph."""
    minima = [x for x in results.values() if x["success"]]
    fast = [x for x in minima if x["seconds"] <= 10.0]
    times = sorted(x.get("seconds", LIMIT) for x in results.values())
    near = [x["clearance"] / x["margin"] for x in minima]
    text = (
        f"{len(fast)} of {len(results)} tasks end in a minimum within 10 s each, {len(minima)} "
        f"within {LIMIT:.0f} s; the median time is {np.median(times):.2f} s. "
        f"The least clearance of a minimum is {min(near, default=np.nan):.3f} of the margin."
    )
    both = [
        (x["effort"], peers[k]["effort"])
        for k, x in results.items()
        if x["success"] and k in peers and peers[k]["success"]
    ]
    if both:
        ratios = [theirs / ours for ours, theirs in both]
        text += (
            f" OMPL and TOPP-RA find a motion for {sum(x['success'] for x in peers.values())} "
            f"tasks; where both do, its effort is {np.median(ratios):.1f} times hovi's in the "
            f"median, {min(ratios):.2f} to {max(ratios):.1f} times."
        )
    return text


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("words", nargs="*", help="parts of names of tasks")
    arguments.add_argument("--peer", help="the Python of an environment with ompl, toppra and pin")
    arguments.add_argument("--results", default=str(Path(tempfile.gettempdir()) / "hovi_tasks"))
    arguments.add_argument("--limit", type=float, default=LIMIT, help="of a plan, in [s]")
    arguments.add_argument("--again", action="store_true", help="forget the results of hovi")
    arguments.add_argument("--only-peer", action="store_true", help="leave hovi out")
    arguments.add_argument("--one", help=argparse.SUPPRESS)
    given = arguments.parse_args()
    folder = Path(given.results)
    folder.mkdir(parents=True, exist_ok=True)
    if given.one:
        scene = Path(given.one)
        file = folder / f"{scene.stem}.json"
        known = json.loads(file.read_text()) if file.exists() else None
        answer = peer(scene, given.peer, known) if given.peer else planned(scene, given.limit)
        print(json.dumps(answer))
        return
    compile_modules()
    results, peers, rows = {}, {}, []
    for scene in task_suite():
        name = f"{scene.parent.name}/{scene.stem}"
        if given.words and not any(word in name for word in given.words):
            continue
        words, place = ["--one", str(scene)], ["--results", str(folder)]
        place += ["--limit", str(given.limit)]
        if not given.only_peer:
            file = folder / f"{scene.stem}.json"
            results[name] = kept(file, given.again, [*words, *place], given.limit + GRACE)
        if given.peer:
            file = folder / f"{scene.stem}.peer.json"
            more = [*words, *place, "--peer", given.peer]
            peers[name] = kept(file, given.again, more, BRANCHES * (PATH_SECONDS + GRACE))
        ours = results.get(name, {"status": "", "success": False})
        rows.append(row(name, ours, peers.get(name)))
        print(" | ".join(rows[-1]), file=sys.stderr, flush=True)
    if results:
        print(summary(results, peers) + "\n")
    columns = ["task", "s", "set-up, s", "status", "cost", "effort", "clearance, mm"]
    if given.peer:
        columns += ["OMPL + TOPP-RA, s", "effort", "clearance, mm", "found"]
    print_table(columns, rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()

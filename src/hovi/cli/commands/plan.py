"""`hovi plan`: the least-torque motion of a scene file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from hovi.discrete.trajectory import Trajectory
    from hovi.planning.refinement.certificate import Certificate
    from hovi.planning.solver.solver import Solution
    from hovi.planning.task_file.task import Task

GUESSES = ("cubic", "minimum-jerk")
LIMITS = ("urdf", "none")
MOST_CERTIFIED = 2000
"""Intervals of the longest motion that is certified unasked."""


def plan(
    context: typer.Context,
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or a shipped scene's name."),
    ],
    scheme: Annotated[str | None, typer.Option(help="Instead of the scene's.")] = None,
    intervals: Annotated[int | None, typer.Option(help="Instead of the scene's.")] = None,
    starts: Annotated[int | None, typer.Option(help="How many guesses are tried.")] = None,
    limits: Annotated[
        str | None, typer.Option(metavar="urdf|none", help="Instead of the scene's.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of the random guesses.")] = None,
    time_limit: Annotated[
        str | None, typer.Option(metavar="SECONDS", help="Keep the best found by then.")
    ] = None,
    guess: Annotated[
        str, typer.Option(metavar="cubic|minimum-jerk|FILE.npz", help="The first guess.")
    ] = "cubic",
    out: Annotated[
        Path | None, typer.Option(metavar="F.npz", help="Where the motion is written.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    certificate: Annotated[
        bool, typer.Option(help="Say what is known of the plan: errors, energy, a replay.")
    ] = True,
    compile: Annotated[
        bool,
        typer.Option("--compile", help="Machine code for what CasADi evaluates; kept for later."),
    ] = False,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="1e-6|'0.1 mm'|'0.01 deg'",
            help="Largest error: of the cost, of the tip or of the joints; chooses the scheme.",
        ),
    ] = None,
) -> None:
    """Plan the least-torque motion of a scene.

    Exit code 0 for a minimum, 1 when none was found, 2 for bad input.
    """
    from hovi.cli.commands.files import check_output

    if out is not None:
        check_output(out, ".npz")
    task = _task(scene, _options(context.params), compile)
    raise typer.Exit(_plan(task, out, json, certificate))


def _options(flags: dict[str, Any]) -> dict[str, Any]:
    """What the flags say of the options of a plan. Raises InputError."""
    from hovi.cli.commands.durations import positive_seconds
    from hovi.errors import InputError, nearest
    from hovi.planning.search.option_fields import about
    from hovi.planning.search.options import PlanOptions

    said = {name: value for name, value in flags.items() if value is not None}
    given: dict[str, Any] = {name: said[name] for name in about(PlanOptions) if name in said}
    if "time_limit" in given:
        given["time_limit"] = positive_seconds("--time-limit", given["time_limit"])
    limits = given.get("limits", "none")
    if limits not in LIMITS:
        hint = nearest(limits, LIMITS)
        raise InputError(f"--limits {limits!r}: {hint} Others are given in the scene file.")
    return given | {"guess": _guess(given["guess"])} | _either(given)


def _either(given: dict[str, Any]) -> dict[str, Any]:
    """A grid that is named takes the place of the scene's tolerance; both together are refused."""
    from hovi.errors import InputError

    if "scheme" not in given and "intervals" not in given:
        return {}
    if "tolerance" in given:
        raise InputError("--tolerance chooses the scheme and the intervals: leave them out.")
    return {"tolerance": None}


def _task(scene: str, options: dict[str, Any], compile: bool) -> Task:
    import dataclasses

    from hovi.cli.commands.files import find_scene
    from hovi.planning.task_file.reading import load_task

    task = load_task(find_scene(scene)).with_options(**options)
    if not compile:
        return task
    return dataclasses.replace(task, scene=dataclasses.replace(task.scene, compile=True))


def _guess(guess: str) -> str | Trajectory:
    from hovi.cli.commands.files import load_trajectory
    from hovi.errors import InputError, nearest

    if guess in GUESSES:
        return guess
    if guess.endswith(".npz"):
        return load_trajectory(Path(guess))
    raise InputError(
        f"--guess {guess!r} is neither a guess nor a .npz file; {nearest(guess, GUESSES)}"
    )


def _plan(task: Task, out: Path | None, json: bool, certified: bool) -> int:
    """Plan, write, print; returns the exit code."""
    from hovi.cli.commands.progress import progress
    from hovi.cli.reports.plan import as_json, print_report
    from hovi.errors import TrajectoryFileError
    from hovi.planning.task_file.task_plan import plan_task

    with progress(quiet=json) as report:
        solution = plan_task(task, report)
    written, refused = out if solution.trajectory is not None else None, None
    if written is not None:
        try:
            solution.trajectory.save(written)
        except TrajectoryFileError as error:
            written, refused = None, error  # what was found is printed all the same
    certificate = _certificate(solution) if certified else None
    if json:
        print(as_json(solution, task, written, certificate))
    else:
        print_report(solution, task, written, certificate)
    if refused is not None:
        raise refused
    return 0 if solution.success else 1


def _certificate(solution: Solution) -> Certificate | None:
    """What can be said for a minimum in little time; None for what is none or too long."""
    from hovi.planning.refinement.certificate import certify

    problem = solution.problem
    if problem is None or not solution.success or problem.grid.intervals > MOST_CERTIFIED:
        return None
    try:
        return certify(solution, estimate=not (problem.limited or problem.constrained))
    except KeyboardInterrupt:  # the plan is told all the same
        return None

"""`hovi plan`: the least-torque motion of a scene file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from hovi.cli.reports.limit_margins import KnownMargins
    from hovi.discrete.trajectory import Trajectory
    from hovi.planning.refinement.certificate import Certificate
    from hovi.planning.solver.solver import Solution
    from hovi.planning.task_file.task import Task
    from hovi.system.deadline import Deadline
    from hovi.system.progress import Progress

GUESSES = ("cubic", "minimum-jerk")
MAX_CERTIFIED_INTERVALS = 2000
"""Largest number of intervals for which a certificate is computed."""
CERTIFICATE_SECONDS = 30.0
"""Time in [s] after which a certificate ends without the rest, if there is no time limit."""

MARGIN_SECONDS = 1.0
"""Time in [s] that the margins to limits and obstacles have in any case."""


def plan(
    context: typer.Context,
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or a shipped scene's name."),
    ],
    scheme: Annotated[str | None, typer.Option(help="Override the scene's.")] = None,
    intervals: Annotated[int | None, typer.Option(help="Override the scene's.")] = None,
    starts: Annotated[int | None, typer.Option(help="Number of initial guesses.")] = None,
    repeat: Annotated[
        int | None, typer.Option(help="How often the motion runs its cycle; override the scene's.")
    ] = None,
    limits: Annotated[
        str | None,
        typer.Option(
            metavar="urdf|soft|none|ARM|{v = '50 %'}",
            help="Override the scene's; ARM such as panda, ur5e; or a table as in a scene file.",
        ),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            metavar="effort|acceleration|jerk|time", help="Override the scene's: what is minimised."
        ),
    ] = None,
    smooth: Annotated[
        bool | None,
        typer.Option("--smooth/--no-smooth", help="Override the scene's: a cost on the jerk."),
    ] = None,
    self_collision: Annotated[
        bool | None,
        typer.Option(
            "--self-collision/--no-self-collision",
            help="Override the scene's: whether links keep apart.",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the random guesses.")] = None,
    time_limit: Annotated[
        str | None, typer.Option(metavar="SECONDS", help="Return the best motion found by then.")
    ] = None,
    guess: Annotated[
        str | None,
        typer.Option(metavar="cubic|minimum-jerk|FILE.npz", help="Override the scene's."),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="F.npz", help="Path of the motion.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="Print the certificate and the solver's numbers, too.")
    ] = False,
    certificate: Annotated[
        bool, typer.Option(help="Estimate errors, and simulate the planned torques.")
    ] = True,
    compile: Annotated[
        bool,
        typer.Option("--compile", help="Without effect, and to be removed.", hidden=True),
    ] = False,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="1e-6|'0.1 mm'|'0.01 deg'",
            help="Largest error of the cost, the tip or the joints; chooses the scheme.",
        ),
    ] = None,
) -> None:
    """Plan the least-torque motion of a scene.

    Exit code 0 for a minimum, 1 when none was found, 2 for invalid input.
    """
    from hovi.cli.arguments.files import check_output
    from hovi.system.progress import progress

    if out is not None:
        check_output(out, ".npz")
    options = _options(context.params)
    with progress(quiet=json, doing="reading the scene"):  # meshes may be divided into parts
        task = _task(scene, options, compile)
    raise typer.Exit(_plan(task, out, json, certificate, verbose))


def _options(flags: dict[str, Any]) -> dict[str, Any]:
    """The plan options given as flags. Raises InputError."""
    from hovi.cli.arguments.durations import positive_seconds
    from hovi.planning.search.option_fields import option_infos
    from hovi.planning.search.options import PlanOptions

    values = {name: value for name, value in flags.items() if value is not None}
    given: dict[str, Any] = {
        name: values[name] for name in option_infos(PlanOptions) if name in values
    }
    if "time_limit" in given:
        given["time_limit"] = positive_seconds("--time-limit", given["time_limit"])
    if "limits" in given:
        given["limits"] = _limits(given["limits"])
    if "guess" in given:
        given["guess"] = _guess(given["guess"])
    return given | _tolerance_override(given)


def _tolerance_override(given: dict[str, Any]) -> dict[str, Any]:
    """A grid given as flags overrides the scene's tolerance. Raises InputError for both."""
    from hovi.errors import InputError
    from hovi.planning.search.options import TOLERANCE_AND_SCHEME

    if "scheme" not in given and "intervals" not in given:
        return {}
    if "tolerance" in given:
        raise InputError(f"--{TOLERANCE_AND_SCHEME}")
    return {"tolerance": None}


def _task(scene: str, options: dict[str, Any], compile: bool) -> Task:
    import dataclasses

    from hovi.cli.arguments.files import find_scene
    from hovi.planning.obstacles.preparation import prepared_within
    from hovi.planning.task_file.reading import load_task

    with prepared_within(options.get("time_limit")):
        task = load_task(find_scene(scene)).with_options(**options)
    if not compile:
        return task
    return dataclasses.replace(task, scene=dataclasses.replace(task.scene, compile=True))


def _limits(given: str) -> str | dict[str, Any]:
    """The name of limits, or their table in TOML. Raises InputError."""
    import tomllib

    from hovi.errors import InputError, nearest
    from hovi.planning.problem.limits import NAMES

    if given in NAMES:
        return given
    if not given.lstrip().startswith("{"):
        raise InputError(
            f"--limits {given!r}: {nearest(given, NAMES)} Give other limits as a table such as "
            "\"{v = '50 %'}\", or in the scene file."
        )
    try:
        table = tomllib.loads(f"limits = {given.strip()}")
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"--limits {given!r} is no table in TOML, such as \"{{v = '50 %'}}\": {error}."
        ) from None
    return dict(table["limits"])


def _guess(guess: str) -> str | Trajectory:
    from hovi.cli.arguments.files import load_trajectory
    from hovi.errors import InputError, nearest

    if guess in GUESSES:
        return guess
    if guess.endswith(".npz"):
        return load_trajectory(Path(guess))
    raise InputError(
        f"--guess {guess!r} is neither a known guess nor a .npz file; {nearest(guess, GUESSES)}"
    )


def _plan(task: Task, out: Path | None, json: bool, certified: bool, verbose: bool) -> int:
    """Plan, write, print; returns the exit code. Where there is no motion, nothing is written."""
    from hovi.cli.reports.limit_margins import is_guess
    from hovi.cli.reports.plan import as_json, print_report
    from hovi.errors import TrajectoryFileError
    from hovi.planning.task_file.task_plan import plan_task
    from hovi.system.deadline import Deadline
    from hovi.system.progress import progress

    deadline = Deadline(task.options.time_limit_seconds)
    if not json:
        _note_assumptions(task)
    with progress(quiet=json) as report:
        solution = plan_task(task, report)
    written, save_error = None if is_guess(solution) else out, None
    if written is not None:
        try:
            solution.trajectory.save(written)
        except TrajectoryFileError as error:
            written, save_error = None, error  # the report is printed all the same
    with progress(quiet=json) as report:
        certificate = _certificate(solution, deadline, report) if certified else None
        margins = _margins(solution, deadline, report)
    try:
        if json:
            print(as_json(solution, task, written, margins, certificate))
        else:
            print_report(solution, task, written, margins, certificate, verbose)
            if out is not None and is_guess(solution):
                print("wrote nothing, as there is no motion")
    finally:  # also where nobody reads the report
        if save_error is not None:
            raise save_error
    return 0 if solution.success else 1


def _note_assumptions(task: Task) -> None:
    """Print what the plan assumes without being asked; see its message for more."""
    import sys
    from contextlib import suppress

    from hovi.planning.problem.presolve.assumptions import assumptions
    from hovi.planning.search.group import in_group

    scene, group = task.planned_scene, task.options.group
    noted = [task.note] if task.note else []
    if group is not None:
        scene, _, _ = in_group(scene, group, task.start, task.goal)
    with suppress(OSError):  # stderr may be closed
        for sentence in (*noted, *assumptions(scene, weighted=task.options.weight is not None)):
            print(f"note: {sentence}", file=sys.stderr, flush=True)


def _margins(solution: Solution, deadline: Deadline, report: Progress | None) -> KnownMargins:
    """The margins of the report, for which there is a second after the deadline, too."""
    from hovi.cli.reports.limit_margins import KnownMargins
    from hovi.system.deadline import Deadline

    if report is not None:
        report("margins to limits and obstacles", 1.0)
    left = deadline.seconds_left
    return KnownMargins.of(solution, Deadline(None if left is None else max(left, MARGIN_SECONDS)))


def _certificate(
    solution: Solution, deadline: Deadline, report: Progress | None
) -> Certificate | None:
    """The certificate of a minimum; None without a minimum or for too many intervals.

    It ends at the deadline, or after CERTIFICATE_SECONDS if there is none.
    """
    from hovi.planning.refinement.certificate import certify

    problem = solution.problem
    if problem is None or not solution.success or problem.grid.intervals > MAX_CERTIFIED_INTERVALS:
        return None
    left = deadline.seconds_left
    seconds = CERTIFICATE_SECONDS if left is None else left
    try:
        return certify(
            solution,
            estimate=not (problem.limited or problem.constrained),
            time_limit=seconds,
            progress=None if report is None else lambda name: report(f"certificate: {name}", 1.0),
        )
    except KeyboardInterrupt:  # the report is printed without it
        return None

"""`hovi accuracy`: the work-precision diagram of a scene on this machine."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from hovi.accuracy import Diagram, Peer


def accuracy(
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or a shipped scene's name."),
    ],
    budget: Annotated[
        float, typer.Option(metavar="SECONDS", help="Wall time of the whole measurement.")
    ] = 60.0,
    guess: Annotated[
        str, typer.Option(metavar="near|cubic", help="Initial guess of every solve.")
    ] = "near",
    clock: Annotated[
        str,
        typer.Option(
            metavar="processor|wall", help="Of all times; other load lengthens the wall's."
        ),
    ] = "processor",
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder for the figure, the CSV and the JSON."),
    ] = None,
    peer: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[=PYTHON]",
            help="Add a reference tool, run by the Python of its environment; repeatable.",
        ),
    ] = None,
    collocation: Annotated[
        bool, typer.Option("--collocation", help="Add collocation by CasADi and Ipopt.")
    ] = False,
    crocoddyl: Annotated[
        Path | None, typer.Option(metavar="PYTHON", help="Short for --peer crocoddyl=PYTHON.")
    ] = None,
    drake: Annotated[
        Path | None, typer.Option(metavar="PYTHON", help="Short for --peer drake=PYTHON.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Measure the work-precision diagram of a scene: error against time, scheme by scheme.

    Exit code 0, 1 when no reference motion was found, or 2 for invalid input.
    """
    from hovi.accuracy import work_precision
    from hovi.accuracy.tables import as_json
    from hovi.cli.arguments.files import find_scene
    from hovi.errors import InputError, UnmeasurableError
    from hovi.planning.task_file.reading import load_task
    from hovi.system.progress import progress

    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out {str(out)!r} is a file; name a folder.")
    with progress(quiet=json, doing="reading the scene"):
        task = load_task(find_scene(scene))
    shortcuts = {"crocoddyl": crocoddyl, "drake": drake}
    names = [*(peer or ()), *(["collocation"] if collocation else [])]
    names += [f"{name}={python}" for name, python in shortcuts.items() if python is not None]
    peers = _peers(names)
    try:
        with progress(quiet=json) as report:
            diagram = work_precision(
                task, guess=guess, budget=budget, clock=clock, peers=peers, progress=report
            )
    except UnmeasurableError as error:
        print(f"nothing was measured: {error}", file=sys.stderr)
        raise typer.Exit(1) from None
    written = [] if out is None else _write(diagram, out)
    if json:
        print(as_json(diagram))
        return
    _print(diagram)
    for path in written:
        print(f"wrote {path}")


def _peers(names: Sequence[str]) -> list[Peer]:
    """The methods of tools given as NAME or NAME=PYTHON."""
    from hovi.accuracy.peers.tools import tool_peers

    parts = [each.partition("=") for each in names]
    named = [(name, Path(python) if equals else None) for name, equals, python in parts]
    return [peer for name, python in named for peer in tool_peers(name, python)]


def _write(diagram: Diagram, folder: Path) -> list[Path]:
    """Write the figure, the runs as CSV and the diagram as JSON; returns their paths."""
    from hovi.accuracy.picture import plot_work_precision
    from hovi.accuracy.tables import as_csv, as_json
    from hovi.errors import InputError
    from hovi.system.files import make_folders, reason, whole_file

    stem = folder / f"{diagram.scene}_accuracy"
    texts = {stem.with_suffix(".csv"): as_csv(diagram), stem.with_suffix(".json"): as_json(diagram)}
    try:
        make_folders(folder)
        for path, text in texts.items():
            with whole_file(path) as stream:
                stream.write(text.encode())
    except OSError as error:
        raise InputError(f"cannot write to {str(folder)!r}: {reason(error)}.") from error
    picture = stem.with_suffix(".png")
    plot_work_precision(diagram, picture)
    return [picture, *texts]


def _print(diagram: Diagram) -> None:
    """Print the reference, the fastest run per tolerance, and notes."""
    from hovi.accuracy.measures import shown_sizes
    from hovi.accuracy.tables import COLUMNS, cheapest_rows
    from hovi.cli.reports.terminal_table import print_table
    from hovi.robot.tip_frame import names_in_words

    resolved = diagram.resolved
    errors = shown_sizes(resolved.uncertainty)
    print(
        f"{diagram.scene}: {len(diagram.runs)} runs in {diagram.seconds:.0f} s; reference: "
        f"{resolved.scheme} on {resolved.intervals} intervals, cost {resolved.cost:.12g}, "
        f"accurate to {errors['cost']:.0e} relative, {errors['joints']:.0e} rad, "
        f"{errors['tip']:.0e} mm at the tip, {names_in_words(resolved.tip_frames)}."
    )
    texts = [i for i, column in enumerate(COLUMNS) if column == "method"]
    print_table(
        COLUMNS,
        cheapest_rows(diagram),
        f"fastest run per tolerance, in {diagram.clock} time",
        texts,
    )
    for note in diagram.notes:
        print(f"note: {note}")
    if not diagram.complete:
        print("note: the budget ended before every scheme reached rounding accuracy.")

"""`hovi accuracy`: what each further digit costs on a scene, on this machine."""

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
        float, typer.Option(metavar="SECONDS", help="Wall time for everything.")
    ] = 60.0,
    guess: Annotated[
        str, typer.Option(metavar="near|cubic", help="Where every solve starts.")
    ] = "near",
    clock: Annotated[
        str,
        typer.Option(
            metavar="wall|processor", help="processor on a machine that is busy with other work."
        ),
    ] = "wall",
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where the picture, the CSV and the JSON go."),
    ] = None,
    peer: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[=PYTHON]",
            help="A reference tool as well, from the Python of its environment; repeat for more.",
        ),
    ] = None,
    collocation: Annotated[
        bool, typer.Option("--collocation", help="Collocation by CasADi and Ipopt as well.")
    ] = False,
    crocoddyl: Annotated[
        Path | None, typer.Option(metavar="PYTHON", help="The same as --peer crocoddyl=PYTHON.")
    ] = None,
    drake: Annotated[
        Path | None, typer.Option(metavar="PYTHON", help="The same as --peer drake=PYTHON.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Draw the work-precision diagram of a scene: errors against time, scheme by scheme.

    Exit code 0 when it was measured, 1 when no motion was found to measure against, 2 for bad
    input.
    """
    from hovi.accuracy import work_precision
    from hovi.accuracy.tables import as_json
    from hovi.cli.commands.files import find_scene
    from hovi.cli.commands.progress import progress
    from hovi.errors import InputError, UnmeasurableError
    from hovi.planning.task_file.reading import load_task

    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out {str(out)!r} is a file; name a folder.")
    task = load_task(find_scene(scene))
    short = {"crocoddyl": crocoddyl, "drake": drake}
    asked = [*(peer or ()), *(["collocation"] if collocation else [])]
    asked += [f"{name}={python}" for name, python in short.items() if python is not None]
    peers = _peers(asked)
    try:
        with progress(quiet=json) as report:
            diagram = work_precision(
                task, guess=guess, budget=budget, clock=clock, peers=peers, progress=report
            )
    except UnmeasurableError as nothing:
        print(f"nothing was measured: {nothing}", file=sys.stderr)
        raise typer.Exit(1) from None
    written = [] if out is None else _write(diagram, out)
    if json:
        print(as_json(diagram))
        return
    _print(diagram)
    for path in written:
        print(f"wrote {path}")


def _peers(asked: Sequence[str]) -> list[Peer]:
    """The methods of the tools that were asked for, each as NAME or NAME=PYTHON."""
    from hovi.accuracy.peers.tools import tool_peers

    parts = [each.partition("=") for each in asked]
    named = [(name, Path(python) if equals else None) for name, equals, python in parts]
    return [peer for name, python in named for peer in tool_peers(name, python)]


def _write(diagram: Diagram, folder: Path) -> list[Path]:
    """The picture, every run as CSV, and all of it as JSON."""
    from hovi.accuracy.picture import plot_work_precision
    from hovi.accuracy.tables import as_csv, as_json
    from hovi.errors import InputError
    from hovi.system.files import reason, whole_file

    stem = folder / f"{diagram.scene}_accuracy"
    texts = {stem.with_suffix(".csv"): as_csv(diagram), stem.with_suffix(".json"): as_json(diagram)}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in texts.items():
            with whole_file(path) as stream:
                stream.write(text.encode())
    except OSError as refused:
        raise InputError(f"cannot write to {str(folder)!r}: {reason(refused)}.") from refused
    picture = stem.with_suffix(".png")
    plot_work_precision(diagram, picture)
    return [picture, *texts]


def _print(diagram: Diagram) -> None:
    """The cheapest run for each error of the cost, and what to know about it."""
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table

    from hovi.accuracy.measures import shown_sizes
    from hovi.accuracy.tables import COLUMNS, cheapest_rows

    resolved = diagram.resolved
    unsure = shown_sizes(resolved.uncertainty)
    print(
        f"{diagram.scene}: {len(diagram.runs)} runs in {diagram.seconds:.0f} s, measured against "
        f"{resolved.scheme} on {resolved.intervals} intervals: cost {resolved.cost:.12g}, known to "
        f"{unsure['cost']:.0e} relative, {unsure['joints']:.0e} rad, {unsure['tip']:.0e} mm."
    )
    table = Table(box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0), title="the cheapest run")
    for column in COLUMNS:
        table.add_column(column, justify="left" if column == "method" else "right")
    for row in cheapest_rows(diagram):
        table.add_row(*row)
    Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else 120).print(table)
    for note in diagram.notes:
        print(f"note: {note}")
    if not diagram.complete:
        print("note: the budget ended before every scheme was as exact as rounding lets it be.")

"""`hovi study`: many plans of one scene, and what they show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from hovi.cli.arguments.robots import PackageDirs

RUN = "run"
"""The subcommand that a study file stands for."""


class StudyGroup(TyperGroup):
    """`hovi study STUDY.toml` is `hovi study run STUDY.toml`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the subcommand where the first argument is none."""
        if args and args[0] not in self.commands and args[0] != "--help":
            args.insert(0, RUN)
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=StudyGroup,
    no_args_is_help=True,
    help="Plan a scene with fields that vary: hovi study STUDY.toml --out FOLDER.",
)


@app.command(RUN)
def run(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="A study file.")],
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Where the tables go; continued if begun.")
    ],
    workers: Annotated[
        int | None, typer.Option(help="Worker processes; all processors by default.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT|local", help="A Dask scheduler to plan with."),
    ] = None,
    sample: Annotated[
        int | None, typer.Option(help="Samples of each motion, in samples.parquet.")
    ] = None,
    sample_format: Annotated[
        str | None,
        typer.Option(metavar="parquet|zarr", help="Of the samples; zarr is samples.zarr.zip."),
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Continue there whatever the folder holds.")
    ] = False,
) -> None:
    """Plan what is missing of a study. Start it again to resume it.

    Exit code 0 when all plans are done, whatever their status; 1 when some were given up; 130
    after Ctrl-C; 2 for invalid input.
    """
    import dataclasses
    import sys

    from hovi.cli.reports.study import Reported, print_ending
    from hovi.planning.search.multistart import default_processes
    from hovi.study.study import Study

    given = {"samples": sample, "sample_format": sample_format}
    changes: dict[str, Any] = {name: each for name, each in given.items() if each is not None}
    chosen = dataclasses.replace(Study.read(study), **changes)
    if note := chosen.note:
        print(f"note: {note}", file=sys.stderr, flush=True)
    with Reported() as reported:
        report = chosen.run(
            out,
            default_processes() if workers is None else workers,
            scheduler=scheduler,
            replace=replace,
            progress=reported.take,
        )
    raise typer.Exit(print_ending(report, out))


@app.command("show")
def show(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of a study.")],
    histograms: Annotated[
        Path | None, typer.Option(metavar="F.png", help="Write histograms; .png, .pdf or .svg.")
    ] = None,
    against: Annotated[
        str | None, typer.Option(metavar="PARAMETER", help="Draw the value against a parameter.")
    ] = None,
    over: Annotated[
        str | None,
        typer.Option(metavar="X,Y", help="The parameters of the map; the first two that vary."),
    ] = None,
    value: Annotated[str, typer.Option(metavar="COLUMN", help="What is drawn.")] = "cost",
    picture: Annotated[
        Path | None,
        typer.Option("--map", metavar="F.png", help="Write a map, or the value against PARAMETER."),
    ] = None,
    worst: Annotated[
        Path | None, typer.Option(metavar="F.html", help="Write a page with the worst ten motions.")
    ] = None,
    package_dir: PackageDirs = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Print how the plans of a study ended, and draw them."""
    from hovi.cli.arguments.files import check_output
    from hovi.cli.reports.study import print_summary
    from hovi.study.showing.charts import draw_against, draw_histograms, draw_map
    from hovi.study.showing.plans import Plans
    from hovi.study.showing.summary import summary
    from hovi.study.worst_page import write_worst

    for path in (histograms, picture):
        if path is not None:
            check_output(path, ".png", ".pdf", ".svg")
    if worst is not None:
        check_output(worst, ".html")
    parameters = _pair(over)
    plans = Plans.read(folder)
    print_summary(summary(plans), json)
    if histograms is not None:
        draw_histograms(plans, histograms)
    if picture is not None and against is not None:
        draw_against(plans, against, picture, value)
    elif picture is not None:
        draw_map(plans, picture, parameters, value)
    if worst is not None:
        write_worst(plans, worst, package_dirs=package_dir or ())
    if not json:
        for path in (histograms, picture, worst):
            if path is not None:
                print(f"wrote    {path}")


@app.command("state")
def state(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of a study.")],
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Print how far a study is, while it runs or after it ended; its folder is only read."""
    from hovi.cli.reports.study import print_state
    from hovi.study.showing.state import StudyState

    print_state(StudyState.read(folder), json)


@app.command("motion")
def motion(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of a study.")],
    cell: Annotated[int, typer.Argument(metavar="CELL", help="The number of the cell.")],
    out: Annotated[Path, typer.Option(metavar="F.npz", help="Path of the motion.")],
    package_dir: PackageDirs = None,
) -> None:
    """Write the motion of one cell to a file, such as for hovi replay."""
    from hovi.cli.arguments.files import check_output
    from hovi.errors import InputError
    from hovi.study.showing.plans import Plans
    from hovi.study.study import Study

    check_output(out, ".npz")
    plans = Plans.read(folder)
    if not plans.finished:
        raise InputError(f"the cells of {folder} are numbered when its run has ended.")
    if cell not in plans.columns["cell"]:
        raise InputError(f"the study in {folder} has no plan of cell {cell}.")
    key = plans.columns["key"][plans.columns["cell"].index(cell)]
    Study.motion(folder, key, package_dir or ()).save(out)
    print(f"wrote    {out}")


def _pair(text: str | None) -> tuple[str, str] | None:
    from hovi.errors import InputError

    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2:
        raise InputError(f"--over takes two parameters with a comma between them, got {text!r}.")
    return names[0], names[1]

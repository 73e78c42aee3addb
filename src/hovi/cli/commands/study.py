"""`hovi study`: many plans of one scene, and what they show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

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
        int | None, typer.Option(help="Samples of each motion for samples.parquet.")
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

    from hovi.cli.reports.study import Told, print_ending
    from hovi.planning.search.multistart import default_processes
    from hovi.study.study import Study

    chosen = Study.read(study)
    if sample is not None:
        chosen = dataclasses.replace(chosen, samples=sample)
    with Told() as told:
        report = chosen.run(
            out,
            workers or default_processes(),
            scheduler=scheduler,
            replace=replace,
            progress=told.take,
        )
    raise typer.Exit(print_ending(report, out))

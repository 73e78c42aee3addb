"""The commands of `hovi`, put together."""

from __future__ import annotations

from typing import Annotated

import typer

from hovi import __version__
from hovi.cli.commands import accuracy as accuracy_command
from hovi.cli.commands import effects as effects_command
from hovi.cli.commands import export as export_command
from hovi.cli.commands import info as info_command
from hovi.cli.commands import plan as plan_command
from hovi.cli.commands import plot as plot_command
from hovi.cli.commands import replay as replay_command
from hovi.cli.commands import schema as schema_command
from hovi.cli.commands import simulate as simulate_command

app = typer.Typer(
    help="Least-torque motions of URDF robots by higher-order variational integrators.",
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"hovi {__version__}")
        raise typer.Exit


@app.callback()
def _hovi(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    pass


app.command("plan")(plan_command.plan)
app.command("accuracy")(accuracy_command.accuracy)
app.command("simulate")(simulate_command.simulate)
app.command("effects")(effects_command.effects)
app.command("replay")(replay_command.replay)
app.command("plot")(plot_command.plot)
app.command("export")(export_command.export)
app.command("schema")(schema_command.schema)
app.command("info")(info_command.info)

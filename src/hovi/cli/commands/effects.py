"""`hovi effects`: the influence of single effects on a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from hovi.accuracy.effect_study.study import EffectStudy


def effects(
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or a shipped scene's name."),
    ],
    candidates: Annotated[
        str | None,
        typer.Option(
            "--with",
            metavar="RICH.toml",
            help="A scene with candidate effects; default: typical ones.",
        ),
    ] = None,
    time_limit: Annotated[
        str | None,
        typer.Option(metavar="SECONDS", help="For the whole study."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="PNG", help="Path of the figure (or .pdf, .svg).")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Add each candidate effect alone to a scene, and tabulate the changes and evaluation times.

    Effects of the scene are removed instead. Ctrl-C ends the study with the trials so far. Exit
    code 0, 1 when candidates failed or are left untried, or 2 for invalid input.
    """
    from hovi.accuracy.effect_study.study import study_effects
    from hovi.accuracy.effect_study.tables import plot_study, study_json
    from hovi.cli.arguments.durations import positive_seconds
    from hovi.cli.arguments.files import check_output, find_scene
    from hovi.planning.task_file.reading import load_task
    from hovi.system.progress import progress

    limit = None if time_limit is None else positive_seconds("--time-limit", time_limit)
    if out is not None:
        check_output(out, ".png", ".pdf", ".svg")
    with progress(quiet=json, doing="reading the scene"):
        task = load_task(find_scene(scene))
        effects = None if candidates is None else load_task(find_scene(candidates)).scene.effects
    with progress(quiet=json) as report:
        study = study_effects(task, effects, report, limit)
    if out is not None:
        plot_study(study, out)
    if json:
        print(study_json(study))
    else:
        _print(study)
        if out is not None:
            print(f"wrote {out}")
    raise typer.Exit(1 if study.untried or study.failed else 0)


def _print(study: EffectStudy) -> None:
    from hovi.accuracy.effect_study.tables import COLUMNS, study_note, study_rows
    from hovi.cli.reports.terminal_table import print_table

    texts = [i for i, column in enumerate(COLUMNS) if column == "effect"]
    print_table(COLUMNS, study_rows(study), study.task.name, texts)
    for trial in study.trials:
        print(f"{'+' if trial.added else '-'} {trial.effect.describe()}")
    print(study_note(study))
    for each in study.failed:
        print(f"! {each.effect.key} failed: {each.reason}")
    if study.untried:
        print(f"not tried: {', '.join(effect.key for effect in study.untried)}")

"""The influence of effects on panda_reach and ur5_reach: tables and figures of `hovi effects`."""

from __future__ import annotations

import sys
from pathlib import Path

from measuring import print_machine, print_table

import hovi
from hovi.accuracy.effect_study.study import study_effects
from hovi.accuracy.effect_study.tables import COLUMNS, plot_study, study_rows

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"


def main() -> None:
    for name in ("panda_reach", "ur5_reach"):
        print(name, file=sys.stderr, flush=True)
        study = study_effects(hovi.load_task(hovi.example(name)))
        print(f"**{name}**\n")
        print_table(COLUMNS, study_rows(study))
        for trial in study.trials:
            print(f"- {trial.effect.describe()}")
        print()
        plot_study(study, IMAGES / f"{name}_effects.png")
    print_machine()


if __name__ == "__main__":
    main()

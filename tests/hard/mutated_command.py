"""`hovi plan` on mutated scenes and with mutated options: a report, or one sentence.

The command runs in this process. It must exit with 0 or 1 and a report whose lines are those that
the options ask for, or with 2 and one line that begins with "error:".
"""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from random import Random
from typing import Any

from hard.mutated_bytes import mutated_bytes
from hard.mutated_robots import placed
from hard.mutated_scene import TOKENS, changed
from hard.verdict import Mutant, Verdict, judge
from hovi.cli.application import BAD_INPUT, main
from hovi.errors import InputError
from hovi.robot.bundled_models import example

VALUES = {
    "--scheme": ("galerkin-2", "taylor-midpoint", "hermite-simpson", "galerkin-0", "cubic", ""),
    "--intervals": ("1", "2", "16", "33", "0", "-1", "x", "1e3", "9" * 400),
    "--limits": ("urdf", "none", "panda", "ur5e", "", "nan", "a" * 300),
    "--seed": ("0", "-1", "x", "9" * 400),
    "--guess": ("cubic", "minimum-jerk", "no.npz", "scene.toml", "", "no\0.npz"),
    "--tolerance": ("1e-3", "0.1 mm", "0.01 deg", "0", "-1 mm", "nan", "x", "1e-300"),
    "--time-limit": ("1", "0.5 s", "0", "-1", "nan", "1e999", "x", ""),
    "--starts": ("1", "0", "-1", "x"),
    "--out": ("motion.npz", "motion.txt", "no/motion.npz", "", "no\0.npz"),
}
FLAGS = ("--json", "--no-certificate", "--certificate", "--smooth", "--no-smooth", "--quiet")
BOUNDS = {"--intervals": "16", "--starts": "1", "--time-limit": "1 s"}
"""Options that keep a run short, where the input has no others."""
SMALL = ("two_link_reach", "two_link_elbow_limited", "two_link_pick", "cart_pole_swing_up")
VERBOSE = ("effort", "n_neg", "nit")
"""Lines that a verbose report of a motion has."""


def mutate(random: Random) -> Mutant:
    """A line with options, as JSON, and a scene below it: as it is, or changed."""
    options = ["--verbose"] if random.random() < 0.8 else []
    for name in random.sample([*VALUES], random.choice((0, 0, 1, 1, 2))):
        options += [name, random.choice(VALUES[name])]
    if random.random() < 0.4:
        options.append(random.choice(FLAGS))
    text, kind = example(f"{random.choice(SMALL)}.toml").read_bytes(), random.random()
    if kind < 0.1:
        text = mutated_bytes(text, random, TOKENS)
    elif kind < 0.6:
        text = changed(text.decode(), random, count=1 if kind < 0.4 else 3)
    return Mutant(json.dumps(options).encode() + b"\n" + text)


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Run the command. Bytes without a line of options are nothing to judge, and refused."""
    head, _, scene = mutant.content.partition(b"\n")
    try:
        options = json.loads(head)
    except (ValueError, RecursionError):
        options = None
    if not isinstance(options, list) or not all(isinstance(each, str) for each in options):
        return Verdict.REFUSED, "not a command"
    path = placed(scene, folder)
    bounds = [x for name, value in BOUNDS.items() if name not in options for x in (name, value)]
    if "--tolerance" in options and "--intervals" not in options:
        bounds = bounds[2:]  # it chooses the grid
    arguments = ["plan", str(path), *bounds, *options]
    return judge(lambda: run(arguments, folder), lambda done: error_in(*done, options), "")


def run(arguments: list[str], folder: Path) -> tuple[int, str]:
    """Run the command line; returns its exit code and what it printed to stdout.

    Raises InputError with the sentence that it printed where the exit code is that of bad input.
    """
    out, err = io.StringIO(), io.StringIO()
    inside, printed = contextlib.chdir(folder), contextlib.redirect_stdout(out)
    with inside, printed, contextlib.redirect_stderr(err):
        code = main(arguments)
    lines = [line for line in err.getvalue().splitlines() if line.startswith("error: ")]
    if code == BAD_INPUT:
        raise InputError("\n".join(lines).removeprefix("error: "))
    return code, out.getvalue()


def error_in(code: int, text: str, options: list[str]) -> str:
    """The error in an exit code and a report; "" if there is none."""
    if code not in (0, 1):
        return f"it ended with {code}"
    if "--json" in options:
        found: dict[str, Any] = json.loads(text)
        return "" if (found["status"] == "minimum") == (code == 0) else "its status is another"
    labels = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    if not {"status", "message"} <= labels.keys():
        return "its report has no status or no message"
    if ("minimum" in labels["status"].split()) != (code == 0):
        return "its exit code is not that of its status"
    wanted = "--verbose" in options and "cost" in labels  # a mere guess has no numbers
    if any((label in labels) != wanted for label in VERBOSE[1:]):
        return f"the numbers of the solver are {'missing' if wanted else 'printed unasked'}"
    return "it has no effort" if wanted and VERBOSE[0] not in labels else ""

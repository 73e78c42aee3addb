"""Motions of many problems, as recorded: does a change of the method move any of them?

Status, steps, kernel points and cost of each problem of the corpus (rules_corpus.py) whose numbers
hardly depend on rounding: those of starts moved by 1e-9 of the ranges agree.

    python recorded_motions.py            # what differs from the record (one minute)
    python recorded_motions.py --write    # the record anew (six minutes), and what differs

tests/claims/test_recorded_motions.py compares each of them. A change that is meant to move them is
recorded anew in the same commit; the sums that are printed belong into its message.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

from measuring import print_table
from rules import solved
from rules_corpus import PROBLEMS

Motion = dict[str, str | int | float]

RECORD = Path(__file__).resolve().parents[2] / "tests" / "data" / "recorded_motions.json"
NUDGES = range(4)
"""Starts that have to agree; 0 is the one that is recorded."""
MOST_SECONDS = 1.3
"""Processor time of a problem above which it is left out, in [s]."""
STEPS_SPREAD, COST_SPREAD = 0.05, 1e-5
"""Relative spreads of steps and costs above which it is left out."""
ROOM = 0.01
"""Relative difference of steps and points beyond the spread that is none, and one step."""
COST_ROOM, ZERO = 1e-9, 1e-12
"""The same of costs, relative, and the absolute cost that is none."""


def measured(name: str, nudge: int = 0, most: float = math.inf) -> Motion:
    """What the plan of a problem takes and gives. most: kernel points after which it is ended."""
    status, steps, cost, points = solved(name, nudge, most)
    return {"status": status, "steps": steps, "points": points, "cost": cost}


def recorded(name: str) -> Motion | None:
    """The record of a problem with the spreads of its numbers; None where it takes long or varies.

    Spreads are the largest differences from the recorded start.
    """
    begin = time.process_time()
    first = measured(name)
    if time.process_time() - begin > MOST_SECONDS:
        return None
    others = [measured(name, nudge) for nudge in NUDGES[1:]]
    if any(each["status"] != first["status"] for each in others):
        return None
    spread = {
        f"{what} spread": max(abs(each[what] - first[what]) for each in others)
        for what in ("steps", "points", "cost")
    }
    if spread["steps spread"] > 1 + STEPS_SPREAD * first["steps"]:
        return None
    if spread["cost spread"] > COST_SPREAD * abs(first["cost"]) + ZERO:
        return None
    return first | spread


def difference(now: Motion, record: Motion) -> str:
    """What of a motion is not as recorded, a clause; "" if all is."""
    if now["status"] != record["status"]:
        return f"{now['status']} instead of {record['status']}"
    for what, extra in (("steps", 1), ("points", 0)):
        room = record[f"{what} spread"] + ROOM * record[what] + extra
        if abs(now[what] - record[what]) > room:
            return f"{now[what]} {what} instead of {record[what]} +- {room:.0f}"
    room = 2.0 * record["cost spread"] + COST_ROOM * abs(record["cost"]) + ZERO
    if abs(now["cost"] - record["cost"]) > room:
        return f"cost {now['cost']:.10g} instead of {record['cost']:.10g} +- {room:.1e}"
    return ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="record all motions anew")
    write = parser.parse_args().write
    before = json.loads(RECORD.read_text()) if RECORD.exists() else {}
    now = {name: recorded(name) for name in PROBLEMS} if write else dict.fromkeys(before)
    rows, sums = [], dict.fromkeys(("steps", "points"), (0, 0))
    for name, record in before.items():
        motion = now[name] or measured(name)
        said = difference(motion, record)
        rows += [[name, said]] if said else []
        sums = {what: (a + record[what], b + motion[what]) for what, (a, b) in sums.items()}
    print_table(["problem", "now"], rows)
    for what, (a, b) in sums.items():
        print(f"{what}: {b} for {a}")
    if write:
        kept = {name: record for name, record in now.items() if record is not None}
        lines = ",\n".join(f"{json.dumps(n)}: {json.dumps(record)}" for n, record in kept.items())
        RECORD.write_text(f"{{\n{lines}\n}}\n")
        print(f"{len(kept)} of {len(PROBLEMS)} problems recorded in {RECORD.name}")


if __name__ == "__main__":
    main()

"""The rules of the stack that solves, turned off one at a time and in groups: which earn a place?

Steps, successes, costs and kernel points of a corpus of problems that are planned through hovi's
public names (rules_corpus.py). First the noise: the corpus from starts moved by 1e-9 of the ranges;
only what goes beyond that spread is an effect. A rule is turned off on those problems alone on
which it was ever reached, that is, on which its expression ever had another value than what takes
its place: on all others it changes nothing. Everything is deterministic, whatever else runs.

    python rules.py [NAME ...]              # the screening corpus, 15 s; some rules, or all of them
    python rules.py --full --store FILE     # the full corpus; FILE keeps what was measured
    python rules.py --full --store FILE --known    # the tables of that alone

Who adds a rule adds its row to rules_list.py; tests/test_rules.py resolves all switches.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from itertools import combinations
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from measuring import machine, print_table
from rules_corpus import PROBLEMS, SCREENING
from rules_list import NOTICED, RULES, Rule
from switches import replaced, watched
from threadpoolctl import threadpool_limits

import hovi
from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel

NUDGES = range(1, 6)
"""Starts of the noise."""
MOST_POINTS, FIRST_POINTS = 20, 200_000
"""Kernel points after which a problem is ended as by Ctrl-C: per point with all rules, and more."""
Result = tuple[str, int, float, int]
"""Status, steps, cost and full evaluations of a point by the kernel of torques."""


class Points:
    """Counts full evaluations of points; ends a plan that takes too many."""

    def __init__(self, most: float = math.inf) -> None:
        self.most, self.count = most, 0

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Within it points are counted."""
        expand = InverseDynamicsKernel.expand

        def counting(kernel: InverseDynamicsKernel, q: np.ndarray, *others: object) -> object:
            self.count += len(q)
            if self.count > self.most:
                raise KeyboardInterrupt
            return expand(kernel, q, *others)

        InverseDynamicsKernel.expand = counting
        try:
            yield
        finally:
            InverseDynamicsKernel.expand = expand


def solved(name: str, nudge: int = 0, most: float = math.inf) -> Result:
    """What the plan of a problem takes and gives. most: number of points."""
    points = Points(most)
    with warnings.catch_warnings(), points.counted(), threadpool_limits(1):
        warnings.simplefilter("ignore")
        try:
            found = PROBLEMS[name](nudge)
            status = str(found.status) if found.success else f"no: {found.status}"
            result = status, int(found.nit), float(found.cost)
        except (hovi.HoviError, ArithmeticError, ValueError, KeyboardInterrupt) as error:
            result = f"no: {type(error).__name__}", 0, math.nan
    return *result, int(points.count)


def with_all(name: str) -> tuple[Result, dict[str, int]]:
    """A problem with all rules, and how often those that were reached were."""
    edits = [(rule.name, edit) for rule in RULES for edit in rule.edits]
    with watched(edit for _, edit in edits) as counts:
        found = solved(name)
    sums: dict[str, int] = {}
    for (rule, _), count in zip(edits, counts, strict=True):
        sums[rule] = sums.get(rule, 0) + int(count)
    return found, {rule: count for rule, count in sums.items() if count > 0}


def without(off: Sequence[str], name: str, most: float) -> Result:
    """A problem without some rules, by their names."""
    edits = [edit for rule in RULES if rule.name in off for edit in rule.edits]
    with replaced(edits):
        return solved(name, most=most)


class Measured:
    """What was measured, by job; a file keeps it from run to run.

    path: of the file; None for none. processes: that measure at a time; 0 to measure nothing.
    """

    def __init__(self, path: Path | None, processes: int) -> None:
        self.path, self.processes = path, processes
        self.known = json.loads(path.read_text()) if path is not None and path.exists() else {}

    def add(self, jobs: dict[str, partial]) -> None:
        """Run the jobs that are not known, by their keys."""
        left = {key: job for key, job in jobs.items() if key not in self.known}
        if self.processes == 0:
            return
        for number, (key, found) in enumerate(self._results(left), 1):
            self.known[key] = found
            if number % 20 == 0:
                print(f"{number} of {len(left)} plans", file=sys.stderr, flush=True)
                self._keep()
        self._keep()

    def _results(self, jobs: dict[str, partial]) -> Iterator[tuple[str, object]]:
        if self.processes == 1:
            yield from ((key, job()) for key, job in jobs.items())
        else:
            with ProcessPoolExecutor(self.processes, mp_context=get_context("spawn")) as pool:
                running = {key: pool.submit(job) for key, job in jobs.items()}
                yield from ((key, future.result()) for key, future in running.items())

    def _keep(self) -> None:
        if self.path is not None:
            self.path.write_text(json.dumps(self.known))


class Corpus:
    """A corpus with its noise. names: of its problems."""

    def __init__(self, names: Sequence[str], measured: Measured) -> None:
        measured.add({f"with all/{n}": partial(with_all, n) for n in names})
        measured.add({f"nudged {i}/{n}": partial(solved, n, i) for i in NUDGES for n in names})
        self.measured, last = measured, f"nudged {max(NUDGES)}"
        self.names = [n for n in names if f"{last}/{n}" in measured.known]

    def all_on(self, name: str) -> Result:
        """A problem with all rules."""
        return tuple(self.measured.known[f"with all/{name}"][0])

    def noise(self, name: str) -> list[Result]:
        """The same from other starts."""
        return [tuple(self.measured.known[f"nudged {i}/{name}"]) for i in NUDGES]

    def reached(self, off: Sequence[str]) -> dict[str, int]:
        """How often rules were reached, by problem, where they were."""
        counts = {n: self.measured.known[f"with all/{n}"][1] for n in self.names}
        sums = {n: sum(each.get(rule, 0) for rule in off) for n, each in counts.items()}
        return {n: count for n, count in sums.items() if count > 0}

    def measure(self, groups: Sequence[Sequence[str]]) -> None:
        """Turn groups of rules off, on the problems that reach one of them."""
        jobs = {}
        for off in groups:
            for name in self.reached(off):
                most = FIRST_POINTS + MOST_POINTS * self.all_on(name)[3]
                jobs[f"without {' + '.join(off)}/{name}"] = partial(without, off, name, most)
        self.measured.add(jobs)

    def known_groups(self) -> list[list[str]]:
        """The groups that were turned off."""
        keys = [key.removeprefix("without ") for key in self.measured.known if " + " in key]
        return [names.split(" + ") for names in dict.fromkeys(key.split("/")[0] for key in keys)]

    def effect(self, off: Sequence[str]) -> Effect:
        """The effect of rules that were turned off together."""
        known, key = self.measured.known, f"without {' + '.join(off)}"
        names = [n for n in self.reached(off) if f"{key}/{n}" in known]
        return Effect(self, names, {n: tuple(known[f"{key}/{n}"]) for n in names})


class Effect:
    """What the problems that reach some rules take and give without them.

    names: of the problems. found: their results.
    """

    def __init__(self, corpus: Corpus, names: list[str], found: dict[str, Result]) -> None:
        self.corpus, self.names, self.found = corpus, names, found
        self.before = {n: corpus.all_on(n) for n in names}
        known = {n: [self.before[n], *corpus.noise(n)] for n in names}
        self.changed = [n for n in names if _differs(found[n], self.before[n])]
        self.lost = [n for n in names if _fails(found[n]) and not any(map(_fails, known[n]))]
        self.gained = [n for n in names if not _fails(found[n]) and all(map(_fails, known[n]))]
        both = [n for n in names if not (_fails(found[n]) or any(map(_fails, known[n])))]
        self.dearer, self.cheaper = _by_cost(both, found, known)
        self.steps, self.steps_noise = _ratios(both, found, known, 1)
        self.points, self.points_noise = _ratios(both, found, known, 3)

    @property
    def known(self) -> str:
        """How many problems changed, of all that were measured."""
        return f"{len(self.changed)} of {len(self.names)}"

    @property
    def beyond_noise(self) -> bool:
        """Whether any of it is more than starts moved by 1e-9 do."""
        figures = (self.steps, self.steps_noise), (self.points, self.points_noise)
        spread = any(not min(noise) <= ratio <= max(noise) for ratio, noise in figures)
        return bool(self.lost or self.gained or self.dearer or self.cheaper or spread)

    @property
    def is_worse(self) -> bool:
        """Whether rules are missed: successes are lost, or steps or points beyond the noise."""
        figures = (self.steps, self.steps_noise), (self.points, self.points_noise)
        return bool(self.lost or self.dearer) or any(r > max(noise) for r, noise in figures)

    def cells(self) -> list[str]:
        """Changed problems, successes, steps, points and costs, for a table."""
        if not self.changed:
            return [self.known if self.names else "", "", "", "", ""]
        lost = [f"{sign}{len(x)}" for x, sign in ((self.lost, "-"), (self.gained, "+")) if x]
        costs = [f"{len(x)} {up}" for x, up in ((self.dearer, "up"), (self.cheaper, "down")) if x]
        return [
            self.known,
            ", ".join(lost),
            _shown(self.steps, self.steps_noise),
            _shown(self.points, self.points_noise),
            ", ".join(costs),
        ]


def _differs(one: Result, other: Result) -> bool:
    return one[:2] != other[:2] or one[3] != other[3] or abs(one[2] - other[2]) > 0.0


def _fails(result: Result) -> bool:
    return result[0].startswith("no")


def _by_cost(
    names: list[str], found: dict[str, Result], known: dict[str, list[Result]]
) -> tuple[list[str], list[str]]:
    """Problems whose cost is higher, and lower, by more than 1e-4 and twice the noise."""
    dearer, cheaper = list[str](), list[str]()
    for n in names:
        cost, costs = found[n][2], [each[2] for each in known[n]]
        room = 2.0 * (max(costs) - min(costs)) + 1e-4 * abs(costs[0])
        dearer += [n] * (cost > max(costs) + room)
        cheaper += [n] * (cost < min(costs) - room)
    return dearer, cheaper


def _ratios(
    names: list[str], found: dict[str, Result], known: dict[str, list[Result]], which: int
) -> tuple[float, list[float]]:
    """The geometric mean ratio to all rules, and those of the nudged starts, with 1."""

    def mean(results: list[Result]) -> float:
        pairs = zip(results, (known[n][0] for n in names), strict=True)
        logs = [math.log(max(a[which], 1) / max(b[which], 1)) for a, b in pairs]
        return math.exp(sum(logs) / len(logs)) if logs else 1.0

    others = [mean([known[n][i + 1] for n in names]) for i in range(len(NUDGES))]
    return mean([found[n] for n in names]), [1.0, *others]


def _shown(ratio: float, noise: list[float]) -> str:
    """A ratio, in parentheses within the noise."""
    text = f"{ratio:.3f}"
    return f"({text})" if min(noise) <= ratio <= max(noise) else text


def quiet_groups(corpus: Corpus, quiet: list[str]) -> list[list[str]]:
    """All rules without an effect together, then halves of what is worse, down to pairs."""
    done, left = list[list[str]](), [quiet] if len(quiet) > 1 else []
    while left:
        corpus.measure(left)
        done += left
        worse = [group for group in left if corpus.effect(group).is_worse and len(group) > 2]
        halves = [half for g in worse for half in (g[: len(g) // 2], g[len(g) // 2 :])]
        left = [half for half in halves if len(half) > 1]
    return done


def mechanisms(corpus: Corpus, quiet: list[str]) -> list[list[str]]:
    """Pairs of quiet rules of one mechanism that some problem reaches, and each mechanism's."""
    groups = list[list[str]]()
    for mechanism in dict.fromkeys(rule.mechanism for rule in RULES):
        own = [r.name for r in RULES if r.mechanism == mechanism and r.name in quiet]
        groups += [own] if len(own) > 2 else []
        common = {name: set(corpus.reached([name])) for name in own}
        groups += [[a, b] for a, b in combinations(own, 2) if common[a] & common[b]]
    corpus.measure(groups)
    return groups


def table_of(corpus: Corpus, rules: Sequence[Rule]) -> None:
    """The table of the rules one at a time."""
    columns = ["rule", "reached", "changed", "successes", "steps", "points", "costs"]
    for mechanism in dict.fromkeys(rule.mechanism for rule in rules):
        print(f"**{mechanism.capitalize()}**\n")
        rows = []
        for rule in rules:
            if rule.mechanism != mechanism:
                continue
            counts = corpus.reached([rule.name])
            often = f"{len(counts)}: {sum(counts.values()):,}" if counts else ""
            often = "; ".join(filter(None, [often, NOTICED.get(rule.name, "")])) or "never"
            what = f"**{rule.name}** `{rule.where}` {rule.meaning}"
            rows.append([what, often, *corpus.effect([rule.name]).cells()])
        print_table(columns, rows)


def table_of_groups(corpus: Corpus, groups: Sequence[Sequence[str]]) -> None:
    """The table of groups of rules that change nothing alone."""
    rows = []
    for group in groups:
        effect = corpus.effect(group)
        if effect.names and (len(group) > 2 or effect.beyond_noise):
            rows.append([", ".join(group), str(len(group)), *effect.cells()])
    print_table(["off together", "rules", "changed", "successes", "steps", "points", "costs"], rows)


def describe(corpus: Corpus) -> None:
    """What the figures are, with the noise."""
    names, known = corpus.names, {n: [corpus.all_on(n), *corpus.noise(n)] for n in corpus.names}
    both = [n for n in names if not any(map(_fails, known[n]))]
    same = {n: corpus.all_on(n) for n in both}
    spread = [_ratios(both, same, known, i)[1] for i in (1, 3)]
    steps, points = (f"{min(each):.3f} to {max(each):.3f}" for each in spread)
    good = [sum(not _fails(known[n][i]) for n in names) for i in range(len(NUDGES) + 1)]
    print(
        f"{len(names)} problems, {good[0]} with a motion; with starts moved by 1e-9 of the ranges "
        f"{min(good[1:])} to {max(good[1:])}, steps {steps} and kernel points {points} times as "
        "many, as geometric means.\n\n"
        "*reached*: on how many problems, and how often, the rule's expression had another value "
        "than what takes its place. The rest compares problems without the rule: *changed* in any "
        "bit, of those that were tried; *successes* lost (-) and gained (+); *steps* and *points* "
        "as ratios, in parentheses where moved starts spread as much; *costs* that rise or fall "
        "by more than 1e-4 and twice that spread. Where none of them changes, *reached* names "
        "the test that fails without the rule, or another problem that takes more steps.\n"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rules", nargs="*", metavar="NAME", help="these rules alone")
    parser.add_argument("--full", action="store_true", help="the full corpus")
    parser.add_argument("--store", type=Path, metavar="FILE", help="keeps what was measured")
    parser.add_argument("--processes", type=int, default=1, metavar="N")
    parser.add_argument("--known", action="store_true", help="tables of what the file has")
    given = parser.parse_args()
    rules = [rule for rule in RULES if not given.rules or rule.name in given.rules]
    names = list(PROBLEMS) if given.full else SCREENING
    corpus = Corpus(names, Measured(given.store, 0 if given.known else given.processes))
    corpus.measure([[rule.name] for rule in rules])
    quiet = [rule.name for rule in rules if not corpus.effect([rule.name]).beyond_noise]
    quiet = [name for name in quiet if corpus.reached([name])]
    groups = [*quiet_groups(corpus, quiet), *mechanisms(corpus, quiet)]
    groups = corpus.known_groups() if given.known else groups
    describe(corpus)
    table_of(corpus, rules)
    table_of_groups(corpus, groups)
    print(f"{machine(threads=1)}\n")


if __name__ == "__main__":
    main()

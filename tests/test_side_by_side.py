"""The comparison of two checkouts notices what it is there for: its judge, verdicts and workers."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi

Array = npt.NDArray[np.float64]

BENCHMARKS = Path(__file__).resolve().parents[1] / "examples" / "benchmarks"
T = 1.5
FREE = np.full((4, 2), np.inf)


@pytest.fixture(scope="module")
def scripts() -> Iterator[dict[str, Any]]:
    """The modules of the comparison, by name."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        names = "outside_judge", "side_by_side", "solving_statements"
        yield {name: importlib.import_module(name) for name in names}
    finally:
        sys.path.remove(str(BENCHMARKS))


@dataclass(frozen=True)
class Samples:
    q: Array
    v: Array
    a: Array


@dataclass(frozen=True)
class Quintic:
    """A two-link arm from rest at zero to rest at `goal`, along a polynomial of degree five."""

    goal: Array
    duration: float = T
    shift: float = 0.0

    @property
    def t(self) -> Array:
        return np.linspace(0.0, self.duration, 5)

    def sample(self, t: Array) -> Samples:
        s = np.asarray(t)[:, None] / self.duration
        q = self.goal * (10 * s**3 - 15 * s**4 + 6 * s**5) + self.shift
        v = self.goal * (30 * s**2 - 60 * s**3 + 30 * s**4) / self.duration
        a = self.goal * (60 * s - 180 * s**2 + 120 * s**3) / self.duration**2
        return Samples(q, v, a)


GOAL = np.array([0.8, -0.5])
MOTION = Quintic(GOAL)
PEAK = 1.875 * 0.8 / T
"""The largest velocity of the first joint."""


@pytest.fixture(scope="module")
def model(scripts: dict[str, Any]) -> Any:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return scripts["outside_judge"].oracle_model(robot.model)


@pytest.fixture(scope="module")
def cost(model: Any) -> float:
    """1/2 integral |tau|^2 by Simpson's rule."""
    from scipy.integrate import simpson

    t = np.linspace(0.0, T, 2_001)
    x, data = MOTION.sample(t), model.createData()
    tau = [pin.rnea(model, data, *row) for row in zip(x.q, x.v, x.a, strict=True)]
    return float(0.5 * simpson(np.sum(np.square(tau), axis=1), x=t))


@pytest.fixture(scope="module")
def asked(scripts: dict[str, Any], model: Any) -> Any:
    stops = [(0.0, np.zeros(2), np.zeros(2)), (np.inf, GOAL, np.zeros(2))]
    return scripts["outside_judge"].Asked([(T, model)], stops, -FREE, FREE)


def limited(kind: int, bound: float) -> tuple[Array, Array]:
    upper = FREE.copy()
    upper[kind, 0] = bound
    return -upper, upper


def test_what_holds_is_not_denied(scripts: dict[str, Any], asked: Any, cost: float) -> None:
    lower, upper = limited(1, 1.0001 * PEAK)
    judge = scripts["outside_judge"].denial
    assert judge(MOTION, cost, replace(asked, lower=lower, upper=upper)) == ""
    assert judge(MOTION, cost + 3.0 * T, replace(asked, price=3.0)) == ""
    assert judge(MOTION, None, asked) == ""


@pytest.mark.parametrize(
    ("changes", "factor", "motion", "word"),
    [
        ({}, 1.02, MOTION, "integral"),
        ({}, np.nan, MOTION, "integral"),
        (
            {"lower": limited(1, 0.9999 * PEAK)[0], "upper": limited(1, 0.9999 * PEAK)[1]},
            1,
            MOTION,
            "v",
        ),
        ({"lower": limited(3, 1.0)[0], "upper": limited(3, 1.0)[1]}, 1, MOTION, "tau"),
        ({}, 1, Quintic(GOAL, shift=1e-5), "misses q at 0"),
        ({}, 1, Quintic(GOAL + np.array([1e-5, 0.0])), "misses q at inf"),
        ({}, 1, Quintic(GOAL * np.nan), "misses q"),
        ({"stops": [(T / 2, None, np.zeros(2))]}, 1, MOTION, "misses v"),
        ({"passive": [1]}, 1, MOTION, "passive torque"),
        ({"weight": np.array([1.0, 0.0])}, 1, MOTION, "integral"),
    ],
)
def test_what_does_not_hold_is_denied(
    scripts: dict[str, Any],
    asked: Any,
    cost: float,
    changes: dict[str, Any],
    factor: float,
    motion: Quintic,
    word: str,
) -> None:
    said = scripts["outside_judge"].denial(motion, factor * cost, replace(asked, **changes))
    assert said.startswith(word)


def test_what_is_carried_counts_in_its_part(
    scripts: dict[str, Any], asked: Any, cost: float, model: Any
) -> None:
    judge = scripts["outside_judge"]
    heavier = judge.carrying(model, "tip", 0.5)
    parts = [(T / 2, model), (T, heavier)]
    assert judge.denial(MOTION, cost, replace(asked, parts=parts)).startswith("integral")
    t = np.array([0.4 * T, T / 2, 0.6 * T])
    tau = judge.torques_at(parts, t, MOTION.sample(t))
    plain, more = (judge.torques(each, MOTION.sample(t)) for each in (model, heavier))
    assert np.array_equal(tau[0], plain[0])
    assert np.array_equal(tau[1:], more[1:])


def test_a_start_is_led_back_from_a_little_and_for_a_while(
    scripts: dict[str, Any], asked: Any, cost: float
) -> None:
    judge, bound = scripts["outside_judge"], 0.98 * PEAK
    lower, upper = limited(1, bound)
    over = replace(asked, lower=lower, upper=upper)
    known = judge.LedBack(1, 0, 0.03 * bound, 0.6 * T)
    assert judge.denial(MOTION, cost, over).startswith("v beyond")
    assert judge.denial(MOTION, cost, replace(over, led_back=[known])) == ""
    early = replace(known, until=0.5 * T)
    assert judge.denial(MOTION, cost, replace(over, led_back=[early])).startswith("v beyond")
    far = replace(known, excess=0.05 * bound)
    assert judge.denial(MOTION, cost, replace(over, led_back=[far])).startswith("led back")


def rows(count: int = 9, **changes: Any) -> dict[str, dict[str, Any]]:
    """Rows of equal problems, with changes of all of them."""
    row = {"success": True, "status": "minimum", "denied": "", "nit": 20, "cost": (2.0).hex()}
    row |= {"seconds": 1.0, "kernel": 0.01, "points": 500, "calls": None, "bits": "abc"}
    return {f"{i}": row | {"name": f"{i}"} | changes for i in range(count)}


def changed(name: str, **changes: Any) -> dict[str, dict[str, Any]]:
    """The same with changes of one."""
    found = rows()
    found[name] |= changes
    return found


LOST = {"success": False, "status": "unresolved"}
GONE = {"success": False, "status": "time-out", "nit": None, "cost": None, "seconds": None}
FALSE = {"denied": "v beyond its limits by 1e-03"}


@pytest.mark.parametrize(
    ("before", "after", "bits", "faults"),
    [
        (rows(), rows(), True, []),
        ({}, {}, False, ["nothing measured"]),
        (rows(), changed("3", **LOST), False, ["lost success"]),
        (rows(), changed("3", **GONE), False, ["lost success"]),
        (rows(), {k: v for k, v in rows().items() if k != "3"}, False, ["lost success"]),
        (changed("3", **LOST), rows(), False, []),
        (rows(), changed("3", **FALSE), False, ["false success"]),
        (changed("3", **FALSE), changed("3", **LOST), False, []),
        (rows(), rows(nit=21), False, []),
        (rows(), rows(nit=22), False, ["steps 1.100 in the median"]),
        (rows(), changed("3", nit=200), False, []),
        (rows(), rows(seconds=1.09), False, []),
        (rows(), rows(seconds=1.2), False, ["time 1.20 in the median", "time 1.20 in all"]),
        (rows(), rows(seconds=1.2, kernel=0.012), False, []),
        (rows(), changed("3", seconds=3.0), False, ["time 1.22 in all"]),
        (rows(), changed("3", bits="abd"), False, []),
        (rows(), changed("3", bits="abd"), True, ["other bits"]),
        (rows(), changed("3", cost=np.nextafter(2.0, 3.0).hex()), True, ["other bits"]),
    ],
)
def test_a_class_passes_if_nothing_is_false_lost_or_slower(
    scripts: dict[str, Any], before: Any, after: Any, bits: bool, faults: list[str]
) -> None:
    verdict = scripts["side_by_side"].verdict("limited", before, after, bits)
    assert list(verdict.faults) == faults
    assert verdict.passes == (not faults)


def test_the_exit_code_follows_from_the_classes(
    scripts: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    script = scripts["side_by_side"]
    found = script.Measurement(0, {}, {"limited": rows()}, {"limited": rows()})
    assert script.report(found, ["limited"], True, [10, 9])
    assert "All classes pass." in capsys.readouterr().out
    found.after["limited"]["3"] |= LOST
    assert not script.report(found, ["limited"], False, [10, 9])
    said = capsys.readouterr().out
    assert "- limited: lost success: 3 (unresolved)" in said
    assert "Fails: limited." in said


WORKER = """
import json, os, sys
for line in sys.stdin:
    request = json.loads(line)
    for name in request["group"]["names"]:
        if name in request["skip"]:
            continue
        print(json.dumps({"begin": [name]}), flush=True)
        if name == "crashes":
            print("out of breath", file=sys.stderr, flush=True)
            os._exit(3)
        if name == "endless":
            os.kill(os.getpid(), 24)
        if name == "raises":
            print(json.dumps({"name": name, "success": False, "status": "InputError"}), flush=True)
            continue
        print(json.dumps({"name": name, "success": True}), flush=True)
    print(json.dumps({"done": True}), flush=True)
"""


def test_a_problem_in_which_its_process_dies_does_not_end_the_others(
    scripts: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = scripts["side_by_side"]
    (tmp_path / "checkout_worker.py").write_text(WORKER)
    monkeypatch.setattr(script, "HERE", tmp_path)
    worker = script.Worker(tmp_path, tmp_path / "log")
    names = ["first", "crashes", "endless", "raises", "last"]
    try:
        for _ in range(2):
            found = worker.run({"names": names, "limit": 1.0}, 0, {})
            assert [found[name]["success"] for name in names] == [True, False, False, False, True]
            rows = {name: found[name] for name in names[1:4]}
            assert script.verdict("limited", rows, rows, bits=True).passes
            assert found["crashes"]["status"] == "crash (3): out of breath"
            assert found["endless"]["status"] == "time-out"
    finally:
        worker.close()


def test_the_faster_of_two_measurements_counts(scripts: dict[str, Any]) -> None:
    script, found = scripts["side_by_side"], rows()
    script._merge(found, changed("3", seconds=0.5) | {"4": rows()["4"] | {"seconds": 2.0}})
    assert [found[name]["seconds"] for name in ("3", "4")] == [0.5, 1.0]


def test_what_cannot_be_compared_is_told_in_a_sentence(
    scripts: dict[str, Any], tmp_path: Path
) -> None:
    script = scripts["side_by_side"]
    (tmp_path / "src" / "hovi" / "_native").mkdir(parents=True)
    with pytest.raises(SystemExit, match="has no compiled modules"):
        script.main([str(tmp_path)])
    with pytest.raises(SystemExit, match="neither the path of a checkout"):
        script.main(["no-such-commit"])
    other = tmp_path / "other.json"
    for text, said in (("", "cannot be read as"), ("[]", "is no"), ("{}", "is no")):
        other.write_text(text)
        with pytest.raises(SystemExit, match=f"{said}.* measurement that"):
            script.main(["--load", str(other)])
    with pytest.raises(SystemExit, match="No such file"):
        script.main(["--load", str(tmp_path / "none.json")])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--jobs", "0"], "--jobs must be at least 1, got 0"),
        (["--save", "/no/folder/x.json"], "--save needs a file in a folder that exists"),
    ],
)
def test_options_that_cannot_work_are_refused_before_anything_runs(
    scripts: dict[str, Any], capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    with pytest.raises(SystemExit, match="2"):
        scripts["side_by_side"].main(["HEAD", *options])
    assert said in capsys.readouterr().err


def test_statements_count_what_formatting_leaves(scripts: dict[str, Any]) -> None:
    count = scripts["solving_statements"].statements
    plain = "x = 1\ny = 2\ndef f(a):\n    return a + x\n"
    written = (
        'X = (\n    1\n)\n"""Of x."""\ny = 2\n\n\ndef f(a):\n    """Add."""\n    return a + x\n'
    )
    assert count(plain) == count(written) == 4

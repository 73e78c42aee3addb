"""Hard cases 26 to 30: untrusted models and files."""

from __future__ import annotations

import contextlib
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from hard import mutated_mesh, mutated_motion, mutated_scene, mutated_urdf
from hard.case import Case, Outcome, parameters
from hard.strange_files import ARM, MASS, by_pinocchio, loaded, long_chain, refusals, run_process
from hard.verdict import Verdict
from hovi import plan
from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.scene.scene import Scene
from hovi.schemes import galerkin

AXIS = '<axis xyz="0 -1 0"/>'
LIMIT = 'lower="-1000" upper="1000"'
TREES = {
    "a cycle": ('parent link="base"', 'parent link="forearm"', "cycle"),
    "a link twice": ("</robot>", '<link name="tip"/></robot>', "'tip' occurs 2 times"),
    "two roots": ("</robot>", '<link name="floor"/></robot>', "'floor'"),
    "no such link": ('child link="tip"', 'child link="tipp"', "did you mean 'tip'"),
}
BODIES = {
    "a negative mass": (MASS, 'mass value="-1"', "'upper_arm'"),
    "an axis of zeros": (AXIS, '<axis xyz="0 0 0"/>', "'shoulder'"),
    "crossed limits": (LIMIT, 'lower="1" upper="-1"', "'shoulder'"),
    "a limit of 1e308": (LIMIT, 'lower="-1" upper="1e308"', "'shoulder'"),
    "a mimic of itself": (AXIS, f'{AXIS}<mimic joint="shoulder"/>', "mimics itself"),
}
TRIANGLE = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
TRIANGLE += "endloop\nendfacet\nendsolid a\n"


def changed(old: str, new: str) -> str:
    assert old in ARM
    return ARM.replace(old, new, 1)


def naive_texts(texts: dict[str, tuple[str, str, str]]) -> Callable[[], str]:
    def naive() -> str:
        found = Counter(by_pinocchio(changed(old, new)) for old, new, _ in texts.values())
        return "; ".join(f"{count} x {what}" for what, count in found.items())

    return naive


def refused_texts(texts: dict[str, tuple[str, str, str]]) -> Callable[[], Outcome]:
    calls: dict[str, tuple[Callable[[], object], str]] = {
        name: ((lambda old=old, new=new: loaded(changed(old, new))), fragment)
        for name, (old, new, fragment) in texts.items()
    }
    return lambda: refusals(calls)


def masses(*values: str) -> dict[str, tuple[str, str, str]]:
    return {value: (MASS, f'mass value="{value}"', "'upper_arm'") for value in values}


def read_masses() -> Outcome:
    read = [
        loaded(changed(MASS, f'mass value="{text}"')).model.inertias[1].mass
        for text in (" 0.375 ", "0.375\t", "\t.375", "37.5e-2")
    ]
    return Outcome(f"{read} kg", read == [0.375] * 4)


def naive_chains() -> str:
    build = "import sys, pinocchio as pin\nm = pin.buildModelFromXML(sys.stdin.read())"
    parts = []
    for links in (3_000, 20_000):
        code, fragment = run_process(
            f"{build}\nm.createData()", long_chain(links), memory=4 * 2**30
        )
        parts.append(f"{links}: exit code {code} {fragment}")
    return "; ".join(parts) + " (with 4 GB of memory)"


def refused_chains() -> Outcome:
    return refusals(
        {
            "3,000 links": (lambda: loaded(long_chain(3_000)), "more than 250 degrees"),
            "20,000 links": (lambda: loaded(long_chain(20_000)), "more than 250 degrees"),
            "20,000 fixed ones": (
                lambda: loaded(long_chain(20_000).replace("continuous", "fixed")),
                "more than 1000 links",
            ),
        }
    )


def with_mesh(folder: Path, name: str) -> Path:
    """A URDF in folder/inside with a mesh of that name, and a mesh in folder/outside."""
    for each in ("inside", "outside"):
        (folder / each).mkdir(exist_ok=True)
    (folder / "outside" / "secret.stl").write_text(TRIANGLE)
    link = folder / "inside" / "link.stl"
    if not link.is_symlink():
        link.symlink_to(folder / "outside" / "secret.stl")
    mesh = f'<geometry><mesh filename="{name.format(folder)}"/></geometry>'
    path = folder / "inside" / "robot.urdf"
    path.write_text(f'<robot name="r"><link name="l"><visual>{mesh}</visual></link></robot>')
    return path


ESCAPES = ("{}/outside/secret.stl", "file://{}/outside/secret.stl", "../outside/secret.stl")
MORE_ESCAPES = ("link.stl", "package://inside/../outside/secret.stl", "package://../../etc/passwd")


def naive_meshes() -> str:
    with tempfile.TemporaryDirectory() as name:
        folder, read = Path(name), 0
        for mesh in (ESCAPES[0], ESCAPES[1], MORE_ESCAPES[1]):
            path = with_mesh(folder, mesh)
            model = pin.buildModelFromUrdf(str(path))
            shapes = pin.buildGeomFromUrdf(model, str(path), pin.VISUAL, None, [str(folder)])
            read += "outside" in str(Path(shapes.geometryObjects[0].meshPath).resolve())
    return f"reads {read} of 3 meshes from outside the package"


def contained_meshes() -> Outcome:
    from hovi.errors import ModelError
    from hovi.robot.loading import load_robot

    kept = 0
    with tempfile.TemporaryDirectory() as name:
        for mesh in (*ESCAPES, *MORE_ESCAPES):
            try:
                robot = load_robot(with_mesh(Path(name), mesh), package_dirs=[])
                kept += robot.visual is None and "outside" in robot.visual_problem
            except ModelError as refused:
                kept += "leaves its package" in str(refused)
    count = len(ESCAPES) + len(MORE_ESCAPES)
    return Outcome(f"{kept} of {count} are kept out", kept == count)


FLIPS = """
import random, sys, tempfile, pinocchio as pin
model, name = pin.buildSampleModelManipulator(), tempfile.mktemp()
model.saveToBinary(name)
data = bytearray(open(name, "rb").read())
position = random.Random(int(sys.stdin.read())).randrange(len(data))
data[position] ^= 0x55
open(name, "wb").write(data)
other = pin.Model()
other.loadFromBinary(name)
print("same" if other == model else "silent")
"""


def naive_flips() -> str:
    found = Counter[str]()
    for seed in range(8):
        code, fragment = run_process(FLIPS, str(seed), memory=2**32)
        found[fragment if code == 0 else "crash" if code < 0 else "exception"] += 1
    return "Boost archives: " + ", ".join(f"{count} x {what}" for what, count in found.items())


def refused_flips() -> Outcome:
    whole = mutated_motion.original()
    places = np.random.default_rng(0).choice(len(whole), 300, replace=False)
    refused = harmless = 0
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "motion.npz"
        path.write_bytes(whole)
        q = Trajectory.load(path).q
        for position in places:
            flipped = bytearray(whole)
            flipped[position] ^= 0x55
            path.write_bytes(flipped)
            try:
                harmless += np.array_equal(Trajectory.load(path).q, q)
            except Exception as error:
                refused += "motion.npz" in str(error)
    shown = f"{refused} refused, {harmless} without effect"
    return Outcome(shown, refused + harmless == 300)


class _Bomb:
    """An object whose unpickling creates a file."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.target,)


def with_pickle(load: Callable[[Path], object]) -> bool:
    """Whether loading a trajectory file with a pickle executes the pickle."""
    with tempfile.TemporaryDirectory() as name:
        path, target = Path(name) / "motion.npz", Path(name) / "ran"
        names = ("header", "steps", "q", "v", "z", "inner", "momenta")
        bombs = {each: np.array([_Bomb(target)], dtype=object) for each in names}
        np.savez(path, **bombs)  # type: ignore[arg-type]
        with contextlib.suppress(Exception):  # only whether code was executed matters
            load(path)
        return target.exists()


def naive_pickle() -> str:
    ran = with_pickle(lambda path: dict(np.load(path, allow_pickle=True)))
    return "executes the code" if ran else "executes nothing"


def unopened_pickle() -> Outcome:
    ran = with_pickle(Trajectory.load)
    return Outcome("executes the code" if ran else "refused, nothing is executed", not ran)


def naive_inputs() -> str:
    h, q0, q1, v0 = 0.0, 0.0, float("nan"), 0.0
    with np.errstate(all="ignore"):
        a = np.float64(2.0) / np.float64(h) ** 2 * (q1 - q0 - h * v0)
    return f"a = {a} at h = 0 from a NaN, silently"


def refused_inputs() -> Outcome:
    scene = Scene(loaded(ARM), effects=[Gravity(9.8)])
    rest, nan, inf = [0.0, 0.0], float("nan"), float("inf")

    def tried(start: Any = rest, goal: Any = rest, T: Any = 1.0, **more: Any) -> Any:
        return lambda: plan(scene, start, goal, T, **more)

    return refusals(
        {
            "T = 0": (tried(T=0.0), "duration"),
            "T < 0": (tried(T=-1.0), "duration"),
            "T = NaN": (tried(T=nan), "duration"),
            "T = inf": (tried(T=inf), "duration"),
            "h of 1e-300": (tried(T=1e-300), "between 1e-12"),
            "h < 0": (lambda: Grid(np.array([0.1, -0.1]), (galerkin(0),) * 2), "positive"),
            "N = 0": (tried(intervals=0), "intervals"),
            "N = -3": (tried(intervals=-3), "intervals"),
            "N = 1.5": (tried(intervals=1.5), "intervals"),
            "NaN in the start": (tried(start=[nan, 0.0]), "'shoulder'"),
            "inf in the goal": (tried(goal=[0.0, inf]), "'elbow'"),
            "1e308 in the goal": (tried(goal=[0.0, 1e308]), "'elbow'"),
            "three numbers": (tried(start=[0.0] * 3), "expected (2,)"),
            "a number": (tried(goal=1.0), "expected (2,)"),
            "words": (tried(start=["a", "b"]), "2 numbers"),
            "no such scheme": (tried(scheme="galerkin-x"), "galerkin-x"),
            "no starts": (tried(starts=0), "starts"),
        }
    )


MUTATED = (mutated_urdf, mutated_scene, mutated_motion, mutated_mesh)
GOOD = (Verdict.REFUSED, Verdict.ACCEPTED)


def fuzzed(count: int) -> Callable[[], Outcome]:
    def run() -> Outcome:
        found = Counter[Verdict]()
        with tempfile.TemporaryDirectory() as folder:
            for module in MUTATED:
                for number in range(count):
                    mutant = module.mutate(Random(f"0:{number}"))
                    found[module.verdict(mutant, Path(folder))[0]] += 1
        shown = ", ".join(f"{number} {verdict}" for verdict, number in found.items())
        return Outcome(f"{shown} (seed 0)", set(found) <= set(GOOD))

    return run


NAMED = "refused with one sentence that names the cause"
CASES = (
    Case(
        "26a",
        "a mass that is not a number is refused",
        naive_texts(masses("NaN", "inf", "1,5", "1abc", "1e999", "")),
        refused_texts(masses("NaN", "inf", "1,5", "1abc", "1e999", "")),
        NAMED,
    ),
    Case(
        "26b",
        "negative masses, axes of zeros, crossed limits, 1e308 and a mimic of itself are refused",
        naive_texts(BODIES),
        refused_texts(BODIES),
        NAMED,
    ),
    Case(
        "26c",
        "links that do not form a tree are refused",
        naive_texts(TREES),
        refused_texts(TREES),
        NAMED,
    ),
    Case(
        "26d",
        "a mass with surrounding blanks is read",
        naive_texts(masses(" 0.375 ", "0.375\t", "\t.375")),
        read_masses,
        "0.375 kg",
    ),
    Case("27", "chains of 3,000 and 20,000 links are refused", naive_chains, refused_chains, NAMED),
    Case(
        "28",
        "no mesh is read from outside its package",
        naive_meshes,
        contained_meshes,
        "6 of 6 are kept out",
    ),
    Case(
        "29a",
        "a file with a flipped byte is refused or unchanged",
        naive_flips,
        refused_flips,
        "300 of 300",
    ),
    Case("29b", "a pickle is not executed", naive_pickle, unopened_pickle, "nothing is executed"),
    Case(
        "30a",
        "invalid times, grids and states are refused",
        naive_inputs,
        refused_inputs,
        "refused with the name of the argument",
    ),
    Case(
        "30b",
        "mutated URDFs, scenes, trajectory files and meshes are refused or load correctly",
        lambda: "see 26 to 30a",
        fuzzed(100),
        "no crash, no silent acceptance",
    ),
)


@pytest.mark.parametrize("case", parameters(CASES))
def test_models_and_files(case: Case) -> None:
    outcome = case.run()
    assert outcome.passed, f"{outcome.shown}; the requirement: {case.requirement}"

"""Hard cases 22 to 25: ill-conditioned mass matrices, wrong quaternion norms, equal bytes."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hard import naive
from hard.case import Case, Outcome, parameters
from hard.scenes import HANG_JET, UP_JET, hanging, links, uneven
from hovi import plan
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.errors import HoviError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from oracles.dense_action import DenseAction
from oracles.path_steps import moved

Array = npt.NDArray[np.float64]


def mass_matrix(robot: Robot, q: Array) -> Array:
    upper = np.triu(pin.crba(robot.model, robot.model.createData(), q))
    return upper + np.triu(upper, 1).T


def naive_square() -> str:
    parts = []
    for count in (10, 30, 100):
        robot = links(count).robot
        M = mass_matrix(robot, np.random.default_rng(0).uniform(-1, 1, count))
        x = np.ones(count)
        W = M.T @ M
        error = np.abs(np.linalg.solve(W, M.T @ (M @ x)) - x).max()
        parts.append(
            f"{count} links: cond(W) = {np.linalg.cond(M) ** 2:.0e}, W^-1 off by {error:.0e}"
        )
    return "; ".join(parts)


def digits_of_a_chain(count: int) -> Callable[[], Outcome]:
    """A minimum, its inertia by two factorizations, and its change by the second one."""

    def run() -> Outcome:
        scene = links(count)
        bent = np.full(count, 0.3)
        bent[0] = 0.2
        options = {"limits": "none", "processes": 1, "intervals": 16}
        found = plan(scene, hanging(scene), bent, 2.0, **options)
        assert found.problem is not None
        change, inertia = solve_again(found.problem, found.trajectory.path)
        D = DiscreteLagrangian.derivatives(found.problem.ld, found.trajectory.path)
        residual = np.abs(D[1:, :2] + D[:-1, 2:]).max(axis=(0, 2)) / np.abs(D).max(axis=(0, 2))[:2]
        floor = last_bits(found.problem, found.trajectory.path)
        shown = (
            f"{found.status}, n_neg = {found.n_neg} and {inertia}; equations hold to "
            f"{residual.max():.0e}, the last bits change them by {floor:.0e}; solved again with "
            f"dense matrices q moves by {change:.0e}"
        )
        good = found.n_neg == inertia == 0
        held = residual.max() <= (1e-8 if count <= 10 else floor)
        return Outcome(shown, bool(good and held and change <= 1e-6))

    return run


def last_bits(problem: TrajectoryProblem, path: DiscretePath) -> float:
    """Relative change of the momenta by a change of the last bits of q, v and z."""
    random = np.random.default_rng(0)

    def nudged(x: Array) -> Array:
        return np.nextafter(x, np.where(random.random(x.shape) < 0.5, -np.inf, np.inf))

    near = replace(path, q=nudged(path.q), v=nudged(path.v), z=nudged(path.z))
    D, other = (DiscreteLagrangian.derivatives(problem.ld, x) for x in (path, near))
    return float(np.max(np.abs(other - D).max(axis=(0, 2)) / np.abs(D).max(axis=(0, 2))))


def solve_again(problem: TrajectoryProblem, path: DiscretePath) -> tuple[float, int]:
    """Change of a minimum by Newton's method with dense matrices, and its index by eigenvalues."""
    near = path
    for _ in range(3):
        action = DenseAction(problem, near)
        scale = 1.0 / np.sqrt(np.abs(np.diag(action.hessian)))
        H = scale[:, None] * action.hessian * scale
        near = moved(
            problem, near, action.step(scale * np.linalg.solve(H, -scale * action.gradient))
        )
    return float(np.abs(near.q - path.q).max()), int((np.linalg.eigvalsh(H) < 0).sum())


LIGHT = 1.0, 1e-17


def naive_massless() -> str:
    robot = uneven(LIGHT).robot
    M = mass_matrix(robot, np.array([0.3, 0.4]))
    u = np.array([1.0, 0.1])
    a = np.abs(np.linalg.solve(M, u)).max()
    return f"cond(M) = {np.linalg.cond(M):.0e}: a torque of 0.1 N m gives {a:.0e} rad/s^2"


def refused_massless() -> Outcome:
    return refusal(lambda: plan(uneven(LIGHT), [0.0, 0.0], [1.0, 0.0], 1.0), "singular", "joint2")


def refusal(work: Callable[[], object], *words: str) -> Outcome:
    """Whether `work` raises one sentence with these words."""
    try:
        work()
    except HoviError as error:
        sentence = str(error)
        return Outcome(sentence[:160], all(word in sentence for word in words))
    return Outcome("accepted", False)


def base() -> Robot:
    return load_robot("hector")


def naive_quaternion() -> str:
    robot = base()
    v, a = np.random.default_rng(0).normal(size=(2, robot.nv))
    q = pin.randomConfiguration(robot.model, -np.ones(7), np.ones(7))
    data = robot.model.createData()
    right = pin.rnea(robot.model, data, q, v, a).copy()
    q[3:] *= 1.01
    wrong = pin.rnea(robot.model, data, q, v, a)
    return f"RNEA changes by {100 * np.abs(wrong - right).max() / np.abs(right).max():.1f} %"


def refused_quaternion() -> Outcome:
    robot = base()
    q = robot.neutral()
    q[3:] *= 1.01
    return refusal(lambda: robot.check_configuration(q, "start"), "start", "unit norm", "normalize")


SCRIPT = """
import sys, hovi
task = hovi.load_task(hovi.example("two_link_swing_up"))
found = hovi.plan(task.scene, task.start, task.goal, 3.0, limits="none", starts=6, processes=1)
found.trajectory.save(sys.argv[1])
print(found.cost.hex())
"""


def naive_bytes() -> str:
    values = naive.Problem.cubic(HANG_JET, UP_JET, 3.0, 1000).values
    orders = [np.random.default_rng(seed).permutation(len(values)) for seed in range(8)]
    sums = {sum(values[order].tolist()).hex() for order in orders}
    return f"summed as processes finish, an action has {len(sums)} values in 8 runs"


def same_bytes() -> Outcome:
    digests, costs = [], []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(2):
            path = Path(folder) / f"{i}.npz"
            command = [sys.executable, "-c", SCRIPT, str(path)]
            done = subprocess.run(command, capture_output=True, check=True)
            costs.append(done.stdout)
            digests.append(hashlib.sha256(path.read_bytes()).hexdigest())
    same = len(set(digests)) == len(set(costs)) == 1
    return Outcome(f"SHA-256 {digests[0][:12]} and {digests[1][:12]}", same)


CASES = (
    Case(
        "22a",
        "a minimum of a chain of 10 links keeps its digits",
        naive_square,
        digits_of_a_chain(10),
        "n_neg = 0 by two algebras, equations to 1e-8, solved again with dense matrices to 1e-6",
    ),
    Case(
        "22b",
        "a minimum of a chain of 30 links keeps its digits",
        naive_square,
        digits_of_a_chain(30),
        "n_neg = 0 by two algebras, equations to the last bits of q, v and z, solved again "
        "with dense matrices to 1e-6",
        long=True,
    ),
    Case(
        "23",
        "a link without mass to working precision is refused",
        naive_massless,
        refused_massless,
        "refused with the name of the joint",
    ),
    Case(
        "24",
        "a quaternion with a norm off by 1 % is refused",
        naive_quaternion,
        refused_quaternion,
        "refused with the name of the joint",
    ),
    Case(
        "25",
        "two processes write the same bytes",
        naive_bytes,
        same_bytes,
        "one SHA-256",
    ),
)


@pytest.mark.parametrize("case", parameters(CASES))
def test_structure(case: Case) -> None:
    outcome = case.run()
    assert outcome.passed, f"{outcome.shown}; the requirement: {case.requirement}"

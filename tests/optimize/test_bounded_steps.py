"""Steps between bounds with equations, and with outputs that are added outside of their bounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.barrier import Barrier, Bounds
from hovi.optimize.bordered_model import EquationModel
from hovi.optimize.bounded_objective import BoundedOutcome, Refinement
from hovi.optimize.bounded_steps import FULL_REACTION_SHARE, BoundedSteps
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.interior_point import OUTSIDE_RADIUS, minimize_bounded
from hovi.optimize.quadratic_model import QuadraticModel
from optimize.test_interior_point import DenseModel, Quadratic

Array = npt.NDArray[np.float64]

PENALTY = 1e3


class WithEquation(Quadratic):
    """An augmented Lagrangian of x H x / 2 + g x with a x = b, whose multiplier is held."""

    def __init__(self, H: Array, g: Array, equation: Array, right: float, far: float) -> None:
        n = len(g)
        super().__init__(H, g, np.eye(n), np.zeros(n), np.full(n, far))
        self.equation, self.right, self.multiplier = equation, right, 0.0

    def residual(self, x: Array) -> float:
        return float(self.equation @ x - self.right)

    def value(self, x: Array) -> float:
        c = self.residual(x)
        return super().value(x) + self.multiplier * c + 0.5 * PENALTY * c**2

    def model(self, x: Array, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        plain = super().model(x, sigma, rho, multipliers)
        assert isinstance(plain, DenseModel)
        c, a = self.residual(x), self.equation
        gradient = plain.gradient + (self.multiplier + PENALTY * c) * a
        inner = DenseModel(gradient, plain.H + PENALTY * np.outer(a, a))
        return EquationModel(inner, a[None], np.array([c]), PENALTY)  # type: ignore[arg-type]

    def hold(self, x: Array, change: Array) -> float:
        self.multiplier += float(change[0])
        return float(change[0]) * self.residual(x)

    def meets_equations(self, x: Array) -> bool:
        return abs(self.residual(x)) <= 1e-10


def cornered(far: float) -> WithEquation:
    """min x0^2 + 4 x1^2 + x2^2 - 20 x0 - 3 x2 with x0 + x1 - x2 = 0.5 and 0 <= x <= far."""
    H, g = np.diag([2.0, 8.0, 2.0]), np.array([-20.0, 0.0, -3.0])
    return WithEquation(H, g, np.array([1.0, 1.0, -1.0]), 0.5, far)


def steps_from(program: WithEquation, x: Array, mu: float) -> BoundedSteps[Array]:
    outputs = program.outputs(x)
    barrier = Barrier.central(program.bounds, outputs.y, mu)
    outcome = BoundedOutcome(x, outputs, barrier, Reason.ITERATION_LIMIT)
    steps = BoundedSteps(program, outcome, Criteria(radius=1e6), 1.0)
    steps.cautious = True  # a plain step, whose gradient is that of the model
    return steps


@pytest.mark.parametrize("far", [1.01, 1.2, 100.0])
def test_a_step_takes_as_much_of_the_multipliers_as_bounds_leave_of_it(far: float) -> None:
    """All of it from a tenth of the step on."""
    steps = steps_from(cornered(far), np.array([1.0, 0.5, 1.0]), 1e-6)
    model = steps.model()
    step = steps.step(model)
    factor = model.factor(0.0)
    whole = model.reaction(model.gradient, factor)
    assert whole is not None
    assert step.reaction is not None
    assert (step.share < FULL_REACTION_SHARE) is (far < 2.0)
    expected = min(1.0, step.share / FULL_REACTION_SHARE) * whole[0]
    np.testing.assert_allclose(step.reaction, expected, rtol=1e-12)


@pytest.mark.parametrize("far", [1.01, 1.2, 100.0])
def test_the_predicted_decrease_of_a_quadratic_program_is_the_actual_one(far: float) -> None:
    """However much of a step, and so of the change of the multiplier, is taken."""
    program = cornered(far)
    start = np.array([1.0, 0.5, 0.5])
    barrier = Barrier.central(program.bounds, start, 1e-6)
    outcome = minimize_bounded(program, start, Criteria(), start=barrier)
    assert outcome.why is Reason.STATIONARY
    assert program.meets_equations(outcome.x)
    assert outcome.history[0].ratio == pytest.approx(1.0, abs=1e-6)
    x0 = min(far, 6.0)  # 2 x0 - 20 + 2 (x0 - 0.5) - 3 = 0, with x1 = 0
    x1 = max(0.0, 0.4 - 0.2 * x0)  # 8 x1 + 2 (x0 + x1 - 0.5) - 3 = 0
    np.testing.assert_allclose(outcome.x, [x0, x1, x0 + x1 - 0.5], atol=1e-5)


@pytest.mark.parametrize("held", [True, False])
def test_what_bounds_hold_back_of_equations_is_left_to_the_penalty(held: bool) -> None:
    """The second of two equations, where a barrier is 1000 times as stiff as their penalty."""
    A, c = np.eye(2, 3), np.array([0.1, 0.2])
    H = np.eye(3) + PENALTY * A.T @ A
    H[1, 1] += 1e3 * PENALTY * held
    inner = DenseModel(PENALTY * A.T @ c, H)
    model = EquationModel(inner, A, c, PENALTY)  # type: ignore[arg-type]
    factor = model.factor(0.0)
    assert factor is not None
    step, _, _ = model.descend(factor)
    reaction = model.reaction(model.gradient, factor)
    assert reaction is not None
    assert step[0] == pytest.approx(-c[0])
    if held:
        assert reaction[0][1] == 0.0
        assert step[1] == pytest.approx(-1e-3 * c[1], rel=1e-2)
    else:
        assert step[1] == pytest.approx(-c[1])


class Watched(Quadratic):
    """min |x - target|^2 / 2 within loose bounds, and with one more that is found on the way."""

    def __init__(self, target: Array) -> None:
        n = len(target)
        super().__init__(np.eye(n), -target, np.eye(n), np.full(n, -1e6), np.full(n, 1e6))
        self.target, self.added = target, False

    @property
    def kept(self) -> npt.NDArray[np.intp]:
        return np.arange(len(self.target))

    def refine_at_once(self, x: Array) -> Refinement | None:
        """Half way, once: x0 is to be larger by 20, several steps of OUTSIDE_RADIUS."""
        if self.added or np.linalg.norm(x - self.target) > 0.5 * np.linalg.norm(self.target):
            return None
        self.added = True
        before, one = self.bounds, np.zeros((1, len(x)))
        one[0, 0] = 1e-3  # of a range of 1000
        self.A = np.concatenate([self.A, one])
        lower = np.append(before.lower, 1e-3 * x[0] + 2e-2)
        self.bounds = Bounds(lower, np.append(before.upper, 1e6), np.append(before.weights, 0.1))
        return Refinement(self.kept, np.array([-1]))


def test_the_radius_is_what_it_was_once_added_outputs_are_matched() -> None:
    program = Watched(np.array([100.0, 4_000.0, 0.0, 0.0]))
    program.radii = 50.0, 50.0
    outcome = minimize_bounded(program, np.zeros(4), Criteria(max_iterations=60))
    assert outcome.why is Reason.STATIONARY
    radii = [step.radius for step in outcome.history]
    first = int(np.argmax(np.array(radii) <= OUTSIDE_RADIUS))
    assert radii[first] <= OUTSIDE_RADIUS < radii[first - 1]
    again = next(i for i, radius in enumerate(radii) if i > first and radius > 10 * OUTSIDE_RADIUS)
    assert radii[again] >= radii[first - 1]
    assert again > first + 1  # not before the bound that was added is met
    np.testing.assert_allclose(outcome.x, program.target, atol=0.1)

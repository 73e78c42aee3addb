"""The trust region on classical test functions: minima, saddles, limits, non-finite numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.quadratic_model import Factor, IntervalSum, QuadraticModel
from hovi.optimize.trust_region import Objective, Outcome, minimize, next_radius, solve_subproblem

Array = npt.NDArray[np.float64]

EXACT = Criteria(decrease=1e-9, exact=True)


@dataclass(frozen=True)
class DenseFactor:
    matrix: Array

    def solve(self, rhs: Array) -> Array:
        return np.linalg.solve(self.matrix, rhs)


class DenseModel(QuadraticModel):
    """g.s + 1/2 s.H s with the metric D: a single interval with m columns of one component."""

    def __init__(self, gradient: Array, hessian: Array, metric: Array | None = None) -> None:
        self.hessian = hessian
        self.metric = np.eye(len(gradient)) if metric is None else metric
        local = gradient[None, :, None], hessian[None, :, :, None, None], self.metric[None]
        super().__init__(IntervalSum(*local))

    def scatter(self, local: Array) -> Array:
        return local[0, :, 0]

    def gather(self, s: Array) -> Array:
        return s[None, :, None]

    def factor(self, shift: float) -> Factor | None:
        matrix = self.hessian + shift * self.metric
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            return None
        return DenseFactor(matrix)

    def change(self, s: Array) -> float:
        """g.s + 1/2 s.H s."""
        return float(self.gradient @ s + s @ self.hessian @ s / 2)

    def norm(self, s: Array) -> float:
        return float(np.sqrt(s @ self.metric @ s))


@dataclass
class Smooth(Objective[Array]):
    """A CasADi expression of x; counts its evaluations."""

    x: ca.SX
    expression: ca.SX
    values: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        hessian, gradient = ca.hessian(self.expression, self.x)
        self.function = ca.Function("f", [self.x], [self.expression])
        self.second = ca.Function("f2", [self.x], [gradient, hessian])

    def value(self, x: Array) -> float:
        self.values.append(float(self.function(x)))
        return self.values[-1]

    def model(
        self, x: Array, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        gradient, hessian = self.second(x)
        return DenseModel(gradient.full().ravel(), hessian.full())

    def retract(self, x: Array, step: Array, model: QuadraticModel) -> Array:
        return x + step

    def relative_size(self, x: Array, step: Array, model: QuadraticModel) -> float:
        return float(np.abs(step).max() / max(1.0, np.abs(x).max()))


def objective(n: int, f: Callable[[ca.SX], ca.SX]) -> Smooth:
    x = ca.SX.sym("x", n)
    return Smooth(x, f(x))


def rosenbrock(x: ca.SX) -> ca.SX:
    return 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2


def chained_rosenbrock(x: ca.SX) -> ca.SX:
    return sum(100 * (x[i + 1] - x[i] ** 2) ** 2 + (1 - x[i]) ** 2 for i in range(9))


def himmelblau(x: ca.SX) -> ca.SX:
    return (x[0] ** 2 + x[1] - 11) ** 2 + (x[0] + x[1] ** 2 - 7) ** 2 + 5


def powell(x: ca.SX) -> ca.SX:
    """Its Hessian is singular at its minimum."""
    first = (x[0] + 10 * x[1]) ** 2 + 5 * (x[2] - x[3]) ** 2
    return first + (x[1] - 2 * x[2]) ** 4 + 10 * (x[0] - x[3]) ** 4 + 1


def beale(x: ca.SX) -> ca.SX:
    return sum((c - x[0] * (1 - x[1] ** k)) ** 2 for k, c in ((1, 1.5), (2, 2.25), (3, 2.625)))


def two_wells(x: ca.SX) -> ca.SX:
    """Minima -1/4 at (0, +-1/sqrt(2)), a saddle of value 0 at the origin."""
    return x[0] ** 2 - x[1] ** 2 + x[1] ** 4


def barrier(x: ca.SX) -> ca.SX:
    """Not a number where x <= 0; the minimum is at 1/2."""
    return 2 * x[0] - ca.log(x[0])


# Minima


@pytest.mark.parametrize(
    ("n", "f", "start", "minimum"),
    [
        (2, rosenbrock, [-1.2, 1.0], [1.0, 1.0]),
        (10, chained_rosenbrock, [-1.2, 1.0] * 5, None),
        (2, himmelblau, [-0.27, -0.92], None),  # near its maximum
        (2, himmelblau, [0.1, 3.0], None),
        (4, powell, [3.0, -1.0, 0.0, 1.0], [0.0] * 4),
        (2, beale, [1.0, 1.0], [3.0, 0.5]),
        (2, two_wells, [1.0, 0.3], [0.0, 0.5**0.5]),
        (1, barrier, [30.0], [0.5]),
    ],
)
@pytest.mark.parametrize("radius", [0.01, 10.0, 1e6])
def test_the_minimum_is_found_from_a_distant_start(
    n: int,
    f: Callable[[ca.SX], ca.SX],
    start: list[float],
    minimum: list[float] | None,
    radius: float,
) -> None:
    problem = objective(n, f)
    outcome = minimize(problem, np.array(start), Criteria(radius=radius))
    assert outcome.why is Reason.STATIONARY
    gradient, hessian = (x.full() for x in problem.second(outcome.x))
    assert np.abs(gradient).max() < 1e-6
    assert np.linalg.eigvalsh(hessian)[0] > -1e-9
    assert outcome.value == problem.value(outcome.x) <= problem.values[0]
    if minimum is not None:
        np.testing.assert_allclose(outcome.x, minimum, rtol=0, atol=1e-3 if f is powell else 1e-9)


def test_a_convex_quadratic_takes_one_step() -> None:
    outcome = minimize(objective(3, lambda x: ca.sumsqr(x - 2) + 7), np.zeros(3), Criteria())
    assert (outcome.why, outcome.iterations) == (Reason.STATIONARY, 2)
    np.testing.assert_allclose(outcome.x, 2.0, rtol=1e-15)


def test_a_minimum_of_value_zero_is_recognized_by_the_step() -> None:
    outcome = minimize(objective(2, rosenbrock), np.array([1.0, 1.0]), Criteria())
    assert (outcome.why, outcome.iterations) == (Reason.STATIONARY, 1)
    assert outcome.value == 0.0


def test_the_history_records_every_step_and_the_value_never_increases() -> None:
    reports: list[tuple[int, float]] = []
    problem = objective(2, rosenbrock)
    outcome = minimize(
        problem, np.array([-1.2, 1.0]), Criteria(), lambda i, value: reports.append((i, value))
    )
    assert len(outcome.history) == outcome.iterations == len(problem.values) - 1
    assert [i for i, _ in reports] == list(range(1, outcome.iterations + 1))
    best = [problem.values[0], *(value for _, value in reports)]
    assert (np.diff(best) <= 1e-14).all()
    assert [step.value for step in outcome.history] == problem.values[1:]


@dataclass
class RecordingModels(Smooth):
    """Like Smooth; records which of its models were requested without a previous one."""

    exact: list[bool] = field(default_factory=list)

    def model(
        self, x: Array, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        self.exact.append(previous is None)
        return super().model(x, previous, step)


@pytest.mark.parametrize("f", [rosenbrock, himmelblau, beale])
def test_the_last_step_uses_an_exact_model_and_converges_to_rounding(
    f: Callable[[ca.SX], ca.SX],
) -> None:
    x = ca.SX.sym("x", 2)
    problem = RecordingModels(x, f(x) + 1)
    outcome = minimize(problem, np.array([0.6, 0.2]), Criteria(decrease=1e-9, exact=True))
    assert outcome.why is Reason.STATIONARY
    assert outcome.convex
    assert problem.exact[0]
    assert problem.exact[-1]
    assert not any(problem.exact[1:4])
    gradient, hessian = (each.full() for each in problem.second(outcome.x))
    assert np.abs(np.linalg.solve(hessian, gradient)).max() < 1e-12


def test_only_a_minimum_is_reported_as_convex() -> None:
    options = Criteria(exact=True, escape_saddles=False)
    assert not minimize(objective(2, two_wells), np.zeros(2), options).convex
    assert minimize(objective(2, two_wells), np.array([0.1, 1.0]), options).convex


# Saddles


def test_a_saddle_is_left_along_negative_curvature() -> None:
    outcome = minimize(objective(2, two_wells), np.zeros(2), Criteria())
    assert outcome.why is Reason.STATIONARY
    assert outcome.value == pytest.approx(-0.25, rel=1e-14)
    np.testing.assert_allclose(np.abs(outcome.x), [0.0, 0.5**0.5], atol=1e-9)
    assert outcome.saddles_left == [0.0]


def test_a_saddle_is_returned_if_escape_is_off() -> None:
    outcome = minimize(objective(2, two_wells), np.zeros(2), Criteria(escape_saddles=False))
    assert (outcome.why, outcome.iterations) == (Reason.STATIONARY, 0)
    np.testing.assert_array_equal(outcome.x, 0.0)


@pytest.mark.parametrize("start", [[1.0, 0.0], [-3.0, 0.0], [1e-3, 0.0]])
def test_a_gradient_orthogonal_to_negative_curvature_does_not_end_in_a_saddle(
    start: list[float],
) -> None:
    # the hard case: the valley x[1] = 0 leads to the saddle
    outcome = minimize(objective(2, two_wells), np.array(start), Criteria())
    assert outcome.why is Reason.STATIONARY
    assert outcome.value == pytest.approx(-0.25, rel=1e-12)


def test_a_maximum_is_left_too() -> None:
    outcome = minimize(
        objective(3, lambda x: ca.sum1(ca.cos(x))), np.zeros(3), Criteria(radius=1.0)
    )
    assert outcome.why is Reason.STATIONARY
    assert outcome.value == pytest.approx(-3.0, rel=1e-12)


# Limits


def test_the_iteration_limit_returns_the_best_so_far() -> None:
    problem = objective(2, rosenbrock)
    outcome = minimize(problem, np.array([-1.2, 1.0]), Criteria(max_iterations=5))
    assert (outcome.why, outcome.iterations) == (Reason.ITERATION_LIMIT, 5)
    assert outcome.value == min(problem.values) == problem.value(outcome.x)


def test_the_time_limit_returns_the_best_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    class Clock:
        now = 0.0

        def monotonic(self) -> float:
            self.now += 1.0
            return self.now

    monkeypatch.setattr("hovi.system.deadline.time", Clock())
    problem = objective(2, rosenbrock)
    outcome = minimize(problem, np.array([-1.2, 1.0]), Criteria(time_limit=4.5))
    assert outcome.why is Reason.TIME_LIMIT
    assert 0 < outcome.iterations <= 4
    assert outcome.value == min(problem.values) == problem.value(outcome.x)


def test_an_expired_time_limit_allows_no_step() -> None:
    outcome = minimize(objective(2, rosenbrock), np.array([-1.2, 1.0]), Criteria(time_limit=-1.0))
    assert (outcome.why, outcome.iterations) == (Reason.TIME_LIMIT, 0)


@pytest.mark.parametrize("evaluations", [2, 5, 9])
def test_an_interrupt_returns_the_best_so_far(evaluations: int) -> None:
    @dataclass
    class Interrupted(Smooth):
        def value(self, x: Array) -> float:
            if len(self.values) == evaluations:
                raise KeyboardInterrupt
            return super().value(x)

    x = ca.SX.sym("x", 2)
    problem = Interrupted(x, rosenbrock(x))
    outcome = minimize(problem, np.array([-1.2, 1.0]), Criteria())
    assert outcome.why is Reason.INTERRUPTED
    assert outcome.iterations == evaluations - 1
    assert outcome.value == min(problem.values)
    np.testing.assert_allclose(outcome.value, float(problem.function(outcome.x)), rtol=1e-15)


def test_an_interrupt_in_the_callback_keeps_the_previous_step() -> None:
    def report(iteration: int, value: float) -> None:
        if iteration == 3:
            raise KeyboardInterrupt

    problem = objective(2, rosenbrock)
    outcome = minimize(problem, np.array([-1.2, 1.0]), Criteria(), report)
    assert outcome.why is Reason.INTERRUPTED
    assert outcome.value == float(problem.function(outcome.x)) <= min(problem.values[:3])


# Non-finite numbers


@pytest.mark.parametrize("start", [-1.0, 0.0, np.nan])
def test_a_start_without_a_finite_value_diverges_at_once(start: float) -> None:
    outcome = minimize(objective(1, barrier), np.array([start]), Criteria())
    assert (outcome.why, outcome.iterations) == (Reason.DIVERGED, 0)


def test_steps_to_a_non_finite_value_are_rejected() -> None:
    problem = objective(1, lambda x: ca.sqrt(x[0]) + 0.1 / x[0])
    outcome = minimize(problem, np.array([5.0]), Criteria(radius=1e3))
    assert not np.isfinite(problem.values).all()
    assert outcome.why is Reason.STATIONARY
    assert outcome.x[0] == pytest.approx(0.2 ** (2 / 3))


@pytest.mark.parametrize(
    "f", [lambda x: -(x[0] ** 4), lambda x: x[0] ** 3, lambda x: -ca.exp(x[0]), lambda x: -x[0]]
)
def test_an_unbounded_function_is_never_reported_as_stationary(f: Callable[[ca.SX], ca.SX]) -> None:
    outcome = minimize(objective(1, f), np.array([-0.3]), Criteria(max_iterations=200))
    assert outcome.why in (Reason.ITERATION_LIMIT, Reason.DIVERGED)


@pytest.mark.parametrize("part", ["gradient", "hessian"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_non_finite_derivatives_end_the_iteration(part: str, bad: float) -> None:
    @dataclass
    class Broken(Smooth):
        def model(
            self, x: Array, previous: QuadraticModel | None, step: Array | None
        ) -> QuadraticModel:
            g, H = (y.full() for y in self.second(x))
            if previous is not None:
                (g if part == "gradient" else H)[0, 0] = bad
            return DenseModel(g.ravel(), H)

    x = ca.SX.sym("x", 2)
    problem = Broken(x, rosenbrock(x))
    with np.errstate(invalid="ignore"):
        outcome = minimize(problem, np.array([-1.2, 1.0]), Criteria())
    assert outcome.why is Reason.DIVERGED
    assert np.isfinite(outcome.x).all()
    assert outcome.value == min(value for value in problem.values if np.isfinite(value))


def test_wrong_derivatives_end_as_diverged() -> None:
    @dataclass
    class Uphill(Smooth):
        def model(
            self, x: Array, previous: QuadraticModel | None, step: Array | None
        ) -> QuadraticModel:
            g, H = (y.full() for y in self.second(x))
            return DenseModel(-g.ravel(), H)

    x = ca.SX.sym("x", 2)
    outcome = minimize(Uphill(x, ca.sumsqr(x) + 1), np.array([1.0, 2.0]), Criteria())
    assert outcome.why is Reason.DIVERGED
    np.testing.assert_array_equal(outcome.x, [1.0, 2.0])


# The subproblem


def least_in_ball(model: DenseModel, radius: float) -> float:
    """min g.s + 1/2 s.H s over |s|_D <= radius, by eigenvalues and bisection of the shift."""
    L = np.linalg.cholesky(model.metric)
    inverse = np.linalg.inv(L)
    e, V = np.linalg.eigh(inverse @ model.hessian @ inverse.T)
    g = V.T @ inverse @ model.gradient

    def length(shift: float) -> float:
        return float(np.linalg.norm(g / (e + shift)))

    low = max(0.0, -e[0])
    if e[0] > 0 and length(0.0) <= radius:
        return float(-0.5 * np.sum(g**2 / e))
    low, high = low + 1e-13 * (1 + low), low + np.linalg.norm(g) / radius + 1e-9
    if length(low) < radius:  # the hard case: completed along the lowest eigenvector
        s = -g / (e + low)
        s[0] += np.sqrt(radius**2 - s @ s)
        return float(g @ s + s @ (e * s) / 2)
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if length(middle) > radius else (low, middle)
    s = -g / (e + high)
    return float(g @ s + s @ (e * s) / 2)


def random_model(n: int, lowest: float, seed: int, hard: bool = False) -> DenseModel:
    random = np.random.default_rng(seed)
    Q = np.linalg.qr(random.normal(size=(n, n)))[0]
    e = np.linspace(lowest, 3.0, n) if n > 1 else np.array([lowest])
    g = random.normal(size=n)
    if hard:
        g[0] = 0.0
    A = random.normal(size=(n, n))
    D = A @ A.T + np.eye(n)
    L = np.linalg.cholesky(D)
    return DenseModel(L @ Q @ g, L @ Q @ np.diag(e) @ Q.T @ L.T, D)


@pytest.mark.parametrize("n", [1, 2, 7])
@pytest.mark.parametrize("lowest", [1.0, 1e-6, -1e-6, -1.0])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize("hard", [False, True])
def test_a_step_is_nearly_optimal_within_three_quarters_of_the_radius(
    n: int, lowest: float, radius: float, hard: bool
) -> None:
    for seed in range(5):
        model = random_model(n, lowest, seed, hard)
        for guess in (0.0, 0.1, 50.0):
            trial = solve_subproblem(model, radius, guess)
            assert trial.norm <= 1.25 * radius * (1 + 1e-9)
            assert model.norm(trial.step) == pytest.approx(trial.norm, rel=1e-6, abs=1e-12 * radius)
            best = least_in_ball(model, 0.75 * radius)
            assert model.change(trial.step) <= best + 0.1 * abs(best) + 1e-15


@pytest.mark.parametrize(
    ("norm", "ratio", "sign"),
    [(2.0, 0.95, 1), (2.0, 0.8, 1), (2.0, 0.5, 0), (2.0, 0.3, 0), (1.0, 0.95, 0), (2.0, 0.2, -1)],
)
def test_the_radius_grows_only_where_it_limits_a_good_model(
    norm: float, ratio: float, sign: int
) -> None:
    """It stays for ratios between 1/4 and 3/4 [NocedalWright2006, algorithm 4.1]."""
    assert np.sign(next_radius(2.0, norm, ratio) - 2.0) == sign


@pytest.mark.parametrize("ratio", [-9.0, -0.5, 0.2])
def test_after_a_failed_step_the_radius_is_a_quarter_to_a_half_of_it(ratio: float) -> None:
    assert 0.25 <= next_radius(2.0, 1.0, ratio) <= 0.5


@pytest.mark.parametrize("n", [2, 7])
@pytest.mark.parametrize("lowest", [1.0, 1e-6, -1e-6, -1.0])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize("hard", [False, True])
def test_the_predicted_decrease_equals_that_of_the_model(
    n: int, lowest: float, radius: float, hard: bool
) -> None:
    for seed in range(5):
        model = random_model(n, lowest, seed, hard)
        trial = solve_subproblem(model, radius, 0.0)
        assert trial.decrease == pytest.approx(-model.change(trial.step), rel=0.1)


@pytest.mark.parametrize("radius", [1.0, 10.0, 100.0])
def test_a_step_along_negative_curvature_goes_downhill(radius: float) -> None:
    for seed in range(20):
        model = random_model(4, -1.0, seed)
        inverse = np.linalg.inv(np.linalg.cholesky(model.metric))
        lowest = inverse.T @ np.linalg.eigh(inverse @ model.hessian @ inverse.T)[1][:, 0]
        for guess in (0.0, 2.0):
            trial = solve_subproblem(model, radius, guess)
            along = lowest @ model.metric @ trial.step
            assert along * (lowest @ model.gradient) < 0


def test_a_newton_step_within_the_radius_is_taken_for_any_initial_shift() -> None:
    model = random_model(5, 1.0, 0)
    newton = np.linalg.solve(model.hessian, -model.gradient)
    for guess in (0.0, 1e-3, 1.0, 1e3):
        trial = solve_subproblem(model, 2 * model.norm(newton), guess)
        assert trial.newton
        np.testing.assert_allclose(trial.step, newton, rtol=1e-9)


def test_only_a_stationary_point_takes_a_pure_negative_curvature_step() -> None:
    model = random_model(4, -1.0, 0)
    assert not solve_subproblem(model, 1.0, 0.0).along_negative_curvature
    at_rest = DenseModel(0 * model.gradient, model.hessian, model.metric)
    trial = solve_subproblem(at_rest, 1.0, 0.0)
    assert trial.along_negative_curvature
    assert trial.norm == pytest.approx(1.0)


def test_outcomes_start_empty() -> None:
    outcome = Outcome(0.0, 1.0, Reason.DIVERGED, 0)
    assert outcome.history == []
    assert outcome.saddles_left == []


@pytest.mark.parametrize("cubic", [0.05, 0.1, 0.2])
def test_no_step_is_taken_once_only_rounding_remains(cubic: float) -> None:
    """Newton's iterates of 1 + x^2/2 + c x^3 are x' = 3 c x^2 / (1 + 6 c x), towards 0."""
    f = objective(1, lambda x: 1 + x[0] ** 2 / 2 + cubic * x[0] ** 3)
    found = minimize(f, np.array([1e-3]), Criteria(exact=True))
    iterates = [1e-3]
    for _ in range(found.iterations):
        iterates.append(3 * cubic * iterates[-1] ** 2 / (1 + 6 * cubic * iterates[-1]))
    left = [x**2 / 2 + cubic * x**3 for x in iterates]
    assert left[-1] <= 1e-26 < left[-2]
    assert found.x[0] == pytest.approx(iterates[-1], abs=1e-16)


def test_it_ends_where_some_steps_together_decrease_the_value_by_a_small_share() -> None:
    """Far above the minimum, in the valley, where it goes on without that option."""
    start, share = np.array([-1.2, 1.0] * 5), 0.3
    problem = objective(10, chained_rosenbrock)
    first = problem.value(start)
    whole = minimize(problem, start, Criteria())
    found = minimize(problem, start, Criteria(stalled=share))
    assert whole.why is Reason.STATIONARY
    assert found.why is Reason.STALLED
    assert found.iterations < whole.iterations
    values = np.minimum.accumulate([first, *(each.value for each in found.history)])
    decreases = 1.0 - values[5:] / values[:-5]
    assert decreases[-1] < share
    assert (decreases[:-1] >= share).all()


def test_a_direction_without_a_positive_length_is_an_arithmetic_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Among penalties of 1e12 rounding errors may leave the root of a negative number."""
    model = random_model(5, -1.0, seed=3, hard=True)
    monkeypatch.setattr(DenseModel, "metric_product", lambda self, s: -np.asarray(s))
    with pytest.raises(ArithmeticError, match="singular to rounding"):
        solve_subproblem(model, 1.0, 0.0)


def test_slow_convergence_to_a_degenerate_minimum_goes_on() -> None:
    """Newton steps leave two thirds of the distance, and a fifth of the decrease."""
    found = minimize(objective(1, lambda x: 1 + (x - 3) ** 4), np.array([1.0]), EXACT)
    assert found.why is Reason.STATIONARY
    assert abs(found.x[0] - 3.0) < 2e-3
    assert found.value - 1.0 < 1e-12


def test_values_that_rise_by_rounding_errors_do_not_stall() -> None:
    class Rising(Smooth):
        """Every value is a little larger than the last one, by less than noise."""

        def value(self, x: Array) -> float:
            return 1.0 + 1e-15 * len(self.values) + 0.0 * super().value(x)

    x = ca.SX.sym("x", 1)
    options = Criteria(max_iterations=8, radius=1e-12)
    found = minimize(Rising(x, 1e-4 * x**2), np.array([1.0]), options)
    assert found.value > 1.0 + 5e-15
    assert found.why is Reason.ITERATION_LIMIT

"""Axes of numbers that are sampled in a box: uniform, Sobol, Latin hypercube."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError
from hovi.study.cells.axis import Axis, Rows, check_count
from hovi.study.cells.field_path import FieldPath

Array = npt.NDArray[np.float64]
SamplerName = Literal["uniform", "sobol", "latin-hypercube"]


def sampled(
    fields: Sequence[FieldPath], sampler: str, lower: Any, upper: Any, count: int, seed: int
) -> Axis:
    """Samples in a box.

    fields: one, of a number or a list, or several of one number each.
    lower, upper: numbers, or lists of them: the corners of the box.
    Raises SceneError for corners that do not fit.
    """
    low, high = _corner(lower, "lower"), _corner(upper, "upper")
    if len(low) != len(high) or (len(fields) > 1 and len(low) != len(fields)):
        raise SceneError(
            f"the study's samples of {', '.join(repr(each.text) for each in fields)} need as many "
            f"numbers in `lower` and `upper` as there are fields, got {len(low)} and {len(high)}."
        )
    points = samples_in_box(sampler, low, high, count, seed)
    whole_list = len(fields) == 1 and isinstance(lower, list)
    return Axis(tuple(fields), Rows(points, _as_list) if whole_list else Rows(points), True)


def samples_in_box(sampler: str, lower: Array, upper: Array, count: int, seed: int) -> Array:
    """Points between two corners, shape (count, d), of `scipy.stats.qmc` or uniform.

    Raises SceneError for an unknown sampler, a box upside down and too many samples.
    """
    check_count(count, len(lower), "the count of samples")
    if not (lower <= upper).all():
        raise SceneError(f"the study's box ends at {upper.tolist()}, below {lower.tolist()}.")
    if sampler not in _SAMPLERS:
        raise SceneError(
            f"there is no sampler {sampler!r}; it is one of {', '.join(get_args(SamplerName))}."
        )
    return np.asarray(lower + (upper - lower) * _SAMPLERS[sampler](len(lower), count, seed))


def _uniform(dimensions: int, count: int, seed: int) -> Array:
    return np.random.default_rng(seed).random((count, dimensions))


def _sobol(dimensions: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc  # 0.5 s

    with warnings.catch_warnings():  # of counts that are no power of two, which are less even
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(count))


def _latin_hypercube(dimensions: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    sampler = qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed))
    return np.asarray(sampler.random(count))


_SAMPLERS: dict[str, Callable[[int, int, int], Array]] = {
    "uniform": _uniform,
    "sobol": _sobol,
    "latin-hypercube": _latin_hypercube,
}


def _corner(given: Any, name: str) -> Array:
    numbers = given if isinstance(given, list) else [given]
    if not numbers:
        raise SceneError(f"`{name}` of the study's samples is empty: give it numbers.")
    return np.array(numbers, dtype=np.float64)


def _as_list(row: list[float]) -> tuple[Any, ...]:
    return (row,)

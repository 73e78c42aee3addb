"""Interpolation of paths and steps in interval columns equal their definitions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.interval_paths import PathArrays, interpolate, misfit, move

Array = npt.NDArray[np.float64]

SHAPES = [(1, 0, 1), (3, 2, 2), (5, 4, 7)]
"""Intervals N, inner modes r, components n."""


def random_path(N: int, r: int, n: int) -> tuple[PathArrays, Array, np.random.Generator]:
    """A path and unequal steps."""
    random = np.random.default_rng(N)
    shapes = (N + 1, n), (N + 1, n), (N, 2, n), (N, r, n)
    q, v, z, inner = (random.normal(size=shape) for shape in shapes)
    return (q, v, z, inner), random.uniform(0.1, 2.0, N), random


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_interpolation_matches_the_table(shape: tuple[int, int, int]) -> None:
    path, h, random = random_path(*shape)
    q, v, z, inner = path
    for modes in range(shape[1] + 1):  # of a scheme that has fewer than the path
        table = random.normal(size=(4, 3, 3 + modes))
        chosen = np.flatnonzero(random.uniform(size=shape[0]) < 0.7)
        k, hh = chosen, h[chosen][:, None, None]
        columns = np.concatenate([v[k, None] / hh, z[k], inner[k, :modes]], axis=1)
        expected = np.einsum("jdc,kcn->dkjn", table, hh**2 * columns)
        expected /= h[chosen][:, None, None] ** np.arange(3)[:, None, None, None]
        expected[0] += q[k, None]
        found = interpolate(table, h[chosen], chosen, path)
        np.testing.assert_allclose(found.reshape(expected.shape), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_steps_match_their_columns(shape: tuple[int, int, int]) -> None:
    path, h, random = random_path(*shape)
    N, r, n = shape
    _, v, z, inner = path
    dq, dv = random.normal(size=(2, N + 1, n))
    change = random.normal(size=(N, r, n))
    hh = h[:, None]
    starts = np.stack([dq[:-1], hh * dv[:-1]], axis=1)
    step = np.concatenate([starts, np.stack([dq[1:], hh * dv[1:]], 1), change], axis=1)
    found = move(path, step, h, nodal=True)
    z0 = (dq[1:] - dq[:-1] - hh * dv[:-1]) / hh**2
    dz = np.stack([z0, (dv[1:] - dv[:-1]) / hh], axis=1)
    after = dq, v + dv, z + dz, inner + change / hh[..., None] ** 2
    for x, y in zip(found, after, strict=True):
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-11)
    regular = np.concatenate([starts, hh[..., None] ** 2 * dz, change], axis=1)
    found = move(path, regular, h, nodal=False)
    dq[-1] = dv[-1] = 0.0
    after = dq, v + dv, *after[2:]
    for x, y in zip(found, after, strict=True):
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-11)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_a_misfit_is_the_largest_difference_of_z(shape: tuple[int, int, int]) -> None:
    (q, v, z, inner), h, _ = random_path(*shape)
    hh = h[:, None]
    gaps = (
        np.diff(q, axis=0) - hh * v[:-1] - hh**2 * z[:, 0],
        hh * (np.diff(v, axis=0) - hh * z[:, 1]),
    )
    expected = np.abs(gaps).max() / max(1.0, np.abs(q).max())
    assert misfit((q, v, z, inner), h) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("part", range(4))
@pytest.mark.parametrize("what", [np.nan, np.inf, -np.inf])
def test_the_misfit_of_a_non_finite_path_is_nan(part: int, what: float) -> None:
    path, h, _ = random_path(*SHAPES[1])
    path[part].flat[-1] = what
    assert np.isnan(misfit(path, h))

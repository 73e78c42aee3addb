"""The Lagrangian of a motion in segments at points of any time."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from hovi.errors import InputError
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.segmented_lagrangian import SegmentedLagrangian

Q, V, A, TIME = (ca.SX.sym(name) for name in ("q", "v", "a", "t"))
FIRST = CasadiLagrangian([Q, V, A], A**2 / 2 + ca.sin(Q))
SECOND = CasadiLagrangian([Q, V, A], A**2 + V * TIME, time=TIME)
BOTH = SegmentedLagrangian((FIRST, SECOND, FIRST), (1.0, 2.5))


def test_every_point_has_the_lagrangian_of_its_time() -> None:
    """In any order; a point where two segments meet is in the later one."""
    t = np.array([2.0, 0.5, 3.0, 1.0, 2.5, 0.0])
    jet = tuple(np.random.default_rng(0).standard_normal((3, 6, 1)))
    in_second = (t >= 1.0) & (t < 2.5)
    expected = np.where(in_second, SECOND.value(*jet, t=t), FIRST.value(*jet, t=t))
    np.testing.assert_array_equal(BOTH.value(*jet, t=t), expected)
    for found, one, other in zip(
        BOTH.evaluate(*jet, t=t), FIRST.evaluate(*jet, t=t), SECOND.evaluate(*jet, t=t), strict=True
    ):
        np.testing.assert_array_equal(found[in_second], other[in_second])
        np.testing.assert_array_equal(found[~in_second], one[~in_second])
    assert BOTH.output(*jet, t=t).shape == (6, 0)
    assert BOTH.value(*(x[:0] for x in jet), t=t[:0]).shape == (0,)


def test_it_depends_on_time() -> None:
    assert BOTH.timed
    with pytest.raises(InputError, match="needs t, one time per point"):
        BOTH.value(*np.zeros((3, 1, 1)))


@pytest.mark.parametrize("ends", [(1.0,), (1.0, 1.0), (0.0, 1.0), (1.0, np.nan)])
def test_segments_end_at_ascending_times(ends: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match=r"a time between each two|ascending times"):
        SegmentedLagrangian((FIRST, SECOND, FIRST), ends)


def test_segments_have_no_segments() -> None:
    with pytest.raises(InputError, match="a segment of a motion has no segments of its own"):
        SegmentedLagrangian((BOTH, FIRST), (1.0,))

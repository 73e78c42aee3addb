"""Factorisation of the model by merging intervals in pairs: accurate at every step length.

Two adjacent intervals become one of their joint length by eliminating the node between them, in
the form of its deviation Y from the cubic through the outer ends. All blocks are in regularized
coordinates (q0, H v0, Z0, Z1) of the merged interval, so no entry is a difference of numbers that
grow like h^-3; there are log2(N) levels of small batched operations. The inertias of the eliminated
blocks add up to that of H. [ColomboFerraroMartin2016, section 2]
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from hovi.optimize.quadratic_model import Factor, IntervalSum, QuadraticModel
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]

CHUNK = 512
"""Number of intervals or pairs eliminated at a time."""


@dataclass(frozen=True, eq=False)
class MergeLevel:
    """One level of merging adjacent pairs.

    left, right: matrices from the parent's (q0, H v0, Z0, Z1, Y0, Y1) to the children's
        coordinates, shape (P, 4, 6), or (1, 4, 6) where all pairs are split in the same ratio.
    pairs: number P of parents. A last interval without a partner is passed on unchanged.
    """

    left: Array
    right: Array
    pairs: int

    def merge(self, children: Array) -> Array:
        """Sum of the children's covectors on their parents, (P, 6, n)."""
        left = np.matmul(self.left.transpose(0, 2, 1), children[0 : 2 * self.pairs : 2])
        right = np.matmul(self.right.transpose(0, 2, 1), children[1 : 2 * self.pairs : 2])
        return np.asarray(left + right)

    def merge_hessian(self, children: Array) -> Array:
        """Sum of the children's Hessians (C, 4, 4, n, n) on their parents, (P, 6, 6, n, n)."""
        n = children.shape[-1]
        P = self.pairs
        total = np.zeros((P, 36, n * n))
        for T, first in ((self.left, 0), (self.right, 1)):
            child = children[first : 2 * P : 2]
            pairs = np.einsum("pxi,pyj->pijxy", T, T).reshape(len(T), 36, 16)
            total += np.matmul(pairs, child.reshape(P, 16, n * n))
        return total.reshape(P, 6, 6, n, n)

    def chunk(self, first: int, last: int) -> MergeLevel:
        """The level restricted to some of the pairs."""
        one = len(self.left) == 1
        left, right = (T if one else T[first:last] for T in (self.left, self.right))
        return MergeLevel(left, right, last - first)

    def split(self, parents: Array) -> Array:
        """Coordinates of the children (C, 4, n) from those of the parents (P, 6, n)."""
        children = np.empty((2 * self.pairs, 4, parents.shape[-1]))
        children[0::2] = np.matmul(self.left, parents)
        children[1::2] = np.matmul(self.right, parents)
        return children


def merge_levels(steps: Array) -> list[MergeLevel]:
    """The levels that merge intervals of the given lengths into one."""
    levels = []
    lengths = np.asarray(steps, dtype=np.float64)
    while len(lengths) > 1:
        P = len(lengths) // 2
        joint = lengths[0 : 2 * P : 2] + lengths[1 : 2 * P : 2]
        fraction = lengths[0 : 2 * P : 2] / joint
        left, right = _split_tables(fraction[:1] if np.ptp(fraction) == 0 else fraction)
        levels.append(MergeLevel(left, right, P))
        lengths = np.concatenate([joint, lengths[2 * P :]])
    return levels


def _split_tables(fraction: Array) -> tuple[Array, Array]:
    """Coordinates of both parts of an interval that is split at `fraction` of its length.

    At the split the cubic through the ends has the values q1 = q0 + x and H v1; Y is added to them.
    """
    s, b = fraction, 1 - fraction
    zero, one = np.zeros_like(s), np.ones_like(s)
    x = np.stack([one, s, s**2 * (3 - 2 * s), s**2 * (s - 1), one, zero], axis=1)
    Hv = np.stack([zero, one, 6 * s * b, s * (3 * s - 2), zero, one], axis=1)
    dq = x.copy()  # q1 - q0 - fraction H v0
    dq[:, :2] = 0
    dv = Hv.copy()  # H v1 - H v0
    dv[:, 1] = 0
    q0, Hv0, q2, dv2 = (np.zeros_like(x) for _ in range(4))
    q0[:, 0] = Hv0[:, 1] = dv2[:, 3] = 1
    left = np.stack([q0, s[:, None] * Hv0, dq, s[:, None] * dv], axis=1)
    # q2 - q1 - b H v1, in which q0 and H v0 cancel
    q2[:, 2] = 1
    rest = q2 - dq - b[:, None] * dv
    right = np.stack([x, b[:, None] * Hv, rest, b[:, None] * (dv2 - dv)], axis=1)
    return left, right


@dataclass(frozen=True, eq=False)
class _Elimination:
    """Eliminated unknowns y of a batch: y = inverse (rhs) - coupling x."""

    inverse: Array  # (B, k, k)
    coupling: Array  # (B, k, 4n)


@dataclass(frozen=True, eq=False)
class MergeTree:
    """The structure of the elimination: inner modes first, then the nodes level by level.

    levels: from the intervals upwards. intervals: N. inner_modes: r. dof: n.
    present: which inner modes exist, shape (N, r); the others are fixed at zero.
    """

    levels: list[MergeLevel]
    intervals: int
    inner_modes: int
    dof: int
    present: npt.NDArray[np.bool_]

    @property
    def shapes(self) -> list[tuple[int, ...]]:
        """Shapes of the parts of a step: inner modes, then Y of every level."""
        first = (self.intervals, self.inner_modes, self.dof)
        return [first, *((level.pairs, 2, self.dof) for level in self.levels)]

    def parts(self, s: Array) -> list[Array]:
        """The parts of a flat step."""
        ends = np.cumsum([int(np.prod(shape)) for shape in self.shapes])[:-1]
        flat = np.split(s, ends)
        return [part.reshape(shape) for part, shape in zip(flat, self.shapes, strict=True)]


class MergeTreeModel(QuadraticModel):
    """A quadratic model in the hierarchical coordinates of a merge tree, both ends fixed.

    The columns of the intervals are the regularized ones: (q0, h v0, Z0, Z1, c).
    """

    def __init__(self, intervals: IntervalSum, tree: MergeTree) -> None:
        self.tree = tree
        super().__init__(intervals)

    def scatter(self, local: Array) -> Array:
        """Covectors of the intervals in the coordinates of the tree."""
        parts = [np.where(self.tree.present[..., None], local[:, 4:], 0.0).ravel()]
        g = local[:, :4]
        for level in self.tree.levels:
            merged = level.merge(g)
            parts.append(merged[:, 4:].ravel())
            g = np.concatenate([merged[:, :4], g[2 * level.pairs :]])
        return np.concatenate(parts)

    def gather(self, s: Array) -> Array:
        """Columns of every interval from a step."""
        inner, *rest = self.tree.parts(s)
        x = np.zeros((1, 4, self.tree.dof))
        for level, Y in zip(reversed(self.tree.levels), reversed(rest), strict=True):
            x = _descend(level, x, Y)
        return np.concatenate([x, np.where(self.tree.present[..., None], inner, 0.0)], axis=1)

    def factor(self, shift: float) -> Factor | None:
        """Cholesky of every eliminated block of H + shift D; None where one fails."""
        try:
            eliminations, _ = self._eliminate(shift, definite=True)
        except np.linalg.LinAlgError:
            return None
        return MergeFactor(self.tree, eliminations)

    def negative_eigenvalues(self) -> int:
        """n_neg by a block LDL^T: the negative eigenvalues of all eliminated blocks."""
        return self._eliminate(0.0, definite=False)[1]

    def _eliminate(self, shift: float, definite: bool) -> tuple[list[_Elimination], int]:
        r, n = self.tree.inner_modes, self.tree.dof
        chunks = (self._shifted(shift, part) for part in _chunks(self.tree.intervals))
        S, elimination, negative = _condense_all(chunks, r, n, definite)
        eliminations = [elimination]
        for level in self.tree.levels:
            chunks = (
                level.chunk(part.start, part.stop).merge_hessian(S[2 * part.start : 2 * part.stop])
                for part in _chunks(level.pairs)
            )
            merged, elimination, count = _condense_all(chunks, 2, n, definite)
            eliminations.append(elimination)
            negative += count
            S = np.concatenate([merged, S[2 * level.pairs :]])
        return eliminations, negative

    def _shifted(self, shift: float, part: slice) -> Array:
        A = self.intervals.hessian[part].copy()
        if shift:
            diagonal = np.arange(self.tree.dof)
            A[:, :, :, diagonal, diagonal] += shift * self.intervals.metric[part][..., None]
        i, j = np.nonzero(~self.tree.present[part])
        A[i, 4 + j, 4 + j] += np.eye(self.tree.dof)
        return A


@dataclass(frozen=True, eq=False)
class MergeFactor:
    """The factor of a merge tree."""

    tree: MergeTree
    eliminations: list[_Elimination]

    def solve(self, rhs: Array) -> Array:
        """(H + shift D)^-1 rhs."""
        parts = self.tree.parts(rhs)
        solved, remaining = _forward(self.eliminations[0], parts[0], None)
        forward = [solved]
        for i, level in enumerate(self.tree.levels, start=1):
            merged = level.merge(remaining)
            solved, merged_rest = _forward(
                self.eliminations[i], parts[i] + merged[:, 4:], merged[:, :4]
            )
            forward.append(solved)
            remaining = np.concatenate([merged_rest, remaining[2 * level.pairs :]])
        return self._backward(forward)

    def _backward(self, forward: list[Array]) -> Array:
        x = np.zeros((1, 4, self.tree.dof))
        parts = []
        for i in range(len(self.tree.levels), 0, -1):
            level = self.tree.levels[i - 1]
            Y = _back(self.eliminations[i], forward[i], x[: level.pairs])
            parts.append(Y.ravel())
            x = _descend(level, x, Y)
        parts.append(_back(self.eliminations[0], forward[0], x).ravel())
        return np.concatenate(parts[::-1])


def _descend(level: MergeLevel, x: Array, Y: Array) -> Array:
    """The children of a level from the parents' coordinates and Y; an odd last one is unchanged."""
    children = level.split(np.concatenate([x[: level.pairs], Y], axis=1))
    return np.concatenate([children, x[level.pairs :]])


def _chunks(count: int) -> Iterator[slice]:
    """Parts of a level that fit in the processor's cache."""
    for first in range(0, count, CHUNK):
        raise_if_late()
        yield slice(first, min(first + CHUNK, count))


def _condense_all(
    chunks: Iterable[Array], k: int, n: int, definite: bool
) -> tuple[Array, _Elimination, int]:
    """`_condense` for one level, chunk by chunk."""
    schur, eliminations, negative = [], [], 0
    for chunk in chunks:
        S, elimination, count = _condense(chunk, k, n, definite)
        schur.append(S)
        eliminations.append(elimination)
        negative += count
    inverse = np.concatenate([e.inverse for e in eliminations])
    coupling = np.concatenate([e.coupling for e in eliminations])
    return np.concatenate(schur), _Elimination(inverse, coupling), negative


def _condense(A: Array, k: int, n: int, definite: bool) -> tuple[Array, _Elimination, int]:
    """Eliminate the last k columns of (B, 4 + k, 4 + k, n, n).

    definite: raise LinAlgError, by Cholesky, where a block is not positive definite.
    """
    B = len(A)
    flat = A.transpose(0, 1, 3, 2, 4).reshape(B, (4 + k) * n, (4 + k) * n)
    block, coupling = flat[:, 4 * n :, 4 * n :], flat[:, 4 * n :, : 4 * n]
    negative = 0
    if definite:
        np.linalg.cholesky(block)
        inverse = np.asarray(np.linalg.inv(block), dtype=np.float64)
        solved = np.matmul(inverse, coupling)
        correction = np.matmul(coupling.transpose(0, 2, 1), solved)
    else:
        inverse, solved, correction, negative = _spectral(block, coupling)
    S = flat[:, : 4 * n, : 4 * n] - correction
    S = (S + S.transpose(0, 2, 1)) / 2
    schur = S.reshape(B, 4, n, 4, n).transpose(0, 1, 3, 2, 4)
    return schur, _Elimination(inverse, solved), negative


def _spectral(block: Array, coupling: Array) -> tuple[Array, Array, Array, int]:
    """B^-1, B^-1 C, C^T B^-1 C and the number of negative eigenvalues of symmetric blocks B.

    From the eigenvectors of B, scaled to unit diagonal: on long chains, products with B^-1 itself
    are too inaccurate to count signs.
    """
    size = np.sqrt(np.abs(np.einsum("bii->bi", block)))
    size[size == 0] = 1.0
    value, vector = np.linalg.eigh(block / (size[:, :, None] * size[:, None, :]))
    vector = vector / size[:, :, None]
    rotated = np.matmul(vector.transpose(0, 2, 1), coupling)
    divided = rotated / value[:, :, None]
    inverse = np.matmul(vector / value[:, None, :], vector.transpose(0, 2, 1))
    correction = np.matmul(rotated.transpose(0, 2, 1), divided)
    return inverse, np.matmul(vector, divided), correction, int(np.sum(value < 0))


def _forward(step: _Elimination, rhs: Array, remaining: Array | None) -> tuple[Array, Array]:
    """(block^-1 rhs, the right-hand side that remains for the other coordinates)."""
    B, _, n = rhs.shape
    flat = rhs.reshape(B, -1, 1)
    solved = np.matmul(step.inverse, flat)
    passed = np.matmul(step.coupling.transpose(0, 2, 1), flat).reshape(B, 4, n)
    return solved, -passed if remaining is None else remaining - passed


def _back(step: _Elimination, solved: Array, x: Array) -> Array:
    """The eliminated unknowns from the remaining coordinates x, shape (B, k, n)."""
    B, _, n = x.shape
    y = solved - np.matmul(step.coupling, x.reshape(B, -1, 1))
    return np.asarray(y.reshape(B, -1, n))

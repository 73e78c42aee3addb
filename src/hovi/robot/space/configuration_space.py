"""The configuration space of a robot: a product of vector spaces and Lie groups."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import numbers_of, require_rows
from hovi.errors import InputError
from hovi.robot.space.groups import GROUPS, SE2, SO2, Group, Layout, differenced, integrated
from hovi.robot.space.joint_kinds import COMPOSITE, kind_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Factor:
    """One group in the product. q, v: its indices in q and v."""

    group: Group
    q: slice
    v: slice


@check_arguments_except("parts")
@dataclass(frozen=True)
class ConfigurationSpace:
    """Q as a product; each part is a number of vector coordinates or the name of a group.

    parts: such as (3, "SO(2)", 1, "SE(3)"), in Pinocchio's order of q and v.
    Raises InputError for any other part.
    """

    parts: tuple[int | str, ...]

    def __post_init__(self) -> None:
        if not isinstance(self.parts, tuple):
            raise InputError(f"the parts of a configuration space are a tuple, not {self.parts!r}.")
        for part in self.parts:
            plain = type(part) is int and part > 0
            if not plain and not (isinstance(part, str) and part in GROUPS):
                raise InputError(
                    f"a part of a configuration space is a positive number of coordinates or one "
                    f"of {', '.join(GROUPS)}, not {part!r}."
                )

    @cached_property
    def nq(self) -> int:
        """Length of a configuration."""
        return sum(p if isinstance(p, int) else GROUPS[p].nq for p in self.parts)

    @cached_property
    def nv(self) -> int:
        """Degrees of freedom."""
        return sum(p if isinstance(p, int) else GROUPS[p].nv for p in self.parts)

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """The groups among the parts."""
        found = []
        for part, (_, iq, iv, _) in zip(self.parts, self.layout.tolist(), strict=True):
            if isinstance(part, str):
                nq, nv = _sizes(GROUPS[part])
                found.append(Factor(GROUPS[part], slice(iq, iq + nq), slice(iv, iv + nv)))
        return tuple(found)

    @cached_property
    def layout(self) -> Layout:
        """The parts for the compiled charts: rows (kind, index in q, index in v, size in v)."""
        rows, iq, iv = [], 0, 0
        for part in self.parts:
            kind = 0 if isinstance(part, int) else GROUPS[part].kind
            nq, nv = (part, part) if isinstance(part, int) else _sizes(GROUPS[part])
            rows.append((kind, iq, iv, nv))
            iq, iv = iq + nq, iv + nv
        return np.array(rows, dtype=np.int64).reshape(-1, 4)

    @cached_property
    def curved(self) -> tuple[Factor, ...]:
        """The groups that do not commute, whose charts are not the identity."""
        return tuple(factor for factor in self.factors if factor.group is not SO2)

    @cached_property
    def angles(self) -> tuple[Factor, ...]:
        """The continuous joints."""
        return tuple(factor for factor in self.factors if factor.group is SO2)

    def names(self, coordinates: Sequence[str]) -> tuple[str, ...]:
        """Names of the entries of a configuration, (nq,), from those of its velocities, (nv,).

        Entries of a group append their own name to that of the joint: wrist[cos], base[x].
        """
        named = [""] * self.nq
        for iq, iv in zip(*self.plain, strict=True):
            named[iq] = coordinates[iv]
        for factor in self.factors:
            joint = coordinates[factor.v.start].removesuffix("[0]")
            named[factor.q] = [f"{joint}[{part}]" for part in factor.group.parts]
        return tuple(named)

    @property
    def vector(self) -> bool:
        """Whether the configuration space is a vector space."""
        return not self.factors

    @property
    def flat(self) -> bool:
        """Whether the space is commutative: only vector coordinates and continuous joints."""
        return not self.curved

    @cached_property
    def plain(self) -> tuple[Index, Index]:
        """Indices in q and in v of the vector coordinates."""
        q, v = np.ones(self.nq, dtype=bool), np.ones(self.nv, dtype=bool)
        for factor in self.factors:
            q[factor.q], v[factor.v] = False, False
        return np.flatnonzero(q), np.flatnonzero(v)

    def integrate(self, q: Array, dq: Array) -> Array:
        """q (+) dq: configurations (..., nq), tangent vectors (..., nv) -> (..., nq)."""
        q, dq = numbers_of("q", q), numbers_of("dq", dq)
        if self.vector:
            require_rows((("q", q, self.nq), ("dq", dq, self.nv)))
            return q + dq
        return integrated(self.layout, q, dq)

    def difference(self, q0: Array, q1: Array) -> Array:
        """q1 (-) q0: the tangent vector of least angles that moves q0 to q1, (..., nv)."""
        q0, q1 = numbers_of("q0", q0), numbers_of("q1", q1)
        if self.vector:
            require_rows((("q0", q0, self.nq), ("q1", q1, self.nq)))
            return q1 - q0
        return differenced(self.layout, q0, q1)

    def difference_near(self, q0: Array, q1: Array, expected: Array) -> Array:
        """As `difference`, plus the full turns that bring it closest to `expected`, (..., nv).

        So rotations are continuous beyond half a turn, where `difference` jumps.
        """
        if self.vector:
            require_rows((("q0", q0, self.nq), ("q1", q1, self.nq)))
            return q1 - q0
        return differenced(self.layout, q0, q1, expected)

    def normalized(self, q: Array) -> Array:
        """Configurations (..., nq) with quaternions and (cos, sin) of unit norm."""
        result = np.array(q, dtype=np.float64)
        for group, rows, _ in self._grouped:
            result[..., rows] = group.normalized(result[..., rows])
        return result

    def nearest(self, q: Array, other: Array) -> Array:
        """Configurations (..., nq) with the quaternion signs that are closest to another one."""
        result = np.array(q, dtype=np.float64)
        for factor in self.curved:
            if factor.group is not SE2:
                part = slice(factor.q.stop - 4, factor.q.stop)
                against = np.sum(q[..., part] * other[..., part], axis=-1, keepdims=True) < 0
                result[..., part] = np.where(against, -q[..., part], q[..., part])
        return result

    def coordinates(self, q: Array) -> Array:
        """The vector coordinates at their indices in v, 0 elsewhere: (..., nq) -> (..., nv)."""
        if self.vector:
            return q
        result = np.zeros((*q.shape[:-1], self.nv))
        iq, iv = self.plain
        result[..., iv] = q[..., iq]
        return result

    @cached_property
    def _grouped(self) -> list[tuple[Group, Index, Index]]:
        """Each group with the indices of all its factors in q (F, nq) and in v (F, nv)."""
        found = []
        for group in GROUPS.values():
            chosen = [factor for factor in self.factors if factor.group is group]
            if chosen:
                rows = np.array([range(f.q.start, f.q.stop) for f in chosen], dtype=np.intp)
                columns = np.array([range(f.v.start, f.v.stop) for f in chosen], dtype=np.intp)
                found.append((group, rows, columns))
        return found


def configuration_space(model: pin.Model) -> tuple[ConfigurationSpace, tuple[str, ...]]:
    """The space of a model's joints, and the names of joints of an unsupported kind.

    The space treats such joints as vector coordinates, so it is valid only if there are none.
    """
    parts: list[int | str] = []
    unknown = []
    for name, joint in zip(model.names[1:], list(model.joints)[1:], strict=True):
        found = _parts_of(joint)
        if found is None:
            unknown.append(str(name))
        parts += found if found is not None else [joint.nv]
    return ConfigurationSpace(tuple(_merged(parts))), tuple(unknown)


def _parts_of(joint: pin.JointModel) -> list[int | str] | None:
    """The parts of a joint, or of the members of a composite; None if unsupported."""
    kind = kind_of(joint)
    if kind is COMPOSITE:
        members = [_parts_of(member) for member in joint.extract().joints]
        known = [part for member in members if member is not None for part in member]
        return known if all(member is not None for member in members) else None
    if kind.group is not None:
        return [kind.group.name]
    if kind.units is None:
        return None
    return [len(kind.units)] if kind.units else []


def _merged(parts: Sequence[int | str]) -> list[int | str]:
    """The parts with consecutive vector coordinates merged into one."""
    merged: list[int | str] = []
    for part in parts:
        last = merged[-1] if merged else None
        if isinstance(part, int) and isinstance(last, int):
            merged[-1] = last + part
        else:
            merged.append(part)
    return merged


def _sizes(group: Group) -> tuple[int, int]:
    return group.nq, group.nv


def bracket(space: ConfigurationSpace, x: Array, y: Array) -> Array:
    """The Lie bracket [x, y] of left-invariant tangent vectors, (M, nv) each."""
    result = np.zeros_like(x)
    for factor in space.curved:
        i, indices = factor.v, list(factor.group.se3_indices)
        a, b, c = np.zeros((3, len(x), 6))
        a[:, indices], b[:, indices] = x[:, i], y[:, i]
        c[:, :3] = np.cross(a[:, 3:], b[:, :3]) + np.cross(a[:, :3], b[:, 3:])
        c[:, 3:] = np.cross(a[:, 3:], b[:, 3:])
        result[:, i] = c[:, indices]
    return result

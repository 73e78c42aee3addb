"""Mutated calls of the compiled entries, and an independent account of which of them are valid.

A call that is not valid must be refused with a sentence, and a valid one must be accepted and write
every number of its outputs. The shapes are written once more here, by letters: "B*Q 3*n" is an
array of two dimensions, and a letter alone is defined where it first occurs.
"""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import casadi as ca
import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict
from hovi._native import (
    band,
    barrier,
    distances,
    dynamics,
    expressions,
    groups,
    integration,
    intervals,
    kinematics,
)
from hovi.dynamics.extension import SymbolicModel, archive
from hovi.dynamics.joint_tree import read_joint_tree
from hovi.dynamics.kinematic_chain import KinematicChain, read_kinematic_chain
from hovi.planning.clearance import compiled_distances
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot

Array = npt.NDArray[Any]
Arguments = dict[str, Any]
Sizes = dict[str, int]


@dataclass(frozen=True)
class Kind:
    """What an array must be: its shape by letters, its type, and whether it is written to.

    output: it is written without being read. updated: it must be writable, and is read.
    """

    shape: str
    dtype: str = "float64"
    output: bool = False
    updated: bool = False

    def __call__(self, sizes: Sizes, random: np.random.Generator) -> Array:
        """A valid array: random numbers, zeros of integers and booleans."""
        shape = [_size(each, sizes) for each in self.shape.split()]
        if self.dtype != "float64":
            return np.zeros(shape, self.dtype)
        return random.uniform(0.1, 1.0, shape)


@dataclass(frozen=True)
class Entry:
    """A compiled function.

    kinds: of its arrays, by argument; those in `optional` may be None.
    scalars: the other arguments, with valid values. letters: smallest and largest valid sizes.
    values: sets the integers and scalars of a valid call. fits: whether those of a call fit, as far
    as the shapes do not say it.
    """

    function: Callable[..., Any]
    kinds: Mapping[str, Kind]
    scalars: Mapping[str, Any] = field(default_factory=dict)
    optional: tuple[str, ...] = ()
    letters: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    values: Callable[[Arguments, Sizes], None] = lambda arguments, sizes: None
    fits: Callable[[Arguments, Sizes], bool] = lambda arguments, sizes: True


def _in(shape: str, dtype: str = "float64") -> Kind:
    return Kind(shape, dtype)


def _out(shape: str) -> Kind:
    return Kind(shape, output=True)


def _updated(shape: str) -> Kind:
    return Kind(shape, updated=True)


def _size(term: str, sizes: Sizes) -> int:
    return int(eval(term, {"__builtins__": {}}, sizes))


# Band

PANEL = 4


def _band_rows(arguments: Arguments, sizes: Sizes) -> None:
    """Panels that reach as far as they can."""
    panels, stride = sizes["p"], sizes["s"]
    first = PANEL * np.arange(panels)
    arguments["rows"][:] = np.minimum(stride // PANEL * PANEL, PANEL * panels - first)
    if "size" in arguments:
        arguments["size"] = max(0, PANEL * panels - 1)


def _band_fits(arguments: Arguments, sizes: Sizes) -> bool:
    panels, rows = sizes["p"], arguments["rows"].tolist()
    size = sizes["k"] if "k" in sizes else arguments["size"]
    ends = [PANEL * panel + count for panel, count in enumerate(rows)]
    inside = all(
        count > 0 and count % PANEL == 0 and count <= sizes["s"] and end <= PANEL * panels
        for count, end in zip(rows, ends, strict=True)
    )
    whole = PANEL * (panels - 1) < size <= PANEL * panels if panels else size == 0
    return inside and whole and ends == sorted(ends)


def _runs(arguments: Arguments, sizes: Sizes) -> None:
    end = min(arguments["hessian"].size, arguments["band"].size)
    arguments["lengths"][:] = min(2, end)
    arguments["positions"][:] = max(0, end - 2)


def _runs_fit(arguments: Arguments, sizes: Sizes) -> bool:
    names = (("starts", "hessian"), ("positions", "band"))
    lengths = arguments["lengths"].tolist()
    return all(
        length >= 0 and 0 <= first <= arguments[whole].size - length
        for name, whole in names
        for first, length in zip(arguments[name].tolist(), lengths, strict=True)
    )


_ROWS = {"rows": _in("p", "int64")}
_BAND = {"values": _band_rows, "fits": _band_fits, "letters": {"p": (0, 4), "s": (4, 12)}}
_SOLVE = _BAND | {"letters": {"p": (1, 4), "s": (4, 12)}}


def _of_size(shapes: Mapping[str, Kind]) -> dict[str, Kind]:
    return {**_ROWS, **shapes}


# Groups

LAYOUTS = (
    [[0, 0, 0, 3]],
    [[1, 0, 0, 1], [0, 2, 1, 2]],
    [[4, 0, 0, 6], [1, 7, 6, 1], [0, 9, 7, 1]],
    [[2, 0, 0, 3], [3, 4, 3, 3]],
    [[0, 0, 0, 10], [3, 10, 10, 3]],
)
"""Rows (kind, index in q, index in v, size): vector coordinates, SO(2), SE(2), SO(3), SE(3)."""
NQ_NV = {1: (2, 1), 2: (4, 3), 3: (4, 3), 4: (7, 6)}


def _layout_sizes(layout: list[list[int]]) -> tuple[int, int] | None:
    """(nq, nv) of a layout; None if it is not one."""
    nq = nv = 0
    for kind, iq, iv, size in layout:
        sizes = (size, size) if kind == 0 else NQ_NV.get(kind)
        if sizes is None or (iq, iv) != (nq, nv) or size != sizes[1] or size < 1:
            return None
        nq, nv = nq + sizes[0], nv + sizes[1]
    return nq, nv


def _layout_fits(arguments: Arguments, sizes: Sizes) -> bool:
    found = _layout_sizes(arguments["layout"].tolist())
    return found is not None and all(sizes.get(k, n) == n for k, n in zip("qn", found, strict=True))


_LAYOUT = {"layout": _in("l 4", "int64")}
_CHARTS = {
    **_LAYOUT,
    **{"table": _in("Q 3 m"), "weights": _in("Q"), "steps": _in("B")},
    **{"x": _in("3 B*Q n"), "ends": _in("B 2 n")},
}
_PORTABLE = {"portable": False}
_OWN_TABLES = {**_CHARTS, "table": _in("B 3 m"), "weights": _in("B"), "x": _in("3 B n")}
_GROUPS = {"fits": _layout_fits}
_ON_CHARTS = {
    "letters": {"Q": (0, 3), "m": (4, 7), "B": (0, 6)},
    "fits": lambda arguments, sizes: _layout_fits(arguments, sizes) and sizes["m"] >= 4,
    "scalars": _PORTABLE,
}
_OF_EACH = {**_ON_CHARTS, "letters": {"m": (4, 7), "B": (1, 6)}}

# Intervals

_PATH = {"v": _in("N+1 n"), "z": _in("N 2 n"), "inner": _in("N r n")}
_RESIDUALS = {"residuals": _in("P n"), "metric": _in("n")}


def _interval_numbers_fit(arguments: Arguments, sizes: Sizes) -> bool:
    inside = all(0 <= k < sizes["N"] for k in arguments["intervals"].tolist())
    return inside and 3 <= sizes["c"] <= 3 + sizes["r"]


def _columns(arguments: Arguments, sizes: Sizes) -> None:
    """As many columns as a path with r inner modes has, in a table or in rows."""
    name = "table" if "table" in arguments else "rows"
    array = arguments[name]
    arguments[name] = np.resize(array, (*array.shape[:-1], 3 + sizes["r"]))


_TABLES = {"table": _in("T R m"), "weights": _in("T"), "steps": _in("B")}
_SELECTION = {"selected": _in("K", "int64"), "scales": _in("K"), "jacobian": _in("P p R*n")}
_ROWS_OF_INTERVALS = {"intervals": _in("E", "int64"), "joints": _in("E", "int64")}


def _tables_fit(arguments: Arguments, sizes: Sizes) -> bool:
    """One table for all intervals, or one for each, and 2 to 5 rows at a point."""
    tables, points, B = sizes["T"], sizes["P"], sizes["B"]
    own = B > 1 and tables == points
    return 2 <= sizes["R"] <= 5 and (points % B == 0 if own else points == B * tables)


def _selection_fits(arguments: Arguments, sizes: Sizes) -> bool:
    end = sizes["R"] * sizes["n"] + sizes["p"]
    inside = all(0 <= column < end for column in arguments["selected"].tolist())
    return inside and _tables_fit(arguments, sizes)


def _selected(arguments: Arguments, sizes: Sizes) -> None:
    """The first columns and the last ones, outputs among them."""
    end = sizes["R"] * sizes["n"] + sizes["p"]
    arguments["selected"][:] = np.arange(sizes["K"]) * 7 % end


def _rows_fit(arguments: Arguments, sizes: Sizes) -> bool:
    intervals, joints = arguments["intervals"].tolist(), arguments["joints"].tolist()
    return all(0 <= k < sizes["N"] for k in intervals) and all(0 <= i < sizes["n"] for i in joints)


_SELECTED: dict[str, Any] = {
    "letters": {"B": (0, 4), "R": (2, 5), "n": (1, 4), "m": (0, 6)},
    "values": _selected,
    "fits": _selection_fits,
}
_LINEAR: dict[str, Any] = {"letters": {"N": (1, 4), "n": (1, 4)}, "fits": _rows_fit}

# Barrier

_SLACKS = {name: _in("R") for name in ("lower", "upper", "s", "zl", "zu")}
_NEWTON = {name: _updated("R") for name in ("ds", "dzl", "dzu")}


def _outputs(*names: str) -> dict[str, Kind]:
    return {name: _out("R") for name in names}


def _inputs(*names: str) -> dict[str, Kind]:
    return {name: _in("R") for name in names}


_TARGETS = ("lower_targets", "upper_targets")
_BARRIER: dict[str, Any] = {"letters": {"R": (0, 9)}}


@cache
def expression() -> Any:
    """Two results of two arguments: operations of every kind, of 3 and 1 numbers."""
    x, s = ca.SX.sym("x", 3), ca.SX.sym("s")
    y = ca.vertcat(ca.dot(x, x) / (1.0 + s**2), ca.if_else(x[0] > s, ca.sin(x[1]), ca.sqrt(s)))
    return expressions.expression_of(ca.Function("f", [x, s], [y, ca.densify(ca.jacobian(y, x))]))


def _run(points: int, threads: int, **arrays: Array) -> None:
    given, made = (
        tuple(x for name, x in arrays.items() if name.startswith(kind))
        for kind in ("argument", "result")
    )
    expression()(given, made, points, threads)


def _still(t: float, y: Array) -> Array:
    """Rates that any number of steps is right for."""
    return np.zeros_like(y)


def _is_integrable(arguments: Arguments, sizes: Sizes) -> bool:
    tolerances = arguments["relative"], arguments["absolute"]
    return bool(arguments["begin"] < arguments["end"] and all(each > 0.0 for each in tolerances))


def _keeps_a_share(arguments: Arguments, sizes: Sizes) -> bool:
    return bool(arguments["keep"] >= 0)


# Dynamics


@cache
def kernel() -> dynamics.InverseDynamicsKernel:
    """Of Talos' legs and body: a free-flyer, revolute joints and branches."""
    return read_joint_tree(load_robot("talos_legs").model).compiled()


_POINTS = {"q": _in("P q"), "v": _in("P n"), "a": _in("P n")}
_THREADS = {"threads": 2}
_KERNEL = {
    "letters": {"P": (0, 9)},
    "fits": lambda arguments, sizes: (
        (sizes["q"], sizes["n"]) == (kernel().nq, kernel().n)
        and -(2**31) <= arguments["threads"] < 2**31
    ),
}


@cache
def _tree() -> dict[str, Any]:
    tree = read_joint_tree(load_robot("talos_legs").model)
    return {name: np.array(value) for name, value in vars(tree).items()}


_TREE_KINDS = {
    **{"gravity": _in("6"), "parents": _in("n", "int64"), "coordinates": _in("n", "int64")},
    **{"continuous": _in("n", "bool"), "rotations": _in("n 3 3"), "translations": _in("n 3")},
    **{"angular": _in("n"), "linear": _in("n"), "masses": _in("n"), "centers": _in("n 3")},
    **{"moments": _in("n 6"), "armatures": _in("n"), "base_twist_indices": _in("b", "int64")},
}


def _tree_values(arguments: Arguments, sizes: Sizes) -> None:
    arguments |= {name: value.copy() for name, value in _tree().items()}
    for name in ("nq", "base_coordinate", "planar_base"):
        arguments[name] = arguments[name].item()


def _tree_fits(arguments: Arguments, sizes: Sizes) -> bool:
    """Whether the joints are a tree whose coordinates lie within a configuration."""
    parents, twist = arguments["parents"].tolist(), arguments["base_twist_indices"].tolist()
    n, b, nq, first = len(parents), len(twist), arguments["nq"], arguments["base_coordinate"]
    rotation = 2 if arguments["planar_base"] else 4
    rows = zip(arguments["coordinates"].tolist(), arguments["continuous"].tolist(), strict=True)
    placed = all(
        -1 <= q <= 2**30 and (k < b or (q >= 0 and q + continuous < nq))
        for k, (q, continuous) in enumerate(rows)
    )
    stands = all(p == k - 1 if k < b else p >= b - 1 for k, p in enumerate(parents))
    ordered = all(-1 <= parent < k for k, parent in enumerate(parents)) and stands
    based = b == 0 or (first >= 0 and first + rotation <= nq and all(0 <= i < 6 for i in twist))
    based &= -1 <= first <= 2**30 and b <= min(n, 6) and all(-1 <= i <= 2**30 for i in twist)
    return placed and ordered and based and 0 <= nq <= 2 * n


_SAMPLED = {
    **{"q": _in("N+1 n"), "v": _in("N+1 n"), "higher": _in("N+1 e n"), "z": _in("N k n")},
    **{"inner": _in("N r n"), "times": _in("N+1"), "steps": _in("N"), "series": _in("d 3 k+r")},
    **{"used": _in("N", "int64"), "ends": _in("s", "int64")},
}


@cache
def arm_kernel() -> dynamics.InverseDynamicsKernel:
    """Of a UR5."""
    return read_joint_tree(load_robot("ur5").model).compiled()


def _sampler_values(arguments: Arguments, sizes: Sizes) -> None:
    """Two segments, where there are as many intervals."""
    N, segments = sizes["N"], min(2, sizes["N"])
    arguments["higher"] = np.zeros((N + 1, max(0, sizes["k"] - 2), sizes["n"]))
    arguments["ends"] = np.arange(N - segments + 1, N + 1)
    arguments["kernels"] = [arm_kernel()] * segments


def _sampler_fits(arguments: Arguments, sizes: Sizes) -> bool:
    ends, kernels = arguments["ends"].tolist(), arguments["kernels"]
    whole = not ends or (ends == sorted(set(ends)) and ends[0] > 0 and ends[-1] == sizes["N"])
    used = all(0 <= modes <= sizes["r"] for modes in arguments["used"].tolist())
    derivatives = 1 <= sizes["k"] <= 20 and sizes["e"] == max(0, sizes["k"] - 2)
    known = len(ends) == len(kernels) and (not kernels or sizes["n"] == 6)
    return sizes["N"] > 0 and whole and used and derivatives and known and sizes["d"] <= 4096


@cache
def sampler() -> dynamics.PathSampler:
    """Of three intervals of 1 s on a UR5."""
    numbers = np.random.default_rng(0).uniform(-1.0, 1.0, 600)
    shapes = {"q": (4, 6), "v": (4, 6), "z": (3, 2, 6), "inner": (3, 1, 6), "series": (5, 3, 3)}
    arrays = {name: np.resize(numbers, shape) for name, shape in shapes.items()}
    return dynamics.PathSampler(
        **arrays,
        higher=np.zeros((4, 0, 6)),
        times=np.arange(4.0),
        steps=np.ones(3),
        used=np.array([1, 0, 1]),
        kernels=[arm_kernel()],
        ends=np.array([3]),
    )


_SLACK = 7 * 2.0**-52 * 3.0


def _times_fit(arguments: Arguments, sizes: Sizes) -> bool:
    t = arguments["t"]
    return bool(((t >= -_SLACK) & (t <= 3.0 + _SLACK)).all())


def _positions_fit(arguments: Arguments, sizes: Sizes) -> bool:
    k, s = arguments["intervals"], arguments["positions"]
    inside = ((k >= 0) & (k < 3) & (s >= 0) & (s <= 1)).all()
    return sizes["n"] == 6 and bool(inside)


# Kinematics

MAX_SEEDS = 100_000


@cache
def chain() -> KinematicChain:
    """Of the tool of a UR5."""
    found = read_kinematic_chain(load_robot("ur5").model, "tool0")
    assert found is not None
    return found


@cache
def inverse_kinematics() -> kinematics.InverseKinematicsKernel:
    """Of the same, within a turn."""
    return chain().compiled(np.full(6, -np.pi), np.full(6, np.pi))


def _search(needed: str, **arguments: Any) -> tuple[int, int]:
    """A search for which one of the optional arguments is not optional."""
    if arguments[needed] is None:
        raise TypeError(f"{needed} must be given.")
    return inverse_kinematics().search(**arguments)


_SEARCH = {
    "near": _in("n"),
    "configurations": _out("K n"),
    "best": _out("n"),
}
_SEARCH_REST: dict[str, Any] = {
    "scalars": {"weight": 2.0, "apart": 1e-3, "seeds": 9, "patience": 4},
    "letters": {"n": (6, 6), "K": (0, 9)},
    "fits": lambda arguments, sizes: (
        sizes["n"] == 6 and all(1 <= arguments[key] <= MAX_SEEDS for key in ("seeds", "patience"))
    ),
}
_CHAIN_KINDS = {
    **{"rotations": _in("n 3 3"), "translations": _in("n 3"), "angular": _in("n")},
    **{"linear": _in("n"), "tip_rotation": _in("3 3"), "tip_translation": _in("3")},
    **{"lower": _in("n"), "upper": _in("n")},
}


def _chain_values(arguments: Arguments, sizes: Sizes) -> None:
    arguments["upper"] += 1.0  # the lower bounds are less than 1


def _chain_fits(arguments: Arguments, sizes: Sizes) -> bool:
    return 1 <= sizes["n"] <= 1000 and bool((arguments["lower"] <= arguments["upper"]).all())


def _frame_placement(archive: str, frame: int) -> str:
    return SymbolicModel(archive).frame_placement(frame)


@cache
def pendulum() -> pin.Model:
    """The model of the pendulum."""
    return load_robot(example("pendulum.urdf")).model


@cache
def pendulum_archive() -> str:
    """Pinocchio's archive of it."""
    return archive(pendulum())


# Distances


@cache
def _pairs() -> dict[str, Any]:
    """What the pairs of a cart-pole with five shapes are built from."""
    model = load_robot(example("cart_pole.urdf")).model
    corners = coal.StdVec_Vec3s()
    corners.extend([np.zeros(3), *np.eye(3)])
    hull = coal.Convex.convexHull(corners, True, "Qt")
    shapes = [hull, coal.Cylinder(0.1, 0.3), coal.Sphere(0.1), coal.Capsule(0.1, 0.2), hull]
    return compiled_distances.arguments_of(
        model,
        [
            pin.GeometryObject(f"s{i}", i % model.njoints, 0, pin.SE3.Random(), shape)
            for i, shape in enumerate(shapes)
        ],
        [(0, 1), (1, 2), (3, 4), (0, 4)],
    )


@cache
def pair_distances() -> distances.PairDistances:
    """Those pairs."""
    return distances.PairDistances(**_pairs())


def _pair_values(arguments: Arguments, sizes: Sizes) -> None:
    arguments |= {
        name: value.copy() if isinstance(value, np.ndarray) else value
        for name, value in _pairs().items()
    }


_JOINT_SIZES = ((1, 1), (2, 1), (7, 6), (4, 3), (4, 3))
"""nq and nv by the number of a kind."""


def _pairs_fit(arguments: Arguments, sizes: Sizes) -> bool:
    lists = {k: v.tolist() for k, v in arguments.items() if isinstance(v, np.ndarray)}
    nq, nv, kinds = arguments["nq"], arguments["nv"], lists["kinds"]
    if not all(0 <= kind < len(_JOINT_SIZES) for kind in kinds):
        return False
    used = [_JOINT_SIZES[kind] for kind in kinds]
    rows = zip(used, lists["coordinates"], lists["columns"], strict=True)
    inside = all(0 <= i <= nq - a and 0 <= j <= nv - b for (a, b), i, j in rows)
    sums = [sum(each[i] for each in used) for i in range(2)] == [nq, nv]
    ordered = all(-1 <= parent < k for k, parent in enumerate(lists["parents"]))
    shapes, joints = len(lists["shape_joints"]), len(kinds)
    moved = all(-1 <= joint < joints for joint in lists["shape_joints"])
    moved &= all(0 <= kind < 3 for kind in lists["shape_kinds"])
    paired = all(0 <= end < shapes for pair in lists["pairs"] for end in pair)
    return inside and sums and ordered and moved and paired and _hulls_fit(lists)


def _hulls_fit(lists: dict[str, list[Any]]) -> bool:
    points, neighbors = len(lists["points"]), len(lists["neighbors"])
    counts, near = lists["point_counts"], lists["neighbor_counts"]
    if min(counts + near, default=0) < 0 or (sum(counts), sum(near)) != (points, neighbors):
        return False
    if any(
        kind == 0 and not count for kind, count in zip(lists["shape_kinds"], counts, strict=True)
    ):
        return False
    owners = [count for count in counts for _ in range(count)]
    limits = [owner for owner, size in zip(owners, near, strict=True) for _ in range(size)]
    return all(0 <= k < end for k, end in zip(lists["neighbors"], limits, strict=True))


_CHOSEN = {
    **{"q": _in("P q"), "chosen": _in("k", "int64")},
    **{"distances": _out("P k"), "known": Kind("P k", "int64", output=True)},
    **{"wanted": _in("P k", "bool"), "rounding": _in("P k"), "normals": _updated("P k 3")},
}


def _small_rounding(arguments: Arguments, sizes: Sizes) -> None:
    arguments["rounding"] = 1e-4 * np.abs(arguments["rounding"]) % 1e-2


def _pair_calls_fit(arguments: Arguments, sizes: Sizes) -> bool:
    pairs, rounding = pair_distances(), arguments["rounding"]
    known = sizes["q"] == pairs.nq and sizes.get("n", pairs.nv) == pairs.nv
    chosen = all(0 <= k < pairs.size for k in arguments["chosen"].tolist())
    rounded = rounding is None or bool(((rounding >= 0.0) & (rounding <= 1.0)).all())
    return known and chosen and rounded


_PAIRS = {
    "letters": {"P": (0, 9)},
    "values": _small_rounding,
    "fits": _pair_calls_fit,
}

ENTRIES: dict[str, Entry] = {
    "band.assemble": Entry(
        band.assemble,
        {
            "hessian": _in("N m1 m2 n1 n2"),
            **{name: _in("R", "int64") for name in ("starts", "positions", "lengths")},
            **{"scales": _in("R"), "band": _out("c s")},
        },
        optional=("scales",),
        values=_runs,
        fits=_runs_fit,
    ),
    "band.factor": Entry(
        band.factor,
        _of_size({"band": _in("4*p s"), "metric": _in("4*p s"), "out": _out("4*p s")}),
        {"shift": 0.5, "size": 0, "portable": False},
        **_BAND,
    ),
    "band.solve": Entry(
        band.solve,
        _of_size({"factor": _in("4*p s"), "rhs": _in("k"), "signs": _in("4*p"), "out": _out("k")}),
        _PORTABLE,
        optional=("signs",),
        **_SOLVE,
    ),
    "band.factor_signed": Entry(
        band.factor_signed,
        _of_size(
            {
                **{"band": _in("4*p s"), "metric": _in("4*p s")},
                **{"signs": _out("4*p"), "out": _out("4*p s")},
            }
        ),
        {"shift": 0.5, "size": 0, "portable": False},
        **_BAND,
    ),
    "band.product": Entry(
        band.product, _of_size({"band": _in("4*p s"), "x": _in("k"), "out": _out("k")}), **_SOLVE
    ),
    "band.descend": Entry(
        band.descend,
        _of_size(
            {"factor": _in("4*p s"), "gradient": _in("k"), "metric": _in("4*p s"), "out": _out("k")}
        ),
        _PORTABLE,
        **_SOLVE,
    ),
    "groups.integrate": Entry(
        groups.integrate,
        {**_LAYOUT, "q": _in("P q"), "x": _in("P n"), "result": _out("P q")},
        **_GROUPS,
    ),
    "groups.difference": Entry(
        groups.difference,
        {
            **_LAYOUT,
            **{"q0": _in("P q"), "q1": _in("P q"), "expected": _in("P n"), "result": _out("P n")},
        },
        optional=("expected",),
        **_GROUPS,
    ),
    "groups.rates": Entry(
        groups.rates,
        {**_LAYOUT, "x": _in("3 P n"), "base_rates": _in("2 P n"), "out": _out("2 P n")},
        _PORTABLE,
        optional=("base_rates",),
        letters={"P": (0, 9)},
        **_GROUPS,
    ),
    "groups.local_rates": Entry(
        groups.local_rates,
        {**_LAYOUT, "x": _in("P n"), "v": _in("P n"), "a": _in("P n"), "out": _out("2 P n")},
        _PORTABLE,
        letters={"P": (0, 9)},
        **_GROUPS,
    ),
    "groups.expand": Entry(
        groups.expand,
        {
            **_CHARTS,
            **{"gradient": _in("B*Q 3*n"), "hessian": _in("B*Q 3*n 3*n")},
            **{"columns_gradient": _out("B m n"), "columns_hessian": _out("B m m n n")},
        },
        **_ON_CHARTS,
    ),
    "groups.pull_gradient": Entry(
        groups.pull_gradient,
        {**_CHARTS, "gradient": _in("B*Q 3*n"), "columns_gradient": _out("B m n")},
        **{**_ON_CHARTS, "scalars": {"regular": True, **_PORTABLE}},
    ),
    "groups.pull_moments": Entry(
        groups.pull_moments,
        {
            **{**_CHARTS, "tests": _in("K Q"), "jacobian": _in("B*Q p 3*n")},
            "columns_gradients": _out("B K p m n"),
        },
        **{**_ON_CHARTS, "letters": _ON_CHARTS["letters"] | {"K": (0, 3), "p": (0, 3)}},
    ),
    "groups.push_steps": Entry(
        groups.push_steps,
        {**_CHARTS, "step": _in("B m n"), "change": _out("B Q 3 n")},
        **_ON_CHARTS,
    ),
    "groups.expand, tables of each": Entry(
        groups.expand,
        {
            **_OWN_TABLES,
            **{"gradient": _in("B 3*n"), "hessian": _in("B 3*n 3*n")},
            **{"columns_gradient": _out("B m n"), "columns_hessian": _out("B m m n n")},
        },
        **_OF_EACH,
    ),
    "groups.push_steps, tables of each": Entry(
        groups.push_steps,
        {**_OWN_TABLES, "step": _in("B m n"), "change": _out("B 1 3 n")},
        **_OF_EACH,
    ),
    "intervals.contract": Entry(
        intervals.contract,
        {
            **_TABLES,
            **{"columns_gradient": _out("B m n"), "columns_hessian": _out("B m m n n")},
            **{"gradient": _in("P R*n"), "hessian": _in("P R*n R*n")},
        },
        _PORTABLE,
        letters={"B": (0, 4), "n": (0, 12), "m": (0, 6), "R": (2, 5)},
        fits=_tables_fit,
    ),
    "intervals.push": Entry(
        intervals.push,
        {**_TABLES, "step": _in("B m n"), **_SELECTION, "out": _out("P K")},
        **_SELECTED,
    ),
    "intervals.pull": Entry(
        intervals.pull,
        {**_TABLES, "forces": _in("P K"), **_SELECTION, "out": _out("B m n")},
        **_SELECTED,
    ),
    "intervals.push_rows": Entry(
        intervals.push_rows,
        {**_ROWS_OF_INTERVALS, "rows": _in("E m"), "step": _in("N m n"), "out": _out("E")},
        **_LINEAR,
    ),
    "intervals.pull_rows": Entry(
        intervals.pull_rows,
        {
            **{**_ROWS_OF_INTERVALS, "rows": _in("E m"), "forces": _in("E")},
            "sums": _updated("N m n"),
        },
        **_LINEAR,
    ),
    "intervals.add_squares": Entry(
        intervals.add_squares,
        {
            **{**_ROWS_OF_INTERVALS, "rows": _in("E m"), "weights": _in("E")},
            "sums": _updated("N m m n n"),
        },
        **_LINEAR,
    ),
    "intervals.interpolate": Entry(
        intervals.interpolate,
        {
            **{"table": _in("Q 3 c"), "steps": _in("B"), "intervals": _in("B", "int64")},
            **{"z": _in("N 2 n"), "q": _in("N+1 n"), "v": _in("N+1 n"), "inner": _in("N r n")},
            "out": _out("3 B*Q n"),
        },
        letters={"N": (1, 4), "c": (3, 3)},
        values=_columns,
        fits=_interval_numbers_fit,
    ),
    "intervals.displacements_at": Entry(
        intervals.displacements_at,
        {
            **{"rows": _in("E c"), "steps": _in("N"), "intervals": _in("E", "int64")},
            **{**_PATH, "out": _out("E n")},
        },
        letters={"N": (1, 4), "c": (3, 3)},
        values=_columns,
        fits=_interval_numbers_fit,
    ),
    "intervals.misfit": Entry(
        intervals.misfit,
        {"steps": _in("N"), "q": _in("N+1 n"), **_PATH},
    ),
    "intervals.move": Entry(
        intervals.move,
        {
            **{"steps": _in("N"), "step": _in("N c n"), **_PATH, "dq": _out("N+1 n")},
            **{"new_v": _out("N+1 n"), "new_z": _out("N 2 n"), "new_inner": _out("N r n")},
        },
        {"nodal": True},
        letters={"c": (4, 4)},
        fits=lambda arguments, sizes: 4 <= sizes["c"] <= 4 + sizes["r"],
    ),
    "intervals.replace_by_prefix_sums": Entry(
        intervals.replace_by_prefix_sums,
        {"increments": _in("N n"), "values": _out("N+1 k n")},
        {"share": 1e-3},
        letters={"k": (1, 3)},
        fits=lambda arguments, sizes: sizes["k"] >= 1,
    ),
    "intervals.weighted_square": Entry(
        intervals.weighted_square, {**_RESIDUALS, "weights": _in("P")}, letters={"P": (0, 130)}
    ),
    "intervals.expand_squares": Entry(
        intervals.expand_squares,
        {
            **_RESIDUALS,
            **{"jacobian": _in("P n k"), "force": _in("P n")},
            **{"values": _out("P"), "gradient": _out("P k")},
        },
        optional=("force",),
    ),
    "intervals.predict": Entry(
        intervals.predict,
        {**_RESIDUALS, "jacobian": _in("P n k"), "change": _in("P k"), "out": _out("P n")},
    ),
    "integration.integrate": Entry(
        integration.integrate,
        {"y": _updated("n")},
        {"rates": _still, "begin": 0.0, "end": 1.0, "relative": 1e-6, "absolute": 1e-9},
        fits=_is_integrable,
    ),
    "barrier.condense": Entry(
        barrier.condense,
        {**_SLACKS, **_inputs("y"), **_outputs("sigma", "rho", "force")},
        {"mu": 0.1},
        **_BARRIER,
    ),
    "barrier.shift": Entry(
        barrier.shift,
        {**_SLACKS, **_inputs(*_TARGETS), **_outputs("out")},
        {"mu": 0.1},
        **_BARRIER,
    ),
    "barrier.aim": Entry(
        barrier.aim,
        {**_SLACKS, **_inputs("y", "dy", *_TARGETS), **_outputs("ds", "dzl", "dzu")},
        {"matched": 1e-9, "keep": 0.99},
        **_BARRIER,
        fits=_keeps_a_share,
    ),
    "barrier.mean_product": Entry(
        barrier.mean_product, {**_SLACKS, **_NEWTON}, {"primal": 0.9, "dual": 0.8}, **_BARRIER
    ),
    "barrier.largest_miss": Entry(barrier.largest_miss, _SLACKS, {"mu": 0.1}, **_BARRIER),
    "barrier.correct": Entry(
        barrier.correct,
        {**_SLACKS, **_inputs("y"), **_NEWTON, **_outputs(*_TARGETS)},
        {"mu": 0.1, "matched": 1e-9},
        **_BARRIER,
    ),
    "barrier.center": Entry(
        barrier.center,
        {**_SLACKS, **_inputs("y"), **_NEWTON, **{name: _updated("R") for name in _TARGETS}},
        {"primal": 0.9, "dual": 0.8, "mu": 0.1, "matched": 1e-9},
        **_BARRIER,
    ),
    "barrier.merit": Entry(
        barrier.merit,
        {**_SLACKS, **_inputs("weights", "y", "dy", "ds")},
        {"share": 0.5, "keep": 0.99, "mu": 0.1, "penalty": 2.0},
        **_BARRIER,
        fits=_keeps_a_share,
    ),
    "barrier.move": Entry(
        barrier.move,
        {**_SLACKS, **_inputs("y"), **_NEWTON, **_outputs("new_s", "new_zl", "new_zu")},
        {
            **{"primal": 0.9, "dual": 0.8, "keep": 0.99, "mu": 0.1},
            **{"penalty": 2.0, "ratio": 1e8},
        },
        **_BARRIER,
        fits=lambda arguments, sizes: (
            _keeps_a_share(arguments, sizes) and arguments["mu"] >= 0 and arguments["ratio"] >= 1
        ),
    ),
    "barrier.recenter": Entry(
        barrier.recenter,
        {**_SLACKS, **_outputs("new_s", "new_zl", "new_zu")},
        {"c": 2.0, "mu": 0.1},
        **_BARRIER,
        fits=lambda arguments, sizes: arguments["c"] > 0 and arguments["mu"] > 0,
    ),
    "barrier.follow": Entry(
        barrier.follow,
        {
            **{**_SLACKS, **_inputs("weights", "y", "dy", "y_new")},
            **_outputs("new_s", "new_zl", "new_zu"),
        },
        {"mu": 0.1, "next_mu": 0.05, "least": 2.0},
        **_BARRIER,
        fits=lambda arguments, sizes: arguments["next_mu"] > 0 and arguments["least"] > 0,
    ),
    "sampling.PathSampler": Entry(
        dynamics.PathSampler,
        _SAMPLED,
        {"kernels": []},
        letters={"N": (1, 4), "n": (6, 6), "k": (1, 4), "r": (1, 3)},
        values=_sampler_values,
        fits=_sampler_fits,
    ),
    "sampling.sample": Entry(
        lambda **arguments: sampler().sample(**arguments),
        {
            **{"intervals": _in("M", "int64"), "positions": _in("M")},
            **{"q": _out("M n"), "v": _out("M n"), "a": _out("M n"), "tau": _out("M n")},
        },
        optional=("tau",),
        letters={"n": (6, 6), "M": (0, 9)},
        fits=_positions_fit,
    ),
    "sampling.locate": Entry(
        lambda **arguments: sampler().locate(**arguments),
        {"t": _in("M"), "intervals": Kind("M", "int64", output=True), "positions": _out("M")},
        letters={"M": (0, 9)},
        fits=_times_fit,
    ),
    "dynamics.torque": Entry(
        lambda **arguments: kernel().torque(**arguments),
        {**_POINTS, "tau": _out("P n")},
        _THREADS,
        **_KERNEL,
    ),
    "dynamics.linearize": Entry(
        lambda **arguments: kernel().linearize(**arguments),
        {**_POINTS, "tau": _out("P n"), "jacobian": _out("P n 3*n")},
        _THREADS,
        **_KERNEL,
    ),
    "dynamics.expand": Entry(
        lambda **arguments: kernel().expand(**arguments),
        {
            **_POINTS,
            **{"weight": _in("P n"), "curvature": _in("P n")},
            **{"tau": _out("P n"), "jacobian": _out("P n 3*n"), "hessian": _out("P 3*n 3*n")},
        },
        _THREADS,
        optional=("curvature",),
        **_KERNEL,
    ),
    "dynamics.InverseDynamicsKernel": Entry(
        dynamics.InverseDynamicsKernel,
        _TREE_KINDS,
        {"nq": 0, "base_coordinate": 0, "planar_base": False, "portable": False},
        letters={"b": (6, 6)},
        values=_tree_values,
        fits=_tree_fits,
    ),
    "kinematics.InverseKinematicsKernel": Entry(
        kinematics.InverseKinematicsKernel,
        _CHAIN_KINDS,
        letters={"n": (1, 8)},
        values=_chain_values,
        fits=_chain_fits,
    ),
    "kinematics.search": Entry(
        lambda **arguments: _search("rotation", axis=None, **arguments),
        {"position": _in("3"), "rotation": _in("3 3"), **_SEARCH},
        optional=("position",),
        **_SEARCH_REST,
    ),
    "kinematics.search_along_axis": Entry(
        lambda **arguments: _search("position", rotation=None, **arguments),
        {"position": _in("3"), "axis": _in("2 3"), **_SEARCH},
        optional=("axis",),
        **_SEARCH_REST,
    ),
    "expressions.expression_of": Entry(
        expressions.expression_of, {}, {"function": ca.Function("f", [ca.SX.sym("x")], [1.0])}
    ),
    "expressions.Expression": Entry(
        _run,
        {
            **{"argument 0": _in("P 3"), "argument 1": _in("P 1")},
            **{"result 0": _out("P 2"), "result 1": _out("P 6")},
        },
        {"points": 0, "threads": 2},
        letters={"P": (0, 40)},
        values=lambda arguments, sizes: arguments.update(points=sizes["P"]),
        fits=lambda arguments, sizes: (
            arguments["points"] == sizes["P"] and -(2**31) <= arguments["threads"] < 2**31
        ),
    ),
    "distances.PairDistances": Entry(
        distances.PairDistances,
        {
            **{name: _in("j", "int64") for name in ("parents", "kinds", "coordinates", "columns")},
            **{"rotations": _in("j 3 3"), "translations": _in("j 3"), "axes": _in("j 6")},
            **{name: _in("s", "int64") for name in ("shape_joints", "shape_kinds")},
            **{"shape_rotations": _in("s 3 3"), "shape_translations": _in("s 3")},
            **{"shape_sizes": _in("s 3"), "shape_spheres": _in("s 4"), "points": _in("v 3")},
            **{"point_counts": _in("s", "int64"), "neighbor_counts": _in("v", "int64")},
            **{"neighbors": _in("e", "int64"), "pairs": _in("k 2", "int64")},
        },
        {"nq": 0, "nv": 0, "portable": False},
        values=_pair_values,
        fits=_pairs_fit,
    ),
    "distances.values": Entry(
        lambda **arguments: pair_distances().values(**arguments),
        _CHOSEN,
        {"reach": 0.5},
        optional=("wanted", "rounding", "normals"),
        **_PAIRS,
    ),
    "distances.expand": Entry(
        lambda **arguments: pair_distances().expand(**arguments),
        {
            **{**_CHOSEN, "force": _in("P k")},
            **{"jacobian": _out("P k n"), "curvature": _out("P n n")},
        },
        {"reach": 0.5},
        optional=("force", "wanted", "rounding", "normals"),
        **_PAIRS,
    ),
    "symbolic.frame_placement": Entry(
        _frame_placement,
        {},
        {"archive": "", "frame": 1},
        values=lambda arguments, sizes: arguments.update(archive=pendulum_archive()),
        fits=lambda arguments, sizes: (
            arguments["archive"] == pendulum_archive()
            and 0 <= arguments["frame"] < pendulum().nframes
        ),
    ),
}


# Valid calls


def valid_call(name: str, seed: int) -> Arguments:
    """The arguments of a valid call with random sizes."""
    entry, random = ENTRIES[name], np.random.default_rng(seed)
    sizes = _random_sizes(entry, random)
    layout: list[list[int]] = []
    if "layout" in entry.kinds:
        layout = LAYOUTS[random.integers(len(LAYOUTS))]
        nq, nv = _layout_sizes(layout) or (0, 0)
        sizes |= {"l": len(layout), "q": nq, "n": nv}
    if name.startswith("dynamics.") and "q" in entry.kinds:
        sizes |= {"q": kernel().nq, "n": kernel().n}
    if "T" in sizes:
        Q = sizes["T"]
        sizes["P"] = sizes["B"] * Q
        sizes["T"] = int(random.choice([Q, sizes["P"]])) if sizes["B"] else Q
    if name.startswith("distances.") and "q" in entry.kinds:
        sizes |= {"q": pair_distances().nq, "n": pair_distances().nv}
    if "p" in sizes:
        sizes["k"] = PANEL * sizes["p"] - int(random.integers(PANEL))
    if "c" in sizes and "table" in entry.kinds:
        sizes["c"] = 3 + sizes["r"]
    arguments: Arguments = {key: kind(sizes, random) for key, kind in entry.kinds.items()}
    arguments |= entry.scalars
    if layout:
        arguments["layout"] = np.array(layout)
    entry.values(arguments, sizes)
    for key in entry.optional:
        if random.integers(2):
            arguments[key] = None
    return arguments


def _random_sizes(entry: Entry, random: np.random.Generator) -> Sizes:
    terms = " ".join(kind.shape for kind in entry.kinds.values())
    letters = sorted(set(re.findall(r"[A-Za-z]\d?", terms)))
    bounds = {letter: entry.letters.get(letter, (0, 4)) for letter in letters}
    return {letter: int(random.integers(low, high + 1)) for letter, (low, high) in bounds.items()}


# What is wrong with a call


def error_in(name: str, arguments: Arguments) -> str:
    """Why a call must be refused; "" if it is valid."""
    entry = ENTRIES[name]
    for key, kind in entry.kinds.items():
        value = arguments[key]
        if not (value is None and key in entry.optional) and not _is_kind(value, kind):
            return f"{key} is not such an array"
    for key, value in entry.scalars.items():
        if not isinstance(arguments[key], (float, int) if type(value) is float else type(value)):
            return f"{key} is not a {type(value).__name__}"
    sizes = sizes_of(name, arguments)
    if sizes is None:
        return "the shapes do not fit each other"
    return "" if entry.fits(arguments, sizes) else "the values do not fit"


def _is_kind(value: object, kind: Kind) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype == np.dtype(kind.dtype)
        and value.dtype.isnative
        and value.ndim == len(kind.shape.split())
        and value.flags.c_contiguous
        and value.flags.aligned
        and (value.flags.writeable or not (kind.output or kind.updated))
    )


def sizes_of(name: str, arguments: Arguments) -> Sizes | None:
    """The sizes of a call by letter; None if its shapes contradict each other."""
    entry, sizes = ENTRIES[name], dict[str, int]()
    given = [
        (term, size)
        for key, kind in entry.kinds.items()
        if arguments[key] is not None
        for term, size in zip(kind.shape.split(), arguments[key].shape, strict=True)
    ]
    for term, size in given:
        if term.isidentifier():
            sizes.setdefault(term, size)
        elif term in ("4*p", "N+1") and term[-1 if term == "4*p" else 0] not in sizes:
            sizes["p" if term == "4*p" else "N"] = size // PANEL if term == "4*p" else size - 1
    same = all(_size(term, sizes) == size for term, size in given)
    return sizes if same else None


# Changes

Change = Callable[[Arguments, str, np.random.Generator], None]
"""Changes one argument of a call."""
EXTREMES = (-1, 1, 3, 4, 5, 8, 10**6, 2**31 - 1, 2**31, 2**62, -(2**63), 2**63 - 1)


def _axis(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    axis, by = random.integers(array.ndim), random.choice((-1, 1, 1, 7))
    shape = [size + (by if i == axis else 0) for i, size in enumerate(array.shape)]
    arguments[key] = _resized(array, [max(0, size) for size in shape])


def _empty(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    shape = list(array.shape)
    shape[random.integers(array.ndim)] = 0
    arguments[key] = np.zeros(shape, array.dtype)


def _dimensions(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    arguments[key] = array.ravel() if array.ndim > 1 and random.integers(2) else array[None]


def _transposed(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    arguments[key] = arguments[key].T


def _dtype(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    kinds = ("float32", "int32", "int64", "float64", "complex128", "bool", "object", ">f8", ">i8")
    with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
        arguments[key] = arguments[key].astype(random.choice(kinds))


def _strided(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    arguments[key] = np.repeat(array, 2, axis=-1)[..., ::2]


def _reversed(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    arguments[key] = arguments[key][::-1]


def _broadcast(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    arguments[key] = np.broadcast_to(np.ones((), array.dtype), array.shape)


def _read_only(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    arguments[key] = arguments[key].copy()
    arguments[key].setflags(write=False)


def _misaligned(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    memory = bytearray(array.nbytes + 1)
    memory[1:] = array.tobytes()
    if array.nbytes:
        flat = np.frombuffer(memory, array.dtype, array.size, offset=1)
        arguments[key] = flat.reshape(array.shape)


def _other(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key]
    others = [None, [], "x", 3, 2.5, object(), array.tolist(), memoryview(b"abc"), np.float64(1.0)]
    arguments[key] = others[random.integers(len(others))]


def _number(arguments: Arguments, key: str, random: np.random.Generator) -> None:
    array = arguments[key].copy()
    if array.size and array.dtype.kind in "if":
        extremes = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0)
        chosen = EXTREMES if array.dtype.kind == "i" else extremes
        array.flat[random.integers(array.size)] = chosen[random.integers(len(chosen))]
    arguments[key] = array


def _resized(array: Array, shape: list[int]) -> Array:
    return np.resize(array, shape) if array.size else np.zeros(shape, array.dtype)


ARRAY_CHANGES: tuple[Change, ...] = (
    *(_axis, _axis, _axis, _axis, _empty, _dimensions, _transposed, _dtype, _strided, _reversed),
    *(_broadcast, _read_only, _misaligned, _other, _number, _number),
)
SCALARS = (None, "x", [], -1, 0, 1, 2, 3, 5, 10**6, 2**31, 2**63, 2**64, 1.5, float("nan"), True)


def changed(name: str, seed: int, changes: int) -> Arguments:
    """A valid call with some random changes."""
    arguments, random = valid_call(name, seed), np.random.default_rng([seed, 1])
    keys = list(arguments)
    for _ in range(changes):
        key = keys[random.integers(len(keys))]
        if isinstance(arguments[key], np.ndarray):
            ARRAY_CHANGES[random.integers(len(ARRAY_CHANGES))](arguments, key, random)
        elif arguments[key] == pendulum_archive() and random.integers(4):
            arguments[key] = damaged(arguments[key], Random(int(random.integers(2**32))))
        elif key in ENTRIES[name].scalars:
            arguments[key] = SCALARS[random.integers(len(SCALARS))]
    return arguments


_NUMBERS = (b" -1 ", b" 255 ", b" 4294967296 ", b" 18446744073709551615 ", b" nan ", b" ")
"""What Boost's reader of archives would take for the size or the index of something."""


def damaged(text: str, random: Random) -> str:
    """The archive of a model with a few random changes; random text once in a while."""
    if random.random() < 0.05:
        return random.randbytes(random.randrange(2_000)).decode("latin-1")
    while (changed := mutated_bytes(text.encode(), random, _NUMBERS)) == text.encode():
        pass
    return changed.decode("latin-1")


# The fuzzer


def mutate(random: Random) -> Mutant:
    """A call: the name of an entry, a seed, and a number of changes, as JSON."""
    call = [random.choice(list(ENTRIES)), random.getrandbits(60), random.choice((0, 1, 1, 1, 2, 3))]
    return Mutant(json.dumps(call).encode())


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Call the entry. Bytes that are not such a call are nothing to judge, and refused."""
    try:
        name, seed, changes = json.loads(mutant.content)
        arguments = changed(name, abs(int(seed)) % 2**63, int(changes) % 9)
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError):
        return Verdict.REFUSED, "not a call"
    return verdict_on(name, arguments)


def verdict_on(name: str, arguments: Arguments) -> tuple[Verdict, str]:
    """Call an entry twice, and compare what it writes to outputs of other numbers."""
    reason = error_in(name, arguments)
    entry = ENTRIES[name]
    outputs = [key for key, kind in entry.kinds.items() if kind.output]
    try:
        written = [_written(entry, arguments, outputs, fill) for fill in (0.25, 0.75)]
    except (TypeError, ValueError, IndexError) as error:
        sentence = str(error)
        if not reason:
            return Verdict.UNCLEAR, f"{name} refuses a valid call: {sentence}"
        clear = "incompatible function arguments" in sentence or "\n" not in sentence
        return (Verdict.REFUSED if sentence and clear else Verdict.UNCLEAR), f"{name}: {sentence}"
    except Exception as error:
        return Verdict.CRASH, f"{name}: {type(error).__name__}: {error}"
    if reason:
        return Verdict.SILENT, f"{name}: {reason}"
    one, other = written
    if entry.function is not intervals.replace_by_prefix_sums and one != other:
        return Verdict.SILENT, f"{name} leaves numbers of its outputs unwritten, or reads others"
    return Verdict.ACCEPTED, ""


def _written(entry: Entry, arguments: Arguments, outputs: list[str], fill: float) -> list[bytes]:
    """What a call returns and writes, its outputs being full of a number before."""
    call = dict(arguments)
    for key in outputs:
        if isinstance(call[key], np.ndarray) and call[key].flags.writeable:
            call[key][...] = fill
    updated = [key for key, kind in entry.kinds.items() if kind.updated]
    for key in updated:
        if _is_kind(call[key], entry.kinds[key]):
            call[key] = call[key].copy()
    result = entry.function(**call)
    if result is False:  # a factorisation that failed leaves its output incomplete
        return []
    told = repr(result) if isinstance(result, bool | float | str | tuple) else ""
    return [told.encode(), *_bytes(call, outputs + updated)]


def _bytes(call: Arguments, outputs: list[str]) -> list[bytes]:
    return [np.asarray(call[key]).tobytes() for key in outputs]

"""The Lagrangians of a motion's segments, such as those of one robot with and without a payload."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import require_shape
from hovi.errors import InputError
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

NODE_TOLERANCE = 1e-9
"""Distance of a node from the end of a segment, relative to the motion's duration."""


@check_arguments
@dataclass(frozen=True, eq=False)
class SegmentedLagrangian(Lagrangian):
    """L_s(q, v, a, ..., t) in segment s of a motion; t runs from the start of the motion.

    On a grid every interval has the Lagrangian of its segment, and segments share the node between
    them: q, ..., q^(k-1) are continuous there, and so are the momenta of a stationary motion, which
    is the natural condition of the action's sum. q^(k) may jump.

    lagrangians: one per segment, two or more, of one order and of the same coordinates.
    ends: times at which the segments but the last end, ascending, in [s].
    Raises InputError for segments that do not fit each other.
    """

    lagrangians: tuple[Lagrangian, ...]
    ends: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.lagrangians) < 2 or len(self.ends) != len(self.lagrangians) - 1:
            raise InputError(
                "a motion in segments has two or more, with a time between each two, got "
                f"{len(self.lagrangians)} segments and {len(self.ends)} times."
            )
        times = np.array([0.0, *self.ends])
        if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
            raise InputError(f"the segments must end at ascending times > 0, got {self.ends}.")
        for each in self.lagrangians:
            _require_fitting(self.lagrangians[0], each)

    @property
    def order(self) -> int:  # type: ignore[override]
        """k, of all segments."""
        return self.lagrangians[0].order

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return self.lagrangians[0].nq

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.lagrangians[0].nv

    @property
    def space(self) -> ConfigurationSpace | None:
        """That of the first segment; the others have the same."""
        return self.lagrangians[0].space

    @property
    def coordinates(self) -> Coordinates:
        """Those of the first segment; the others have the same."""
        return self.lagrangians[0].coordinates

    def within(self, begin: float, end: float) -> Lagrangian:
        """That of the segments between two times, by a clock that starts at the first, in [s]."""
        chosen, ends = segments_within(self.ends, begin, end)
        parts = tuple(each.within(begin, end) for each in self.lagrangians[chosen])
        return SegmentedLagrangian(parts, ends) if ends else parts[0]

    @property
    def timed(self) -> bool:
        """L depends on time: it changes where segments meet."""
        return True

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """The scene of every segment; empty if they are about no robot."""
        scenes = (getattr(each, "scene", None) for each in self.lagrangians)
        return tuple(scene for scene in scenes if isinstance(scene, Scene))

    @property
    def scene(self) -> Scene | None:
        """The scene of the first segment, for its robot."""
        return self.scenes[0] if self.scenes else None

    @property
    def output_weight(self) -> Array:
        """R of the first segment; the others have as many outputs."""
        return self.lagrangians[0].output_weight

    def reweighted(self, weight: Array) -> SegmentedLagrangian:
        """The same segments with another R, shape (m,), in all of them."""
        parts = tuple(each.reweighted(weight) for each in self.lagrangians)
        return SegmentedLagrangian(parts, self.ends)

    @property
    def needs_torques(self) -> bool:
        """Whether torques are part of the cost of a segment."""
        return any(each.needs_torques for each in self.lagrangians)

    @property
    def output_name(self) -> str:
        """Name of an output in messages."""
        return self.lagrangians[0].output_name

    def segments_at(self, t: Array) -> Index:
        """The number of the segment at each time, (M,); where two meet, that of the later one."""
        return np.searchsorted(np.array(self.ends), t, side="right")

    def segments_of(self, nodes: Array) -> Index:
        """The number of the segment of each interval, (N,). nodes: times, (N + 1,), in [s].

        Raises InputError if no node is at the end of a segment, or the motion ends before the last.
        """
        require_shape("nodes", nodes, None)
        if len(nodes) < 2 or not np.isfinite(nodes).all():
            raise InputError(f"a grid has two or more nodes at finite times, got {len(nodes)}.")
        for end in self.ends:
            nearest = float(nodes[np.argmin(np.abs(nodes - end))])
            if abs(nearest - end) > NODE_TOLERANCE * nodes[-1] or end >= nodes[-1]:
                raise InputError(
                    f"a segment ends at {end:g} s, where the grid needs an inner node; its nearest "
                    f"node is at {nearest:g} s of {nodes[-1]:g} s."
                )
        return self.segments_at((nodes[1:] + nodes[:-1]) / 2)

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L at P points of given times, shape (P,)."""
        return self._by_segment(lambda L, x, s: (L.value(*x, t=s),), jet, t)[0]

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Value, gradient and Hessian at points of given times: see Lagrangian.evaluate."""
        value, g, H = self._by_segment(lambda L, x, s: L.evaluate(*x, t=s), jet, t)
        return value, g, H

    def output(self, *jet: Array, t: Array | None = None) -> Array:
        """y at P points of given times, shape (P, m)."""
        return self._by_segment(lambda L, x, s: (L.output(*x, t=s),), jet, t)[0]

    def _by_segment(
        self,
        function: Callable[[Lagrangian, tuple[Array, ...], Array], tuple[Array, ...]],
        jet: tuple[Array, ...],
        t: Array | None,
    ) -> tuple[Array, ...]:
        """The results of a function of (L, jet, t) at the points of each segment, put together."""
        if t is None:
            raise InputError("the Lagrangian of a motion in segments needs t, one time per point.")
        require_shape("t", t, None)
        for x in jet:
            require_shape("every derivative of the jet", x, len(t), None)
        number = self.segments_at(t)
        present = np.unique(number) if len(number) else np.array([0])
        parts = []
        for s in present:
            here = number == s
            parts.append(function(self.lagrangians[s], tuple(x[here] for x in jet), t[here]))
        order = np.argsort(np.concatenate([np.flatnonzero(number == s) for s in present]))
        return tuple(np.concatenate(arrays)[order] for arrays in zip(*parts, strict=True))


def segments_within(
    ends: Sequence[float], begin: float, end: float
) -> tuple[slice, tuple[float, ...]]:
    """The numbers of the segments from one time to another, and where they meet, from there.

    ends: times at which the segments but the last end, ascending, in [s].
    """
    least = NODE_TOLERANCE * end
    first = int(np.searchsorted(np.array(ends), begin + least))
    last = int(np.searchsorted(np.array(ends), end - least))
    return slice(first, last + 1), tuple(each - begin for each in ends[first:last])


def _require_fitting(first: Lagrangian, other: Lagrangian) -> None:
    """Raise InputError unless two segments are of one order, on one space, and driven alike."""
    if isinstance(other, SegmentedLagrangian):
        raise InputError("a segment of a motion has no segments of its own: list all of them.")
    if other.order != first.order:
        raise InputError(
            f"all segments must be of one order, got {first.order} and {other.order}: use "
            "Lagrangians of the same order."
        )
    names = first.coordinates.coordinate_names, other.coordinates.coordinate_names
    if names[0] != names[1] or first.coordinates.space != other.coordinates.space:
        raise InputError(
            "all segments must move the same joints, got "
            f"{' and '.join(', '.join(each) for each in names)}: use scenes of one robot."
        )
    scenes = [isinstance(getattr(each, "scene", None), Scene) for each in (first, other)]
    sizes = len(first.output_weight), len(other.output_weight)
    if scenes[0] != scenes[1] or sizes[0] != sizes[1]:
        raise InputError(
            "all segments must be about a robot and have its torques as outputs, or none: use the "
            "effort of scenes, or CasADi Lagrangians alone, all with a scene or all without."
        )
    passive = [getattr(getattr(each, "scene", None), "passive", ()) for each in (first, other)]
    if set(passive[0]) != set(passive[1]):
        listed = (", ".join(map(repr, each)) or "none" for each in passive)
        raise InputError(
            f"all segments must have the same passive joints, got {' and '.join(listed)}: use "
            "scenes with the same `passive`."
        )

"""What a motion carries in parts of it: where it lies before it is taken and after it is left."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.system.dataclass import dataclass
from hovi.viewing.recorded_limits import imposed_clearance

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CarriedObjects:
    """Links that are carried in parts of a motion.

    parts: by link, the times at which a part begins and ends, in order, in [s].
    """

    parts: Mapping[str, tuple[tuple[float, float], ...]]

    @classmethod
    def of(cls, trajectory: Trajectory) -> CarriedObjects:
        """Those that the motion's record names."""
        clearance = imposed_clearance(trajectory)
        parts = dict[str, tuple[tuple[float, float], ...]]()
        for name, begin, end in sorted(() if clearance is None else clearance.during):
            parts[name] = (*parts.get(name, ()), (begin, end))
        return cls(parts)

    def drawn(self, model: pin.Model, visual: pin.GeometryModel) -> dict[int, str]:
        """The link of each drawn object that is carried in parts, by the object's number."""
        links = {model.getFrameId(each): each for each in self.parts}
        shapes = enumerate(visual.geometryObjects)
        return {k: links[x.parentFrame] for k, x in shapes if x.parentFrame in links}

    def rest(self, link: str, times: Array) -> Array:
        """When a link was, or will be, carried where it is at each time, (M,), in [s].

        The time itself while it is carried, before it the time at which it is taken, and after it
        the time at which it was left.
        """
        parts = self.parts[link]
        found = np.full(len(times), parts[0][0])
        for begin, end in parts:
            found = np.where(times >= begin, np.minimum(times, end), found)
        return found

    def acting(self, begins: Array, ends: Array) -> Mask:
        """Whether anything is carried in each of some segments, (S,). begins, ends: in [s]."""
        middles = 0.5 * (begins + ends)
        inside = [
            (begin < middles) & (middles < end) for x in self.parts.values() for begin, end in x
        ]
        return np.any(inside, axis=0) if inside else np.zeros(len(middles), dtype=bool)

"""Positions of a motion's joints as one number each, continuous in time, with full turns."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.kinds import shown
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_paths import changes_along, scaled_data
from hovi.discrete.output.interpolant import interpolant_rows
from hovi.errors import InputError
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.turns import nearest_angles, remainder
from hovi.robot.space.unwrapped_angles import unwrapped

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

MAX_TURNS_AT_START = 1e9
"""Largest number of full turns at a start."""


@check_arguments
class Positions:
    """Positions of the joints of a motion, as controllers and encoders count them."""

    grid: Grid
    path: DiscretePath
    turns: Mapping[str, int]

    @property
    @abstractmethod
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None if it is a vector space."""

    @property
    @abstractmethod
    def coordinate_names(self) -> tuple[str, ...]:
        """One name per velocity."""

    @abstractmethod
    def jet_intervals(
        self, k: npt.ArrayLike, s: npt.ArrayLike, order: int = 2
    ) -> tuple[Array, ...]:
        """Configurations and their derivatives in given intervals."""

    @abstractmethod
    def _locate(self, t: npt.ArrayLike) -> tuple[Index, Array]:
        """The interval of each time, and the position in [0, 1] within it."""

    def positions(self, t: npt.ArrayLike) -> Array:
        """One number per velocity coordinate at times in [0, T], shape (M, nv), in [rad] and [m].

        Angles of continuous joints begin at the turns of the start and go on beyond a turn; of a
        planar base x, y and its angle; orientations are rotation vectors from the parent's axes.
        Planar angles and orientations go on from one time to the next.
        t: shape (M,) or scalar. Raises InputError for a time outside the motion.
        """
        return self.positions_intervals(*self._locate(t))

    def positions_intervals(self, k: npt.ArrayLike, s: npt.ArrayLike) -> Array:
        """As `positions`, at the times of `sample_intervals`."""
        q, space = self.jet_intervals(k, s, 0)[0], self.space
        if space is None:
            return q
        numbers, where = unwrapped(space, q), np.asarray(k, dtype=np.intp)
        top = max(2, self.grid.order)
        moved = displacements(self.grid, self.path, where, np.asarray(s, dtype=float), top)[:, 0]
        columns = [factor.v.start for factor in space.angles]
        near = self._angles_at_nodes(space)[where] + moved
        numbers[:, columns] = nearest_angles(q, near, space)[:, columns]
        return numbers

    def _angles_at_nodes(self, space: ConfigurationSpace) -> Array:
        """Angles of continuous joints at the nodes, full turns included, (N + 1, nv), in [rad]."""
        first = remainder(self.path.q[0], space) + 2 * np.pi * self.turns_at_start
        changes = np.cumsum(changes_along(self.path, self.grid.steps), axis=0)
        return np.asarray(first + np.concatenate([np.zeros((1, len(first))), changes]))

    @property
    def turns_at_start(self) -> Array:
        """Full turns of continuous joints at the start, (nv,). Raises InputError for others."""
        names, space = self.coordinate_names, self.space
        angles = () if space is None else space.angles
        known, found = {names[each.v.start]: each.v for each in angles}, np.zeros(len(names))
        for joint, count in self.turns.items():
            if joint not in known or type(count) is not int or not abs(count) <= MAX_TURNS_AT_START:
                raise InputError(
                    "the full turns at the start are whole numbers of continuous joints, not "
                    f"{shown(count)} of {joint!r}."
                )
            found[known[joint]] = count
        return found


def displacements(grid: Grid, path: DiscretePath, k: Index, s: Array, top: int) -> Array:
    """h^j x^(j) of q = q_k (+) x in intervals k (M,), j up to `top`, 2 or more, (M, top + 1, nv).

    s: relative positions in the intervals, shape (M,).
    """
    scaled, h = np.empty((len(k), top + 1, path.v.shape[1])), grid.steps[k][:, None]
    for scheme, members in grid.groups:
        here = np.isin(k, members)
        data = scaled_data(path, k[here], h[here], scheme.inner_modes)
        scaled[here] = interpolant_rows(scheme, s[here], top) @ data
    return scaled

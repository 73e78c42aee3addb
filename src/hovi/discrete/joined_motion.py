"""Motions one after the other, each at rest where the next one begins, as one to sample."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.output.caution import cautions_of, with_cautions
from hovi.discrete.output.stored_torque import StoredTorque
from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import InputError, expect
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SAME = 1e-6
"""Largest distance of the ends of two motions that are joined, by joint, in [rad] or [m]."""
REST = 1e-6
"""Largest speed of a joint at rest, in [rad/s] or [m/s]."""
MAX_GAP = 3600.0
"""Longest gap between two motions, in [s]."""


@dataclass(frozen=True, eq=False)
class JoinedMotion:
    """Motions of one robot with rests between them; it samples as a Trajectory does.

    motions: each begins where the one before it ends, within SAME, and both are at rest there.
    gap: time for which the robot stays between two motions, in [s]; efforts hold it there.
    Raises InputError for a motion that begins elsewhere or is not at rest, for motions of
    different robots, and for a gap that is negative or longer than MAX_GAP.
    """

    motions: tuple[Trajectory, ...]
    gap: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.gap) and 0 <= self.gap <= MAX_GAP):
            raise InputError(f"the gap must be 0 to {MAX_GAP:g} s, got {self.gap}.")
        if not self.motions:
            raise InputError("there is no motion to join: give one or more.")
        for motion in self.motions:
            expect(motion, Trajectory, "the trajectory of a solution")
        pairs = itertools.pairwise(self.motions)
        for number, (before, after) in enumerate(pairs, start=1):
            _require_joint(number, before, after)
        if self.gap and any(not each.scenes and _has_torques(each) for each in self.motions[:-1]):
            raise InputError(
                "a motion that was saved without its robot has no torques that hold it in a gap: "
                "use a gap of 0."
            )

    @property
    def robot(self) -> Robot | None:
        """The robot of the first motion; None without one."""
        return self.motions[0].robot

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """Those of all motions."""
        return tuple(scene for each in self.motions for scene in each.scenes)

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None if it is a vector space."""
        return self.motions[0].space

    @property
    def torque(self) -> StoredTorque | None:
        """That of the first motion, if its torques are stored."""
        return self.motions[0].torque

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """A name per velocity coordinate."""
        return self.motions[0].coordinate_names

    @cached_property
    def starts(self) -> Array:
        """When each motion begins, shape (motions,), in [s]."""
        lengths = [each.duration + self.gap for each in self.motions[:-1]]
        return np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def duration(self) -> float:
        """T, in [s]: of all motions and the gaps between them."""
        return float(self.starts[-1] + self.motions[-1].duration)

    @property
    def metadata(self) -> dict[str, Any]:
        """The cautions of all motions."""
        found = [caution for each in self.motions for caution in cautions_of(each.metadata)]
        return with_cautions({}, found)

    def sample(self, t: npt.ArrayLike) -> Sample:
        """q, v, a and tau, as `Trajectory.sample`; in a gap v and a are zero.

        t: times in [0, T], shape (M,), in [s].
        """
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        number, local = self._locate(times)
        q, v, a, tau = (np.empty((len(times), x.shape[1])) for x in self.motions[0].sample([0.0]))
        for k, motion in enumerate(self.motions):
            here = number == k
            ends = np.minimum(local, motion.duration)
            for target, found in zip((q, v, a, tau), motion.sample(ends[here]), strict=True):
                target[here] = found
            held = here & (local >= motion.duration) & self._has_gap_after(k)
            if held.any():
                v[held], a[held] = 0.0, 0.0
                tau[held] = _holding_torque(motion, tau.shape[1])
        return Sample(q, v, a, tau)

    def positions(self, t: npt.ArrayLike) -> Array:
        """One number per velocity coordinate, as `Trajectory.positions`; angles go on at joints.

        t: times in [0, T], shape (M,), in [s].
        """
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        number, local = self._locate(times)
        numbers = np.empty((len(times), len(self.coordinate_names)))
        for k, motion in enumerate(self.motions):
            here = number == k
            inside = np.minimum(local[here], motion.duration)
            numbers[here] = motion.positions(inside) + self._turned[k]
        return numbers

    @cached_property
    def _turned(self) -> Array:
        """Full turns by which the angles of each motion go on from the one before, in [rad]."""
        columns = [] if self.space is None else [factor.v.start for factor in self.space.angles]
        turned = np.zeros((len(self.motions), len(self.coordinate_names)))
        for k, (before, after) in enumerate(itertools.pairwise(self.motions)):
            end = before.positions([before.duration])[0] + turned[k]
            apart = (end - after.positions([0.0])[0])[columns]
            turned[k + 1, columns] = 2 * np.pi * np.round(apart / (2 * np.pi))
        return turned

    def _has_gap_after(self, k: int) -> bool:
        return self.gap > 0 and k < len(self.motions) - 1

    def _locate(self, times: Array) -> tuple[npt.NDArray[np.intp], Array]:
        """The motion that has begun last at each time, and the time since then."""
        number = np.clip(np.searchsorted(self.starts, times, side="right") - 1, 0, None)
        return number, times - self.starts[number]


AnyMotion = Trajectory | JoinedMotion
"""What the formats of samples take."""


def joined(motions: Sequence[Trajectory], gap: float = 0.0) -> AnyMotion:
    """A single motion as it is, several as one. Raises InputError as JoinedMotion does."""
    whole = JoinedMotion(tuple(motions), gap)
    return whole if len(whole.motions) > 1 else whole.motions[0]


def require_rest(motion: Trajectory, time: float, what: str) -> None:
    """Raise InputError where a joint moves at a time. what: the motion, such as "motion 1 ends"."""
    speeds = np.abs(motion.sample([time]).v[0])
    i = int(np.argmax(speeds))
    if speeds[i] > REST:
        raise InputError(
            f"{what} at {speeds[i]:.3g} rad/s or m/s of {motion.coordinate_names[i]!r}, and must "
            "be at rest there: plan it with zero velocity at that end."
        )


def _require_joint(number: int, before: Trajectory, after: Trajectory) -> None:
    """Raise InputError unless one motion begins at rest where the other ends at rest."""
    if before.coordinate_names != after.coordinate_names:
        raise InputError(
            f"motion {number + 1} moves other joints than motion {number}: join motions of one "
            "robot, with the same locked joints."
        )
    if _has_torques(before) != _has_torques(after):
        raise InputError("some of these motions have torques and some have none: join either.")
    end, start = before.q[-1], after.q[0]
    robot = before.robot
    apart = np.abs(start - end if robot is None else robot.difference(end, start))
    i = int(np.argmax(apart))
    if not apart[i] <= SAME:
        name = f"q[{i}]" if robot is None else before.coordinate_names[i]
        raise InputError(
            f"motion {number + 1} begins {apart[i]:.3g} rad or m of {name!r} from where motion "
            f"{number} ends: plan it from there."
        )
    require_rest(before, before.duration, f"motion {number} ends")
    require_rest(after, 0.0, f"motion {number + 1} begins")


def _has_torques(motion: Trajectory) -> bool:
    return bool(motion.sample([0.0]).tau.size)


def _holding_torque(motion: Trajectory, size: int) -> Array:
    """tau that holds the robot where a motion ends, shape (1, size)."""
    if not size:
        return np.empty((1, 0))
    still = np.zeros((1, size))
    jet = motion.q[-1:], still, still
    return motion.scenes[-1].inverse_dynamics(*jet, np.array([motion.duration]))

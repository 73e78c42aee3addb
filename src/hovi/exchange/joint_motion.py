"""A motion joint by joint, for formats that know joints with one position each."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.joined_motion import AnyMotion
from hovi.exchange.samples import times_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointMotion:
    """The joints with one position at M times.

    names: of the J joints. times: shape (M,), strictly increasing, in [s].
    q, v, a: shape (M, J), in [rad] or [m] and per [s]; angles of continuous joints begin at the
        turns of the start and go on beyond a full turn.
    tau: shape (M, J), in [N m] or [N]; (M, 0) for a Lagrangian without torques.
    others: names of the joints with several coordinates, such as a free-flyer, which are left out.
    """

    names: tuple[str, ...]
    times: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    others: tuple[str, ...]


def joint_motion(trajectory: AnyMotion, rate: float) -> JointMotion:
    """Samples at multiples of 1/rate and at the end.

    rate: samples per second. Raises InputError for an invalid one.
    """
    times = times_of(trajectory, rate)
    _, v, a, tau = trajectory.sample(times)
    q = trajectory.positions(times)
    names = np.array(trajectory.coordinate_names, dtype=object)
    single = np.array([not name.endswith("]") for name in names], dtype=bool)
    others = dict.fromkeys(name.rpartition("[")[0] for name in names[~single])
    return JointMotion(
        names=tuple(names[single]),
        times=times,
        q=q[:, single],
        v=v[:, single],
        a=a[:, single],
        tau=tau[:, single] if tau.size else tau,
        others=tuple(others),
    )

"""Symmetries and their momentum maps, which motions conserve.

A one-parameter group acts on Q with generator xi(q). Its lift to T^(k-1)Q has the generator
(xi, d/dt xi, ...), and J = sum_j p_j . d^j/dt^j xi is constant along motions of an invariant L, and
along every discrete motion of an invariant L_d: the discrete Noether theorem. On groups xi is in
the body's frame, and the second entry of the lift is d/dt xi + [v, xi], the change of v.
[MarsdenWest2001, section 1.3.3; for k = 2: J = p.xi + p~.(d xi/dq v)]
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments
from hovi.checks.directions import unit_vector
from hovi.checks.shapes import numbers_of, require_shape
from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.errors import InputError, SceneError
from hovi.flows.legendre_transforms import total_derivative
from hovi.robot.model import frame_ids
from hovi.robot.space.configuration_rate import bracket_on, rate_on
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.joint_kinds import kind_of
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_DERIVATIVES = 4


@check_arguments
@dataclass(frozen=True, eq=False)
class Symmetry:
    """A one-parameter group of motions of Q, by its generator.

    generator: q (CasADi column of nq) -> xi(q), a column of n, the velocity of q.
    n: degrees of freedom. space: the configuration space; None for R^n.
    """

    generator: Callable[[ca.SX], ca.SX]
    n: int
    space: ConfigurationSpace | None = None

    def momentum(self, x: Array, p: Array) -> Array:
        """J at N points, shape (N,); x and p of shape (N, k, n), on groups x as for `lift`.

        The group need not be a symmetry of L. Raises InputError for other shapes.
        """
        lifted = self.lift(x)
        require_shape("p", p, *lifted.shape)
        return np.asarray(np.sum(p * lifted, axis=(1, 2)))

    def defect(self, lagrangian: Lagrangian, *jet: Array) -> Array:
        """sum_j dL/dq^(j) . d^j/dt^j xi, shape (P,): zero if L is invariant.

        jet: (q, q', ..., q^(k)), k + 1 arrays of shape (P, n). Raises InputError for others.
        """
        if not jet or len(jet) != lagrangian.order + 1:
            raise InputError(f"L takes {lagrangian.order + 1} arrays (q, q', ...), got {len(jet)}.")
        for j, array in enumerate(jet):
            rows, size = (len(jet[0]), self.n) if j else (None, self._nq)
            require_shape(f"array {j} of the jet", array, rows, size)
        lifted = self._lifted(list(jet))
        return np.asarray(np.sum(lagrangian.gradient(*jet) * lifted, axis=(1, 2)))

    def lift(self, x: Array) -> Array:
        """(xi, d/dt xi, ...) at N points of T^(k-1)Q, shape (N, k, n).

        x: shape (N, k, n); on groups rows (q, q', ..), shape (N, 1, nq + (k - 1) n).
        """
        if self.space is None:
            require_shape("x", x, None, None, self.n)
            return self._lifted(list(np.moveaxis(np.asarray(x, dtype=np.float64), 1, 0)))
        require_shape("x", x, None, 1, None)
        count, left = divmod(x.shape[2] - self._nq, self.n)
        if count < 0 or left:
            raise InputError(
                f"points have {self._nq} numbers for q and {self.n} for each derivative, got "
                f"{x.shape[2]}."
            )
        ends = self._nq + self.n * np.arange(count + 1)
        return self._lifted(np.split(x[:, 0], ends, axis=1)[:-1])

    @property
    def _nq(self) -> int:
        return self.n if self.space is None else self.space.nq

    def _lifted(self, jet: list[Array]) -> Array:
        """The lift at (q, q', ...), k arrays of N rows, (N, k, n)."""
        k = len(jet)
        if k > MAX_DERIVATIVES:
            raise InputError(f"symmetries are lifted to k <= {MAX_DERIVATIVES}, got {k}.")
        derivatives = self._lifts[k - 1](*jet)
        return np.stack([d.reshape(len(jet[0]), self.n) for d in derivatives], axis=1)

    @cached_property
    def _lifts(self) -> list[PointFunction]:
        jet = [ca.SX.sym("q0", self._nq)]
        jet += [ca.SX.sym(f"q{j}", self.n) for j in range(1, MAX_DERIVATIVES)]
        xi, space = [ca.densify(self.generator(jet[0]))], self.space
        for j in range(1, MAX_DERIVATIVES):
            if space is None:
                rate = total_derivative(xi[-1], jet)
            else:
                rates = ca.vertcat(rate_on(space, jet[0], jet[1]), *jet[2:])
                rate = ca.jtimes(xi[-1], ca.vertcat(*jet[:-1]), rates)
            if space is not None and j == 1:
                rate += bracket_on(space, jet[1], xi[0])
            xi.append(ca.densify(rate))
        return [
            PointFunction(ca.Function("lift", jet[: k + 1], xi[: k + 1]))
            for k in range(MAX_DERIVATIVES)
        ]


@check_arguments
def base_rotation(scene: Scene, axis: npt.ArrayLike, point: npt.ArrayLike = (0, 0, 0)) -> Symmetry:
    """The rotation of a whole robot about an axis under which gravity is invariant.

    axis: shape (3,). point: a point on it, shape (3,), in [m].
    An effect on the first joints, such as a joint limit potential, may break the symmetry: see
    `Symmetry.defect`.
    Raises SceneError if gravity is not invariant, or the robot's first joints cannot perform it.
    """
    w = _unit(axis)
    g = np.array(scene.model.gravity.linear)
    if np.abs(np.cross(w, g)).max() > 1e-12 * max(1.0, float(np.abs(g).max())):
        raise SceneError(
            f"gravity {g.tolist()} changes under a rotation about {w.tolist()}; use an axis along "
            "gravity."
        )
    return _base_motion(scene, np.concatenate([np.cross(numbers_of("point", point, 3), w), w]))


@check_arguments
def base_translation(scene: Scene, direction: npt.ArrayLike) -> Symmetry:
    """The translation of a whole robot along a direction orthogonal to gravity.

    direction: shape (3,). Raises SceneError as `base_rotation` does.
    """
    d = _unit(direction)
    g = np.array(scene.model.gravity.linear)
    if abs(d @ g) > 1e-12 * max(1.0, float(np.abs(g).max())):
        raise SceneError(
            f"gravity {g.tolist()} does work under a translation along {d.tolist()}; use a "
            "direction orthogonal to gravity."
        )
    return _base_motion(scene, np.concatenate([d, np.zeros(3)]))


def _unit(vector: npt.ArrayLike) -> Array:
    array = numbers_of("a direction of the world", vector, 3)
    if not (array.any() and np.isfinite(array).all()):
        raise InputError(f"a direction of the world is three numbers, not all zero; got {array}.")
    return unit_vector(array)


def _base_motion(scene: Scene, twist: Array) -> Symmetry:
    """The generator that moves every body with one twist (velocity at the origin, rotation).

    The first joint must perform it, or the first few if the bodies between them are massless.
    """
    robot, trunk = scene.robot, _trunk(scene)
    q = ca.SX.sym("q", robot.nq)
    axes = [_joint_axes(scene, joint, q) for joint in trunk]
    samples = np.random.default_rng(0).uniform(-1.0, 1.0, size=(8, robot.nq))
    samples = robot.space.normalized(samples)
    for count in range(1, len(trunk) + 1):
        S = ca.densify(ca.horzcat(*axes[:count]))
        normal = ca.mtimes(S.T, S)
        xi = ca.solve(normal, ca.mtimes(S.T, ca.DM(twist)))
        residual = ca.Function("r", [q], [ca.mtimes(S, xi) - ca.DM(twist), ca.trace(normal)])
        misses = [float(ca.norm_inf(residual(sample)[0])) for sample in samples]
        if np.isfinite(misses).all() and max(misses) < 1e-9:
            column = ca.vertcat(xi, ca.SX.zeros(robot.nv - S.shape[1]))
            return Symmetry(ca.Function("xi", [q], [column]), robot.nv, robot.curved_space)
    raise SceneError(
        f"the first joints of robot {robot.name!r} cannot move the whole robot this way: "
        "the motion of its base is not a symmetry of its configurations."
    )


def _trunk(scene: Scene) -> list[int]:
    """Joints with one coordinate or on a group, up to the first body with mass or branch."""
    model, trunk = scene.model, []
    leading = set(scene.model.mimicked_joints)  # they move other joints as well
    for joint in range(1, model.njoints):
        alone = list(model.parents)[1:].count(model.parents[joint]) == 1
        moves = model.joints[joint]
        known = moves.nq == moves.nv == 1 or kind_of(moves).group is not None
        simple = known and joint not in leading
        if not (alone and simple and model.parents[joint] == joint - 1):
            break
        trunk.append(joint)
        if model.inertias[joint].mass > 0:
            break
    return trunk


def _joint_axes(scene: Scene, joint: int, q: ca.SX) -> ca.SX:
    """The twists per unit speed of a joint in the world, (velocity at the origin, rotation)."""
    model = scene.model
    named = ((name, model.frames[index]) for name, index in frame_ids(model).items())
    frame = next(
        name for name, f in named if f.parentJoint == joint and f.placement.isIdentity(1e-15)
    )
    R, p = casadi_functions(model).frame_placement(frame)(q)
    data = model.createData()
    first, count = model.joints[joint].idx_v, model.joints[joint].nv
    twists = []
    for v in np.eye(model.nv)[first : first + count]:
        pin.forwardKinematics(model, data, pin.neutral(model), v)
        motion = data.v[joint].vector  # in the joint's own frame, and constant there
        linear, angular = ca.mtimes(R, ca.DM(motion[:3])), ca.mtimes(R, ca.DM(motion[3:]))
        twists.append(ca.vertcat(linear + ca.cross(p, angular), angular))
    return ca.horzcat(*twists)

"""The symbols of formulas: q, v, a and tau by joint, frames, and the force on the base."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import casadi as ca

from hovi.dynamics.moving_base_torque import BASE_DOF, on_base_joints
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.effects.expressions.formula import Symbols, Table
from hovi.effects.expressions.frame_motion import frame_motion
from hovi.effects.expressions.joint_positions import positioned, positions
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

AXES = ("x", "y", "z")


def joint_symbols(robot: Robot, symbols: SceneSymbols) -> dict[str, Any]:
    """q, v and a by coordinate name, and t. Joints with nq != nv have no q."""
    names, q = robot.coordinate_names, positions(robot, symbols.q)
    by_name = (dict(zip(names, ca.vertsplit(x), strict=True)) for x in (symbols.v, symbols.a))
    v, a = by_name
    return {"t": symbols.t, "q": {names[i]: q[i] for i in positioned(robot)}, "v": v, "a": a}


def cost_symbols(robot: Robot, symbols: SceneSymbols, tau: ca.SX) -> Symbols:
    """The symbols of formulas of a running cost; what a formula does not name is not built.

    q, v, a, tau: by coordinate name, or all as a column. position, velocity, acceleration: of the
    origin of a frame in the world, by frame and axis, in [m], [m/s] and [m/s^2]. x_axis, y_axis,
    z_axis: the axes of a frame in the world, by frame and component; they are the columns of its
    rotation. base_force, base_moment: see `base_reaction`.
    """
    columns = {"v": symbols.v, "a": symbols.a, "tau": tau}
    if len(positioned(robot)) == robot.nv:
        columns["q"] = positions(robot, symbols.q)
    known: dict[str, Any] = joint_symbols(robot, symbols)
    known["tau"] = dict(zip(robot.coordinate_names, ca.vertsplit(tau), strict=True))
    for name in ("q", "v", "a", "tau"):
        known[name] = _by_joint(known[name], columns.get(name))
    for order, name in enumerate(("position", "velocity", "acceleration")):
        entry = functools.partial(frame_column, robot, symbols, order)
        known[name] = Table(robot.frame_names, entry, components=AXES, kind="frame")
    for number, name in enumerate(("x_axis", "y_axis", "z_axis")):
        entry = functools.partial(_axis, robot, symbols, number)
        known[name] = Table(robot.frame_names, entry, components=AXES, kind="frame")
    reaction = functools.cache(lambda: base_reaction(robot, symbols))
    for part, name in enumerate(("base_force", "base_moment")):
        known[name] = _by_axis(reaction, part)
    return known


def base_reaction(robot: Robot, symbols: SceneSymbols) -> tuple[ca.SX, ca.SX]:
    """Force [N] and moment [N m] of the ground on the base, by RNEA, each of shape (3,).

    In the axes of the world; the moment is about its origin. They carry the weight and the inertia
    of all links, the base's own weight included; wrenches and drag at frames are no part of them.
    Raises SceneError with a moving base.
    """
    if symbols.base is not None:
        raise SceneError(
            "base_force and base_moment are those on a base at rest: leave out the effect "
            "'moving_base', or these symbols."
        )
    model = robot.model if symbols.model is None else symbols.model
    rest = ca.SX.zeros(BASE_DOF)
    jet = (ca.vertcat(rest, x) for x in (symbols.q, symbols.v, symbols.a))
    tau = casadi_functions(on_base_joints(model)).inverse_dynamics(*jet)
    return tau[:3], tau[[5, 4, 3]]  # the joints are x, y, z, yaw, pitch, roll


def _by_joint(entries: dict[str, ca.SX], whole: ca.SX | None) -> Table:
    """The entries of a column by joint, and the column."""
    return Table(list(entries), entries.__getitem__, None if whole is None else lambda: whole)


def _by_axis(reaction: Callable[[], tuple[ca.SX, ca.SX]], part: int) -> Table:
    """The components of a force or a moment, and the column."""
    return Table(
        AXES,
        lambda axis: reaction()[part][AXES.index(axis)],
        lambda: reaction()[part],
        kind="component",
    )


def frame_column(robot: Robot, symbols: SceneSymbols, order: int, frame: str) -> ca.SX:
    """The origin of a frame in the world, or its first or second derivative, shape (3,)."""
    motion = frame_motion(robot, symbols, frame)
    if order < 2:
        return (motion.position, motion.velocity)[order]
    q, v, a, t = symbols.columns()
    changes = (q, motion.rate), (v, a), (t, ca.SX(1))
    parts = [ca.jtimes(motion.velocity, x, dx) for x, dx in changes]
    return parts[0] + parts[1] + parts[2]


def _axis(robot: Robot, symbols: SceneSymbols, number: int, frame: str) -> ca.SX:
    """An axis of a frame in the world, shape (3,)."""
    return frame_motion(robot, symbols, frame).rotation[:, number]

"""Plots of a motion, drawn by Matplotlib without its global state.

Curves are drawn interval by interval, so that a jump at a node is a gap and not a steep line.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

# mpl_toolkits ships no types
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import DisplayError, expect
from hovi.planning.problem.limit_conditions import at_limit
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.solver.solver import Solution
from hovi.robot.model import frame_named
from hovi.robot.robot import Robot
from hovi.robot.space.unwrapped_angles import shown_names
from hovi.system.dataclass import dataclass
from hovi.viewing.curves.colors import COLORS, curve_style
from hovi.viewing.curves.given_motion import motion_in, motions_in
from hovi.viewing.curves.joint_panels import joint_figure
from hovi.viewing.curves.scheme_torque import scheme_torque
from hovi.viewing.curves.shown_figure import ShownFigure
from hovi.viewing.distance_panel import draw_distances
from hovi.viewing.figures import align_zeros, draw_cautions, write_figure
from hovi.viewing.limit_bands import Curve, draw_limits, legend_entries
from hovi.viewing.recorded_limits import imposed_limits, kept_distances
from hovi.viewing.segment_marks import draw_segments

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_CURVE_POINTS = 2_000
_MAX_MARKED_INTERVALS = 150
_MAX_MARKED_COORDINATES = 28
"""Number of curves up to which nodes have dots; those of more have styles that come again."""
_SURFACE_TIMES = 180
_SECTIONS = 25
_STRIPS = 20
_RIGHT = " (right)"


@dataclass(frozen=True, eq=False)
class _SampledMotion:
    """A motion sampled at m points in each of N intervals, ends included."""

    t: Array  # (N, m)
    positions: Array  # (N, m, nv)
    motion: Sample  # arrays (N, m, n)
    limits: Limits | None
    active: Mask  # (N, m, 4, nv), True where a limit is active


@dataclass(frozen=True)
class _Panel:
    """What a panel shows, and the label and scale of angular and linear coordinates."""

    kind: int  # in KINDS
    angular: tuple[str, float]
    linear: tuple[str, float]


_POSITION = _Panel(KINDS.index("q"), ("angle [deg]", np.degrees(1.0)), ("position [m]", 1.0))
_VELOCITY = _Panel(KINDS.index("v"), ("velocity [deg/s]", np.degrees(1.0)), ("velocity [m/s]", 1.0))
_EFFORT = _Panel(KINDS.index("tau"), ("torque [N m]", 1.0), ("force [N]", 1.0))


@check_arguments_except("trajectory", "compare")
def plot(
    trajectory: Trajectory | Solution,
    path: str | os.PathLike[str] | None = None,
    *,
    compare: Sequence[Trajectory | Solution] = (),
) -> Figure:
    """The curves of a motion: positions, velocities and efforts over time, and its limits.

    trajectory: a motion, or a solution. Notebooks show the figure that is returned.
    path: a PNG, PDF or SVG by its suffix to write, completely or not at all; None for no file.
    compare: others of the same joints. Each joint has its panels then, with limits dashed.
    Raises DisplayError.
    """
    motions = [motion_in(trajectory), *motions_in(compare)]
    if len(motions) == 1:
        figure = motion_figure(motions[0])
    else:
        labels = [f"{k + 1}: {each.duration:g} s" for k, each in enumerate(motions)]
        figure = joint_figure(motions, labels, [imposed_limits(each) for each in motions])
    draw_cautions(figure, [each.metadata for each in motions])
    if path is not None:
        write_figure(figure, path)
    return figure


def plot_angles(trajectory: Trajectory, path: str | os.PathLike[str]) -> None:
    """Write `angles_figure` to a file, as `plot` does."""
    write_figure(angles_figure(trajectory), path)


def plot_swept_surface(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    window: tuple[float, float] | None = None,
) -> None:
    """Write `surface_figure` to a file, as `plot` does."""
    write_figure(surface_figure(trajectory, window), path)


def motion_figure(trajectory: Trajectory) -> Figure:
    """Positions, velocities and efforts over time, one line per coordinate, nodes as marks.

    Limits of the plan are shown as bands where they are close to the curves; a curve is wider where
    it is at a limit. For a motion planned with obstacles or self-collision, a fourth panel shows
    the distances of the closest pairs.
    """
    expect(trajectory, Trajectory, "the trajectory of a solution")
    curve, kept = _sampled_motion(trajectory), kept_distances(trajectory)
    panels = 3 if kept is None else 4
    figure = ShownFigure(figsize=(8.0, 2.5 * panels), layout="constrained")
    axes = figure.subplots(panels, sharex=True)
    values = (curve.positions, curve.motion.v, curve.motion.tau)
    for ax, panel, y in zip(axes[:3], (_POSITION, _VELOCITY, _EFFORT), values, strict=True):
        _draw(ax, trajectory, panel, curve, y)
    if kept is not None:
        draw_distances(axes[3], trajectory, *kept)
    draw_segments(axes, trajectory)
    axes[-1].set_xlabel("time [s]")
    _legend(figure, axes[0], _names(trajectory))
    return figure


def angles_figure(trajectory: Trajectory) -> Figure:
    """The configuration over time [ColomboFerraroMartin2016, section 5, first result]."""
    curve = _sampled_motion(trajectory)
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    ax = figure.subplots()
    _draw(ax, trajectory, _POSITION, curve, curve.positions)
    ax.set_xlabel("time [s]")
    _legend(figure, ax, _names(trajectory))
    return figure


def surface_figure(trajectory: Trajectory, window: tuple[float, float] | None = None) -> Figure:
    """The surface swept by the chain from base to tip, over time and the plane of the motion.

    A section at a fixed time shows the links at that time
    [ColomboFerraroMartin2016, section 5, second result].

    window: start and end time, in [s]; 0.3 T to 0.6 T by default.
    Raises DisplayError when the window lies outside the motion, or the robot is unknown.
    """
    start, end = window or (0.3 * trajectory.duration, 0.6 * trajectory.duration)
    if not 0 <= start < end <= trajectory.duration:
        raise DisplayError(
            f"the window {start:g} to {end:g} s must lie within 0 and {trajectory.duration:g} s."
        )
    t, dark = _surface_times(start, end)
    points = _chain(_robot(trajectory), trajectory.configurations(t))  # (links + 1, M, 3)
    plane = np.sort(np.argsort(np.ptp(points, axis=(0, 1)))[1:])  # without the axis of least extent
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    ax = figure.add_subplot(projection="3d")
    assert isinstance(ax, Axes3D)
    _sweep(ax, t, points[:, :, plane], dark)
    across, up = ("xyz"[axis] for axis in plane)
    _format_surface(ax, across, up, np.ptp(points[:, :, plane], axis=(0, 1)))
    return figure


def plot_all(trajectory: Trajectory, path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """`plot`, and for a planar two-link arm the two figures of the paper as well.

    path: of the first picture; the others append `_angles` and `_surface` to its stem.
    Returns the paths of the files.
    """
    first = Path(path)
    plot(trajectory, first)
    if trajectory.robot is None or not is_planar_two_link(trajectory.robot):
        return (first,)
    angles, surface = (
        first.with_name(f"{first.stem}_{name}{first.suffix}") for name in ("angles", "surface")
    )
    plot_angles(trajectory, angles)
    plot_swept_surface(trajectory, surface)
    return first, angles, surface


def is_planar_two_link(robot: Robot) -> bool:
    """Whether a robot is a serial chain of two revolute joints with parallel axes."""
    if (robot.nq, robot.nv, robot.model.njoints) != (2, 2, 3) or list(robot.model.parents)[2] != 1:
        return False
    first, second = _axes_in_world(robot).T
    return bool(not robot.sliding.any() and abs(first @ second) > 1 - 1e-9)


def _robot(trajectory: Trajectory) -> Robot:
    if trajectory.robot is None:
        raise DisplayError(
            "this motion was saved without its robot, which was a bare Pinocchio model, so its "
            "links cannot be drawn; load the robot from a URDF and plan again."
        )
    return trajectory.robot


def _axes_in_world(robot: Robot) -> Array:
    """Angular part of each coordinate's motion at the neutral configuration, shape (3, nv)."""
    data = robot.model.createData()
    axes: Array = pin.computeJointJacobians(robot.model, data, robot.neutral())[3:]
    leading = [joint for joint in list(robot.model.joints)[1:] if joint.nv]  # not mimic joints
    columns = [range(joint.idx_vExtended, joint.idx_vExtended + joint.nv) for joint in leading]
    return axes[:, [column for each in columns for column in each]]


def _names(trajectory: Trajectory) -> tuple[str, ...]:
    """Names of the columns of `Trajectory.positions`."""
    names = trajectory.coordinate_names
    return names if trajectory.space is None else shown_names(trajectory.space, names)


def _chain(robot: Robot, q: Array) -> Array:
    """Origins of the joints from base to tip, and the tip, shape (links + 1, M, 3), in [m]."""
    model = robot.model
    tip = frame_named(model, robot.tip_frame)
    joints = [joint for joint in model.supports[tip.parentJoint] if joint != 0]
    data, points = model.createData(), np.empty((len(joints) + 1, len(q), 3))
    for i, configuration in enumerate(q):
        pin.forwardKinematics(model, data, configuration)
        points[:-1, i] = [data.oMi[joint].translation for joint in joints]
        points[-1, i] = (data.oMi[tip.parentJoint] * tip.placement).translation
    return points


def _sampled_motion(trajectory: Trajectory) -> _SampledMotion:
    N = trajectory.grid.intervals
    s = np.linspace(0.0, 1.0, max(3, -(-_CURVE_POINTS // N) + 1))
    where = np.repeat(np.arange(N), len(s)), np.tile(s, N)
    motion = trajectory.sample_intervals(*where)
    t = trajectory.t[:-1, None] + trajectory.grid.steps[:, None] * s
    tau = scheme_torque(trajectory, t.ravel())
    motion = motion if tau is None else motion._replace(tau=tau)
    limits = imposed_limits(trajectory)
    active: Mask = np.zeros((N, len(s), 4, motion.v.shape[1]), dtype=bool)
    if limits is not None:
        active = at_limit(limits, motion, trajectory.robot).reshape(active.shape)
    q = trajectory.positions_intervals(*where).reshape(N, len(s), -1)
    motion = Sample(*(x.reshape(N, len(s), -1) for x in motion))
    return _SampledMotion(t, q, motion, limits, active)


def _draw(ax: Axes, trajectory: Trajectory, panel: _Panel, curve: _SampledMotion, y: Array) -> None:
    """One line per coordinate; linear coordinates on the right axis if there are angular ones."""
    robot = trajectory.robot
    if robot is None:  # unknown which coordinates are angles: no unit conversion
        label = f"{panel.angular[0].split(' [')[0]} [SI]".replace("angle", "position")
        _lines(ax, trajectory, panel.kind, curve, y, 1.0, np.arange(y.shape[-1]))
        _format_axes(ax, label)
        return
    angular, side = ~robot.sliding, ax
    for mask, (label, scale) in ((angular, panel.angular), (~angular, panel.linear)):
        if mask.any():
            side = ax.twinx() if side.lines else ax
            _lines(side, trajectory, panel.kind, curve, y, scale, np.flatnonzero(mask))
            _format_axes(side, label)
            if side is not ax:
                side.grid(False)
    if side is not ax:
        if panel is _EFFORT:
            _share_scale(trajectory, (ax, angular), (side, ~angular))
        align_zeros(ax, side)


def _share_scale(trajectory: Trajectory, one: tuple[Axes, Mask], other: tuple[Axes, Mask]) -> None:
    """Give an axis of passive joints only the other's limits; its own would magnify rounding."""
    passive = np.zeros(len(one[1]), dtype=bool)
    if trajectory.scene is not None:
        passive[trajectory.scene.passive_coordinates] = True
    for (ax, mask), (wider, _) in ((one, other), (other, one)):
        if passive[mask].all():
            ax.set_ylim(wider.get_ylim())


def _lines(
    ax: Axes,
    trajectory: Trajectory,
    kind: int,
    curve: _SampledMotion,
    y: Array,
    scale: float,
    members: npt.NDArray[np.intp],
) -> None:
    t, y = curve.t, scale * y
    gap = np.full((len(t), 1), np.nan)
    broken = np.hstack([t, gap]).ravel()
    limited: list[Curve] = []
    names, side = (
        _names(trajectory),
        _RIGHT if ax.yaxis.get_ticks_position() == "right" else "",
    )
    for i in members:
        style = curve_style(int(i))
        color, line = style.color, np.hstack([y[:, :, i], gap]).ravel()
        (drawn,) = ax.plot(broken, line, color=color, linewidth=1.4, label=names[i] + side)
        drawn.set_linestyle(style.line)
        if len(t) <= _MAX_MARKED_INTERVALS and y.shape[-1] <= _MAX_MARKED_COORDINATES:
            ends = np.s_[:, [0, -1]]
            ax.plot(t[ends].ravel(), y[:, :, i][ends].ravel(), ".", color=color, markersize=3)
        if curve.limits is not None:
            lower, upper = curve.limits.lower[kind, i], curve.limits.upper[kind, i]
            active = np.hstack([curve.active[:, :, kind, i], np.isinf(gap)]).ravel()
            limited.append(
                Curve(names[i], color, broken, line, scale * lower, scale * upper, active)
            )
    if limited:
        draw_limits(ax, limited)
    ax.set_xlim(0.0, trajectory.duration)


def _format_axes(ax: Axes, label: str) -> None:
    ax.set_ylabel(label)
    ax.grid(color="0.88", linewidth=0.6)
    ax.spines["top"].set_visible(False)


def _legend(figure: Figure, ax: Axes, names: Sequence[str]) -> None:
    """Draw one legend above the figure, for the lines of all axes that share the first panel.

    names: of the coordinates, in the order of the legend.
    """
    shared = [a for a in figure.axes if a.bbox.bounds == ax.bbox.bounds]
    pairs = [pair for a in shared for pair in zip(*a.get_legend_handles_labels(), strict=True)]
    rank = {label: i for i, name in enumerate(names) for label in (name, name + _RIGHT)}
    pairs.sort(key=lambda pair: rank[pair[1]])
    pairs += legend_entries(figure.axes)
    handles, labels = zip(*pairs, strict=True)
    columns = -(-len(labels) // -(-len(labels) // 4))  # at most 4, rows of equal length
    figure.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False)


def _surface_times(start: float, end: float) -> tuple[Array, Mask]:
    """Times (M,) of the surface mesh, and which of its M - 1 columns are thin dark sections."""
    thin = (end - start) / 500
    sections = np.linspace(start, end - thin, _SECTIONS)
    even = np.linspace(start, end, _SURFACE_TIMES)
    t = np.unique(np.concatenate([even, sections, sections + thin]))
    middles = 0.5 * (t[1:] + t[:-1])
    dark: Mask = (np.abs(middles[:, None] - sections - thin / 2) < thin / 2).any(axis=1)
    return t, dark


def _sweep(ax: Axes3D, t: Array, points: Array, dark: Mask) -> None:
    """Draw a ruled surface per link, with the patches of all links sorted by depth together.

    The dark columns of patches show the links at those times.
    """
    u = np.linspace(0.0, 1.0, _STRIPS + 1)[:, None, None]
    patches, colors = [], []
    for link, (p0, p1) in enumerate(itertools.pairwise(points)):
        plane = (1 - u) * p0 + u * p1  # (strips + 1, M, 2)
        times = np.broadcast_to(t[:, None], (*plane.shape[:2], 1))
        mesh = np.concatenate([times, plane], axis=2)
        corners = [mesh[:-1, :-1], mesh[:-1, 1:], mesh[1:, 1:], mesh[1:, :-1]]
        patches.append(np.stack(corners, axis=2).reshape(-1, 4, 3))
        light = 0.75 * np.array(to_rgb(COLORS[link % len(COLORS)])) + 0.25
        colors.append(np.tile(np.where(dark[:, None], 0.35 * light, light), (_STRIPS, 1)))
    faces = np.concatenate(colors)
    ax.add_collection3d(
        Poly3DCollection(
            np.concatenate(patches), facecolors=faces, edgecolors=faces, linewidths=0.4, shade=True
        )
    )
    across, up = points.reshape(-1, 2).T
    ax.auto_scale_xyz(t, across, up)


def _format_surface(ax: Axes3D, across: str, up: str, extent: Array) -> None:
    """Label the axes and draw the two space axes to the same scale."""
    ax.set_xlabel("time [s]", labelpad=12)
    ax.set_ylabel(f"{across} [m]", labelpad=6)
    ax.set_zlabel(f"{up} [m]")
    for axis in (ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(5))
    ax.set_box_aspect((1.9 * extent.max(), *np.maximum(extent, 0.2 * extent.max())), zoom=1.05)
    ax.view_init(elev=22, azim=-58)

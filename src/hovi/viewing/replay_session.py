"""Replay of a motion: live in a browser in real time, or as one page that plays offline."""

from __future__ import annotations

import html as html_text
import itertools
import math
import os
import time
import warnings
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, expect
from hovi.robot.robot import Robot
from hovi.system.files import reason, whole_file
from hovi.viewing.animation import animation_of, frame_times, placements_at
from hovi.viewing.highlights import AT_LIMIT_NOTE, Highlights
from hovi.viewing.meshcat_page import Page
from hovi.viewing.meshcat_server import ServedPage
from hovi.viewing.recorded_limits import MovingObjects, with_obstacles
from hovi.viewing.skeleton import skeleton

with warnings.catch_warnings():
    # meshcat imports a deprecated module of ZeroMQ that hovi does not use.
    warnings.simplefilter("ignore", DeprecationWarning)
    import meshcat
    import meshcat.animation
    import meshcat.geometry
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]

_FIELD_OF_VIEW = math.radians(75.0)  # meshcat's camera, vertically
_ELEVATION = 0.25
_TRACE_COLOR = (0.80, 0.47, 0.65)
_TRACE_WIDTH = 0.006  # relative to the picture's size
_FRAME_RATE = 60.0
_VIEW_SAMPLES = 60
_TRACE_SAMPLES = 2_000
_BROWSER_TIMEOUT = 20.0  # [s]


@dataclass(frozen=True, eq=False)
class Replay:
    """A motion on a page. Jupyter shows it as the value of a cell.

    trajectory: the motion.
    visualizer: Pinocchio's, for drawing more (`visualizer.viewer` is meshcat's).
    url: the page's address.
    page: the page's content; a ServedPage when it is served at `url`.
    highlights: links highlighted at limits; None where no joint is ever at a limit.
    """

    trajectory: Trajectory
    visualizer: MeshcatVisualizer
    url: str
    page: Page
    highlights: Highlights | None = None

    def play(self, *, speed: float = 1.0, loop: bool = False, rate: float = _FRAME_RATE) -> None:
        """Move the robot on the page in real time, by the monotonic clock.

        speed: motion seconds per second. rate: frames per second.
        loop: play again and again until interrupted (Ctrl-C, or Jupyter's stop button).
        """
        check_speed(speed)
        _check_positive("rate", rate)
        try:
            self._play_once(speed, rate)
            while loop:
                self._play_once(speed, rate)
        except KeyboardInterrupt:
            if not loop:
                raise

    def offer_controls(self, *, loop: bool = False) -> None:
        """Give browsers that are opened from now on the motion with the page's controls.

        loop: whether the controls repeat the motion.
        """
        self.page.keep(animation_of(self.trajectory, self.visualizer, loop, self.highlights))

    def close(self) -> None:
        """Stop the server, if there is one. An open page stays as it is."""
        if isinstance(self.page, ServedPage):
            self.page.close()

    def _play_once(self, speed: float, rate: float) -> None:
        duration = self.trajectory.duration
        moving = MovingObjects.of(self.trajectory)
        start, elapsed = time.monotonic(), 0.0
        while elapsed * speed < duration:
            moving.place(self.visualizer, elapsed * speed)
            self.visualizer.display(self.trajectory.configurations(elapsed * speed)[0])
            if self.highlights is not None:
                self.highlights.show(self.visualizer, elapsed * speed)
            due = (math.floor(elapsed * rate) + 1) / rate
            time.sleep(max(0.0, start + min(due, duration / speed) - time.monotonic()))
            elapsed = time.monotonic() - start
        moving.place(self.visualizer, duration)
        self.visualizer.display(self.trajectory.configurations(duration)[0])
        if self.highlights is not None:
            self.highlights.show(self.visualizer, duration)

    def _repr_html_(self) -> str:
        """An iframe: of the address when the page is served, of the page itself otherwise."""
        if isinstance(self.page, ServedPage):
            source = f'src="{self.url}"'
        else:
            source = f'srcdoc="{html_text.escape(self.page.offline_html())}"'
        return f'<iframe {source} style="width:100%;height:480px;border:none"></iframe>'

    def __enter__(self) -> Self:
        """The replay, closed at the end of the block."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop serving."""
        self.close()


@check_arguments_except("trajectory")
def replay(
    trajectory: Trajectory,
    *,
    speed: float = 1.0,
    loop: bool = False,
    trace: bool = True,
    open_browser: bool = False,
    html: str | os.PathLike[str] | None = None,
    port: int = 0,
    announce: Callable[[str], object] = print,
) -> Replay:
    """Show a motion: live on a page of this machine, or as one file that plays offline.

    The function returns when the live page has played the motion once in real time (or, with loop,
    when it is interrupted). The page is served until the Replay is closed or the process ends;
    browsers opened later can play the motion with the page's controls.

    trajectory: the motion. A robot without visual models is drawn as a skeleton.
    speed: motion seconds per second. loop: play again and again until interrupted.
    trace: draw the paths of the robot's tip_frames.
    open_browser: open the page in the default browser and wait for it before playing.
    html: path of one self-contained page to write instead of serving; it is written completely or
        not at all.
    port: of the live page on 127.0.0.1; 0 for any free one.
    announce: called with the page's address before the motion starts.
    Raises DisplayError when the page cannot be served, opened or written.
    """
    check_speed(speed)
    if html is not None:
        return write_html(trajectory, html, speed=speed, loop=loop, trace=trace)
    shown = serve(trajectory, trace, open_browser, port, announce)
    try:
        shown.play(speed=speed, loop=loop)
        shown.offer_controls(loop=loop)
    except BaseException:
        shown.close()
        raise
    return shown


def serve(
    trajectory: Trajectory,
    trace: bool = True,
    open_browser: bool = False,
    port: int = 0,
    announce: Callable[[str], object] = print,
) -> Replay:
    """A live page that shows the start of a motion, for `Replay.play`.

    Arguments and errors as in `replay`.
    """
    robot = _robot(trajectory)
    highlights = Highlights.of(trajectory, robot, frame_times(trajectory))
    page = ServedPage(_title(trajectory, robot), _note(robot, highlights), port)
    try:
        visualizer = _draw(trajectory, robot, page, trace, highlights)
        announce(page.web_url)
        if open_browser:
            _open_browser(page)
    except BaseException:
        page.close()
        raise
    return Replay(trajectory, visualizer, page.web_url, page, highlights)


def write_html(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    *,
    speed: float = 1.0,
    loop: bool = False,
    trace: bool = True,
) -> Replay:
    """Write one page that plays the motion with its own controls and needs no network.

    The same motion gives the same bytes. Arguments as in `replay`. Raises DisplayError.
    """
    check_speed(speed)
    robot = _robot(trajectory)
    highlights = Highlights.of(trajectory, robot, frame_times(trajectory))
    page = Page(_title(trajectory, robot), _note(robot, highlights))
    visualizer = _draw(trajectory, robot, page, trace, highlights)
    page.keep(animation_of(trajectory, visualizer, loop, highlights))
    text = page.offline_html(speed)
    try:
        with whole_file(path) as stream:
            stream.write(text.encode())
    except OSError as error:
        raise DisplayError(f"cannot write the page {str(path)!r}: {reason(error)}.") from error
    return Replay(trajectory, visualizer, Path(path).resolve().as_uri(), page, highlights)


def _robot(trajectory: Trajectory) -> Robot:
    expect(trajectory, Trajectory, "the trajectory of a solution")
    if trajectory.robot is None:
        raise DisplayError(
            "this motion was saved without its robot, which was a bare Pinocchio model, so it "
            "cannot be drawn; load the robot from a URDF and plan again."
        )
    return trajectory.robot


def _open_browser(page: ServedPage) -> None:
    advice = f"open {page.web_url} yourself, or write a page with html=..."
    if not webbrowser.open(page.web_url, new=2):
        raise DisplayError(f"no browser could be started; {advice}")
    if not page.wait(_BROWSER_TIMEOUT):
        raise DisplayError(f"no browser showed the page in {_BROWSER_TIMEOUT:.0f} s; {advice}")


def _note(robot: Robot, highlights: Highlights | None) -> str:
    notes = [robot.visual_problem, "" if highlights is None else AT_LIMIT_NOTE]
    return " ".join(note for note in notes if note)


def _draw(
    trajectory: Trajectory, robot: Robot, page: Page, trace: bool, highlights: Highlights | None
) -> MeshcatVisualizer:
    """Draw the robot at the start of the motion and the paths of its tips; place the camera."""
    visual = robot.visual
    if visual is None or visual.ngeoms == 0:
        visual = skeleton(robot.model)
    if highlights is not None:
        visual = highlights.with_highlighted_copies(visual)
    visual = with_obstacles(visual, trajectory)
    visualizer = MeshcatVisualizer(robot.model, None, visual)
    visualizer.initViewer(viewer=meshcat.Visualizer(window=page))
    visualizer.loadViewerModel(rootNodeName="robot")
    visualizer.setBackgroundColor("gray")
    MovingObjects.of(trajectory).place(visualizer, 0.0)
    visualizer.display(trajectory.q[0])
    if highlights is not None:
        highlights.show(visualizer, 0.0)
    lower, upper = _swept_box(visualizer, trajectory)
    if trace:
        q = trajectory.configurations(_times(trajectory, _TRACE_SAMPLES))
        tips = robot.frame_positions(robot.tip_frames, q)
        width = _TRACE_WIDTH * float(np.linalg.norm(upper - lower))
        _draw_trace(visualizer, tips.reshape(-1, 3), width)
    _place_camera(visualizer, lower, upper)
    return visualizer


def _times(trajectory: Trajectory, max_count: int) -> Array:
    """Evenly spaced times, at most max_count, shape (M,)."""
    count = int(min(max_count, 1 + _VIEW_SAMPLES * trajectory.grid.intervals))
    return np.linspace(0.0, trajectory.duration, count)


def _swept_box(visualizer: MeshcatVisualizer, trajectory: Trajectory) -> tuple[Array, Array]:
    """Lower and upper corner of the volume that the drawn robot sweeps, each (3,), in [m]."""
    corners = [_corners(item) for item in visualizer.visual_model.geometryObjects]
    points = [np.zeros((1, 3))]  # keep the base in the picture
    for placements in placements_at(visualizer, trajectory, _times(trajectory, _VIEW_SAMPLES)):
        pairs = zip(corners, placements, strict=True)
        points += [c @ pose.rotation.T + pose.translation for c, pose in pairs]
    swept = np.concatenate(points)
    return swept.min(axis=0), swept.max(axis=0)


def _corners(item: pin.GeometryObject) -> Array:
    """Corners of a drawn object's own bounding box, shape (8, 3), in [m].

    None, shape (0, 3), for a mesh whose points are not all finite.
    """
    item.geometry.computeLocalAABB()
    box = item.geometry.aabb_local
    choices = np.array(list(itertools.product((0, 1), repeat=3)))
    corners: Array = np.where(choices, box.max_, box.min_)
    return corners if np.isfinite(corners).all() else np.zeros((0, 3))


def _draw_trace(visualizer: MeshcatVisualizer, points: Array, width: float) -> None:
    """Draw paths as dense points, since browsers draw lines of any width one pixel wide."""
    colors = np.tile(_TRACE_COLOR, (len(points), 1))
    geometry = meshcat.geometry.PointsGeometry(*(x.T.astype(np.float32) for x in (points, colors)))
    material = meshcat.geometry.PointsMaterial(size=width)
    visualizer.viewer["trace"].set_object(meshcat.geometry.Points(geometry, material))


def _place_camera(visualizer: MeshcatVisualizer, lower: Array, upper: Array) -> None:
    """Point the camera across the larger horizontal extent, far enough to show everything.

    meshcat's camera turns about the world's origin, so the center of the motion is moved there.
    """
    size, center = upper - lower, 0.5 * (lower + upper)
    aside = np.array([size[1], -size[0], 0.0])
    direction = aside / max(float(np.linalg.norm(aside)), 1e-12) + np.array([0, 0, _ELEVATION])
    diagonal = max(float(np.linalg.norm(size)), 1e-3)
    distance = 0.5 * diagonal / math.sin(_FIELD_OF_VIEW / 2)
    x, y, z = distance * direction / np.linalg.norm(direction)
    viewer = visualizer.viewer
    camera = viewer["/Cameras/default/rotated/<object>"]
    camera.set_property("position", [x, z, -y])  # the y axis of this node points up
    camera.set_property("far", max(100.0, 4 * distance))
    viewer["/meshcat"].set_transform(_shift(-center))
    viewer["/Grid"].set_transform(_shift(np.array([-center[0], -center[1], lower[2] - center[2]])))
    viewer["/Axes"].set_transform(_shift(-center) @ np.diag([*np.full(3, 0.2 * diagonal), 1.0]))


def _shift(offset: Array) -> Array:
    placement = np.eye(4)
    placement[:3, 3] = offset
    return placement


def _title(trajectory: Trajectory, robot: Robot) -> str:
    return f"{robot.name}, {trajectory.duration:g} s"


def check_speed(speed: float) -> None:
    """Raise DisplayError unless a speed is a positive number."""
    _check_positive("speed", speed)


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise DisplayError(f"{name} must be a positive number, got {value}.")

"""Replay of a motion: on a live page of this machine, or as one page that plays offline."""

from __future__ import annotations

import dataclasses
import html as html_text
import math
import os
import time
import warnings
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.output.caution import caution_lines, warn_of_cautions
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, expect
from hovi.planning.problem.limits import as_limits
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.system.files import reason, whole_file
from hovi.system.terminal import has_browser, terminal_script, wait_at_exit, wait_for_interrupt
from hovi.viewing.animation import animation_of, frame_times
from hovi.viewing.curves.given_motion import motion_in, motions_in
from hovi.viewing.drawing import drawn, ghost_color
from hovi.viewing.highlights import AT_LIMIT_NOTE, Highlights
from hovi.viewing.meshcat_page import Page, packed
from hovi.viewing.meshcat_server import ServedPage
from hovi.viewing.meshes.page_mesh import MESH_NOTE
from hovi.viewing.panel.panel import Curves, Panel, View, joints_of, labels_of, names_of
from hovi.viewing.recorded_limits import MovingObjects, imposed_limits, led_back_sentence

if TYPE_CHECKING:
    from hovi.planning.solver.solver import Solution

with warnings.catch_warnings():
    # meshcat imports a deprecated module of ZeroMQ that hovi does not use.
    warnings.simplefilter("ignore", DeprecationWarning)
    import meshcat
    import meshcat.commands
    import meshcat.path
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_FRAME_RATE = 60.0
_BROWSER_TIMEOUT = 20.0  # [s]


@dataclass(frozen=True, eq=False, repr=False)
class Replay:
    """A motion on a page. Jupyter shows it as the value of a cell.

    trajectory: the motion.
    visualizer: Pinocchio's, for drawing more (`visualizer.viewer` is meshcat's).
    url: the page's address.
    page: the page's content; a ServedPage when it is served at `url`.
    highlights: links highlighted at limits; None where no joint is ever at a limit.
    ghosts: the motions that are compared with it, and what draws them.
    speed: motion seconds per second, at first.
    tracks: when what is not always shown is so, by node name: times in [s], and flags.
    """

    trajectory: Trajectory
    visualizer: MeshcatVisualizer
    url: str
    page: Page
    highlights: Highlights | None = None
    ghosts: tuple[tuple[Trajectory, MeshcatVisualizer], ...] = ()
    speed: float = 1.0
    tracks: Mapping[str, tuple[Array, Mask]] = field(default_factory=dict)

    def play(self, *, speed: float = 1.0, loop: bool = False, rate: float = _FRAME_RATE) -> None:
        """Move the robot on the page in real time from here, by the monotonic clock.

        The page can do so itself; here other code may run during the motion.

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

    def __repr__(self) -> str:
        name = "" if self.trajectory.robot is None else f" of {self.trajectory.robot.name!r}"
        return f"Replay{name}, {self.trajectory.duration:.6g} s, at {self.url}"

    def close(self) -> None:
        """Stop the server, if there is one. An open page stays as it is."""
        if isinstance(self.page, ServedPage):
            self.page.close()

    def is_open(self) -> bool:
        """Whether the page is served."""
        return isinstance(self.page, ServedPage) and self.page.is_open

    def _play_once(self, speed: float, rate: float) -> None:
        duration = self.trajectory.duration
        moving = MovingObjects.of(self.trajectory)
        start, elapsed = time.monotonic(), 0.0
        while elapsed * speed < duration:
            self._show(elapsed * speed, moving)
            due = (math.floor(elapsed * rate) + 1) / rate
            time.sleep(max(0.0, start + min(due, duration / speed) - time.monotonic()))
            elapsed = time.monotonic() - start
        self._show(duration, moving)

    def _show(self, t: float, moving: MovingObjects) -> None:
        moving.place(self.visualizer, t)
        self.visualizer.display(self.trajectory.configurations(t)[0])
        for node, (times, flags) in self.tracks.items():
            shown = flags[max(int(np.searchsorted(times, t, side="right")) - 1, 0)]
            self.visualizer.viewer[node].set_property("visible", bool(shown))
        for trajectory, ghost in self.ghosts:
            ghost.display(trajectory.configurations(min(t, trajectory.duration))[0])
        if isinstance(self.page, Page):  # the slider and the curves follow
            self.page.send(meshcat.commands.SetProperty("time", t, meshcat.path.Path(("hovi",))))

    def _repr_html_(self) -> str:
        """An iframe with the page itself, which plays wherever the notebook goes.

        It does not need the server, which a browser on another machine cannot reach.
        """
        page = html_text.escape(packed(self.page.offline_html(self.speed)))
        return f'<iframe srcdoc="{page}" style="width:100%;height:600px;border:none"></iframe>'

    def __enter__(self) -> Self:
        """The replay, closed at the end of the block."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop serving."""
        self.close()


@check_arguments_except("trajectory", "compare")
def replay(
    trajectory: Trajectory | Solution,
    *,
    compare: Sequence[Trajectory | Solution] = (),
    speed: float = 1.0,
    loop: bool = False,
    trace: bool = True,
    open_browser: bool | None = None,
    html: str | os.PathLike[str] | None = None,
    port: int = 0,
    announce: Callable[[str], object] = print,
    wait: bool | None = None,
) -> Replay:
    """Show a motion: live on a page of this machine, or as one file that plays offline.

    The page plays the motion in real time when it is opened, and has controls for the time, the
    speed, names, frames and arcs of joints. It is served until the Replay is closed or the process
    ends. A script that was started from a terminal does not end while its page is open: at its end
    it waits for Ctrl-C. In a notebook, in the interpreter, and where there is no terminal, as in a
    test, nothing waits.

    trajectory: the motion, or a solution for its own. A robot without visual models is drawn as a
        skeleton.
    compare: other motions, shown as ghosts at the same times.
    speed: motion seconds per second. loop: play again and again.
    trace: draw the paths of the robot's tip_frames.
    open_browser: open the page in the default browser and wait until it shows the page. None, the
        default: open it if a script was started from a terminal and there is a browser.
    html: path of one self-contained page to write instead of serving; it is written completely or
        not at all.
    port: of the live page on 127.0.0.1; 0 for any free one.
    announce: called with the page's address.
    wait: True to wait here until Ctrl-C, whatever started the process; False not to wait at the end
        of a script either.
    Raises DisplayError when the page cannot be served, opened or written.
    """
    check_speed(speed)
    trajectory, others = motion_in(trajectory), motions_in(compare)
    if html is not None:
        return write_html(trajectory, html, compare=others, speed=speed, loop=loop, trace=trace)
    script = terminal_script()
    shown = serve(
        trajectory, trace, bool(open_browser), port, announce, others, speed=speed, loop=loop
    )
    if open_browser is None and script and has_browser():
        webbrowser.open(shown.url, new=2)
    if wait:
        wait_for_interrupt()
    elif wait is None and script:
        wait_at_exit(f"the motion is shown at {shown.url}; Ctrl-C ends it", shown.is_open)
    return shown


def serve(
    trajectory: Trajectory,
    trace: bool = True,
    open_browser: bool = False,
    port: int = 0,
    announce: Callable[[str], object] = print,
    compare: Sequence[Trajectory] = (),
    *,
    speed: float = 1.0,
    loop: bool = False,
) -> Replay:
    """A live page that plays a motion when it is opened.

    Arguments and errors as in `replay`.
    """
    page = ServedPage("", "", port)
    try:
        shown = _fill(page, trajectory, compare, trace, speed, loop)
        announce(page.web_url)
        if open_browser:
            _open_browser(page)
    except BaseException:
        page.close()
        raise
    return shown


def write_html(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    *,
    compare: Sequence[Trajectory] = (),
    speed: float = 1.0,
    loop: bool = False,
    trace: bool = True,
) -> Replay:
    """Write one page that plays the motion with its own controls and needs no network.

    The same motion gives the same bytes. Arguments as in `replay`. Raises DisplayError.
    """
    check_speed(speed)
    page = Page("")
    shown = _fill(page, trajectory, compare, trace, speed, loop)
    text = page.offline_html(speed)
    try:
        with whole_file(path) as stream:
            stream.write(text.encode())
    except OSError as error:
        raise DisplayError(f"cannot write the page {str(path)!r}: {reason(error)}.") from error
    return dataclasses.replace(shown, url=Path(path).resolve().as_uri())


def page_of(trajectory: Trajectory, compare: Sequence[Trajectory] = ()) -> Page:
    """The page that `write_html` writes."""
    page = Page("")
    _fill(page, trajectory, compare, True, 1.0, False)
    return page


def _fill(
    page: Page,
    trajectory: Trajectory,
    compare: Sequence[Trajectory],
    trace: bool,
    speed: float,
    loop: bool,
) -> Replay:
    """Draw motions on a page, with all that is shown next to them."""
    robot = _robot(trajectory)
    warn_of_cautions(trajectory.metadata)
    others = [(each, _robot(each)) for each in compare]
    highlights = Highlights.of(trajectory, robot, frame_times(trajectory))
    led_back = led_back_sentence(trajectory)
    page.title, page.note = _title(trajectory, robot), _note(led_back, robot, highlights)
    page.cautions = caution_lines([each.metadata for each in (trajectory, *compare)])
    scene = drawn(trajectory, robot, page, trace, highlights, others)
    page.panel = _panel(trajectory, robot, compare, scene.view, speed, trace)
    motions = ((trajectory, scene.visualizer), *scene.ghosts)
    page.keep(animation_of(motions, loop, scene.tracks))
    known = page.web_url, page, highlights, scene.ghosts, speed, scene.tracks
    return Replay(trajectory, scene.visualizer, *known)


def _panel(
    trajectory: Trajectory,
    robot: Robot,
    compare: Sequence[Trajectory],
    view: View,
    speed: float,
    trace: bool,
) -> Panel:
    imposed = imposed_limits(trajectory)
    with warnings.catch_warnings():  # about ranges that look like degrees: planning says so
        warnings.simplefilter("ignore")
        limits = imposed or as_limits(robot, "urdf")
    curves = [Curves.of(each) for each in compare]
    names = names_of(trajectory)
    same = [each for each in curves if each is not None and len(each.v) == len(names)]
    labels = labels_of((trajectory, *compare)) if compare else ()
    colors = ("#8a94a0", *(ghost_color(k + 1) for k in range(len(compare))))
    return Panel(
        duration=trajectory.duration,
        speed=speed,
        view=view,
        names=names,
        angular=tuple(bool(x) for x in ~robot.sliding),
        curves=Curves.of(trajectory),
        others=tuple(same),
        limits=limits,
        imposed=imposed is not None,
        joints=joints_of(trajectory, robot, limits),
        labels=tuple(zip(labels, colors, strict=False)),
        trace=trace,
    )


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


def _note(led_back: str, robot: Robot, highlights: Highlights | None) -> str:
    at_limit = "" if highlights is None else AT_LIMIT_NOTE
    visual = robot.visual
    meshes = visual is not None and any(each.meshPath for each in visual.geometryObjects)
    notes = [led_back, robot.visual_problem, at_limit, MESH_NOTE if meshes else ""]
    return " ".join(note for note in notes if note)


def _title(trajectory: Trajectory, robot: Robot) -> str:
    return f"{robot.name}, {trajectory.duration:g} s"


def check_speed(speed: float) -> None:
    """Raise DisplayError unless a speed is a positive number."""
    _check_positive("speed", speed)


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise DisplayError(f"{name} must be a positive number, got {value}.")

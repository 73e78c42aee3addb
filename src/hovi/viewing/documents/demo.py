"""A menu of motions in the browser with their scene files, the first of which plays at once.

The others are planned when they are chosen.

The pages are served to browsers of this machine only, as a replay is, by a thread. Motions are
planned in the main thread, one at a time, so that Ctrl-C ends them.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import html
import queue
import threading
from collections.abc import Callable
from pathlib import Path
from string import Template

import tornado.web

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.bundled_models import example
from hovi.system.dataclass import dataclass
from hovi.system.terminal import LOOK_SECONDS
from hovi.viewing.meshcat_server import limited_server, open_listener
from hovi.viewing.replay_session import page_of


@dataclass(frozen=True)
class Demonstration:
    """A motion of the menu: a bundled scene, a title, and what it shows in a sentence."""

    scene: str
    title: str
    sentence: str

    def text(self) -> str:
        """The scene file."""
        return example(f"{self.scene}.toml").read_text(encoding="utf-8")

    @property
    def picture(self) -> Path:
        """A picture of the motion."""
        return _PICTURES / f"{self.scene}.jpg"

    def page(self) -> str:
        """Plan the motion and write its page. Raises as `plan_task` does."""
        solution = plan_task(load_task(example(f"{self.scene}.toml")))
        return page_of(solution.trajectory).offline_html()


MOTIONS = (
    Demonstration(
        "panda_reach_down",
        "A Panda reaches down",
        "With little torque and jerk, as fast as its joints allow: a yellow link is at a limit.",
    ),
    Demonstration(
        "ur5_past_ball",
        "Past a ball",
        "A UR5 turns about its base and keeps its links 3 cm from a ball and from each other.",
    ),
    Demonstration(
        "panda_lift",
        "Lift 2 kg, smoothly",
        "A small cost on the jerk, zero accelerations at both ends: fit for a real controller.",
    ),
    Demonstration(
        "two_link_pick",
        "Pick, carry, return",
        "Three segments, each with its own goal and payload, in one optimisation.",
    ),
    Demonstration(
        "cart_pole_swing_up",
        "A cart swings up a pole",
        "The hinge has no motor: its torque is zero all the time.",
    ),
    Demonstration(
        "pendubot_swing_up",
        "A Pendubot swings up",
        "The paper's arm without a motor at the elbow, from hanging to upright.",
    ),
    Demonstration(
        "spacecraft_reorients",
        "A spacecraft turns itself",
        "By swinging its arm: momentum and center of mass stay as they are.",
    ),
    Demonstration(
        "solo_in_flight",
        "A quadruped in flight",
        "Solo12 draws up its legs while it falls: no torque acts on its base.",
    ),
)
"""The motions of `hovi demo`; each is planned in some seconds."""

_MENU = Path(__file__).with_name("demo.html")
_PICTURES = Path(__file__).with_name("pictures")
FIRST = _PICTURES / "first_motion.npz"
"""The first motion, planned in advance, which is shown at once."""
_INTRO = (
    "Eight motions. Each is a scene file; the first was planned in advance, the others when you "
    "choose them. "
    "Copy the file, change it, and run <code>hovi plan my_scene.toml</code>."
)
_CARD = """<section class="card" id="{scene}"><img alt="" src="data:image/jpeg;base64,{picture}">
<h2>{title}</h2><p>{sentence}</p>
<button class="play">Play</button>
<details><summary>{scene}.toml</summary>
<button class="copy">Copy</button><pre>{text}</pre></details>
</section>"""


def menu_html() -> str:
    """The page with all motions and their scene files."""
    cards = [
        _CARD.format(
            scene=each.scene,
            title=html.escape(each.title),
            sentence=html.escape(each.sentence),
            text=html.escape(each.text()),
            picture=base64.b64encode(each.picture.read_bytes()).decode(),
        )
        for each in MOTIONS
    ]
    menu = Template(_MENU.read_text(encoding="utf-8"))
    return menu.substitute(intro=_INTRO, cards="\n".join(cards))


class DemoServer:
    """The menu and its pages, served by a thread.

    port: on the loopback interface; 0 for any free one. Raises DisplayError.
    url: the address of the menu.
    """

    def __init__(self, port: int = 0) -> None:
        """Start serving."""
        listener = open_listener(port)
        self.url = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        self._chosen: queue.Queue[Demonstration | None] = queue.Queue()
        self._pages: dict[str, asyncio.Future[str]] = {}
        self._loop = asyncio.new_event_loop()
        self._loop.call_soon(self._listen, listener)
        self._thread = threading.Thread(target=self._run, name="hovi-demo", daemon=True)
        self._thread.start()

    def plan_what_is_chosen(self, tell: Callable[[str], object] = print) -> None:
        """Plan each motion that a browser asks for, until `close` or Ctrl-C.

        tell: called with a line of text for each motion.
        """
        while (chosen := self._next()) is not None:
            try:
                page = self._page(chosen, tell)
            except HoviError as error:
                page = f"<!DOCTYPE html><meta charset='utf-8'><p>{html.escape(str(error))}</p>"
            self._loop.call_soon_threadsafe(self._pages[chosen.scene].set_result, page)

    def _next(self) -> Demonstration | None:
        while True:
            with contextlib.suppress(queue.Empty):
                return self._chosen.get(timeout=LOOK_SECONDS)

    def _page(self, chosen: Demonstration, tell: Callable[[str], object]) -> str:
        if chosen is MOTIONS[0]:
            return page_of(Trajectory.load(FIRST)).offline_html()
        tell(f"planning {chosen.scene}")
        return chosen.page()

    def page(self, scene: str) -> asyncio.Future[str] | None:
        """The page of a scene, planned once; None for another name. For the server's thread."""
        if scene not in self._pages:
            found = [each for each in MOTIONS if each.scene == scene]
            if not found:
                return None
            self._pages[scene] = self._loop.create_future()
            self._chosen.put(found[0])
        return self._pages[scene]

    def close(self) -> None:
        """Stop serving and planning."""
        self._chosen.put(None)
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    def _listen(self, listener: object) -> None:
        self._server = limited_server(
            [
                tornado.web.url(r"/", _Menu),
                tornado.web.url(r"/motion/([a-z0-9_]+)", _Motion, {"demo": self}),
            ]
        )
        self._server.add_socket(listener)  # type: ignore[arg-type]
        self.page(MOTIONS[0].scene)  # before a browser asks for it

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_forever()
        finally:
            self._server.stop()
            for task in (tasks := asyncio.all_tasks(self._loop)):
                task.cancel()
            if tasks:
                self._loop.run_until_complete(asyncio.wait(tasks, timeout=5.0))
            self._loop.run_until_complete(self._server.close_all_connections())
            self._loop.close()


class _Menu(tornado.web.RequestHandler):
    """The page with all motions."""

    def get(self) -> None:
        self.write(menu_html())


class _Motion(tornado.web.RequestHandler):
    """The page of one motion, when it has been planned."""

    def initialize(self, demo: DemoServer) -> None:
        self.demo = demo

    async def get(self, scene: str) -> None:
        page = self.demo.page(scene)
        if page is None:
            self.set_status(404)
            self.finish("There is no such motion.\n")
            return
        self.write(await asyncio.shield(page))

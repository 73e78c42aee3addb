"""The pictures of the replay page in README and docs, from a headless Chromium.

python pictures.py            all of them
python pictures.py phone ...  those with these names
"""

from __future__ import annotations

import io
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import hovi
from hovi.viewing.documents.demo import FIRST, MOTIONS

TOP = Path(__file__).resolve().parents[2]
IMAGES = TOP / "docs" / "images"
sys.path.insert(0, str(TOP / "tests"))

from PIL import Image  # noqa: E402

from oracles.headless_browser import Tab, headless_browser  # noqa: E402

DESKTOP, PHONE, MOVING, MENU = (1280, 800), (390, 844), (560, 350), (640, 360)
FRAMES_PER_SECOND, HOLD = 16, 0.9
COLORS = 96
IN_FRONT = ([2.1, -0.7, 1.05], [0.3, 0.0, 0.28])
Camera = tuple[list[float], list[float]]
ACCENTS = ("#cc78a6", "#d08fb2", "#f0d000", "#0072b2", "#d55e00", "#4d8c59", "#2f5738")


def first_motion() -> hovi.Trajectory:
    """The motion that the README begins with: its code, run as it stands there."""
    code = (TOP / "README.md").read_text().split("```python\n")[1].split("```")[0]
    names: dict[str, object] = {}
    exec(code.replace("hovi.replay(", "shown = ("), names)
    motion = names["shown"]
    assert isinstance(motion, hovi.Trajectory)
    return motion


def swing_up() -> hovi.Trajectory:
    return planned("two_link_swing_up", scheme="galerkin-2", intervals=100)


def planned(scene: str, **options: object) -> hovi.Trajectory:
    task = hovi.load_task(hovi.example(scene))
    return hovi.plan_task(task, **options).trajectory  # type: ignore[arg-type]


@contextmanager
def page(size: tuple[int, int], motion: hovi.Trajectory, *others: hovi.Trajectory) -> Iterator[Tab]:
    """The page of a motion in a window of a given size."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        hovi.replay(motion, compare=others, html=file)
        with headless_browser(size) as tab:
            width, height = size
            metrics = {"deviceScaleFactor": 1, "mobile": width < 500}
            tab.call("Emulation.setDeviceMetricsOverride", width=width, height=height, **metrics)
            tab.open(file.as_uri())
            tab.until("typeof viewer == 'object' && viewer.animator.actions.length > 0")
            time.sleep(2.0)  # meshes are read one after another
            yield tab


def seek(tab: Tab, t: float) -> None:
    tab.value(f"controls.seek({t}); viewer.render(); 1")
    time.sleep(0.1)


def still(
    size: tuple[int, int], motions: list[hovi.Trajectory], name: str, press: str = ""
) -> None:
    with page(size, *motions) as tab:
        for chip in press.split():
            tab.value(f"document.getElementById('chip-{chip}').click(); 1")
        seek(tab, 0.55 * motions[0].duration)
        tab.screenshot(IMAGES / name)


def moving(
    motion: hovi.Trajectory, name: str, speed: float = 1.0, camera: Camera | None = None
) -> None:
    """A GIF of the scene alone: the motion once, and a while at its end.

    camera: its position and the point that it looks at, in [m]; None for that of the page.
    """
    count = round(motion.duration / speed * FRAMES_PER_SECOND)
    with page(MOVING, motion) as tab:
        tab.value("document.body.classList.add('bare'); stage.resize(); 1")
        if camera is not None:
            tab.value(f"stage.stand({camera[0]}, {camera[1]}); 1")
        frames = []
        for k in range(count + 1):
            seek(tab, motion.duration * k / count)
            frames.append(Image.fromarray(tab.screenshot().astype("uint8")))
    frames = in_common_colors(frames)
    durations = [1000 // FRAMES_PER_SECOND] * count + [round(1000 * HOLD)]
    stream = io.BytesIO()
    frames[0].save(
        stream, "GIF", save_all=True, append_images=frames[1:], duration=durations, loop=0
    )
    (IMAGES / name).write_bytes(stream.getvalue())


def in_common_colors(frames: list[Image.Image]) -> list[Image.Image]:
    """The frames in one palette, in which the colors of thin lines have a place, too."""
    width, height = frames[0].size
    chosen = frames[:: max(1, len(frames) // 4)]
    sheet = Image.new("RGB", (width, height * len(chosen) + 60 * len(ACCENTS)))
    for k, each in enumerate(chosen):
        sheet.paste(each, (0, k * height))
    for k, color in enumerate(ACCENTS):
        top = len(chosen) * height + 60 * k
        sheet.paste(color, (0, top, width, top + 60))
    palette = sheet.quantize(COLORS, method=Image.Quantize.MEDIANCUT)
    return [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames]


def menu() -> None:
    """The pictures of `hovi demo`, and the motion that it shows first, which are part of hovi."""
    for number, each in enumerate(MOTIONS):
        motion = planned(each.scene)
        if number == 0:
            motion.save(FIRST)
        with page(MENU, motion) as tab:
            tab.value("document.body.classList.add('bare'); stage.resize(); 1")
            seek(tab, 0.55 * motion.duration)
            picture = Image.fromarray(tab.screenshot().astype("uint8"))
        picture.resize((MENU[0] // 2, MENU[1] // 2)).save(each.picture, "JPEG", quality=82)


PICTURES: dict[str, Callable[[], None]] = {
    "pick": lambda: moving(planned("panda_over_wall"), "pick.gif", camera=IN_FRONT),
    "swing": lambda: moving(swing_up(), "swing_up.gif", speed=2.0),
    "desktop": lambda: still(DESKTOP, [first_motion()], "replay.png"),
    "menu": menu,
    "phone": lambda: still(PHONE, [first_motion()], "replay_phone.png", "names"),
    "ghosts": lambda: still(
        DESKTOP,
        [planned("ur5_past_ball"), planned("ur5_past_ball", obstacles=())],
        "replay_ghosts.png",
        "names",
    ),
}


def main() -> None:
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()
        print(f"drew {name}")


if __name__ == "__main__":
    main()

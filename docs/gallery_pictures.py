"""Pictures of the gallery: the robot halfway through a motion, and the curves of the motions."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from PIL import Image

import hovi
from hovi.discrete.output.caution import CAUTIONS, caution_lines
from hovi.exchange.film.pictures import pictures
from hovi.exchange.film.shot import Shot
from hovi.viewing.plotting import motion_figure

SIZE = 640, 448
"""Width and height of the picture of a robot, in the proportions of a thumbnail."""


def scrape_motion(block: Any, variables: dict[str, Any], gallery: dict[str, Any]) -> str:
    """The curves of the newest motion below the code that plans it.

    Above those of an example's first motion is its robot, which is the thumbnail of the example.
    """
    from sphinx_gallery.scrapers import figure_rst

    seen = variables.setdefault("hovi_seen", set())
    names = variables["example_globals"]
    motions = [getattr(each, "trajectory", each) for each in list(names.values())]
    new = [m for m in motions if isinstance(m, hovi.Trajectory) and id(m) not in seen]
    seen.update(map(id, motions))
    if not new:
        return ""
    drawn = dict[str, str]()
    if not variables.get("hovi_drawn") and new[-1].robot is not None:
        variables["hovi_drawn"] = True
        picture = next(variables["image_path_iterator"])
        draw_halfway(new[-1], Path(picture))
        cautions = "".join(f" Caution: {each}" for each in caution_lines([new[-1].metadata]))
        drawn[picture] = f"The robot {new[-1].robot.name} halfway through its motion.{cautions}"
    path = next(variables["image_path_iterator"])
    try:
        motion_figure(new[-1]).savefig(path, dpi=80)
        drawn[path] = f"Curves of the joints over the {new[-1].duration:.3g} s of the motion"
    except hovi.HoviError:  # a motion without torques between its nodes
        pass
    shown = [figure_rst([path], gallery["src_dir"], words) for path, words in drawn.items()]
    return "\n".join(map(str, shown))


def draw_halfway(motion: hovi.Trajectory, path: Path) -> None:
    """Write a picture of the robot halfway through a motion.

    Cautions are left to the words of the picture: in a thumbnail they could not be read.
    """
    unsaid = {
        key: value for key, value in motion.metadata.items() if key not in (CAUTIONS, "status")
    }
    shown = replace(motion, metadata=unsaid)
    *_, halfway = islice(pictures(shown, 2.0 / shown.duration, Shot(SIZE)), 2)
    Image.fromarray(halfway).save(path)

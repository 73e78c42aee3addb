"""Pictures of the gallery: the curves of the motions that an example plans."""

from __future__ import annotations

from typing import Any

import hovi
from hovi.viewing.plotting import motion_figure


def scrape_motion(block: Any, variables: dict[str, Any], gallery: dict[str, Any]) -> str:
    """The curves of the newest motion below the code that plans it; its thumbnail, too."""
    from sphinx_gallery.scrapers import figure_rst

    seen = variables.setdefault("hovi_seen", set())
    names = variables["example_globals"]
    motions = [getattr(each, "trajectory", each) for each in list(names.values())]
    new = [m for m in motions if isinstance(m, hovi.Trajectory) and id(m) not in seen]
    seen.update(map(id, motions))
    if not new:
        return ""
    path = next(variables["image_path_iterator"])
    try:
        motion_figure(new[-1]).savefig(path, dpi=80)
    except hovi.HoviError:  # a motion without torques between its nodes
        return ""
    return str(figure_rst([path], gallery["src_dir"]))

"""The panel of distances: what is in it, and where its legend is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.viewing.plotting import motion_figure
from samples.cubic_motion import cubic_motion

NEAR_SHOULDER = hovi.Sphere([0.0, 0.4, 0.3], 0.1, name="near the upper link")
FAR = hovi.Sphere([0.0, 4.0, 0.0], 0.1, name="far")


@pytest.fixture(scope="module")
def motion(arm_scene: hovi.Scene) -> Trajectory:
    """The elbow alone moves."""
    found, _ = cubic_motion(arm_scene, seed=1)
    still = [x * np.array([0.0, 1.0]) for x in (found.q, found.v, found.path.z)]
    kept = Clearance([NEAR_SHOULDER, FAR], 0.05).to_dict()
    path = DiscretePath(*still, found.path.inner)
    return dataclasses.replace(found, path=path, metadata={"clearance": kept})


def test_pairs_whose_distance_never_changes_are_left_out(motion: Trajectory) -> None:
    """Though they are the nearest ones."""
    panel = motion_figure(motion).axes[-1]
    pairs = [line for line in panel.lines if " to " in str(line.get_label())]
    assert len(pairs) > 0
    assert all(np.ptp(np.asarray(line.get_ydata())) > 1e-6 for line in pairs)
    labels = " ".join(str(line.get_label()) for line in pairs)
    assert "upper" not in labels.replace("near the upper link", "")


def test_the_legend_is_not_over_the_curves(motion: Trajectory) -> None:
    figure = motion_figure(motion)
    figure.draw_without_rendering()
    panel = figure.axes[-1]
    legend = panel.get_legend()
    assert legend is not None
    box = legend.get_window_extent()
    assert not any(box.overlaps(ax.get_window_extent()) for ax in figure.axes)
    assert box.y1 <= figure.bbox.y1

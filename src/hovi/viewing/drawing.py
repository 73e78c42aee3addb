"""A robot drawn on a meshcat page: itself, its obstacles and payloads, paths, and ghosts."""

from __future__ import annotations

import base64
import io
import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import ModelError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.viewing.animation import placements_at
from hovi.viewing.carried_objects import CarriedObjects
from hovi.viewing.highlights import Highlights
from hovi.viewing.meshcat_page import Page
from hovi.viewing.meshes.page_mesh import page_mesh
from hovi.viewing.panel.panel import View
from hovi.viewing.payloads import Payloads
from hovi.viewing.recorded_limits import MovingObjects, with_obstacles
from hovi.viewing.skeleton import skeleton

with warnings.catch_warnings():
    # meshcat imports a deprecated module of ZeroMQ that hovi does not use.
    warnings.simplefilter("ignore", DeprecationWarning)
    import meshcat
    import meshcat.geometry
    from pinocchio.visualize import MeshcatVisualizer
    from pinocchio.visualize.meshcat_visualizer import DaeMeshGeometry

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_ELEVATION = 0.34
_AZIMUTH = math.radians(-28.0)
_FLAT = 0.25
_GHOST_COLORS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")
_GHOST_OPACITY = 0.42
_TRACE_COLOR = (0.80, 0.47, 0.65)
_TRACE_WIDTH = 0.011  # relative to the picture's size
_VIEW_SAMPLES = 60
_TRACE_SAMPLES = 2_000  # to measure a path by
_TRACE_SPACING = 0.15  # of the points that draw it, relative to their width
_TRACE_POINTS = 8_000
_KEPT_COLOR = (0.10, 0.45, 0.70)
_KEPT_WIDTH, _KEPT_SPACING = 0.4, 0.3  # relative to the width of a trace


@dataclass(frozen=True, eq=False)
class Drawn:
    """Motions on a page.

    visualizer: of the first motion. tracks: visibility over time, by node name.
    ghosts: the motions that are compared with it, and the visualizers that draw them.
    view: of the camera.
    """

    visualizer: MeshcatVisualizer
    tracks: dict[str, tuple[Array, Mask]]
    ghosts: tuple[tuple[Trajectory, MeshcatVisualizer], ...]
    view: View


def drawn(
    trajectory: Trajectory,
    robot: Robot,
    page: Page,
    trace: bool = True,
    highlights: Highlights | None = None,
    others: Sequence[tuple[Trajectory, Robot]] = (),
) -> Drawn:
    """Draw the robot at the start of the motion, the paths of its tips, and others as ghosts."""
    payloads, carried = Payloads.of(trajectory), CarriedObjects.of(trajectory, robot)
    visual = carried.added_to(_shapes(robot), robot)
    if highlights is not None:
        frames = [robot.model.getFrameId(name) for name in carried.parts]
        visual = highlights.with_highlighted_copies(visual, frames)
    visual = with_obstacles(payloads.added_to(visual, robot), trajectory)
    viewer = meshcat.Visualizer(window=page)
    visualizer = _visualizer(robot, visual, viewer, "robot")
    tracks = payloads.changes(visualizer) | carried.changes(visualizer, robot)
    MovingObjects.of(trajectory).place(visualizer, 0.0)
    visualizer.display(trajectory.q[0])
    for node, (_, flags) in tracks.items():
        viewer[node].set_property("visible", bool(flags[0]))
    if highlights is not None:
        highlights.show(visualizer, 0.0)
        tracks |= highlights.changes(visualizer)
    ghosts = [
        (each, _ghost(each, other, viewer, k)) for k, (each, other) in enumerate(others, start=1)
    ]
    boxes = [_swept_box(each, motion) for motion, each in ((trajectory, visualizer), *ghosts)]
    lower, upper = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
    if trace:
        width = _TRACE_WIDTH * float(np.linalg.norm(upper - lower))
        paths = _tip_paths(trajectory, robot, width)
        _draw_trace(viewer["trace"], paths, width, _TRACE_COLOR)
        if trajectory.metadata.get("keep"):
            from hovi.viewing.kept_marks import kept_marks  # most motions keep nothing

            marks = kept_marks(trajectory, robot, _KEPT_SPACING * width)
            _draw_trace(viewer["kept"], marks, _KEPT_WIDTH * width, _KEPT_COLOR)
        for k, (each, other) in enumerate(others, start=1):
            paths = _tip_paths(each, other, width)
            _draw_trace(viewer[f"trace/{k}"], paths, width, _rgb(ghost_color(k)))
    return Drawn(visualizer, tracks, tuple(ghosts), _view(viewer, lower, upper))


class _RobotVisualizer(MeshcatVisualizer):  # type: ignore[misc]
    """Pinocchio's, which also draws meshes stored in a motion's file, without writing them."""

    def __init__(self, robot: Robot, visual: pin.GeometryModel) -> None:
        super().__init__(robot.model, None, visual)
        self._stored = robot.source.meshes

    def loadMeshFromFile(self, geometry_object: pin.GeometryObject) -> Any:
        """The mesh of a shape, of few triangles. The name is Pinocchio's."""
        path = Path(geometry_object.meshPath)
        name = self._stored.name_at(geometry_object.meshPath)
        scale, plain = geometry_object.meshScale, bool(geometry_object.overrideMaterial)
        try:
            content = path.read_bytes() if name is None else self._content(name)
            mesh = page_mesh(path, content, scale, plain)
        except (OSError, ModelError):
            mesh = None
        return self._original(geometry_object, name) if mesh is None else mesh

    def _content(self, name: str) -> bytes:
        return self._stored.content(self._stored.meshes[name].sha256)

    def _original(self, geometry_object: pin.GeometryObject, name: str | None) -> Any:
        """The mesh as its file has it, for pictures on its surface."""
        if name is None:
            with warnings.catch_warnings():  # it asks an XML element for its truth value
                warnings.simplefilter("ignore", DeprecationWarning)
                return super().loadMeshFromFile(geometry_object)
        mesh = self._stored.meshes[name]
        content = self._stored.content(mesh.sha256)
        suffix = Path(geometry_object.meshPath).suffix.lower()
        if suffix == ".stl":
            return meshcat.geometry.StlMeshGeometry.from_stream(io.BytesIO(content))
        if suffix == ".obj":
            return meshcat.geometry.ObjMeshGeometry.from_stream(io.BytesIO(content))
        textures = {key: self._stored.content(each) for key, each in mesh.textures.items()}
        return _Collada(content.decode(), textures)


class _Collada(DaeMeshGeometry):  # type: ignore[misc]
    """A Collada mesh as Pinocchio sends it to a page, from its content instead of its file."""

    def __init__(self, content: str, textures: Mapping[str, bytes]) -> None:
        meshcat.geometry.ReferenceSceneElement.__init__(self)
        self.path = self.material = None
        self.intrinsic_transform = np.eye(4)
        self.dae_raw = content
        self.img_resources = {
            str(Path(name)): f"data:image/png;base64,{base64.b64encode(each).decode()}"
            for name, each in textures.items()
        }


def ghost_color(k: int) -> str:
    """The color of the k-th motion that is compared, k = 1, 2, ..."""
    return _GHOST_COLORS[(k - 1) % len(_GHOST_COLORS)]


def _shapes(robot: Robot) -> pin.GeometryModel:
    visual = robot.visual
    return skeleton(robot.model) if visual is None or visual.ngeoms == 0 else visual


def _visualizer(
    robot: Robot, visual: pin.GeometryModel, viewer: meshcat.Visualizer, root: str
) -> MeshcatVisualizer:
    visualizer = _RobotVisualizer(robot, visual)
    visualizer.initViewer(viewer=viewer)
    visualizer.loadViewerModel(rootNodeName=root)
    return visualizer


def _ghost(
    trajectory: Trajectory, robot: Robot, viewer: meshcat.Visualizer, k: int
) -> MeshcatVisualizer:
    """A robot in one translucent color, at the start of its motion."""
    visual = _shapes(robot).copy()
    for item in visual.geometryObjects:
        item.meshColor = np.array([*_rgb(ghost_color(k)), _GHOST_OPACITY])
        item.overrideMaterial = True
    visualizer = _visualizer(robot, visual, viewer, f"ghost {k}")
    visualizer.display(trajectory.q[0])
    return visualizer


def _tip_paths(trajectory: Trajectory, robot: Robot, width: float) -> Array:
    """Points along the paths of all tips, shape (M, 3), in [m].

    They are a fraction of `width` apart, where a tip is fast as where it is slow, so that they
    look like a line.
    """
    t, frames = _times(trajectory, _TRACE_SAMPLES), robot.tip_frames
    tips = robot.frame_positions(frames, trajectory.configurations(t))  # (M, tips, 3)
    steps = np.linalg.norm(np.diff(tips, axis=0), axis=2).max(axis=1)
    passed = np.concatenate([[0.0], np.cumsum(steps)])
    if not 0.0 < passed[-1] < np.inf:
        return tips.reshape(-1, 3)
    count = min(passed[-1] / (_TRACE_SPACING * width), _TRACE_POINTS / len(frames))
    even = np.linspace(0.0, passed[-1], 2 + int(count))
    points = robot.frame_positions(frames, trajectory.configurations(np.interp(even, passed, t)))
    return points.reshape(-1, 3)


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


def _draw_trace(
    node: meshcat.Visualizer, points: Array, width: float, color: tuple[float, ...]
) -> None:
    """Draw paths as dense points, since browsers draw lines of any width one pixel wide."""
    colors = np.tile(color, (len(points), 1))
    geometry = meshcat.geometry.PointsGeometry(*(x.T.astype(np.float32) for x in (points, colors)))
    material = meshcat.geometry.PointsMaterial(size=width)
    node.set_object(meshcat.geometry.Points(geometry, material))


def _view(viewer: meshcat.Visualizer, lower: Array, upper: Array) -> View:
    """Look across the larger horizontal extent, somewhat from the side unless all is in a plane.

    meshcat's camera turns about the world's origin, so the center of the motion is moved there.
    """
    size, center = upper - lower, 0.5 * (lower + upper)
    x, y = (size[1], -size[0]) if size[:2].max() > 0 else (1.0, 0.0)
    turn = _AZIMUTH if size[:2].min() > _FLAT * size[:2].max() else 0.0
    aside = np.array(
        [math.cos(turn) * x - math.sin(turn) * y, math.sin(turn) * x + math.cos(turn) * y]
    )
    direction = np.array([*(aside / np.linalg.norm(aside)), _ELEVATION])
    viewer["/meshcat"].set_transform(_shift(-center))
    half = np.maximum(0.5 * size, 0.5e-3)
    floor = (-center[0], -center[1], lower[2] - center[2])
    return View(*(tuple(map(float, x)) for x in (half, direction, floor, -center)))


def _shift(offset: Array) -> Array:
    placement = np.eye(4)
    placement[:3, 3] = offset
    return placement


def _rgb(color: str) -> tuple[float, ...]:
    """Red, green and blue from 0 to 1 of a color such as "#0072B2"."""
    return tuple(each / 255.0 for each in bytes.fromhex(color[1:]))

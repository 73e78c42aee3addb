"""Obstacles from files, against the same files read by Pinocchio and PyYAML themselves."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import HoviError
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.distances import Distances
from oracles.world_distances import Placed, from_world
from samples.meshes import channel
from samples.world_files import CUPBOARD, PLANNING_SCENE

CAPSULE = '<geometry><capsule radius="0.1" length="0.5"/></geometry>'
Array = npt.NDArray[np.float64]
AT, RPY = [0.5, -0.3, 0.1], [0.1, -0.2, 0.8]
PLACED = pin.SE3(pin.rpy.rpyToMatrix(*RPY), np.array(AT))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cupboard.urdf").write_text(CUPBOARD)
    (tmp_path / "channel.obj").write_text(channel())
    (tmp_path / "kitchen.yaml").write_text(PLANNING_SCENE)
    return tmp_path


def samples(robot: hovi.Robot, count: int) -> Array:
    pin.seed(5)
    return np.array([pin.randomConfiguration(robot.model) for _ in range(count)])


def require_same(robot: hovi.Robot, obstacles: object, world: list[Placed]) -> None:
    """That obstacles are as far as shapes of Coal, at 40 configurations, where they are apart."""
    q = samples(robot, 40)
    found = Distances(robot, hovi.Clearance(obstacles)).values(q)  # type: ignore[arg-type]
    expected = from_world(robot, q, world, convex_geometry(robot))
    found = found.reshape(len(q), len(world), -1).transpose(0, 2, 1)
    apart = expected > 0
    assert np.count_nonzero(apart) > 1_000
    np.testing.assert_allclose(found[apart], expected[apart], atol=2e-5)
    assert (found[~apart] <= 1e-6).all()


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
def test_a_urdf_gives_its_shapes_at_a_pose_and_a_configuration(
    folder: Path, panda: hovi.Robot
) -> None:
    """The hull of its channel is that of Coal's own call."""
    file = folder / "cupboard.urdf"
    obstacles = hovi.load_obstacles(file, position=AT, rpy=RPY, joints={"hinge": 0.7})
    assert [each.name for each in obstacles] == ["frame", "frame 2", "door", "door 2", "door 3"]
    model = pin.buildModelFromUrdf(str(file))
    where = str(folder)
    shapes = pin.buildGeomFromUrdf(model, str(file), pin.GeometryType.COLLISION, package_dirs=where)
    data, places = model.createData(), shapes.createData()
    pin.updateGeometryPlacements(model, data, shapes, places, np.array([0.7]))
    world = list[Placed]()
    for k, item in enumerate(shapes.geometryObjects):
        shape = item.geometry
        if isinstance(shape, coal.BVHModelBase):
            shape = hull(np.array(shape.vertices()))
        world.append((shape, PLACED * places.oMg[k]))
    require_same(panda, obstacles, world)


def hull(points: Array) -> coal.ConvexBase:
    listed = coal.StdVec_Vec3s()
    listed.extend(list(points))
    return coal.Convex.convexHull(listed, True, "Qt")


def test_a_planning_scene_gives_its_objects(folder: Path, panda: hovi.Robot) -> None:
    """Placed by hand, with quaternions as rotation matrices of SciPy."""
    from scipy.spatial.transform import Rotation

    obstacles = hovi.load_obstacles(folder / "kitchen.yaml", name="kitchen", position=AT, rpy=RPY)
    names = [each.name for each in obstacles]
    assert names == ["kitchen/table", "kitchen/table 2", "kitchen/ball", "kitchen/wedge"]

    def at(xyz: list[float], quaternion: list[float]) -> pin.SE3:
        turn = Rotation.from_quat(quaternion).as_matrix()
        return PLACED * pin.SE3(turn, np.array(xyz))

    wedge = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.4]])
    world: list[Placed] = [
        (coal.Box(0.6, 1.0, 0.05), at([0.55, 0.0, 0.1], [0, 0, 0, 1])),
        (coal.Cylinder(0.03, 0.7), at([0.3, 0.4, -0.2], [0.5] * 4)),
        (coal.Sphere(0.15), at([0.1, 0.6, 0.6], [0, 0, 0, 1])),
        (hull(wedge), at([-0.4, 0.3, 0.2], [0, 0, 0, 1])),
    ]
    require_same(panda, obstacles, world)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("world:", "word:", "line 3: unknown key 'word': did you mean 'world'"),
        ("world:", "world: 7\nname2:", "unknown key 'name2'"),
        ("- id: ball", "- id: ball\n      id: bowl", "line 18: key 'id' is given twice"),
        ("dimensions: [0.15]", "dimensions: [0.15, 1]", "a sphere has 1 dimensions, got 2"),
        ("dimensions: [0.15]", "dimensions: [-0.15]", "'ball': `radius` of a sphere must be pos"),
        ("dimensions: [0.15]", "dimensions: [wide]", "line 22: expected a finite number, got 'wi"),
        ("dimensions: [0.15]", "dimensions: [.nan]", "expected a finite number, got '.nan'"),
        ("type: 2", "type: 4", "`type` must be 1 or box, 2 or sphere, 3 or cylinder, got '4'"),
        ("[0.5, 0.5, 0.5, 0.5]", "[0.5, 0.5, 0.5]", "expected the 4 numbers x, y, z, w"),
        ("[0.5, 0.5, 0.5, 0.5]", "[0, 0, 0, 2]", "`orientation` must be a unit quaternion"),
        ("operation: 0", "operation: 1", "`operation` must be 0 or ADD"),
        ("[1, 2, 3]", "[1, 2, 4]", "`vertex_indices` must number the vertices"),
        ("[1, 2, 3]", "[1, 2]", "a triangle must have three whole numbers"),
        ("    - id: wedge\n      header: {frame_id: world}", "    - id: wedge", "in one frame"),
        ("name: kitchen", "name: &a kitchen", "line 2: anchors"),
        ("name: kitchen", "name: [", "not valid YAML"),
        ("primitives: [{type: 2, dimensions: [0.15]}]", "planes: [{coef: [0]}]", "half_space"),
        ("\nname: kitchen", "", "is not a file of hovi"),
    ],
)
def test_a_wrong_planning_scene_is_one_sentence_with_its_line(
    folder: Path, old: str, new: str, words: str
) -> None:
    assert old in PLANNING_SCENE
    text = PLANNING_SCENE.replace(old, new) if words != "is not a file of hovi" else ""
    (folder / "kitchen.yaml").write_text(text)
    with pytest.raises(HoviError) as refused:
        hovi.load_obstacles(folder / "kitchen.yaml")
    expected = words if text else "is empty"
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("kitchen.stl", {}, "a mesh is an obstacle of kind 'mesh'"),
        ("none.yaml", {}, "there is no file"),
        ("kitchen.yaml", {"joints": {"hinge": 1.0}}, "a planning scene has none"),
        ("cupboard.urdf", {"joints": {"hinges": 1.0}}, "hinge"),
        ("cupboard.urdf", {"position": [0, 0]}, "position must have shape"),
        ("bare.urdf", {}, "no collision shapes"),
        ("capsule.urdf", {}, "has 6 collision shapes, of which only 3 can be read"),
    ],
)
def test_other_files_are_refused_in_one_sentence(
    folder: Path, name: str, options: dict[str, object], words: str
) -> None:
    capsule = CUPBOARD.replace("<collision>", f"<collision>{CAPSULE}</collision><collision>", 1)
    (folder / "capsule.urdf").write_text(capsule)
    (folder / "bare.urdf").write_text('<robot name="bare"><link name="base"/></robot>')
    with pytest.raises(HoviError, match=words):
        hovi.load_obstacles(folder / name, **options)  # type: ignore[arg-type]


def test_without_pyyaml_the_sentence_names_the_extra(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "yaml", None)
    with pytest.raises(HoviError, match=r"pip install 'hovi\[yaml\]'"):
        hovi.load_obstacles(folder / "kitchen.yaml")

"""Compiled distances against Coal's own, and their derivatives against finite differences."""

from __future__ import annotations

import itertools

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.planning.clearance.compiled_distances import EXACT, FAR, UNKNOWN, CompiledDistances
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from oracles.finite_differences import derivative_per_point
from samples.manifold_robots import chain, half_turning

Array = npt.NDArray[np.float64]


def hull(seed: int, points: int) -> coal.ConvexBase:
    """Of random points within 0.2 m."""
    return hull_around(np.random.default_rng(seed).uniform(-0.2, 0.2, (points, 3)))


def hull_around(points: Array) -> coal.ConvexBase:
    """Of points (M, 3)."""
    corners = coal.StdVec_Vec3s()
    corners.extend(list(points))
    return coal.Convex.convexHull(corners, True, "Qt")


SHAPES = {
    "sphere": coal.Sphere(0.1),
    "capsule": coal.Capsule(0.06, 0.3),
    "box": coal.Box(0.2, 0.3, 0.1),
    "cylinder": coal.Cylinder(0.1, 0.25),
    "triangle": coal.TriangleP(*(0.2 * np.eye(3))),
    "small hull": hull(0, 14),
    "large hull": hull(1, 300),
}
COMPARED = [shape for name, shape in SHAPES.items() if name != "triangle"]
"""Those of which Coal has the distances from all others."""
JOINTS = {
    "fixed axes": [pin.JointModelRX(), pin.JointModelPY(), pin.JointModelRZ()],
    "helical": [pin.JointModelHelicalUnaligned(np.array([0.6, 0.0, 0.8]), 0.2)],
    "unaligned": [pin.JointModelRevoluteUnaligned(0.6, 0.0, 0.8), pin.JointModelRUBY()],
    "translation": [pin.JointModelTranslation(), pin.JointModelRUBZ()],
    "floating": [pin.JointModelFreeFlyer(), pin.JointModelRX()],
    "spherical": [pin.JointModelRX(), pin.JointModelSpherical(), pin.JointModelRY()],
    "planar": [pin.JointModelPlanar(), pin.JointModelRX()],
}


def robot_of(model: pin.Model) -> Robot:
    return load_robot(model)


def geometry_of(model: pin.Model, shapes: list[coal.CollisionGeometry]) -> pin.GeometryModel:
    """Shapes in turn on the world and on the joints, turned at random; pairs of all bodies."""
    random, geometry = np.random.default_rng(5), pin.GeometryModel()
    for i, shape in enumerate(shapes):
        place = pin.SE3(pin.exp3(random.uniform(-2, 2, 3)), random.uniform(-0.4, 0.4, 3))
        joint = i % model.njoints
        geometry.addGeometryObject(pin.GeometryObject(f"s{i}", joint, 0, place, shape))
    for i, j in itertools.combinations(range(len(shapes)), 2):
        if i % model.njoints != j % model.njoints:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
    return geometry


def configurations(robot: Robot, count: int, width: float = 1.0) -> Array:
    random = np.random.default_rng(7)
    neutral = np.tile(pin.neutral(robot.model), (count, 1))
    return robot.integrate(neutral, random.uniform(-width, width, (count, robot.nv)))


def by_coal(robot: Robot, geometry: pin.GeometryModel, q: Array) -> Array:
    """Distances by Pinocchio's own call, (P, K)."""
    data, places = robot.model.createData(), geometry.createData()
    for request in places.distanceRequests:
        request.gjk_tolerance = request.epa_tolerance = 1e-12
        request.gjk_max_iterations = request.epa_max_iterations = 2000
        request.gjk_initial_guess = coal.GJKInitialGuess.DefaultGuess
    rows = []
    for one in q:
        pin.computeDistances(robot.model, data, geometry, places, one)
        rows.append([result.min_distance for result in places.distanceResults])
    return np.array(rows)


def known_distances(compiled: CompiledDistances, q: Array, pairs: npt.NDArray[np.int64]) -> Array:
    """Distances, NaN where they are not known."""
    distances, known = compiled.values(q, pairs, np.inf)
    return np.where(known == EXACT, distances, np.nan)


def everything(geometry: pin.GeometryModel) -> npt.NDArray[np.int64]:
    return np.arange(len(geometry.collisionPairs))


@pytest.mark.parametrize("joints", JOINTS.values(), ids=JOINTS)
def test_distances_are_those_of_coal_for_all_shapes_and_joints(
    joints: list[pin.JointModel],
) -> None:
    robot = robot_of(chain(joints))
    geometry = geometry_of(robot.model, COMPARED)
    q = configurations(robot, 60)
    found, known = CompiledDistances(robot, geometry).values(q, everything(geometry), np.inf)
    expected = by_coal(robot, geometry, q)
    assert (known != FAR).all()
    np.testing.assert_array_equal(known == UNKNOWN, known != EXACT)
    exact = known == EXACT
    assert exact.mean() > 0.5
    assert (expected[~exact] < 1e-3).all()  # only where cores overlap or nearly touch
    np.testing.assert_allclose(found[exact], expected[exact], atol=2e-6)
    polyhedral = exact & ~of_kind(geometry, coal.Cylinder)
    np.testing.assert_allclose(found[polyhedral], expected[polyhedral], atol=1e-9)


def of_kind(geometry: pin.GeometryModel, kind: type) -> npt.NDArray[np.bool_]:
    """Whether one of a pair's shapes is of a kind, (K,)."""
    objects = geometry.geometryObjects
    return np.array(
        [
            any(isinstance(objects[k].geometry, kind) for k in (pair.first, pair.second))
            for pair in geometry.collisionPairs
        ]
    )


def test_the_distance_from_a_cylinder_is_that_of_its_parts() -> None:
    """From its lateral surface, its cap and its rim, by plane geometry."""
    robot = robot_of(chain([pin.JointModelTranslation()]))
    geometry = pin.GeometryModel()
    unit, place = pin.SE3.Identity(), robot.model.jointPlacements[1]
    geometry.addGeometryObject(pin.GeometryObject("can", 0, 0, place, coal.Cylinder(0.3, 1.0)))
    geometry.addGeometryObject(pin.GeometryObject("ball", 1, 0, unit, coal.Sphere(0.05)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (400, 3))
    across = np.maximum(np.hypot(q[:, 0], q[:, 1]) - 0.3, 0.0)
    beyond = np.maximum(np.abs(q[:, 2]) - 0.5, 0.0)
    outside = (across > 0) | (beyond > 0)
    found, known = CompiledDistances(robot, geometry).values(q, np.arange(1), np.inf)
    np.testing.assert_array_equal(known[:, 0] == EXACT, outside)
    expected = np.hypot(across, beyond)[outside] - 0.05
    np.testing.assert_allclose(found[outside, 0], expected, atol=1e-11)


@pytest.mark.parametrize("joints", JOINTS.values(), ids=JOINTS)
def test_derivatives_are_those_of_finite_differences(joints: list[pin.JointModel]) -> None:
    """First ones of the distances, second ones of the first, along `integrate`."""
    robot = robot_of(chain(joints))
    geometry = geometry_of(robot.model, [*SHAPES.values()])
    compiled, pairs = CompiledDistances(robot, geometry), everything(geometry)
    q = configurations(robot, 20)
    zero = np.zeros((len(q), robot.nv))
    distances, known, jacobian, _ = compiled.expand(q, pairs, np.inf)
    exact = (known == EXACT) & (distances > 1e-3)

    def moved(dq: Array) -> Array:
        return known_distances(compiled, robot.integrate(q, dq), pairs)

    numeric = derivative_per_point(moved, zero, 1e-6)
    exact &= np.isfinite(numeric).all(axis=2)
    np.testing.assert_allclose(jacobian[exact], numeric[exact], atol=1e-6)
    force = np.random.default_rng(2).uniform(0.5, 1.0, distances.shape) * exact

    def slope(dq: Array) -> Array:
        J = compiled.expand(robot.integrate(q, dq), pairs, np.inf)[2]
        return np.einsum("pk,pki->pi", force, J)

    rows = derivative_per_point(slope, zero, 1e-6)
    numeric = 0.5 * (rows + rows.transpose(0, 2, 1))
    curvature = compiled.expand(q, pairs, np.inf, force)[3]
    np.testing.assert_array_equal(curvature, curvature.transpose(0, 2, 1))
    error = np.abs(curvature - numeric).max(axis=(1, 2)) / np.abs(numeric).max(axis=(1, 2))
    assert np.median(error) < 1e-5
    assert np.mean(error > 1e-3) <= 0.15  # a kink of a polyhedron's distance within a difference


@pytest.mark.parametrize("first", SHAPES)
@pytest.mark.parametrize("second", ["sphere", "box", "cylinder"])
def test_second_derivatives_of_every_kind_of_pair(first: str, second: str) -> None:
    robot = robot_of(chain([pin.JointModelFreeFlyer()]))
    geometry = pin.GeometryModel()
    for joint, name, at in (
        (0, first, robot.model.jointPlacements[1]),
        (1, second, pin.SE3.Identity()),
    ):
        geometry.addGeometryObject(pin.GeometryObject(f"s{joint}", joint, 0, at, SHAPES[name]))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    compiled = CompiledDistances(robot, geometry)
    q = configurations(robot, 120, 1.2)
    q[:40, :3] *= 0.1  # many of these overlap
    force = np.ones((len(q), 1))
    distances, known, _, curvature = compiled.expand(q, np.arange(1), np.inf, force)
    apart = (known == EXACT)[:, 0] & (distances[:, 0] > 0.05)
    assert apart.sum() > 20
    overlapping = (known == EXACT)[:, 0] & (distances[:, 0] < -0.02)

    def slope(dq: Array) -> Array:
        return compiled.expand(robot.integrate(q, dq), np.arange(1), np.inf)[2][:, 0]

    rows = derivative_per_point(slope, np.zeros((len(q), 6)), 1e-6)
    numeric = 0.5 * (rows + rows.transpose(0, 2, 1))
    error = np.abs(curvature - numeric).max(axis=(1, 2))
    assert np.median(error[apart]) < 1e-6
    assert np.mean(error[apart] > 1e-3) <= 0.1  # kinks, as above
    if overlapping.sum() > 3 and "cylinder" not in (first, second):
        assert np.median(error[overlapping]) < 1e-5


def test_mimic_joints_follow_their_leaders() -> None:
    robot = robot_of(half_turning())
    geometry = geometry_of(robot.model, COMPARED)
    compiled, pairs = CompiledDistances(robot, geometry), everything(geometry)
    q = configurations(robot, 20)
    found, known, jacobian, _ = compiled.expand(q, pairs, np.inf)
    exact = (known == EXACT) & (found > 1e-3)
    np.testing.assert_allclose(found[exact], by_coal(robot, geometry, q)[exact], atol=2e-6)

    def moved(dq: Array) -> Array:
        return known_distances(compiled, robot.integrate(q, dq), pairs)

    numeric = derivative_per_point(moved, np.zeros((len(q), robot.nv)), 1e-6)
    exact &= np.isfinite(numeric).all(axis=2)
    np.testing.assert_allclose(jacobian[exact], numeric[exact], atol=1e-6)


def test_beyond_reach_a_lower_bound_is_returned_without_derivatives(panda: Robot) -> None:
    """Along a motion, where bounds follow from the distances before."""
    geometry = geometry_of(panda.model, [*SHAPES.values(), *SHAPES.values()])
    compiled, pairs = CompiledDistances(panda, geometry), everything(geometry)
    s = np.linspace(0.0, 1.0, 300)[:, None]
    q = pin.neutral(panda.model) + np.sin(3 * s) * np.linspace(-1, 1, panda.nq)
    exactly = known_distances(compiled, q, pairs)
    for reach in (0.05, 0.2, 0.5):
        distances, known, jacobian, _ = compiled.expand(q, pairs, reach)
        far, both = known == FAR, (known == EXACT) & np.isfinite(exactly)
        assert far.any()
        assert (distances[far] > reach).all()
        assert not (distances[far] > exactly[far] + 1e-9).any()
        np.testing.assert_allclose(distances[both], exactly[both], atol=1e-9)
        assert np.mean(exactly[both] > reach) < 0.2
        assert (jacobian[far] == 0.0).all()


def test_bounds_hold_for_a_shape_that_turns_on_the_spot() -> None:
    """A rod, whose middle does not move, turns until it points at a ball."""
    robot = robot_of(chain([pin.JointModelRX()]))
    geometry, place = pin.GeometryModel(), robot.model.jointPlacements[1]
    unit, ahead = pin.SE3.Identity(), pin.SE3(np.eye(3), np.array([0.0, 1.2, 0.0]))
    geometry.addGeometryObject(pin.GeometryObject("rod", 1, 0, unit, coal.Capsule(0.05, 2.0)))
    geometry.addGeometryObject(pin.GeometryObject("ball", 0, 0, place * ahead, coal.Sphere(0.1)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    q = np.linspace(0.0, 0.5 * np.pi, 60)[:, None]
    compiled = CompiledDistances(robot, geometry)
    exactly = compiled.values(q, np.arange(1), np.inf)[0]
    assert exactly[0] > 1.0
    assert exactly[-1] == pytest.approx(0.05)
    distances, known = compiled.values(q, np.arange(1), 0.3)
    assert (known == FAR).any()
    assert (distances <= exactly + 1e-12).all()
    assert (distances[exactly > 0.3] > 0.3).all()
    np.testing.assert_allclose(distances[exactly <= 0.3], exactly[exactly <= 0.3], atol=1e-12)


def test_both_instruction_sets_agree(panda: Robot) -> None:
    geometry = geometry_of(panda.model, [*SHAPES.values(), *SHAPES.values()])
    pairs, q = everything(geometry), configurations(panda, 30)
    force = np.ones((len(q), len(pairs)))
    one, other = (
        CompiledDistances(panda, geometry, portable).expand(q, pairs, 0.4, force)
        for portable in (False, True)
    )
    both = (one[1] == EXACT) & (other[1] == EXACT)
    assert (one[1] != other[1]).mean() < 1e-2  # where an iteration stagnates
    np.testing.assert_allclose(one[0][both], other[0][both], atol=1e-9)
    np.testing.assert_allclose(one[2][both], other[2][both], atol=1e-6)


def test_chosen_pairs_are_those_columns(panda: Robot) -> None:
    geometry = geometry_of(panda.model, [*SHAPES.values()])
    compiled, q = CompiledDistances(panda, geometry), configurations(panda, 10)
    some = np.array([3, 0, 7])
    whole, part = (compiled.expand(q, x, np.inf) for x in (everything(geometry), some))
    np.testing.assert_array_equal(part[0], whole[0][:, some])
    np.testing.assert_array_equal(part[2], whole[2][:, some])


def test_distances_that_are_not_wanted_are_far(panda: Robot) -> None:
    geometry = geometry_of(panda.model, [SHAPES[name] for name in ("sphere", "capsule", "box")])
    compiled, pairs = CompiledDistances(panda, geometry), everything(geometry)
    q = configurations(panda, 6)
    wanted = np.random.default_rng(2).uniform(size=(len(q), len(pairs))) < 0.3
    force = np.ones(wanted.shape)
    whole = compiled.expand(q, pairs, 2.0, np.where(wanted, force, 0.0))
    part = compiled.expand(q, pairs, 2.0, force, wanted)
    for all_of_them, some in zip(whole[:3], part[:3], strict=True):
        np.testing.assert_allclose(some[wanted], all_of_them[wanted], atol=1e-9)
    np.testing.assert_allclose(part[3], whole[3], atol=1e-6)
    assert (part[0][~wanted] == 2.0).all()
    assert (part[1][~wanted] == FAR).all()
    assert (part[2][~wanted] == 0.0).all()
    values, known = compiled.values(q, pairs, 2.0, wanted)
    np.testing.assert_allclose(values[wanted], whole[0][wanted], atol=1e-9)
    assert (known[~wanted] == FAR).all()


def test_other_shapes_are_not_known_and_other_joints_refused() -> None:
    robot = robot_of(chain([pin.JointModelRX()]))
    geometry = geometry_of(robot.model, [coal.Cone(0.1, 0.2), coal.Sphere(0.1)])
    known = CompiledDistances(robot, geometry).values(
        configurations(robot, 4), np.arange(1), np.inf
    )[1]
    assert (known == UNKNOWN).all()
    universal = chain([pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1])])
    with pytest.raises(NotImplementedError, match="universal"):
        CompiledDistances(robot_of(universal), geometry)


ROUNDING = 1e-4


@pytest.mark.parametrize("joints", JOINTS.values(), ids=JOINTS)
def test_rounded_distances_are_hardly_smaller_and_have_derivatives(
    joints: list[pin.JointModel],
) -> None:
    """First and second ones are those of finite differences, without exceptions."""
    robot = robot_of(chain(joints))
    geometry = geometry_of(robot.model, [*SHAPES.values()])
    compiled, pairs = CompiledDistances(robot, geometry), everything(geometry)
    q = configurations(robot, 20)
    plain, known = compiled.values(q, pairs, np.inf)
    sizes = np.full(plain.shape, ROUNDING)
    rounded, _, jacobian, _ = compiled.expand(q, pairs, np.inf, rounding=sizes)
    exact = (known == EXACT) & (plain > 1e-3)
    loss = (plain - rounded)[exact]
    assert loss.min() >= -1e-12
    assert loss.max() <= 10 * ROUNDING

    def values(dq: Array) -> Array:
        at = robot.integrate(q, dq)
        distances, known = compiled.values(at, pairs, np.inf, rounding=sizes)
        return np.where(known == EXACT, distances, np.nan)

    zero = np.zeros((len(q), robot.nv))
    numeric = derivative_per_point(values, zero, 1e-6)
    exact &= np.isfinite(numeric).all(axis=2)
    np.testing.assert_allclose(jacobian[exact], numeric[exact], atol=1e-6)
    force = np.random.default_rng(2).uniform(0.5, 1.0, plain.shape) * exact

    def slope(dq: Array) -> Array:
        J = compiled.expand(robot.integrate(q, dq), pairs, np.inf, rounding=sizes)[2]
        return np.einsum("pk,pki->pi", force, J)

    rows = derivative_per_point(slope, zero, 1e-7)
    numeric = 0.5 * (rows + rows.transpose(0, 2, 1))
    curvature = compiled.expand(q, pairs, np.inf, force, rounding=sizes)[3]
    error = np.abs(curvature - numeric).max(axis=(1, 2)) / np.abs(numeric).max(axis=(1, 2))
    assert error.max() < 1e-4


@pytest.mark.parametrize("joints", JOINTS.values(), ids=JOINTS)
@pytest.mark.parametrize("given", ["none", "nearby", "far", "random", "opposite", "no numbers"])
@pytest.mark.parametrize("rounding", [1e-3, ROUNDING, 2e-5, 1e-6])
def test_rounded_distances_are_the_same_from_any_normal(
    joints: list[pin.JointModel], given: str, rounding: float
) -> None:
    robot = robot_of(chain(joints))
    geometry = geometry_of(robot.model, [*SHAPES.values()])
    compiled, pairs = CompiledDistances(robot, geometry), everything(geometry)
    q = configurations(robot, 30)
    sizes = np.full((len(q), len(pairs)), rounding)
    force, normals = np.ones(sizes.shape), np.zeros((*sizes.shape, 3))
    random = np.random.default_rng(3)
    if given in ("nearby", "far", "opposite"):
        move = 0.5 if given == "far" else 0.05
        near = robot.integrate(q, move * random.uniform(-1.0, 1.0, (len(q), robot.nv)))
        compiled.values(near, pairs, np.inf, rounding=sizes, normals=normals)
        known = np.linalg.norm(normals, axis=2)
        assert (np.isclose(known, 1.0) | (known == 0.0)).all()
        assert (known > 0.0).mean() > 0.5
        normals *= -1.0 if given == "opposite" else 1.0
    elif given == "random":
        normals = random.normal(size=normals.shape)
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    elif given == "no numbers":
        normals[:] = np.nan
    expected = compiled.expand(q, pairs, np.inf, force, rounding=sizes)
    found = compiled.expand(q, pairs, np.inf, force, rounding=sizes, normals=normals)
    np.testing.assert_array_equal(found[1], expected[1])
    exact = expected[1] == EXACT
    np.testing.assert_allclose(found[0][exact], expected[0][exact], atol=1e-9)
    sharp = exact & (expected[0] > 0.0) & (rounding >= 2e-5)  # or maxima are too flat in n
    np.testing.assert_allclose(found[2][sharp], expected[2][sharp], atol=1e-6)
    again = compiled.values(q, pairs, np.inf, rounding=sizes, normals=normals)
    np.testing.assert_allclose(again[0][exact], expected[0][exact], atol=1e-9)


def test_parallel_faces_are_never_taken_for_an_overlap() -> None:
    """The origin may seem to be inside a flat simplex, by rounding: it did in 1 of 144."""
    random = np.random.default_rng(0)
    robot = robot_of(chain([pin.JointModelRX(), pin.JointModelPY()]))
    place = robot.model.jointPlacements[1] * robot.model.jointPlacements[2]
    for _ in range(100):
        quaternion = random.normal(size=4)
        R = pin.Quaternion(*(quaternion / np.linalg.norm(quaternion))).matrix()
        first, second = random.uniform(0.05, 0.4, (2, 3))
        gap = 10.0 ** random.uniform(-3, -1)
        at = np.append(random.uniform(-0.1, 0.1, 2), 0.5 * (first[2] + second[2]) + gap)
        base, turn = pin.SE3(R, np.zeros(3)), pin.utils.rotate("z", random.uniform(0, 3))
        wall, link = place * base, base * pin.SE3(turn, at)
        geometry = pin.GeometryModel()
        geometry.addGeometryObject(pin.GeometryObject("wall", 0, 0, wall, coal.Box(*first)))
        geometry.addGeometryObject(pin.GeometryObject("link", 2, 0, link, coal.Box(*second)))
        geometry.addCollisionPair(pin.CollisionPair(0, 1))
        q = random.uniform(-1, 1, (40, robot.nq)) * 10.0 ** random.uniform(-17, -4, (40, 1))
        _, known = CompiledDistances(robot, geometry).values(q, np.arange(1), np.inf)
        assert (known == EXACT).all()


def test_shapes_of_many_vertices_are_rounded_without_jumps() -> None:
    """A dense sphere beside a box: more vertices count than one search looks at."""
    robot = robot_of(chain([pin.JointModelPX()]))
    geometry = pin.GeometryModel()
    place, unit = robot.model.jointPlacements[1], pin.SE3.Identity()
    wall = place * pin.SE3(np.eye(3), np.array([0.7, 0.0, 0.0]))
    geometry.addGeometryObject(pin.GeometryObject("wall", 0, 0, wall, coal.Box(0.2, 1.0, 1.0)))
    index = np.arange(6_000) + 0.5
    z, turn = 1.0 - 2.0 * index / len(index), np.pi * (1.0 + 5.0**0.5) * index
    ring = np.sqrt(1.0 - z**2)
    points = 0.5 * np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    geometry.addGeometryObject(pin.GeometryObject("ball", 1, 0, unit, hull_around(points)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    compiled, pairs = CompiledDistances(robot, geometry), np.arange(1)
    q = np.linspace(-0.05, 0.05, 400)[:, None]
    d, _ = compiled.values(q, pairs, np.inf, rounding=np.full((400, 1), 1e-3))
    slopes = np.diff(d[:, 0]) / np.diff(q[:, 0])
    np.testing.assert_allclose(slopes, -1.0, atol=2e-3)


def test_a_rounded_distance_is_smooth_where_faces_are_parallel() -> None:
    """A box that tilts below a larger one, where the slope of its distance jumps."""
    robot = robot_of(chain([pin.JointModelRX()]))
    geometry = pin.GeometryModel()
    place = robot.model.jointPlacements[1]
    above = place * pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.25]))
    geometry.addGeometryObject(pin.GeometryObject("floor", 0, 0, above, coal.Box(1.0, 1.0, 0.1)))
    unit = pin.SE3.Identity()
    geometry.addGeometryObject(pin.GeometryObject("box", 1, 0, unit, coal.Box(0.2, 0.2, 0.2)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    compiled, pairs = CompiledDistances(robot, geometry), np.arange(1)
    tilt = np.array([[-1e-6], [0.0], [1e-6]])
    slope = compiled.expand(tilt, pairs, np.inf)[2][:, 0, 0]
    assert slope[2] - slope[0] == pytest.approx(-0.2, rel=1e-3)  # half a width to either side
    force = np.ones((3, 1))
    sizes = ROUNDING * force
    _, _, jacobian, curvature = compiled.expand(tilt, pairs, np.inf, force, rounding=sizes)
    rounded = jacobian[:, 0, 0]
    # the corners of each face have radii of their variance over the rounding, which add up inverse
    radii = np.array([0.1, 0.5]) ** 2 / ROUNDING
    assert curvature[1, 0, 0] == pytest.approx(-1.0 / np.sum(1.0 / radii), rel=1e-2)
    assert (rounded[2] - rounded[0]) / 2e-6 == pytest.approx(curvature[1, 0, 0], rel=1e-3)

"""Random motions with all defaults: do links keep their distance, and what does it take?

Reaches from rest to rest under gravity, between configurations that can be held and at which links
are apart, in 1.5 to 2 times the time at the velocity limits. Distances are those of the given
meshes by Coal, not of hovi's hulls: at 2,000 instants, and at 200 around each of the five least.
Pairs are those that hovi keeps apart. The ratio is that of the processor times of the same motion
with and without self_collision.

    python self_collision.py [ARM ...] [--count 36] [--seed 0]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from measuring import alone, print_machine, print_table
from random_arms import Reach, middle_and_most, random_reaches, timed

import hovi
from hovi.planning.clearance.clearance import DEFAULT_MARGIN
from hovi.planning.clearance.distances import distances_between
from hovi.planning.clearance.self_collisions import self_collision_pairs

Array = npt.NDArray[np.float64]

ARMS = ("ur5", "ur10", "panda", "xarm7")
INSTANTS, AROUND, LEAST = 2_000, 200, 5
"""Instants of a motion, and those around each of its least distances."""
TIME_LIMIT = 60.0
ALLOWED = 1e-6
"""By which a mesh may be nearer than the margin: the tolerance of hovi's distances, in [m]."""
NEAR = 0.02
"""Distance up to which links come near on the motion without self-collision, in [m]."""


@dataclass(frozen=True, eq=False)
class Meshes:
    """The given collision shapes of a robot, of which some pairs are measured by Coal."""

    robot: hovi.Robot
    pairs: tuple[tuple[int, int], ...]

    @cached_property
    def geometry(self) -> pin.GeometryModel:
        """The shapes as they are in the robot's files."""
        geometry = self.robot.collision.copy()
        for item in geometry.geometryObjects:
            item.geometry.computeLocalAABB()
        geometry.removeAllCollisionPairs()
        for i, j in self.pairs:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
        return geometry

    def distances(self, q: Array) -> Array:
        """Distances of the pairs at configurations (M, nq), (M, K), in [m]; 0 where they overlap.

        Those of pairs whose bounding boxes are far apart are lower bounds.
        """
        model, geometry = self.robot.model, self.geometry
        data, places = model.createData(), geometry.createData()
        found = np.empty((len(q), len(self.pairs)))
        for m, at in enumerate(q):
            pin.updateGeometryPlacements(model, data, geometry, places, at)
            found[m] = [self._distance(places, i, j) for i, j in self.pairs]
        return found

    def _distance(self, places: pin.GeometryData, i: int, j: int) -> float:
        ends = [(self.geometry.geometryObjects[k].geometry, places.oMg[k]) for k in (i, j)]
        placed = [(shape, coal.Transform3s(at.rotation, at.translation)) for shape, at in ends]
        centers = [at.act(np.array(shape.aabb_center)) for shape, at in ends]
        far = float(np.linalg.norm(centers[1] - centers[0]))
        far -= sum(float(shape.aabb_radius) for shape, _ in ends)
        if far > NEAR:
            return far
        overlap = coal.CollisionResult()
        if coal.collide(*placed[0], *placed[1], coal.CollisionRequest(), overlap):
            return 0.0
        result = coal.DistanceResult()
        coal.distance(*placed[0], *placed[1], coal.DistanceRequest(), result)
        return float(max(result.min_distance, 0.0))

    def at(self, motion: hovi.Trajectory, t: Array) -> Array:
        """The least distance at some times of a motion, (M,), in [m]."""
        return self.distances(motion.sample(t).q).min(axis=1)

    def without_said(self, message: str) -> Meshes:
        """Those of pairs of which a message does not say that they are not kept apart."""
        model, shapes = self.robot.model, self.geometry.geometryObjects

        def said(pair: tuple[int, int]) -> bool:
            one, other = (model.frames[shapes[i].parentFrame].name for i in pair)
            orders = (one, other), (other, one)
            return any(f"Links {a!r} and {b!r} are not kept apart" in message for a, b in orders)

        return Meshes(self.robot, tuple(pair for pair in self.pairs if not said(pair)))

    def least_along(self, motion: hovi.Trajectory) -> float:
        """The least distance along a motion, in [m], which is looked at around the least ones."""
        t = np.linspace(0.0, motion.duration, INSTANTS)
        d = self.at(motion, t)
        inner = np.flatnonzero((d[1:-1] <= d[:-2]) & (d[1:-1] <= d[2:])) + 1
        least = [d.min()]
        for k in inner[np.argsort(d[inner])][:LEAST]:
            least.append(self.at(motion, np.linspace(t[k - 1], t[k + 1], AROUND)).min())
        return float(min(least))


@dataclass(frozen=True)
class Run:
    """One reach. ratio: of the times with and without. free, kept: least distances, in [m]."""

    arm: str
    number: int
    status: str
    message: str
    seconds: float
    ratio: float
    free: float
    kept: float
    cost: float

    @property
    def false(self) -> bool:
        """Whether it is called a success and comes too near."""
        return self.status == "minimum" and self.kept < DEFAULT_MARGIN - ALLOWED


def scene_of(arm: str) -> hovi.Scene:
    """An arm under gravity with its fingers locked."""
    names = hovi.load_robot(arm).joint_names
    locked = [name for name in names if "finger" in name or "gripper" in name.lower()]
    return hovi.Scene(hovi.load_robot(arm, locked=locked), [hovi.effects.Gravity()])


def apart(scene: hovi.Scene, count: int, seed: int) -> Iterator[Reach]:
    """Random reaches between configurations at which links keep the margin."""
    found = 0
    for reach in random_reaches(scene, 20 * count, seed):
        ends = np.stack([reach.start, reach.goal])
        if hovi_distances(scene.robot, ends).min() > DEFAULT_MARGIN:
            yield reach
            found += 1
        if found == count:
            return


def hovi_distances(robot: hovi.Robot, q: Array) -> Array:
    """Distances of hovi's hulls, (M, K)."""
    return distances_between(robot, hovi.Clearance(self_collision=True)).values(q)


def measure(arm: str, count: int, seed: int) -> list[Run]:
    """Every reach of an arm with and without self-collision, when warm."""
    scene, rows = scene_of(arm), []
    meshes = Meshes(scene.robot, self_collision_pairs(scene.robot))
    common = {"processes": 1, "time_limit": TIME_LIMIT}
    for number, reach in enumerate(apart(scene, count, seed)):
        ends = scene, reach.start, reach.goal, reach.duration
        if number == 0:
            hovi.plan(*ends, **common)
        without, free = timed(lambda e=ends: hovi.plan(*e, self_collision=False, **common))
        seconds, plan = timed(lambda e=ends: hovi.plan(*e, **common))
        T = np.linspace(0.0, reach.duration, INSTANTS // 10)
        nearest = meshes.at(free.trajectory, T).min(), meshes.least_along(plan.trajectory)
        changed = plan.cost / free.cost - 1.0
        given = str(plan.status), plan.message, seconds, seconds / without
        run = Run(arm, number, *given, float(nearest[0]), nearest[1], changed)
        print(
            f"{arm} {number}: {run.status}, {seconds:.2f} s, ratio {run.ratio:.2f}, least distance "
            f"{nearest[0]:.4f} without, {nearest[1]:.6f} with; cost {100 * changed:+.2g} %",
            file=sys.stderr,
            flush=True,
        )
        rows.append(run)
    return rows


def row(arm: str, runs: list[Run]) -> list[object]:
    """A row of the table: one arm."""
    clear = [run for run in runs if run.free >= DEFAULT_MARGIN]
    bent = [run for run in runs if run.free < DEFAULT_MARGIN]
    good = [run for run in runs if run.status == "minimum"]
    return [
        f"`{arm}`",
        f"{len(good)} of {len(runs)}",
        f"{sum(run.free == 0.0 for run in runs)}",
        f"{min((run.kept for run in good), default=np.nan):.6f}",
        f"{sum(run.false for run in runs)}",
        f"{len(clear)}",
        middle_and_most([run.ratio for run in clear], ".2f"),
        f"{len(bent)}",
        middle_and_most([run.ratio for run in bent], ".2f"),
    ]


def main() -> None:
    """Print the table, and every plan that is no minimum or comes too near."""
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", metavar="ARM")
    parser.add_argument("--count", type=int, default=36)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    arms = given.arms or list(ARMS)
    found = {arm: alone(measure, arm, given.count, given.seed) for arm in arms}
    print(f"{given.count} reaches per arm, seed {given.seed}, one thread.\n")
    columns = ["arm", "minima", "through itself without", "least distance, m", "too near"]
    columns += ["free reaches", "their ratio: median, max", "others", "their ratio: median, max"]
    print_table(columns, [row(arm, runs) for arm, runs in found.items()])
    for run in (run for runs in found.values() for run in runs):
        if run.status != "minimum" or run.false:
            print(f"- `{run.arm}` {run.number}: {run.status} after {run.seconds:.2g} s, least")
            print(f"  distance {run.kept:.6f} m: {run.message}")
    print()
    print_machine(threads=1)


if __name__ == "__main__":
    main()

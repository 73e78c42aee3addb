"""A robot as its findings see it: the model, the URDF, and how it was loaded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.findings.boxes import ShapeBox
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
LEAST_SIZE = 0.05
"""Least size of a body, in [m]."""


@dataclass(frozen=True)
class LightJoint:
    """Its least inertia, and the armature with which it is no longer light, in [kg m^2]."""

    inertia: float
    armature: float


@dataclass(frozen=True, eq=False)
class Subject:
    """What is known of a robot.

    urdf: its checked element <robot>, None without one. harmless: notes on what was taken out of
        it. locked: joints that are fixed.
    mimic: whether joints follow their leaders. leaders: by the names of the joints that do.
    notes: of the reader of another format.
    light: joints with little inertia, by name. massless: indices of joints that have none.
    ambiguous: the kind of frame that a name stands for, by names that several frames have.
    boxes: of its shapes, none where they are not looked at. tips: its tip frames.
    """

    model: pin.Model
    urdf: Element | None
    harmless: Mapping[str, list[str]]
    locked: frozenset[str]
    mimic: bool
    leaders: Mapping[str, str]
    notes: tuple[str, ...]
    light: Mapping[str, LightJoint]
    massless: tuple[int, ...]
    ambiguous: Mapping[str, str]
    boxes: tuple[ShapeBox, ...] = ()
    tips: tuple[str, ...] = ()

    @cached_property
    def joints(self) -> dict[str, pin.JointModel]:
        """The joints of the model by name."""
        pairs = zip(self.model.names, self.model.joints, strict=True)
        return {str(name): joint for name, joint in list(pairs)[1:]}

    @cached_property
    def single(self) -> dict[str, tuple[float, float]]:
        """The ranges of joints with one position, by name, in [rad] or [m]."""
        lower, upper = self.model.lowerPositionLimit, self.model.upperPositionLimit
        return {
            name: (float(lower[joint.idx_q]), float(upper[joint.idx_q]))
            for name, joint in self.joints.items()
            if joint.nq == joint.nv == 1
        }

    @cached_property
    def elements(self) -> dict[str, Element]:
        """The elements <joint> of the URDF that move, by name."""
        joints = () if self.urdf is None else self.urdf.iterfind("joint")
        return {x.get("name", ""): x for x in joints if x.get("name") in self.joints}

    @cached_property
    def links(self) -> dict[str, Element]:
        """The elements <link> of the URDF by name."""
        links = () if self.urdf is None else self.urdf.iterfind("link")
        return {each.get("name", ""): each for each in links}

    @cached_property
    def bodies(self) -> dict[int, list[str]]:
        """The links of the URDF by the joint that moves them, that of the world included."""
        found: dict[int, list[str]] = {}
        for frame in self.model.frames:
            if frame.type == pin.FrameType.BODY and frame.name in self.links:
                found.setdefault(int(frame.parentJoint), []).append(str(frame.name))
        return found

    @cached_property
    def sizes(self) -> Array:
        """Sizes of the bodies of joints, in [m]: distances to the center of mass or next joints."""
        sizes = np.array([max(LEAST_SIZE, np.linalg.norm(x.lever)) for x in self.model.inertias])
        for parent, distance in self._steps:
            sizes[parent] = max(sizes[parent], distance)
        return sizes

    @cached_property
    def reach(self) -> float:
        """The length of its longest chain of joints, in [m]."""
        reach = [0.0]
        for parent, distance in self._steps:
            reach.append(reach[parent] + distance)
        return max(reach)

    @property
    def _steps(self) -> list[tuple[int, float]]:
        """The parent of each joint but the world's, and the distance between them, in [m]."""
        pairs = zip(self.model.parents, self.model.jointPlacements, strict=True)
        return [(int(i), float(np.linalg.norm(x.translation))) for i, x in pairs][1:]

    def inertial(self, link: str, tag: str, key: str) -> str:
        """An attribute of an element in the <inertial> of a link; "0" without one."""
        found = self.links[link].find(f"inertial/{tag}")
        return "0" if found is None else found.get(key, "0")

    def moving_links(self) -> Iterator[Element]:
        """Links moved by a joint of their own, and others that move and have shapes.

        A link without shapes on a fixed joint is a frame.
        """
        children = (joint.find("child") for joint in self.elements.values())
        own = {child.get("link", "") for child in children if child is not None}
        moved = {name for joint, names in self.bodies.items() if joint for name in names}
        for name, link in self.links.items():
            has_shapes = not {"visual", "collision"}.isdisjoint(part.tag for part in link)
            if name in own or (name in moved and has_shapes):
                yield link

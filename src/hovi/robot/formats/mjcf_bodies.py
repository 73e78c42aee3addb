"""From the bodies and joints of an MJCF to a Pinocchio model, as MuJoCo understands them.

A body with several joints becomes a chain of bodies without mass, one for each joint, so that every
joint has its own name and coordinates in q, which are those of MuJoCo. [TodorovErezTassa2012]
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from hovi.robot.formats.mjcf_assets import Meshes
from hovi.robot.formats.mjcf_defaults import Compiler, Defaults, sections
from hovi.robot.formats.mjcf_inertia import bounded, inertia_of_geom, inertial_of
from hovi.robot.formats.mjcf_poses import pose_of, unit
from hovi.robot.formats.mjcf_text import Array, MjcfError, number, numbers, word
from hovi.system.dataclass import dataclass

MAX_BODIES = 1_000
MAX_JOINTS = 250
"""Largest numbers of bodies and joints."""


@dataclass(frozen=True, eq=False)
class Place:
    """Where something is: a joint of the model, the pose in its frame, and the frame above it."""

    joint: int
    pose: pin.SE3
    frame: int

    def at(self, pose: pin.SE3) -> Place:
        """The place of something that is at a pose in this one."""
        return Place(self.joint, self.pose * pose, self.frame)


@dataclass(frozen=True, eq=False)
class Geom:
    """Attributes of a geom with those of its class, its name for messages, and where it is."""

    given: dict[str, str]
    where: str
    place: Place


class Bodies:
    """Builds the model and collects the geoms of a file; Raises MjcfError."""

    def __init__(
        self, root: Element, compiler: Compiler, defaults: Defaults, meshes: Meshes
    ) -> None:
        self.compiler, self.defaults, self.meshes = compiler, defaults, meshes
        self.model, self.geoms, self.notes = pin.Model(), dict[str, list[Geom]](), list[str]()
        self.names, self.bodies, self.joints = dict[str, set[str]](), 0, 0
        self.inertias: list[tuple[Place, pin.Inertia]] = []
        self.world = list[str]()
        for child in sections(root, "worldbody"):
            self._child(child, Place(0, pin.SE3.Identity(), 0), "", "")
        self._append_inertias()

    def _append_inertias(self) -> None:
        """Put the inertias into the model, scaled to the total mass that <compiler> names."""
        total, wanted = sum(inertia.mass for _, inertia in self.inertias), self.compiler.total
        factor = wanted / total if wanted > 0.0 and total > 0.0 else 1.0
        for place, inertia in self.inertias:
            scaled = pin.Inertia(factor * inertia.mass, inertia.lever, factor * inertia.inertia)
            self.model.appendBodyToJoint(place.joint, scaled, place.pose)

    def _child(self, child: Element, place: Place, inherited: str, body: str) -> None:
        """Add what a body contains, but for its joints and its inertia."""
        if child.tag == "body":
            self._body(child, place, inherited)
        elif child.tag == "frame":
            pose = pose_of(child.attrib, _where(child, body), self.compiler.angles)
            for each in child:
                if body and each.tag in ("joint", "freejoint", "inertial"):
                    raise MjcfError(f"{_where(each, body)} is inside a <frame>: move it out of it.")
                self._child(each, place.at(pose), child.get("childclass", inherited), body)
        elif child.tag == "site" and body:
            self._site(child, place, inherited, body)
        elif child.tag == "geom":
            given = self.defaults.of(child, inherited)
            if body:
                self.geoms[body].append(Geom(given, _where(child, body), place))
            else:
                self.world.append(_where(child, "the world"))
        elif child.tag not in _KNOWN:
            raise MjcfError(
                f"<{child.tag[:40]}> in {f'body {body!r}' if body else 'the world'} is not read: "
                "save the model by MuJoCo itself, with mujoco.mj_saveLastXML."
            )

    def _body(self, body: Element, place: Place, inherited: str) -> None:
        self.bodies += 1
        if self.bodies > MAX_BODIES:
            raise MjcfError(f"it has more than {MAX_BODIES:,} bodies, the maximum.")
        name = self._unique("body", body.get("name", "") or f"body_{self.bodies}")
        inherited = body.get("childclass", inherited)
        place = place.at(pose_of(body.attrib, f"body {name!r}", self.compiler.angles))
        joints = [each for each in body if each.tag in ("joint", "freejoint")]
        for k, joint in enumerate(joints):
            place = self._joint(joint, place, inherited, name, k, len(joints))
        frame = pin.Frame(name, place.joint, place.frame, place.pose, pin.BODY)
        place = Place(place.joint, place.pose, int(self.model.addFrame(frame, False)))
        inertials = body.findall("inertial")
        if len(inertials) > 1:
            raise MjcfError(f"body {name!r} has {len(inertials)} elements <inertial>: keep one.")
        self.geoms[name] = []
        for child in body:
            if child.tag not in ("joint", "freejoint", "inertial"):
                self._child(child, place, inherited, name)
        self._inertia(inertials, self.geoms[name], place, name)

    def _inertia(
        self, inertials: list[Element], geoms: list[Geom], place: Place, body: str
    ) -> None:
        rule = self.compiler.from_geoms
        inertia = pin.Inertia.Zero()
        if inertials:  # checked also where <compiler> takes the geoms instead
            where = f"<inertial> of body {body!r}"
            inertia = inertial_of(inertials[0].attrib, where, self.compiler)
        counts = place.joint or self.compiler.total > 0.0  # what is fixed to the world needs none
        if counts and (rule == "true" or (rule == "auto" and not inertials)):
            inertia, back = pin.Inertia.Zero(), place.pose.inverse()
            low, high = self.compiler.groups
            for geom in geoms:
                if low <= number(geom.given, "group", geom.where, 0.0) <= high:
                    found = inertia_of_geom(geom.given, geom.where, self.compiler, self.meshes)
                    if found.mass > 0.0:
                        inertia = inertia + (back * geom.place.pose).act(found)
        self.inertias.append((place, bounded(inertia, self.compiler, body)))

    def _joint(
        self, joint: Element, place: Place, inherited: str, body: str, count: int, of: int
    ) -> Place:
        """Add a joint; returns the place of its body behind it."""
        self.joints += 1
        if self.joints > MAX_JOINTS:
            raise MjcfError(f"it has more than {MAX_JOINTS} joints, the maximum.")
        is_free = joint.tag == "freejoint"
        given = dict(joint.attrib) if is_free else self.defaults.of(joint, inherited)
        kind = "free" if is_free else word(given, "type", _where(joint, body), KINDS)
        default = f"{body}_free" if kind == "free" else f"{body}Joint_{count}"
        name = self._unique("joint", joint.get("name", "") or default)
        where = f"joint {name!r}"
        if kind == "free":
            if place.joint or of > 1 or place.frame:
                raise MjcfError(f"{where} is free, and not the only joint of a body of the world.")
            place = self._add(pin.JointModelFreeFlyer(), name, Place(0, pin.SE3.Identity(), 0))
            self._losses(given, where, place)
            return place
        position = numbers(given, "pos", where, 3)
        shift = pin.SE3(np.eye(3), np.zeros(3) if position is None else position)
        at = place.at(shift)
        if kind == "ball":
            place = self._add(pin.JointModelSpherical(), name, at)
            if "range" in given:
                self.notes.append(f"range= of {where} is not kept, since it is a ball joint")
        else:
            place = self._single(given, where, kind, name, at)
        self._losses(given, where, place)
        return place.at(shift.inverse())

    def _single(self, given: dict[str, str], where: str, kind: str, name: str, at: Place) -> Place:
        """Add a hinge or a slide with its range."""
        axis = numbers(given, "axis", where, 3)
        axis = unit(np.array([0.0, 0.0, 1.0]) if axis is None else axis, f"the axis of {where}")
        turns = kind == "hinge"
        limits = numbers(given, "range", where, 2)
        ref = number(given, "ref", where, 0.0)
        if turns:
            ref = float(self.compiler.angles.radians(np.array([ref]))[0])
            limits = None if limits is None else self.compiler.angles.radians(limits)
        # A position of ref is the pose that the file describes, as in MuJoCo.
        back = (
            pin.SE3(pin.exp3(-ref * axis), np.zeros(3))
            if turns
            else pin.SE3(np.eye(3), -ref * axis)
        )
        place = self._add(_joint_model(turns, axis), name, at.at(back))
        if self._is_limited(given, where, "limited", limits is not None) and limits is not None:
            if not limits[0] < limits[1]:
                raise MjcfError(f"range of {where} has no lower end below its upper end.")
            q = self.model.joints[place.joint].idx_q
            lower, upper = self.model.lowerPositionLimit, self.model.upperPositionLimit
            lower[q], upper[q] = limits
            self.model.lowerPositionLimit, self.model.upperPositionLimit = lower, upper
        self._effort(given, where, self.model.joints[place.joint].idx_v)
        return place

    def _effort(self, given: dict[str, str], where: str, v: int) -> None:
        """The limit of the effort of a joint by actuatorfrcrange=, the smaller of both ends."""
        limits = numbers(given, "actuatorfrcrange", where, 2)
        if limits is None or not self._is_limited(given, where, "actuatorfrclimited", True):
            return
        if not limits[0] < limits[1] or limits[0] > 0.0 or limits[1] < 0.0:
            raise MjcfError(f"actuatorfrcrange of {where} must begin at or below 0 and end above.")
        efforts = self.model.effortLimit
        efforts[v] = min(-limits[0], limits[1])
        self.model.effortLimit = efforts
        if limits[0] != -limits[1]:
            self.notes.append(f"actuatorfrcrange of {where} is taken as +-{efforts[v]:g}")

    def _is_limited(self, given: dict[str, str], where: str, key: str, is_given: bool) -> bool:
        limited = word(given, key, where, ("auto", "true", "false"))
        if limited == "true" and not is_given:
            raise MjcfError(f"{where} has {key}='true' and no range=.")
        if limited == "auto" and is_given and not self.compiler.autolimits and key == "limited":
            raise MjcfError(
                f"{where} has a range= and no limited=, and <compiler> autolimits='false': add it."
            )
        return limited == "true" or (limited == "auto" and is_given)

    def _losses(self, given: dict[str, str], where: str, place: Place) -> None:
        """Armature, damping and friction of a joint, as in a URDF opt-in by effects."""
        for key, name in LOSSES.items():
            values = numbers(given, key, where, 1, 3)
            if values is None:
                continue
            if values[0] < 0.0:
                raise MjcfError(f"{key}= of {where} is negative: give 0 or more.")
            if values[1:].any():
                self.notes.append(f"only the first coefficient of {key}= of {where} is read")
            joint = self.model.joints[place.joint]
            self._fill(name, slice(joint.idx_v, joint.idx_v + joint.nv), float(values[0]))

    def _add(self, joint: pin.JointModel, name: str, at: Place) -> Place:
        index = self.model.addJoint(at.joint, joint, at.pose, name)
        frame = int(self.model.addJointFrame(index, at.frame))
        q, v = self.model.joints[index].idx_q, self.model.joints[index].idx_v
        nq, nv = self.model.joints[index].nq, self.model.joints[index].nv
        quaternion = q + nq - (4 if nq > 1 else 0)
        for name_, sign in (("lowerPositionLimit", -1.0), ("upperPositionLimit", 1.0)):
            self._fill(name_, slice(q, q + nq), sign * np.inf)
            self._fill(name_, slice(quaternion, q + nq), sign * (1.01 if nq > 1 else np.inf))
        self._fill("effortLimit", slice(v, v + nv), np.inf)
        self._fill("velocityLimit", slice(v, v + nv), np.inf)
        return Place(int(index), pin.SE3.Identity(), frame)

    def _fill(self, name: str, entries: slice, value: float) -> None:
        array = np.array(getattr(self.model, name))
        array[entries] = value
        setattr(self.model, name, array)

    def _site(self, site: Element, place: Place, inherited: str, body: str) -> None:
        name = site.get("name", "")
        if not name:
            return
        given = self.defaults.of(site, inherited)
        pose = place.at(pose_of(given, _where(site, body), self.compiler.angles))
        self._unique("site", name)
        frame = pin.Frame(name, pose.joint, pose.frame, pose.pose, pin.OP_FRAME)
        self.model.addFrame(frame, False)

    def _unique(self, kind: str, name: str) -> str:
        names = self.names.setdefault(kind, {"universe"})
        if name in names or not name.isprintable() or len(name) > 256:
            raise MjcfError(f"the name {name[:60]!r} of a {kind} occurs twice, or is no name.")
        names.add(name)
        return name


KINDS = "hinge", "slide", "ball", "free"
LOSSES = {"armature": "armature", "damping": "damping", "frictionloss": "friction"}
_KNOWN = "camera", "light", "site", "geom", "plugin"


def _joint_model(turns: bool, axis: Array) -> pin.JointModel:
    """A joint about or along an axis; those of the frame have their own kinds in Pinocchio."""
    for k, letter in enumerate("XYZ"):
        if axis[k] == 1.0:
            return getattr(pin, f"JointModel{'R' if turns else 'P'}{letter}")()
    unaligned = pin.JointModelRevoluteUnaligned if turns else pin.JointModelPrismaticUnaligned
    return unaligned(axis)


def _where(element: Element, body: str) -> str:
    name = element.get("name", "")
    return f"{element.tag} {name[:60]!r}" if name else f"<{element.tag}> of {body!r}"

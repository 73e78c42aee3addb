"""A robot: its model, its limits and names, and the group operations of its configuration space.

Coordinates follow Pinocchio: q (nq,) in [rad] or [m], v and a (nv,). Continuous, spherical and
floating joints have nq != nv: use `integrate` and `difference` on their q, never + and -. Limits
are those of the URDF as Pinocchio reads them: a missing limit is the largest double, a velocity or
effort limit of 0 in the file stays 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import require_rows
from hovi.errors import InputError, ModelError, nearest
from hovi.robot import model as robot_model
from hovi.robot.description import describe
from hovi.robot.geometry import Shapes, load_shapes
from hovi.robot.mass_matrix import check_mass_matrix
from hovi.robot.meshes.stored_meshes import StoredMeshes
from hovi.robot.mimic_model import Coupling, PortableModel, couplings_of
from hovi.robot.source import RobotSource
from hovi.robot.space import pinocchio_configurations as configuration
from hovi.robot.space.configuration_space import ConfigurationSpace, configuration_space
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.joint_kinds import Units, coordinate_units
from hovi.robot.srdf import Srdf, parse_srdf
from hovi.robot.tip_frame import is_moved, tip_frames
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@check_arguments_except("package_dirs")
@dataclass(frozen=True, eq=False)
class Robot(Coordinates):
    """A robot, created by `load_robot`.

    name: the user's name for it.
    model: its Pinocchio model without the locked joints; treat it as read-only.
    source: the URDF and options that it was built from.
    given: visual and collision geometry passed together with a pinocchio.Model.
    """

    name: str
    model: pin.Model
    source: RobotSource
    given: tuple[pin.GeometryModel | None, pin.GeometryModel | None] = (None, None)

    def __repr__(self) -> str:
        """Name and dimensions, for a terminal; see `describe` for more."""
        return f"<Robot {self.name!r}: nq = {self.nq}, nv = {self.nv}>"

    # Sizes and names

    @property
    def owner(self) -> str:
        """The robot by its name, for messages."""
        return f"robot {self.name!r}"

    @cached_property
    def nq(self) -> int:
        """Length of a configuration q."""
        return int(self.model.nq)

    @cached_property
    def nv(self) -> int:
        """Number of degrees of freedom: length of v, a and tau."""
        return int(self.model.nv)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The independent joints, in Pinocchio's order; joints that mimic others are left out."""
        pairs = zip(self.model.names, self.model.joints, strict=True)
        return tuple(name for name, joint in list(pairs)[1:] if joint.nv)

    @cached_property
    def couplings(self) -> tuple[Coupling, ...]:
        """The couplings of the joints that mimic others."""
        return couplings_of(self.model)

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """One name per velocity, (nv,): the joint's name, with [i] where it has several."""
        return configuration.entry_names(self.model, "nv")

    @cached_property
    def coordinate_units(self) -> tuple[Units, ...]:
        """Units of q, v, a and tau at each coordinate, (nv,)."""
        return coordinate_units(self.model)

    @cached_property
    def space(self) -> ConfigurationSpace:
        """The configuration space as a product of vector spaces and groups.

        Not valid if there are joints of an unsupported kind: see `unplanned_joints`.
        """
        return self._space[0]

    @property
    def unplanned_joints(self) -> tuple[str, ...]:
        """Joints whose configurations are neither vectors nor elements of a supported group."""
        return self._space[1]

    @cached_property
    def _space(self) -> tuple[ConfigurationSpace, tuple[str, ...]]:
        return configuration_space(self.model)

    def hint(self, name: str, valid: Iterable[str] | None = None) -> str:
        """The end of a message about a joint that is not independent, or does not exist.

        valid: the accepted names; `joint_names` when None.
        """
        for coupling in self.couplings:
            if coupling.follower == name:
                return f"it mimics {coupling.leader!r}; name that joint."
        return nearest(name, self.joint_names if valid is None else valid)

    def joint_at(self, index: int) -> str:
        """The joint that the entry of v at an index belongs to. Raises InputError without one."""
        if not 0 <= index < self.nv:
            raise InputError(f"v has entries 0 to {self.nv - 1}, not {index}.")
        pairs = ((name, self.entries_of(name)) for name in self.joint_names)
        return next(name for name, part in pairs if part.start <= index < part.stop)

    def entries_of(self, joint: str) -> slice:
        """The entries of v of one of the `joint_names`."""
        member = self.model.joints[self.model.getJointId(joint)]
        return slice(member.idx_v, member.idx_v + member.nv)

    @cached_property
    def manifold_joints(self) -> tuple[str, ...]:
        """The joints whose configuration is not a plain vector (nq != nv)."""
        pairs = zip(self.model.names, self.model.joints, strict=True)
        return tuple(name for name, joint in pairs if joint.nq != joint.nv)

    @cached_property
    def vector_joints(self) -> bool:
        """Whether every joint has nq = nv, so that configurations form a vector space."""
        return not self.manifold_joints

    @cached_property
    def frame_names(self) -> tuple[str, ...]:
        """Every frame of the model: links, joints and extra frames."""
        return tuple(frame.name for frame in self.model.frames)

    @cached_property
    def tip_frame(self) -> str:
        """The first of the `tip_frames`: where a tool is mounted."""
        return self.tip_frames[0]

    @cached_property
    def tip_frames(self) -> tuple[str, ...]:
        """Its tool, hands or feet: the ends of its longest chains of joints."""
        return tip_frames(self.model)

    def measured_frames(self, frame: str | None = None) -> tuple[str, ...]:
        """The frames at which a length is measured: the given one, or the tip_frames if None.

        Raises InputError for a given frame that is unknown or that no joint moves.
        """
        if frame is None:
            return self.tip_frames
        self.check_frame_moves(frame)
        return (frame,)

    def check_frame_moves(self, frame: str) -> None:
        """Raise InputError for a frame that the robot does not have, or that no joint moves."""
        self._check_frame(frame)
        if not is_moved(self.model, frame):
            other = self.tip_frame
            hint = f"; one that moves is {other!r}" if is_moved(self.model, other) else ""
            raise InputError(
                f"frame {frame!r} of robot {self.name!r} is fixed to the world, as no joint moves "
                f"it{hint}."
            )

    def _check_frame(self, frame: str) -> None:
        if frame not in self.frame_names:
            raise InputError(
                f"robot {self.name!r} has no frame {frame!r}: {nearest(frame, self.frame_names)}"
            )

    # Properties from the URDF

    @property
    def lower(self) -> Array:
        """Lower position limits, (nq,), in [rad] or [m]."""
        return np.array(self.model.lowerPositionLimit, dtype=float)

    @property
    def upper(self) -> Array:
        """Upper position limits, (nq,), in [rad] or [m]."""
        return np.array(self.model.upperPositionLimit, dtype=float)

    @property
    def velocity_limit(self) -> Array:
        """Largest joint speeds, (nv,), in [rad/s] or [m/s]."""
        return np.array(self.model.velocityLimit, dtype=float)

    @property
    def effort_limit(self) -> Array:
        """Largest joint efforts, (nv,), in [N m] or [N]."""
        return np.array(self.model.effortLimit, dtype=float)

    @property
    def damping(self) -> Array:
        """Viscous damping of the joints, (nv,), in [N m s/rad] or [N s/m]."""
        return np.array(self.model.damping, dtype=float)

    @property
    def friction(self) -> Array:
        """Dry friction of the joints, (nv,), in [N m] or [N]."""
        return np.array(self.model.friction, dtype=float)

    @property
    def armature(self) -> Array:
        """Reflected rotor inertia of the joints, (nv,), in [kg m^2] or [kg]."""
        return np.array(self.model.armature, dtype=float)

    # Properties from the SRDF

    @cached_property
    def poses(self) -> dict[str, Array]:
        """Named configurations (nq,) of the SRDF; empty without an SRDF.

        Raises ModelError for an SRDF that cannot be read.
        """
        return self.semantics.poses(self.model)

    @cached_property
    def semantics(self) -> Srdf:
        """Named poses and disabled collision pairs of the SRDF."""
        text = self.source.srdf
        return Srdf({}, frozenset()) if text is None else parse_srdf(text, self.name)

    def pose(self, name: str) -> Array:
        """The SRDF's configuration `name`, (nq,). Raises InputError for an unknown name."""
        if name in self.poses:
            return self.poses[name].copy()
        none = "its SRDF, if it has one, defines none."
        known = nearest(name, self.poses) if self.poses else none
        raise InputError(f"robot {self.name!r} has no pose {name!r}: {known}")

    # Shapes

    @property
    def visual(self) -> pin.GeometryModel | None:
        """Visual geometry, loaded on first access; None if none was found."""
        return self._visual_shapes.geometry

    @property
    def collision(self) -> pin.GeometryModel | None:
        """Collision geometry, loaded on first access; None if none was found."""
        return self._collision_shapes.geometry

    @property
    def collision_problem(self) -> str:
        """Why `collision` is None or incomplete, as a sentence; "" if it is complete."""
        return self._collision_shapes.problem

    @property
    def visual_problem(self) -> str:
        """Why `visual` is None or incomplete, as a sentence; "" if it is complete."""
        return self._visual_shapes.problem

    @cached_property
    def _visual_shapes(self) -> Shapes:
        given = self.given[0]
        return load_shapes(self.source, "visual") if given is None else Shapes(given, "")

    @cached_property
    def _collision_shapes(self) -> Shapes:
        given = self.given[1]
        return load_shapes(self.source, "collision") if given is None else Shapes(given, "")

    # Configurations

    def neutral(self) -> Array:
        """The neutral configuration, (nq,): zeros, with unit quaternions and angles of 0."""
        return np.array(pin.neutral(self.model), dtype=float)

    def integrate(self, q: Array, dq: Array) -> Array:
        """q (+) dq: move configurations (..., nq) by tangent vectors (..., nv) -> (..., nq).

        Raises InputError for other shapes.
        """
        if not (self.vector_joints or self.unplanned_joints):
            return self.space.integrate(q, dq)
        require_rows((("q", q, self.nq), ("dq", dq, self.nv)))
        return q + dq if self.vector_joints else configuration.integrate(self.model, q, dq)

    def difference(self, q0: Array, q1: Array) -> Array:
        """q1 (-) q0: the tangent vector (..., nv) that moves q0 (..., nq) to q1 (..., nq).

        Raises InputError for other shapes.
        """
        if not (self.vector_joints or self.unplanned_joints):
            return self.space.difference(q0, q1)
        require_rows((("q0", q0, self.nq), ("q1", q1, self.nq)))
        return q1 - q0 if self.vector_joints else configuration.difference(self.model, q0, q1)

    def frame_position(self, frame: str, q: Array) -> Array:
        """Position of a frame's origin in the world, in [m]: q (..., nq) -> (..., 3).

        Raises InputError for an unknown frame or another shape.
        """
        return self.frame_positions((frame,), q)[..., 0, :]

    def frame_positions(self, frames: Sequence[str], q: Array) -> Array:
        """Positions of the origins of F frames in the world, in [m]: q (..., nq) -> (..., F, 3)."""
        for frame in frames:
            self._check_frame(frame)
        indices = [robot_model.frame_id(self.model, frame) for frame in frames]
        return configuration.frame_positions(self.model, indices, q)

    def frame_pose(self, frame: str, q: Array) -> Array:
        """Pose of a frame in the world as homogeneous matrices: q (..., nq) -> (..., 4, 4).

        [R p; 0 1] with the frame's axes R and its origin p in [m], as a FrameGoal takes it.
        Raises InputError for an unknown frame or another shape.
        """
        self._check_frame(frame)
        return configuration.frame_poses(self.model, robot_model.frame_id(self.model, frame), q)

    @check_arguments_except("q")
    def check_configuration(self, q: npt.ArrayLike, name: str) -> Array:
        """`q` as a float array (nq,), finite and with unit quaternions and angles.

        name: of the argument, for the message. Raises InputError.
        """
        checked = configuration.check_vector(q, name, *self._entries)
        if self.vector_joints:
            return checked
        configuration.check_unit_norms(self.model, checked, name)
        return np.array(pin.normalize(self.model, checked), dtype=float)

    @cached_property
    def _entries(self) -> tuple[tuple[str, ...], str]:
        """Names of the entries of q, and a hint about joints with nq != nv."""
        return (
            configuration.entry_names(self.model, "nq"),
            configuration.manifold_hint(self.model),
        )

    def check_mass_matrix(self) -> None:
        """Raise ModelError if M(q) is singular to working precision."""
        check_mass_matrix(self.model)

    # Text and files

    def describe(self) -> str:
        """A summary for a terminal: joints, limits, mass, and properties that need an effect."""
        text = describe(self.name, self.model, self.source, self.tip_frames)
        names = ", ".join(repr(name) for name in self.poses)
        text += f"\n\nPoses of its SRDF: {names}." if names else ""
        try:
            self.check_mass_matrix()
        except ModelError as singular:
            text += f"\n\nPlanning with torques is not possible: {singular}"
        return text

    def to_dict(self) -> dict[str, Any]:
        """A JSON-compatible dictionary with the text of the URDF and without local paths."""
        return {"name": self.name, **self.source.to_dict()}

    @classmethod
    def from_dict(
        cls,
        data: Mapping[str, Any],
        package_dirs: Iterable[str | Path] = (),
        meshes: Mapping[str, StoredMeshes] | None = None,
    ) -> Robot:
        """The robot from the result of `to_dict`, built from the text of its URDF.

        package_dirs: local folders that contain the packages of its meshes. meshes: those stored
            in a motion's file, by the sha256 of the URDF; they are taken first.
        Raises ModelError, also for a robot that was loaded from a pinocchio.Model.
        """
        if not isinstance(data, Mapping) or not isinstance(data.get("name"), str):
            raise ModelError("a stored robot needs a string under 'name'.")
        source = RobotSource.from_dict(data, package_dirs, meshes)
        return cls(data["name"], robot_model.build_model(source), source)

    def __getstate__(self) -> dict[str, Any]:
        """The fields, without geometry that is loaded on demand."""
        state = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**state, "model": PortableModel.of(self.model)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the fields."""
        self.__dict__.update({**state, "model": state["model"].model()})

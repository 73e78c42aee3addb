"""The robots of example-robot-data, read without the package's own loader.

That loader opens every mesh of a robot (0.3 to 0.5 s). Here only its table is read: the paths of
the URDF and the SRDF, whether the base floats, and whether the SRDF contains rotor inertias.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pinocchio as pin

from hovi.errors import ModelError, nearest
from hovi.system.dataclass import dataclass

BUILT_IN_CODE = ("human", "talos_legs")
"""Robots whose loader modifies the model after reading the URDF."""


@dataclass(frozen=True)
class ExampleRobot:
    """One entry of the table.

    package_dir: folder in which `package://` meshes are looked up.
    free_flyer: whether the base floats. srdf: path of the SRDF, or None.
    rotors: whether rotor inertias are read from the SRDF.
    """

    name: str
    urdf: Path
    package_dir: Path
    free_flyer: bool
    srdf: Path | None
    rotors: bool


def example_names() -> tuple[str, ...]:
    """The names of all robots in example-robot-data, sorted."""
    return tuple(sorted(_loaders().ROBOTS))


def example_robot(name: str) -> ExampleRobot:
    """The entry of a robot. Raises ModelError for an unknown name or a robot without a URDF."""
    loader = _loader_class(name)
    relative = Path(loader.path) / loader.urdf_subpath / loader.urdf_filename
    if not loader.urdf_filename:
        raise ModelError(
            f"example robot {name!r} is described by an SDF file ({loader.sdf_filename}), "
            "and hovi reads URDF: choose another robot or convert it to URDF first."
        )
    try:
        folder = Path(_loaders().getModelPath(str(relative)))
    except OSError as error:
        raise ModelError(
            f"example-robot-data is installed without {relative}: install it again "
            "(pip install --force-reinstall example-robot-data)."
        ) from error
    srdf = folder / loader.path / loader.srdf_subpath / (loader.srdf_filename or "none")
    return ExampleRobot(
        name=name,
        urdf=folder / relative,
        package_dir=folder.parent.parent,
        free_flyer=bool(loader.free_flyer),
        srdf=srdf if srdf.is_file() else None,
        rotors=bool(loader.has_rotor_parameters),
    )


def build_in_code(name: str) -> tuple[pin.Model, pin.GeometryModel, pin.GeometryModel]:
    """Model, visual and collision geometry of a robot of BUILT_IN_CODE.

    Its loader takes joints from the model and leaves their shapes.
    """
    wrapper = _loader_class(name)().robot
    model = wrapper.model
    visual, collision = (_on(model, x) for x in (wrapper.visual_model, wrapper.collision_model))
    return model, visual, collision


def _on(model: pin.Model, geometry: pin.GeometryModel) -> pin.GeometryModel:
    """The shapes that a model's joints carry."""
    kept = pin.GeometryModel()
    for shape in geometry.geometryObjects:
        if shape.parentJoint < model.njoints:
            kept.addGeometryObject(shape)
    return kept


def rotor_armature(model: pin.Model, srdf: Path) -> tuple[tuple[str, float], ...]:
    """Reflected rotor inertias, I_rotor ratio^2 in [kg m^2], of the joints that an SRDF lists."""
    work = model.copy()
    pin.loadRotorParameters(work, str(srdf), False)
    reflected = work.rotorInertia * work.rotorGearRatio**2
    pairs = zip(work.joints[1:], work.names[1:], strict=True)
    values = ((name, float(reflected[joint.idx_v])) for joint, name in pairs if joint.nv == 1)
    return tuple((name, value) for name, value in values if value != 0.0)


def _loader_class(name: str) -> Any:
    robots = _loaders().ROBOTS
    if name not in robots:
        raise ModelError(
            f"there is no example robot {name!r}: {nearest(name, robots)} "
            "(A path to a URDF file ends in .urdf.)"
        )
    return robots[name]


def _loaders() -> Any:
    try:
        from example_robot_data import robots_loader
    except ImportError as error:
        raise ModelError(
            "robots by name need example-robot-data: pip install example-robot-data "
            "example-robot-data-loaders, or give the path of a URDF file."
        ) from error
    return robots_loader

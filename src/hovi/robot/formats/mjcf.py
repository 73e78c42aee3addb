"""Models from MJCF files, read as MuJoCo reads them.

Pinocchio's own reader takes the bodies of a second <worldbody> twice, leaves out bodies inside a
<frame> or without a name, and ignores what it does not know, so that another robot is planned for.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pinocchio as pin

from hovi.errors import ModelError, warn
from hovi.robot.findings.loops import open_loops
from hovi.robot.formats.mjcf_assets import Meshes
from hovi.robot.formats.mjcf_bodies import Bodies
from hovi.robot.formats.mjcf_defaults import Defaults, compiler_of
from hovi.robot.formats.mjcf_notes import loops, notes_of, require_known
from hovi.robot.formats.mjcf_shapes import shapes_of
from hovi.robot.formats.mjcf_text import MjcfError, read_mjcf
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class MjcfModel:
    """A model with its visual and collision shapes, or None, and notes on what is not read."""

    model: pin.Model
    visual: pin.GeometryModel | None
    collision: pin.GeometryModel | None
    notes: tuple[str, ...]


def model_of_mjcf(path: Path, free_flyer: bool, locked: Iterable[str] = ()) -> MjcfModel:
    """The model of an MJCF file, and a warning about ties of joints that it does not keep.

    free_flyer: asked for; an MJCF has it by an element <freejoint/>.
    locked: joints that will not move, whose ties need no warning.
    Raises ModelError for a file that is no MJCF, or has what hovi does not read.
    """
    if free_flyer:
        raise ModelError(
            "the base of an MJCF floats by <freejoint/> in its first body: put it into "
            f"{path.name!r}."
        )
    try:
        return _model(path, frozenset(locked))
    except MjcfError as error:
        raise ModelError(f"MJCF {path.name!r}: {error}") from error


def _model(path: Path, locked: frozenset[str]) -> MjcfModel:
    root = read_mjcf(path)
    require_known(root)
    compiler, defaults = compiler_of(root), Defaults(root)
    bodies = Bodies(root, compiler, defaults, Meshes(root, path.parent, compiler, defaults))
    if not bodies.bodies:
        raise MjcfError("it has no <body> in <worldbody>: a robot needs at least one.")
    bodies.model.name = root.get("model", "") or path.stem
    notes = [*notes_of(root, defaults), *bodies.notes]
    if bodies.world:
        notes.append(
            f"shapes of the world are no obstacles, give them by name: {len(bodies.world)}"
        )
    shapes = [shapes_of(bodies, kind) for kind in ("visual", "collision")]
    notes += [problem for _, problem in shapes if problem]
    if ties := loops(root, locked):
        warn(open_loops(f"MJCF {path.name!r}", "joints", ties))
    return MjcfModel(bodies.model, shapes[0][0], shapes[1][0], tuple(notes))

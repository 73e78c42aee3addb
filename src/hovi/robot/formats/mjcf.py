"""Models from MJCF files, as Pinocchio reads them."""

from __future__ import annotations

from pathlib import Path

import pinocchio as pin

from hovi.errors import ModelError
from hovi.system.files import reason, require_file

MAX_BYTES = 2**26
Geometry = tuple[pin.GeometryModel | None, pin.GeometryModel | None]


def model_of_mjcf(path: Path, free_flyer: bool) -> tuple[pin.Model, Geometry]:
    """The model, and its visual and collision geometry where Pinocchio finds the meshes.

    free_flyer: asked for; an MJCF has it by an element <freejoint/>.
    Raises ModelError for a file that Pinocchio does not read.
    """
    if free_flyer:
        raise ModelError(
            "the base of an MJCF floats by <freejoint/> in its first body: put it into "
            f"{path.name!r}."
        )
    try:
        require_file(path, MAX_BYTES)
        model = pin.buildModelFromMJCF(str(path))
    except OSError as error:
        raise ModelError(f"cannot read the MJCF file {str(path)!r}: {reason(error)}.") from error
    except Exception as error:  # Pinocchio's own, of several kinds
        raise ModelError(
            f"Pinocchio does not read the MJCF {path.name!r}: {_cause(error)}."
        ) from error
    model.name = model.name or path.stem
    kinds = pin.GeometryType.VISUAL, pin.GeometryType.COLLISION
    return model, (_geometry(model, path, kinds[0]), _geometry(model, path, kinds[1]))


def _geometry(model: pin.Model, path: Path, kind: pin.GeometryType) -> pin.GeometryModel | None:
    try:
        return pin.buildGeomFromMJCF(model, str(path), kind)
    except Exception:  # such as a mesh that is not there
        return None


def _cause(error: Exception) -> str:
    """What Pinocchio says, without the place in its sources."""
    return " ".join(str(error).rpartition("message:")[2].split()).removesuffix(".")

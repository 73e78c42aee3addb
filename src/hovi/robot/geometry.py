"""The geometry of a robot, loaded on first access so that planning reads no mesh.

Mesh names are untrusted input: each file must lie inside its own package folder (or, for plain
paths, inside the URDF's folder, the ROS package around it, or one of `package_dirs`), and so must
every file that a mesh names. A shape whose mesh is missing or lies outside is left out and the
reason is recorded; the robot stays usable. Meshes that a motion's file stores are taken from there.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError
from hovi.robot.example_robots import example_robot
from hovi.robot.findings.meshes import NOWHERE
from hovi.robot.formats.packages import holds_all_files, package_name
from hovi.robot.meshes.mesh_shape import mesh_shape
from hovi.robot.meshes.stored_meshes import Packing, StoredMesh, StoredMeshes, content_hash
from hovi.robot.model import build_full_model, couplings_in, locked_and_coupled
from hovi.robot.source import RobotSource
from hovi.robot.urdf.check import checked_urdf
from hovi.robot.urdf.mesh_files import check_mesh, check_stored, is_inside, shown_textures
from hovi.robot.urdf.normalize import make_plain
from hovi.system.dataclass import dataclass
from hovi.system.files import reason

MAX_ALL_MESHES = 256_000_000
"""Largest sum of the bytes of all meshes, each counted as often as it is used."""

ShapeOf = Callable[[Path, bytes, Sequence[float]], coal.CollisionGeometry]
"""The shape of a mesh from its path, content and scale; it raises ModelError."""


@dataclass(frozen=True, eq=False)
class MeshShape:
    """A mesh of a robot as a shape, and where it is from.

    path: of the file. scale: factors of the coordinates, (3,). size: of the file, in bytes.
    """

    shape: coal.CollisionGeometry
    path: str
    scale: npt.NDArray[np.float64]
    size: int


Meshes = dict[tuple[str, int], MeshShape]
"""The meshes of a URDF by the name of their link and their number among its shapes."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """The loaded geometry, or None, and a sentence about what is missing, or ""."""

    geometry: pin.GeometryModel | None
    problem: str


def load_shapes(source: RobotSource, kind: str, shape_of: ShapeOf = mesh_shape) -> Shapes:
    """The "visual" or "collision" geometry of a source, with its joints locked and coupled.

    shape_of: makes the shape of a mesh, of its triangles by default. Shapes that have the same mesh
        and scale share it.
    """
    if source.urdf is None:
        return Shapes(None, f"robot {source.reference!r} was given without {kind} geometry.")
    text, meshes, problems = _without_meshes(source, kind, shape_of)
    geometry_type = pin.GeometryType.VISUAL if kind == "visual" else pin.GeometryType.COLLISION
    model = build_full_model(source)
    try:
        geometry = pin.buildGeomFromUrdfString(model, text, geometry_type)
    except (ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        return Shapes(None, f"{kind} shapes of {source.reference!r} cannot be read: {reason}.")
    _put_in(meshes, geometry, model)
    _, (geometry,) = locked_and_coupled(model, [geometry], source.held, couplings_in(source))
    problem = _sentence(source, kind, problems)
    return Shapes(geometry if geometry.ngeoms or not problems else None, problem)


def find_mesh(filename: str, source: RobotSource, drawn: bool = False) -> tuple[Path, bytes]:
    """The file of a mesh, and its content.

    drawn: whether its textures are needed, too.
    Raises ModelError if it does not exist, cannot be used, if it or a file that it names is outside
    its folder, or if it is not the file with which the motion was saved.
    """
    stored = source.meshes
    if stored.keeps(filename):
        mesh, path = stored.meshes[filename], Path(stored.paths[filename])
        content = stored.content(mesh.sha256)
        check_stored(path, content, mesh.textures, drawn)
        return path, content
    path, content = _find_file(filename, source, drawn)
    if filename in stored.meshes and stored.meshes[filename].sha256 != content_hash(content):
        raise ModelError(
            f"mesh {_short(filename)} in {str(path.parent)!r} is another file than the one of the "
            "motion: name the folder of that one in package_dirs, or load the robot and plan again."
        )
    return path, content


def _find_file(filename: str, source: RobotSource, drawn: bool) -> tuple[Path, bytes]:
    """The same for a mesh that is not stored in a motion's file."""
    try:
        candidates = list(_candidates(filename, source))
        for root, path in candidates:
            if holds_all_files(root):
                raise ModelError(
                    f"mesh {_short(filename)} is looked for in {str(root)!r}, which holds the "
                    "files of every user: put the URDF and its meshes into a folder of their own."
                )
            if not is_inside(path, root):
                raise ModelError(
                    f"mesh {_short(filename)} lies outside {str(root)!r}: mesh names must stay "
                    "inside their package; to allow another folder, name it in package_dirs."
                )
            if path.is_file():
                return path, check_mesh(path, root, drawn)
    except (OSError, RuntimeError, ValueError) as error:  # too long, a loop of links, a NUL
        why = reason(error) if isinstance(error, OSError) else "no file can have that path"
        raise ModelError(f"mesh {_short(filename)} cannot be looked for: {why}.") from error
    known = filename in source.meshes.meshes
    left = " is not in the file of its motion, whose meshes are too large, and" if known else ""
    raise ModelError(f"mesh {_short(filename)}{left} was not found in {_places(candidates)}.")


def stored_meshes(sources: Iterable[RobotSource]) -> dict[str, StoredMeshes]:
    """The meshes of robots for the file of their motion, by the sha256 of their URDFs.

    Of each robot all visual ones with their textures are kept, then all collision ones, as far as
    there is room; of the others, names and hashes. Robots that are found by a name have none.
    """
    packing = Packing()
    tables = {
        source.sha256 or "": _stored(source, packing) for source in sources if source.kind == "urdf"
    }
    return {urdf: StoredMeshes(each, packing.packed) for urdf, each in tables.items() if each}


def _stored(source: RobotSource, packing: Packing) -> dict[str, StoredMesh]:
    """The meshes of a robot that can be used, by name. packing: gets their contents."""
    robot, found = checked_urdf(source.urdf or "", source.reference), dict[str, StoredMesh]()
    for kind in ("visual", "collision"):
        meshes = robot.iterfind(f"link/{kind}/geometry/mesh")
        for name in dict.fromkeys(mesh.get("filename", "") for mesh in meshes):
            with suppress(ModelError, OSError):
                if name not in found:
                    content, textures = _contents(name, source, kind == "visual")
                    hashes = {each: packing.add(texture) for each, texture in textures.items()}
                    found[name] = StoredMesh(packing.add(content), hashes)
        packing.keep()
    return {**source.meshes.meshes, **found}


def _contents(name: str, source: RobotSource, drawn: bool) -> tuple[bytes, dict[str, bytes]]:
    """A mesh, and the textures that a page shows by their names in it. Raises ModelError."""
    path, content = find_mesh(name, source, drawn)
    textures = shown_textures(path, content) if drawn else []
    if source.meshes.keeps(name):
        hashes = source.meshes.meshes[name].textures
        return content, {each: source.meshes.content(hashes[each]) for each in textures}
    return content, {each: (path.parent / each).read_bytes() for each in textures}


def _candidates(filename: str, source: RobotSource) -> Iterator[tuple[Path, Path]]:
    """(folder that must contain the mesh, path of the mesh), in search order."""
    scheme, _, rest = filename.rpartition("://")
    if scheme in ("package", "model"):
        rest = rest.lstrip("/")
        package, _, rest = rest.partition("/")
        for folder in _package_folders(package, source):
            yield folder, Path(os.path.normpath(folder / rest))
        return
    path = Path(rest)
    pairs = [(Path(folder), Path(folder)) for folder in source.package_dirs]
    if source.folder:
        pairs.insert(0, (_package_root(Path(source.folder)), Path(source.folder)))
    if path.is_absolute():
        inside = [pair for pair in pairs if is_inside(path, pair[0])]
        pairs = inside or pairs[:1]
    for root, folder in pairs:
        yield root.absolute(), Path(os.path.normpath(folder.absolute() / path))


def _package_root(folder: Path) -> Path:
    """The folder of the ROS package that a folder belongs to, or the folder itself."""
    return next((p for p in (folder, *folder.parents) if (p / "package.xml").is_file()), folder)


def _package_folders(package: str, source: RobotSource) -> Iterator[Path]:
    """Folders of a package, by their names: in the package folders, or around the URDF file."""
    for parent in _package_dirs(source):
        yield parent.absolute() / package
        if parent.name == package:
            yield parent.absolute()
    if source.folder:
        # Any other folder above may be a home folder, and its files nobody's to show.
        folder = Path(source.folder).absolute()
        around = (p for p in folder.parents if (p / "package.xml").is_file())
        yield from (p for p in (folder, *around) if package in (p.name, package_name(p)))


def _package_dirs(source: RobotSource) -> list[Path]:
    folders = [Path(folder) for folder in source.package_dirs]
    if source.kind == "example":
        try:
            folders.append(example_robot(source.reference).package_dir)
        except ModelError:
            return folders
    return folders


def _without_meshes(
    source: RobotSource, kind: str, shape_of: ShapeOf
) -> tuple[str, Meshes, list[str]]:
    """The URDF with a box in place of every mesh, the meshes, and why other shapes are left out."""
    robot = checked_urdf(source.urdf or "", source.reference)
    _drop_textures(robot)
    problems, meshes, room = list[str](), Meshes(), MAX_ALL_MESHES
    known = dict[tuple[str, str], MeshShape]()
    for link in robot.iterfind("link"):
        name, kept = link.get("name", ""), 0
        for shape in link.findall(kind):
            try:
                if (mesh := shape.find("geometry/mesh")) is not None:
                    key = mesh.get("filename", ""), mesh.get("scale", "1 1 1")
                    if key in known:
                        _require_room(Path(key[0]), known[key].size, room)
                    else:
                        known[key] = _read(*key, source, kind == "visual", shape_of, room)
                    meshes[name, kept] = known[key]
                    room -= known[key].size
            except ModelError as error:
                problems.append(f"link {name!r}: {error}")
                link.remove(shape)
            else:
                kept += 1
    _replace_meshes(robot)
    make_plain(robot)
    return ElementTree.tostring(robot, encoding="unicode"), meshes, problems


def _replace_meshes(robot: ElementTree.Element) -> None:
    for geometry in robot.iter("geometry"):
        for mesh in geometry.findall("mesh"):
            geometry.remove(mesh)
            ElementTree.SubElement(geometry, "box", size="1 1 1")


def _put_in(meshes: Meshes, geometry: pin.GeometryModel, model: pin.Model) -> None:
    """Replace the boxes that stand for meshes. Shapes are numbered within their link."""
    counts = Counter[str]()
    for item in geometry.geometryObjects:
        link = str(model.frames[item.parentFrame].name)
        if (mesh := meshes.get((link, counts[link]))) is not None:
            item.geometry, item.meshPath, item.meshScale = mesh.shape, mesh.path, mesh.scale
        counts[link] += 1


def _drop_textures(robot: ElementTree.Element) -> None:
    """Remove the textures of materials, which no page shows, so that nothing opens their files."""
    for material in [*robot.iter("material")]:
        for texture in material.findall("texture"):
            material.remove(texture)
    for material in robot.findall("material"):
        if material.find("color") is None:
            robot.remove(material)


def _read(
    filename: str, scale: str, source: RobotSource, drawn: bool, shape_of: ShapeOf, room: int
) -> MeshShape:
    """The shape of a <mesh> with these attributes. room: see _require_room. Raises ModelError."""
    path, content = find_mesh(filename, source, drawn)
    _require_room(path, len(content), room)
    factors = [float(word) for word in scale.split()]
    return MeshShape(shape_of(path, content, factors), str(path), np.array(factors), len(content))


def _require_room(path: Path, size: int, room: int) -> None:
    """Raise ModelError for a mesh with more bytes than there is room for."""
    if size > room:
        largest = f"{MAX_ALL_MESHES / 1e6:.0f} MB"
        raise ModelError(f"mesh {path.name!r} makes the meshes of all shapes exceed {largest}.")


def _sentence(source: RobotSource, kind: str, problems: list[str]) -> str:
    if not problems:
        return ""
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return f"robot {source.reference!r} lacks {kind} shapes: {problems[0]}{more}"


def _short(filename: str) -> str:
    return repr(filename if len(filename) <= 200 else f"{filename[:100]}...{filename[-97:]}")


def _places(candidates: list[tuple[Path, Path]]) -> str:
    if not candidates:
        return f"{NOWHERE}; give package_dirs=[the folder of the package] or --package-dir"
    return ", ".join(repr(root) for root in dict.fromkeys(str(root) for root, _ in candidates))

"""Triangles of Collada files: the geometries of the scene, placed by its nodes."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np

from hovi.robot.meshes.polygons import triangulated
from hovi.robot.meshes.triangles import (
    Array,
    BrokenMeshError,
    Index,
    Triangles,
    floats,
    integers,
    require_few,
)
from hovi.system.dataclass import dataclass

MAX_DEPTH = 200
"""Largest depth of nested elements."""
MAX_NODES = 100_000
"""Largest number of nodes that are shown, each counted as often as it is."""
_LIBRARIES = "geometry", "node", "visual_scene", "controller", "material", "effect"
_GRAY = 0.8, 0.8, 0.8
_TRANSFORMS = "matrix", "translate", "rotate", "scale", "lookat", "skew"


@dataclass(frozen=True, eq=False)
class _Part:
    """Vertices (M, 3) and triangles (K, 3) of a geometry.

    materials: the symbols of its materials, with the number of triangles of each, in order. paint:
        the color of each triangle, (K, 3); None for a picture.
    """

    vertices: Array
    triangles: Index
    materials: tuple[tuple[str, int], ...] = ()
    paint: Array | None = None


def read_collada(content: bytes) -> Triangles:
    """The triangles of a Collada file. Raises BrokenMeshError."""
    return _Document(_parsed(content)).triangles()


def painted_collada(content: bytes) -> tuple[Triangles, Array | None]:
    """The triangles, and the color of each, (K, 3), from 0 to 1; None if one has a picture.

    Raises BrokenMeshError.
    """
    document = _Document(_parsed(content))
    triangles = document.triangles()
    paints = [each.paint for each in document.found]
    known = [each for each in paints if each is not None]
    return triangles, np.concatenate(known) if len(known) == len(paints) else None


def _parsed(content: bytes) -> Element:
    """The root element; names of elements lose their namespace."""
    builder, depth = ElementTree.TreeBuilder(), 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise BrokenMeshError(f"has elements nested more than {MAX_DEPTH} deep: simplify it.")
        builder.start(tag.rpartition("}")[2], attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag.rpartition("}")[2])

    def doctype(*_: object) -> None:
        raise BrokenMeshError("has a DOCTYPE, which no mesh needs: delete it.")

    parser = expat.ParserCreate(namespace_separator="}")
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, doctype
    try:
        parser.Parse(content, True)
    except (expat.ExpatError, LookupError, ValueError) as error:  # or an unknown encoding
        if isinstance(error, BrokenMeshError):
            raise
        raise BrokenMeshError(f"is not well-formed XML: {error}.") from error
    return builder.close()


class _Document:
    """The elements of a Collada file by their identifiers."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.by_id = {
            (element.tag, element.get("id", "")): element
            for element in root.iter()
            if element.tag in _LIBRARIES and element.get("id")
        }
        self.parts: dict[str, list[_Part]] = {}
        self.found: list[_Part] = []
        self.nodes = self.count = 0

    def triangles(self) -> Triangles:
        """All triangles of the scene."""
        shown = self.root.find("scene/instance_visual_scene")
        if shown is None:
            raise BrokenMeshError("shows no scene: it needs <instance_visual_scene>.")
        unit = self.root.find("asset/unit")
        meter = 1.0 if unit is None else float(_numbers(unit.get("meter", "1"), 1)[0])
        scene = self._target(shown, "visual_scene")
        for node in scene.iterfind("node"):
            self._place(node, meter * np.eye(4)[:3], ())
        shifts = np.cumsum([0, *(len(part.vertices) for part in self.found)])
        vertices = [part.vertices for part in self.found] or [np.empty((0, 3))]
        pairs = zip(self.found, shifts, strict=False)
        corners = [part.triangles + shift for part, shift in pairs] or [np.empty((0, 3), np.int64)]
        return Triangles(np.concatenate(vertices), np.concatenate(corners))

    def _target(self, instance: Element, tag: str) -> Element:
        """The element that an instance names. Raises BrokenMeshError if there is none."""
        name = instance.get("url", "")
        target = self.by_id.get((tag, name.removeprefix("#")))
        if target is None or not name.startswith("#"):
            raise BrokenMeshError(
                f"shows {name[:60]!r}, and has no <{tag}> of that id: export it again."
            )
        return target

    def _place(self, node: Element, placement: Array, above: tuple[Element, ...]) -> None:
        """Add the triangles of a node. placement: of its parent, (3, 4). above: its ancestors."""
        self.nodes += 1
        if any(node is each for each in above):
            raise BrokenMeshError(
                f"has a node {node.get('id', '')[:60]!r} that is inside itself: export it again."
            )
        if self.nodes > MAX_NODES or len(above) > MAX_DEPTH:
            raise BrokenMeshError(
                f"shows more than {MAX_NODES:,} nodes, or nodes nested more than {MAX_DEPTH} "
                "deep: simplify it."
            )
        placement = _product(placement, node)
        above = (*above, node)
        for child in node:
            if child.tag == "node":
                self._place(child, placement, above)
            elif child.tag == "instance_node":
                self._place(self._target(child, "node"), placement, above)
            elif child.tag in ("instance_geometry", "instance_controller"):
                self._add(self._geometry(child), placement, child)

    def _geometry(self, instance: Element) -> Element:
        """The geometry of an instance, also one that a skin or a morph deforms."""
        if instance.tag == "instance_geometry":
            return self._target(instance, "geometry")
        controller = self._target(instance, "controller")
        skin = next((each for each in controller if each.tag in ("skin", "morph")), None)
        source = "" if skin is None else skin.get("source", "")
        return self._target(Element("instance", url=source), "geometry")

    def _add(self, geometry: Element, placement: Array, instance: Element) -> None:
        name = geometry.get("id", "")
        if name not in self.parts:
            self.parts[name] = [_part(mesh) for mesh in geometry.iterfind("mesh")]
        for part in self.parts[name]:
            self.count += len(part.triangles)
            require_few(self.count)
            with np.errstate(over="ignore", invalid="ignore"):  # coordinates are checked later
                vertices = part.vertices @ placement[:, :3].T + placement[:, 3]
            paint = self._paint(part, instance)
            # a mirror turns the triangles inside out
            mirrored = np.linalg.det(placement[:, :3]) < 0
            triangles = part.triangles[:, ::-1] if mirrored else part.triangles
            self.found.append(_Part(vertices, triangles, part.materials, paint))

    def _paint(self, part: _Part, instance: Element) -> Array | None:
        """The colors of the triangles of a part, (K, 3), where an instance shows it."""
        bound = {
            each.get("symbol", ""): each.get("target", "").removeprefix("#")
            for each in instance.iterfind("bind_material/technique_common/instance_material")
        }
        found = [self._color(bound.get(symbol, symbol)) for symbol, _ in part.materials]
        colors = [each for each in found if each is not None]
        if len(colors) < len(found):
            return None
        counts = [count for _, count in part.materials]
        return np.repeat(np.array(colors, dtype=float).reshape(-1, 3), counts, axis=0)

    def _color(self, material: str) -> tuple[float, ...] | None:
        """The diffuse color of a material; None for a picture, gray for one that is not there."""
        effect = self.by_id.get(("material", material))
        given = None if effect is None else effect.find("instance_effect")
        name = "" if given is None else given.get("url", "").removeprefix("#")
        shading = self.by_id.get(("effect", name))
        if shading is None:
            return _GRAY
        diffuse = list(shading.iter("diffuse"))
        if any(each.find("texture") is not None for each in diffuse):
            return None
        texts = [text for each in diffuse if (text := each.findtext("color")) is not None]
        return tuple(np.clip(_numbers(texts[0], 4)[:3], 0.0, 1.0)) if texts else _GRAY


def _part(mesh: Element) -> _Part:
    """The triangles of a mesh in its own frame."""
    sources = {each.get("id", ""): each for each in mesh.iterfind("source")}
    positions = {
        each.get("id", ""): given.get("source", "").removeprefix("#")
        for each in mesh.iterfind("vertices")
        for given in each.iterfind("input[@semantic='POSITION']")
    }
    points: dict[str, Array] = {}
    found, at, vertices = [np.empty((0, 3), np.int64)], 0, [np.empty((0, 3))]
    materials = []
    for primitive in mesh:
        if primitive.tag not in _PRIMITIVES:
            continue
        name, index, width = _inputs(primitive)
        source = sources.get(positions.get(name, ""))
        if source is None:
            raise BrokenMeshError(f"has <{primitive.tag}> without positions: export it again.")
        if name not in points:
            points[name] = _points(source)
        counts, corners = _PRIMITIVES[primitive.tag](primitive, width)
        found.append(at + triangulated(points[name], counts, corners[index::width]))
        materials.append((primitive.get("material", ""), len(found[-1])))
        vertices.append(points[name])
        at += len(points[name])
    return _Part(np.concatenate(vertices), np.concatenate(found), tuple(materials))


def _inputs(primitive: Element) -> tuple[str, int, int]:
    """The name of a primitive's vertices, where their index is, and how many each corner has."""
    inputs = [(each, _offset(each)) for each in primitive.iterfind("input")]
    named = [(each, at) for each, at in inputs if each.get("semantic") == "VERTEX"]
    if not named:
        raise BrokenMeshError(f"has <{primitive.tag}> without vertices: export it again.")
    vertex, at = named[0]
    return vertex.get("source", "").removeprefix("#"), at, 1 + max(at for _, at in inputs)


def _offset(given: Element) -> int:
    (offset,) = _counts(given.get("offset", "0"), 1)
    if not 0 <= offset < 64:
        raise BrokenMeshError(f"has an <input> with offset {offset}: export it again.")
    return int(offset)


def _points(source: Element) -> Array:
    """The positions in a source, (M, 3), by its accessor."""
    array, accessor = source.find("float_array"), source.find("technique_common/accessor")
    if array is None or accessor is None:
        raise BrokenMeshError("has positions without <float_array> or <accessor>: export it again.")
    values = floats(_text(array))
    (declared,) = _counts(array.get("count", str(len(values))), 1)
    count, offset, stride = (
        int(_counts(accessor.get(key, default), 1)[0])
        for key, default in (("count", "0"), ("offset", "0"), ("stride", "1"))
    )
    names = [each.get("name", "") for each in accessor.iterfind("param")]
    columns = [names.index(axis) if axis in names else k for k, axis in enumerate("XYZ")]
    needed = offset + stride * (count - 1) + max(columns) + 1 if count else 0
    if declared != len(values) or min(count, offset) < 0 or stride < 3 or needed > len(values):
        raise BrokenMeshError(
            f"declares {count:,} positions and has {len(values):,} numbers: export it again."
        )
    rows = offset + stride * np.arange(count)
    return np.asarray(values[rows[:, None] + np.array(columns)])


# Corners of primitives: numbers of corners of each face, and indices of all inputs of all corners.

Faces = tuple[Index, Index]


def _triangles(primitive: Element, width: int) -> Faces:
    corners = _joined(primitive)
    return _of_length(corners, width, np.full(_declared(primitive), 3))


def _polylist(primitive: Element, width: int) -> Faces:
    counted = primitive.find("vcount")
    counts = integers(b"" if counted is None else _text(counted))
    if len(counts) != _declared(primitive) or (counts < 0).any():
        raise BrokenMeshError("has a <polylist> with another number of faces than it declares.")
    return _of_length(_joined(primitive), width, counts)


def _polygons(primitive: Element, width: int) -> Faces:
    if primitive.find("ph") is not None:
        raise BrokenMeshError("has polygons with holes: export it as triangles.")
    faces = [integers(_text(each)) for each in primitive.iterfind("p")]
    counts = np.array([len(face) // width for face in faces], dtype=np.int64)
    return _of_length(np.concatenate([np.empty(0, np.int64), *faces]), width, counts)


def _fans(primitive: Element, width: int) -> Faces:
    return _runs(primitive, width, lambda k: (np.zeros_like(k), k + 1, k + 2))


def _strips(primitive: Element, width: int) -> Faces:
    return _runs(primitive, width, lambda k: (k + k % 2, k + 1 - k % 2, k + 2))


def _runs(primitive: Element, width: int, corners: Callable[[Index], tuple[Index, ...]]) -> Faces:
    """The triangles of fans or strips. corners: of triangle k, as rows of one <p>."""
    found = [np.empty((0, width), np.int64)]
    for each in primitive.iterfind("p"):
        rows = integers(_text(each))
        if len(rows) % width:
            raise BrokenMeshError(f"has {len(rows):,} indices in place of {width} a corner.")
        k = np.arange(max(len(rows) // width - 2, 0))
        found.append(rows.reshape(-1, width)[np.stack(corners(k), axis=1).reshape(-1)])
    indices = np.concatenate(found)
    return np.full(len(indices) // 3, 3), indices.reshape(-1)


_PRIMITIVES = {"triangles": _triangles, "polylist": _polylist, "polygons": _polygons}
_PRIMITIVES |= {"trifans": _fans, "tristrips": _strips}


def _joined(primitive: Element) -> Index:
    return integers(b" ".join(_text(each) for each in primitive.iterfind("p")))


def _declared(primitive: Element) -> int:
    count = int(_counts(primitive.get("count", "0"), 1)[0])
    if count < 0:
        raise BrokenMeshError(f"declares {count} faces: export it again.")
    require_few(count)
    return count


def _of_length(corners: Index, width: int, counts: Index) -> Faces:
    """Faces whose indices are as many as their corners need. Raises BrokenMeshError."""
    if len(corners) != width * sum(counts.tolist()):
        raise BrokenMeshError(
            f"has faces of {sum(counts.tolist()):,} corners, and {len(corners):,} indices in place "
            f"of {width} each: export it again."
        )
    return counts, corners


# Transformations of nodes


def _product(placement: Array, node: Element) -> Array:
    """The placement of a node, (3, 4): the product of its parent's and of its own transforms."""
    for each in node:
        if each.tag in _TRANSFORMS:
            with np.errstate(over="ignore", invalid="ignore"):
                placement = placement @ _transform(each)
    return placement


def _transform(element: Element) -> Array:
    """A transformation as a matrix, (4, 4)."""
    matrix, text = np.eye(4), _text(element)
    if element.tag == "matrix":
        matrix = _numbers(text, 16).reshape(4, 4)
    elif element.tag == "translate":
        matrix[:3, 3] = _numbers(text, 3)
    elif element.tag == "scale":
        matrix[:3, :3] = np.diag(_numbers(text, 3))
    elif element.tag == "rotate":
        matrix[:3, :3] = _rotation(_numbers(text, 4))
    else:
        raise BrokenMeshError(f"has a node with <{element.tag}>: apply transformations first.")
    return matrix


def _rotation(values: Array) -> Array:
    """About an axis by an angle in degrees: x, y, z, angle."""
    x, y, z = axis = values[:3] / (np.linalg.norm(values[:3]) or 1.0)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    c, s = np.cos(np.deg2rad(values[3])), np.sin(np.deg2rad(values[3]))
    return np.asarray(c * np.eye(3) + s * cross + (1.0 - c) * np.outer(axis, axis))


def _text(element: Element) -> bytes:
    return (element.text or "").encode()


def _numbers(text: str | bytes, count: int) -> Array:
    """So many numbers. Raises BrokenMeshError for others."""
    found = floats(text.encode() if isinstance(text, str) else text)
    if len(found) != count:
        raise BrokenMeshError(f"has {len(found)} numbers where {count} are expected.")
    return found


def _counts(text: str, count: int) -> Index:
    found = integers(text.encode())
    if len(found) != count:
        raise BrokenMeshError(f"has {text[:40]!r} in place of an integer: export it again.")
    return found

"""Mutated meshes that name files inside and outside of their package, and what is read of them.

A mesh that loads must have opened nothing outside, as the kernel reports it, and the page of a
motion must contain nothing from there.
"""

from __future__ import annotations

import base64
import xml.sax.saxutils
from collections.abc import Callable
from pathlib import Path
from random import Random

from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict, judge
from hovi.discrete.trajectory import Trajectory
from hovi.errors import ModelError
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.viewing.replay_session import replay
from oracles.offline_pages import parts_of
from oracles.opened_files import opened_files
from samples.cubic_motion import cubic_motion
from samples.meshes import NAMESPACE, collada, mesh_arm, obj

SECRET = b"a file outside of the package, which nobody may read"
INSIDE = ("in.png", "./in.png", "sub/in.png", "sub/../in.png", "inner.png", "in.mtl", "gone.png")
OUTSIDE = (
    *("../outside/secret.png", "sub/../../outside/secret.png", "{outside}/secret.png"),
    *("link.png", "links/secret.png", "./links/../links/secret.png", "sub/../link.png"),
    *("gone/link.png", "gone/sub/link.png"),
)
NAMED = b"mesh named "
"""Start of an input that is the name of a mesh in the URDF, and not its content."""
MESHES_INSIDE = ("rod.obj", "sub/../rod.obj", "package://package/rod.obj", "file://rod.obj")
MESHES_OUTSIDE = (
    *("../outside/secret.obj", "file://{outside}/secret.obj", "link.obj", "links/secret.obj"),
    *("package://{above}/outside/secret.obj", "package://outside/secret.obj", "loop.obj"),
    *("package://{above}/package/rod.obj", "file://package://../outside/secret.obj"),
    *("a" * 300 + ".obj", "a/" * 3_000 + "rod.obj", "package://" + "p" * 300 + "/rod.obj"),
)
TOKENS = (
    *(b"<init_from>", b"</init_from>", b"<image>", b"library_images", b"<!--", b"-->", b"../"),
    *(b"../outside/secret.png", b"link.png", b"mtllib ", b"\\\n", b"\\", b"\r", b"\0", b"\f"),
    *(b"xmlns", b"<![CDATA[", b"]]>", b"&#46;", b"<ref>", b"</ref>", b"1e99", b"NaN", b"-1"),
)


def mutate(random: Random) -> Mutant:
    """A mesh with names of files; those outside must be refused. {outside} is that folder."""
    is_collada = random.random() < 0.6
    kind = random.random()
    if kind < 0.1:
        name = random.choice(MESHES_OUTSIDE).encode()
        return Mutant(NAMED + name, "it lies outside, or nowhere")
    if kind < 0.15:
        name = random.choice((*MESHES_INSIDE, *MESHES_OUTSIDE)).encode()
        changed = mutated_bytes(name, random, (b"../", b"package://", b"/", b".."))
        return Mutant(NAMED + random.choice((name, changed)))
    if kind < 0.45:
        return Mutant(_mesh(random.choice(OUTSIDE), is_collada, random), "it names a file outside")
    content = _mesh(random.choice((*INSIDE, *INSIDE, *INSIDE, *OUTSIDE)), is_collada, random)
    return Mutant(mutated_bytes(content, random, TOKENS) if kind < 0.9 else content)


def _mesh(name: str, is_collada: bool, random: Random) -> bytes:
    if is_collada:
        element = random.choice(_ELEMENTS)(random.choice(_SPELLINGS)(name, random))
        return collada(element, random.choice((NAMESPACE, NAMESPACE, ""))).encode()
    line = random.choice(_LINES)(name)
    return obj(line).encode()


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Show it on a page; `folder` gets a package and a folder outside of it."""
    package, outside = folder / "package", folder / "outside"
    _prepare(package, outside)
    urdf = _named(mutant.content, package, outside) or _with_content(
        mutant.content, package, outside
    )
    page = folder / "page.html"
    page.unlink(missing_ok=True)
    opened: set[str] = set()

    def load() -> Robot:
        nonlocal opened
        robot = load_robot(urdf)
        with opened_files(outside) as opened:
            found = robot.visual, robot.collision
            if None not in found:
                replay(_motion(robot), html=page)
        if None in found and not opened:
            raise ModelError(robot.visual_problem or robot.collision_problem)
        return robot

    def error_in(robot: Robot) -> str:
        if opened:
            return f"it opens {sorted(opened)} outside of its package"
        return "the page has the content of a file outside" if _leaks(page) else ""

    return judge(load, error_in, mutant.reason)


def _named(content: bytes, package: Path, outside: Path) -> Path | None:
    """The URDF of a mesh with this name; None if the content is that of a mesh."""
    if not content.startswith(NAMED):
        return None
    name = content.removeprefix(NAMED).decode(errors="replace")
    name = name.replace("{outside}", str(outside)).replace("{above}", package.parent.name)
    (package / "rod.obj").write_text(obj(""))
    return mesh_arm(package, xml.sax.saxutils.escape(name, {'"': "&quot;"}))


def _with_content(content: bytes, package: Path, outside: Path) -> Path:
    """The URDF of a mesh with this content."""
    is_collada = content.lstrip()[:1] == b"<"
    mesh = package / ("rod.dae" if is_collada else "rod.obj")
    mesh.write_bytes(content.replace(b"{outside}", str(outside).encode()))
    return mesh_arm(package, mesh.name)


def _prepare(package: Path, outside: Path) -> None:
    if package.exists():
        return
    (package / "sub").mkdir(parents=True)
    outside.mkdir()
    for name in ("secret.png", "secret.mtl"):
        (outside / name).write_bytes(SECRET)
    (outside / "secret.obj").write_text(obj(""))
    (package / "link.obj").symlink_to(outside / "secret.obj")
    (package / "loop.obj").symlink_to("loop.obj")
    for name in ("in.png", "sub/in.png", "in.mtl"):
        (package / name).write_bytes(b"newmtl a\nKd 1 0 0\n")
    (package / "inner.png").symlink_to("sub/in.png")
    (package / "link.png").symlink_to(outside / "secret.png")
    (package / "links").symlink_to(outside)


def _motion(robot: Robot) -> Trajectory:
    return cubic_motion(Scene(robot))[0]


def _leaks(page: Path) -> bool:
    """Whether the secret is on the page, in its messages or, in base64, in an image in them."""
    content = b"".join(parts_of(page.read_text()))
    assert b"set_object" in content, "the page has no messages"
    return SECRET in content or base64.b64encode(SECRET)[:60] in content


# Ways to write the same name


def _plain(name: str, random: Random) -> str:
    return xml.sax.saxutils.escape(name)


def _as_references(name: str, random: Random) -> str:
    if "{" in name:  # the placeholder of a folder
        return name
    return "".join(f"&#{ord(c)};" if random.random() < 0.3 else c for c in name)


def _as_data(name: str, random: Random) -> str:
    return f"<![CDATA[{name}]]>"


def _with_a_comment(name: str, random: Random) -> str:
    at = random.randint(name.find("}") + 1, len(name))
    return f"{name[:at]}<!-- c -->{name[at:]}"


def _with_an_element(name: str, random: Random) -> str:
    return f"{name}<x/>"


_SPELLINGS: tuple[Callable[[str, Random], str], ...] = (
    *(_plain, _plain, _as_references, _as_data, _with_a_comment, _with_an_element),
)
_ELEMENTS: tuple[Callable[[str], str], ...] = (
    *([lambda text: f"<init_from>{text}</init_from>"] * 3),
    lambda text: f"<init_from>in.png</init_from><init_from>{text}</init_from>",
    lambda text: f"<x_init_from_x>{text}</x_init_from_x>",
    lambda text: f'<c:init_from xmlns:c="c">{text}</c:init_from>',
    lambda text: f"<init_from><ref>{text}</ref></init_from>",
    lambda text: f"<image><init_from>{text}</init_from></image>",
)
_LINES: tuple[Callable[[str], str], ...] = (
    lambda name: f"mtllib {name}",
    lambda name: f"mtllib\t{name}",
    lambda name: f"o rod\nmtllib in.mtl\nmtllib {name}",
    lambda name: f"mtllib \\\n{name}",
    lambda name: f"mtl\\\nlib {name}",
    lambda name: f"mtllib \\\fx\n{name}",
    lambda name: "mtllib " + name.replace("/", "\\"),
    lambda name: f"mtllib in.mtl\rmtllib {name}",
)

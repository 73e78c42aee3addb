"""Random robots in MJCF that use every way of saying the same that the format has."""

from __future__ import annotations

from collections.abc import Callable
from random import Random


def mjcf(random: Random, meshes: bool = False) -> str:
    """The text of a valid file. meshes: whether it may name cube.stl beside it."""
    return _Writer(random, meshes).text()


class _Writer:
    def __init__(self, random: Random, meshes: bool) -> None:
        self.random, self.meshes, self.count = random, meshes, 0
        self.degrees = random.random() < 0.6
        self.autolimits = random.random() < 0.8
        self.sequence = random.choice(("xyz", "zyx", "XYZ", "ZyX", "xzx"))
        self.from_geoms = random.choice(("auto", "auto", "false", "true"))
        self.classes = ["", "a", "b"]

    def text(self) -> str:
        r = self.random
        settings = {
            **(
                {"angle": "degree" if self.degrees else "radian"}
                if r.random() < 0.8 or not self.degrees
                else {}
            ),
            **({"eulerseq": self.sequence} if self.sequence != "xyz" else {}),
            **({} if self.autolimits else {"autolimits": "false"}),
            **({} if self.from_geoms == "auto" else {"inertiafromgeom": self.from_geoms}),
            **({"balanceinertia": "true"} if r.random() < 0.3 else {}),
            **({"boundmass": "0.05"} if r.random() < 0.2 else {}),
            **({"boundinertia": "0.001"} if r.random() < 0.2 else {}),
            **({"settotalmass": "7"} if r.random() < 0.15 else {}),
            **({"inertiagrouprange": "0 3"} if r.random() < 0.2 else {}),
        }
        compiler = "".join(f' {key}="{value}"' for key, value in settings.items())
        worlds = "".join(
            f"<worldbody><light pos='0 0 3'/>{self.body(0, True)}</worldbody>"
            for _ in range(r.choice((1, 1, 2)))
        )
        asset = '<asset><mesh name="cube" file="cube.stl" scale="0.1 0.2 0.3"/></asset>'
        asset = asset if self.meshes else ""
        gravity = '<option gravity="0 0 -9.81"/>'
        return (
            f'<mujoco model="made"><compiler{compiler}/>{gravity}{self.defaults()}{asset}{worlds}'
            "</mujoco>"
        )

    def defaults(self) -> str:
        damping = f'<joint damping="{self.number(0, 2)}" armature="{self.number(0, 0.2)}"/>'
        return (
            f'<default>{damping}<geom density="{self.number(200, 2000)}"/><default class="a">'
            f'<joint type="slide" axis="0 1 0"/><geom type="box" size="0.1 0.2 0.3"/></default>'
            f'<default class="b"><joint range="{self.range()}" {self.limited()}/>'
            f'<geom mass="0.3" group="{self.random.choice((0, 2, 4))}"/></default></default>'
        )

    def body(self, depth: int, is_first: bool = False) -> str:
        r = self.random
        self.count += 1
        name = f"b{self.count}"
        child_class = f' childclass="{r.choice("ab")}"' if r.random() < 0.25 else ""
        joints = self.joints(is_first)
        inertial = self.inertial() if self.from_geoms == "false" or r.random() < 0.6 else ""
        geoms = "".join(self.geom() for _ in range(r.choice((1, 1, 2, 3))))
        if self.from_geoms == "true" or not inertial:  # a moving body needs a mass
            geoms += f'<geom type="box" size="0.1 0.05 0.2" mass="0.5" group="1" {self.pose()}/>'
        site = f'<site name="s{self.count}" {self.pose()}/>'
        children = "".join(
            self.body(depth + 1) for _ in range(r.choice((0, 1, 2)) if depth < 3 else 0)
        )
        if r.random() < 0.3:
            children = (
                f'<frame {self.pose()}>{children}<geom type="sphere" size="0.1" group="2"/></frame>'
            )
        inside = f"{joints}{inertial}{geoms}{site}{children}"
        return f'<body name="{name}" {self.pose()}{child_class}>{inside}</body>'

    def joints(self, is_first: bool) -> str:
        """A free joint of a body of the world, a ball joint, or up to three others."""
        r = self.random
        if is_first and r.random() < 0.3:
            form = r.choice(("<freejoint {}/>", '<joint {} type="free"/>'))
            return form.format(f'name="f{self.count}"')
        if r.random() < 0.1:
            return f'<joint name="j{self.count}" type="ball" class="main" {self.offset()}/>'
        return "".join(self.joint(k) for k in range(r.choice((0, 1, 1, 1, 2, 3)) or is_first))

    def joint(self, k: int) -> str:
        r = self.random
        name = f'name="j{self.count}_{k}"'
        kind = r.choice(("", "", 'type="hinge"', 'type="slide"'))
        parts = [name, kind]
        parts += [f'axis="{self.vector()}"'] if r.random() < 0.7 else []
        parts += [self.offset()]
        parts += [f'range="{self.range()}" {self.limited()}'] if r.random() < 0.5 else []
        parts += [f'ref="{self.number(-0.5, 0.5)}"'] if r.random() < 0.2 else []
        parts += [f'damping="{self.number(0, 1)}"'] if r.random() < 0.2 else []
        parts += [f'frictionloss="{self.number(0, 1)}"'] if r.random() < 0.2 else []
        parts += ['actuatorfrcrange="-5 5"'] if r.random() < 0.3 and self.autolimits else []
        parts += [f'class="{r.choice("ab")}"'] if r.random() < 0.2 else []
        return f"<joint {' '.join(parts)}/>"

    def inertial(self) -> str:
        a, b, c = sorted(self.random.uniform(0.04, 0.06) for _ in range(3))
        mass = f'mass="{self.number(0.1, 4)}"'
        if self.random.random() < 0.3:
            e = 0.1 * a
            return (
                f'<inertial pos="{self.vector()}" {mass} '
                f'fullinertia="{a:.6f} {b:.6f} {c:.6f} {e:.6f} {-e:.6f} {e / 2:.6f}"/>'
            )
        return f'<inertial {self.pose(True)} {mass} diaginertia="{a:.6f} {b:.6f} {c:.6f}"/>'

    def geom(self) -> str:
        r, x = self.random, lambda: self.number(0.05, 0.3)
        kind = r.choice(("sphere", "capsule", "cylinder", "box", "ellipsoid", "mesh", ""))
        mass = r.choice(("", "", f'mass="{self.number(0, 2)}"', f'density="{self.number(0, 900)}"'))
        if kind == "mesh":
            kind = "mesh" if self.meshes else "sphere"
        if kind == "mesh":
            return f'<geom type="mesh" mesh="cube" {self.pose()} {mass}/>'
        if kind in ("capsule", "cylinder", "box", "ellipsoid") and r.random() < 0.3:
            ends = f"{self.vector()} {self.vector()}"
            return f'<geom type="{kind}" fromto="{ends}" size="{x()}" {mass}/>'
        name = f'type="{kind}"' if kind else ""
        return f'<geom {name} size="{x()} {x()} {x()}" {self.pose()} {mass}/>'

    def pose(self, always: bool = False) -> str:
        """A position and an orientation, one of them or none."""
        r = self.random
        position = f'pos="{self.vector()}"' if always or r.random() < 0.7 else ""
        ways: tuple[Callable[[], str], ...] = (
            lambda: "",
            lambda: f'quat="{self.vector()} {self.number(0.1, 3)}"',
            lambda: f'euler="{" ".join(self.angle() for _ in range(3))}"',
            lambda: f'axisangle="{self.vector()} {self.angle()}"',
            lambda: f'xyaxes="{self.vector()} {self.vector()}"',
            lambda: f'zaxis="{self.vector()}"',
        )
        return f"{position} {r.choice(ways)()}"

    def offset(self) -> str:
        return f'pos="{self.vector()}"' if self.random.random() < 0.4 else ""

    def limited(self) -> str:
        return "" if self.autolimits else 'limited="true"'

    def range(self) -> str:
        scale = 57.0 if self.degrees else 1.0
        return f"{self.number(-2 * scale, -0.1)} {self.number(0.1, 2 * scale)}"

    def angle(self) -> str:
        return self.number(-170, 170) if self.degrees else self.number(-3, 3)

    def vector(self) -> str:
        return " ".join(self.number(-1, 1) for _ in range(3))

    def number(self, low: float, high: float) -> str:
        return f"{self.random.uniform(low, high):.4f}"

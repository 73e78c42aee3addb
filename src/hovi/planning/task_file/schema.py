"""The keys of a scene file, with their types and descriptions.

The description of a field completes the message "`key` must be ...". Options of a plan that are a
single number, boolean or text become keys automatically; options of another form are defined here.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    Tag,
    create_model,
)

from hovi.checks.units import DURATION_IN_WORDS
from hovi.planning.obstacles.obstacle import GRASPED_KEYS
from hovi.planning.problem.arms.limit_set import LimitSetName
from hovi.planning.problem.notation.via_points import TIME_IN_WORDS
from hovi.planning.search.option_fields import SceneKey, option_infos
from hovi.planning.search.options import MAX_INTERVALS, PlanOptions

FORMAT = 2
"""The format of scene files. In files of format 1, without that key, links may meet unless
`self_collision` is said."""


def _kind(value: object) -> str:
    if isinstance(value, dict):
        return "<table>"
    return "<list>" if isinstance(value, list) else "<number>"


def _kind_or_text(value: object) -> str:
    return "<text>" if isinstance(value, str) else _kind(value)


Numbers = Annotated[list[FiniteFloat], Tag("<list>")]
ByJoint = Annotated[
    dict[str, Annotated[Annotated[FiniteFloat, Tag("<number>")] | Numbers, Discriminator(_kind)]],
    Tag("<table>"),
]
Coordinates = Annotated[Numbers | ByJoint, Discriminator(_kind)]
Configuration = Annotated[
    Numbers | ByJoint | Annotated[str, Tag("<text>")], Discriminator(_kind_or_text)
]

PositionBound = Annotated[
    Annotated[float, Tag("<number>")] | Annotated[list[float], Tag("<list>")],
    Discriminator(_kind),
]
PositionBounds = Annotated[
    Annotated[float, Tag("<number>")]
    | Annotated[list[PositionBound], Tag("<list>")]
    | Annotated[dict[str, PositionBound], Tag("<table>")],
    Discriminator(_kind),
]
_POSITION_BOUNDS = (
    "a positive number, a list with a positive number or a pair [lower, upper] for each joint, "
    "or a table of joint names"
)
Fraction = Annotated[str, Field(pattern=r"^ *[0-9.]+([eE][+-]?[0-9]+)? *% *$"), Tag("<text>")]
Bound = Annotated[
    Annotated[float, Tag("<number>")] | Annotated[list[float], Tag("<list>")] | Fraction,
    Discriminator(_kind_or_text),
]
JointBounds = Annotated[
    Annotated[float, Tag("<number>")]
    | Annotated[list[Bound], Tag("<list>")]
    | Annotated[dict[str, Bound], Tag("<table>")]
    | Fraction,
    Discriminator(_kind_or_text),
]
_BOUNDS = (
    "a positive number, a list with a positive number or a pair [lower, upper] for each joint, "
    'a text such as "50 %" of the limits of the base, or a table of joint names'
)


NumberAndUnit = Annotated[
    str, Field(pattern=r"^ *[0-9.]+([eE][+-]?[0-9]+)? *[a-z]+ *$"), Tag("<text>")
]
Seconds = Annotated[Annotated[float, Tag("<number>")] | NumberAndUnit, Discriminator(_kind_or_text)]
PositiveSeconds = Annotated[
    Annotated[FiniteFloat, Field(gt=0), Tag("<number>")] | NumberAndUnit,
    Discriminator(_kind_or_text),
]
Bounds = Annotated[list[Seconds], Field(min_length=2, max_length=2), Tag("<list>")]
Duration = Annotated[
    Annotated[float, Tag("<number>")] | NumberAndUnit | Bounds, Discriminator(_kind_or_text)
]
PositiveDuration = Annotated[
    Annotated[FiniteFloat, Field(gt=0), Tag("<number>")] | NumberAndUnit | Bounds,
    Discriminator(_kind_or_text),
]


class Table(BaseModel):
    """A table that takes no other keys and converts nothing."""

    # Tables of a file are compiled once, as parts of the whole file, and not each by itself, too.
    model_config = ConfigDict(extra="forbid", strict=True, defer_build=True)


_JOINTS = 'a list of joint names, or ["all"]'
_ACCELERATION = (
    "for a motion with a cost on the jerk: a list of finite numbers, one per velocity, or a table "
    "of joint names"
)


Direction = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)]


class AxisTable(Table):
    """axis of a frame's target."""

    frame: Direction = Field(description="a list of three finite numbers: a direction in the frame")
    world: Direction = Field(description="a list of three finite numbers: a direction in the world")


class EndTable(Table):
    """[start], [goal], or the goal of a table [[via]]: a state or the target of a frame."""

    q: Configuration | None = Field(
        default=None,
        description="a list of finite numbers, one per coordinate, a table of joint names, or the "
        "name of a pose",
    )
    v: Coordinates | None = Field(
        default=None,
        description="a list of finite numbers, one per velocity, or a table of joint names",
    )
    a: Coordinates | None = Field(default=None, description=_ACCELERATION)
    free_acceleration: list[str] = Field(default=[], description=_JOINTS)
    free: list[str] = Field(default=[], description=_JOINTS)
    free_velocity: list[str] = Field(default=[], description=_JOINTS)
    frame: str | None = Field(default=None, description="the name of a frame of the robot")
    position: Direction | None = Field(default=None, description="a list of three finite numbers")
    rpy: Direction | None = Field(
        default=None, description="a list of three finite numbers: roll, pitch and yaw in radians"
    )
    quaternion_xyzw: Quaternion | None = Field(
        default=None, description="a list of four finite numbers: x, y, z, w of a unit quaternion"
    )
    quaternion_wxyz: Quaternion | None = Field(
        default=None, description="a list of four finite numbers: w, x, y, z of a unit quaternion"
    )
    axis: AxisTable | None = Field(
        default=None, description="a table with two directions, `frame` and `world`"
    )
    within: Any = Field(default=None, description='a length, such as "10 mm", or a list of three')
    within_angle: Any = Field(default=None, description='an angle, such as "5 deg"')
    velocity: Direction | None = Field(
        default=None, description="a list of three finite numbers, in m/s"
    )
    angular_velocity: Direction | None = Field(
        default=None, description="a list of three finite numbers, in rad/s"
    )
    box_frame: str | None = Field(default=None, description="the name of a frame of the robot")


class StartTable(EndTable):
    """[start]."""


class GoalTable(EndTable):
    """[goal], or the goal of a table [[via]]."""

    turns: ByJoint = Field(
        default={}, description="a table of joint names with full turns of the first guess"
    )


def _with_q(given: Any) -> Any:
    """The table of an end from a configuration that is given by itself, as Python takes it."""
    if isinstance(given, list) and given and all(isinstance(each, dict) for each in given):
        return given
    if isinstance(given, str | list):
        return {"q": given}
    by_joint = isinstance(given, dict) and given and not given.keys() & GoalTable.model_fields
    return {"q": given} if by_joint else given


def _listed(given: Any) -> Any:
    """A list of one table that is given by itself."""
    return [given] if isinstance(given, dict) else given


Start = Annotated[StartTable, BeforeValidator(_with_q)]
Goal = Annotated[
    Annotated[
        Annotated[GoalTable, Tag("<table>")] | Annotated[list[GoalTable], Tag("<list>")],
        Discriminator(_kind),
    ]
    | None,
    BeforeValidator(_with_q),
]
Bare = list[FiniteFloat] | dict[str, FiniteFloat | list[FiniteFloat]] | str
"""A configuration by itself in place of the table of an end."""
_END = (
    "a list of finite numbers, a table of joint names, the name of a pose, or a table {} with q "
    "and, if moving, v, or with a frame and its target"
)
_FRAMES = "; or tables [{}], one for each of several frames at once"


class ViaTable(GoalTable):
    """[[via]]."""

    time: PositiveSeconds | Literal["free"] = Field(description=TIME_IN_WORDS)


class GraspedTable(Table):
    """[[grasped]]."""

    name: str = Field(default="grasped", description="the name of the object's link")
    frame: str = Field(description=GRASPED_KEYS["frame"])
    mass: FiniteFloat = Field(description=GRASPED_KEYS["mass"])
    shape: Any = Field(description=GRASPED_KEYS["shape"])
    position: Direction | None = Field(default=None, description="a list of three finite numbers")
    rpy: Direction | None = Field(
        default=None, description="a list of three finite numbers: roll, pitch and yaw in radians"
    )
    center: Direction | None = Field(default=None, description="a list of three finite numbers")
    inertia: list[FiniteFloat] | None = Field(
        default=None, description="a list of six finite numbers: Ixx, Iyy, Izz, Ixy, Ixz, Iyz"
    )
    may_touch: list[str] = Field(default=[], description="a list of obstacles and links")


class SegmentTable(Table):
    """[[segments]]: the segments of a sequence."""

    name: str = Field(default="", description="a text")
    duration: PositiveDuration = Field(description=DURATION_IN_WORDS)
    goal: Goal = Field(
        default=None,
        description=(_END + _FRAMES).format("[segments.goal]", "[segments.goal]"),
    )
    limits: Any = Field(
        default=None, description='"urdf", "soft", "none", the name of an arm or a table of limits'
    )
    keep: Annotated[list[dict[str, Any]], BeforeValidator(_listed)] = Field(
        default=[], description="tables [[segments.keep]] with a kind each"
    )
    grasped: Annotated[list[GraspedTable], BeforeValidator(_listed)] = Field(
        default=[], description="tables [[segments.grasped]] with frame, mass and shape"
    )
    effects: dict[str, dict[str, Any]] = Field(default={}, description="tables of effects")


class SchemeTable(Table):
    """[scheme]: either key fixes the grid."""

    name: str | None = Field(default=None, description='the name of a scheme, such as "galerkin-2"')
    intervals: int | None = Field(
        default=None,
        ge=1,
        le=MAX_INTERVALS,
        description=f"a whole number from 1 to {MAX_INTERVALS:,}",
    )


LimitsName = Literal["urdf", "soft", "none", LimitSetName]
"""The limits that have a name."""


class LimitsTable(Table):
    """[limits]."""

    base: LimitsName = Field(
        default="urdf", description='"urdf", "soft", "none" or the name of an arm, such as "panda"'
    )
    q: PositionBounds | None = Field(default=None, description=_POSITION_BOUNDS)
    v: JointBounds | None = Field(default=None, description=_BOUNDS)
    a: JointBounds | None = Field(default=None, description=_BOUNDS)
    tau: JointBounds | None = Field(default=None, description=_BOUNDS)
    jerk: JointBounds | None = Field(default=None, description=_BOUNDS)
    torque_rate: JointBounds | None = Field(default=None, description=_BOUNDS)
    power: PositionBounds | None = Field(default=None, description=_POSITION_BOUNDS)
    margin: FiniteFloat = Field(
        default=0.0, ge=0, lt=0.5, description="a fraction of the range, from 0 to below 0.5"
    )
    tolerance: FiniteFloat = Field(default=1e-6, gt=0, description="fraction of the range, above 0")


class ShapedTable(Table):
    """The keys of a file except for the options that are single values."""

    format: int = Field(
        default=1, ge=1, le=FORMAT, description=f"a whole number from 1 to {FORMAT}"
    )
    robot: str = Field(
        description="the path of a .urdf relative to this file, or a name of example-robot-data"
    )
    locked: Annotated[
        Annotated[list[str], Tag("<list>")] | Annotated[dict[str, FiniteFloat], Tag("<table>")],
        Discriminator(_kind),
    ] = Field(
        default=[], description="a list of joint names, or a table of joint names with positions"
    )
    package_dirs: list[str] = Field(
        default=[], description="a list of folders relative to this file"
    )
    srdf: str | None = Field(default=None, description="the path of an .srdf relative to this file")
    free_flyer: bool | None = Field(
        default=None, description="true or false; by default as the example robot's loader says"
    )
    mimic: bool = Field(default=False, description="true or false")
    tools: dict[str, dict[str, Any]] = Field(
        default={}, description="tables [tools.NAME] with a frame, and position and rpy in it"
    )
    passive: list[str] = Field(default=[], description="a list of joint names")
    begin: float = Field(default=0.0, allow_inf_nan=False, description="a time in seconds")
    duration: Duration | None = Field(default=None, description=DURATION_IN_WORDS)
    group: str | None = Field(
        default=None, description="the name of a group of joints in the robot's SRDF"
    )
    limits: Any = Field(
        default="urdf", description='"urdf", "soft", "none", the name of an arm or a table [limits]'
    )
    obstacles: Annotated[list[dict[str, Any]], BeforeValidator(_listed)] = Field(
        default=[], description="tables [[obstacles]], or one table [obstacles]"
    )
    grasped: Annotated[list[GraspedTable], BeforeValidator(_listed)] = Field(
        default=[],
        description="tables [[grasped]], or one table [grasped], with frame, mass and shape",
    )
    keep: Annotated[list[dict[str, Any]], BeforeValidator(_listed)] = Field(
        default=[], description="tables [[keep]], or one table [keep], with a kind each"
    )
    start: Start = Field(description=_END.format("[start]"))
    goal: Goal = Field(default=None, description=(_END + _FRAMES).format("[goal]", "[goal]"))
    segments: list[SegmentTable] = Field(
        default=[], description="tables [[segments]] with a duration and a goal each"
    )
    via: list[ViaTable] = Field(default=[], description="tables [[via]] with time and a goal")
    scheme: Annotated[
        Annotated[SchemeTable, Tag("<table>")] | Annotated[str, Tag("<text>")],
        Discriminator(_kind_or_text),
    ] = Field(
        default=SchemeTable(),
        description="a table [scheme] with name and intervals, or the name of a scheme",
    )
    intervals: int | None = Field(
        default=None,
        ge=1,
        le=MAX_INTERVALS,
        description=f"a whole number from 1 to {MAX_INTERVALS:,}",
    )
    tolerance: Any = Field(
        default=None, description='a number, or a text such as "0.1 mm" or "0.01 deg"'
    )
    effects: dict[str, dict[str, Any]] = Field(default={}, description="tables [effects.NAME]")


PLAIN: dict[str, SceneKey] = {
    name: known.key for name, known in option_infos(PlanOptions).items() if known.key is not None
}
"""The options that are single values in a file."""


_KINDS: dict[str, Any] = {
    "time_limit": PositiveSeconds | None,
    "guess": str,
    "self_collision": bool | None,
}
"""Types of options that the type of their default does not say."""


def _plain_field(name: str) -> tuple[Any, Any]:
    """The field of an option, with the type of its default and its bounds."""
    default, known = getattr(PlanOptions, name), option_infos(PlanOptions)[name]
    kind = FiniteFloat if isinstance(default, float) else _KINDS.get(name, type(default))
    must_be, least, most = PLAIN[name].must_be, known.least, known.most
    return kind, Field(default=default, description=must_be, ge=least, le=most)


_PLAIN_FIELDS: dict[str, Any] = {name: _plain_field(name) for name in PLAIN}
TaskTable: type[ShapedTable] = create_model(
    "TaskTable", __base__=ShapedTable, __doc__="The whole file.", **_PLAIN_FIELDS
)

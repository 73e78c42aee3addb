"""Invalid effects are refused in one sentence, in Python and in scene files."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from hovi.effects import (
    Armature,
    CasadiCost,
    Custom,
    Drag,
    DryFriction,
    Effect,
    EffortWeight,
    Gravity,
    JointLimitPotential,
    JointSprings,
    MovingBase,
    Payload,
    PowerCost,
    ReferenceCost,
    RunningCost,
    VelocityCost,
    ViscousFriction,
    Wrench,
)
from hovi.effects.expressions.formula import MAX_CHARACTERS, Number
from hovi.errors import SceneError
from hovi.planning.task_file.reading import load_task
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

TIP = "panda_hand_tcp"


def matrix(changes: dict[tuple[int, int], Number]) -> tuple[tuple[Number, ...], ...]:
    """The identity of the Panda's size with other entries."""
    return tuple(tuple(changes.get((i, j), float(i == j)) for j in range(7)) for i in range(7))


CASES: dict[str, tuple[Callable[[], Effect], str]] = {
    "no direction": (
        lambda: Gravity(9.8, (0.0, 0.0, 0.0)),
        "direction must be three finite numbers",
    ),
    "gravity upwards": (
        lambda: Gravity(-9.81),
        r"0 or more, got -9.81 .* upwards; .* `dir",
    ),
    "range of three": (
        lambda: JointLimitPotential({"panda_joint2": (0.0, 1.0, 2.0)}),  # type: ignore[dict-item]
        "range of 'panda_joint2' must be two numbers, got 3",
    ),
    "negative friction": (
        lambda: ViscousFriction({"panda_joint2": -0.1}),
        r"viscous_friction': coefficient of joint 'panda_joint2' must be finite and 0 or more, got",
    ),
    "misspelt joint": (
        lambda: ViscousFriction({"panda_joint9": 1.0}),
        "did you mean 'panda_joint7'",
    ),
    "short list": (lambda: ViscousFriction((1.0, 2.0)), "needs one number per joint coordinate, 7"),
    "no friction": (
        lambda: ViscousFriction(),
        "needs either coefficient or from_urdf = true; neither",
    ),
    "both": (lambda: ViscousFriction(0.1, from_urdf=True), "from_urdf = true; both were given"),
    "no dry friction": (lambda: DryFriction(), "needs either coulomb or from_urdf = true; neither"),
    "dry friction twice": (
        lambda: DryFriction(0.1, from_urdf=True),
        "from_urdf = true; both were given",
    ),
    "no rotors": (lambda: Armature(), "needs either inertia or from_urdf = true; neither"),
    "rotors twice": (lambda: Armature(0.1, from_urdf=True), "from_urdf = true; both were given"),
    "no friction in the URDF": (
        lambda: DryFriction(from_urdf=True),
        "states no friction; give the",
    ),
    "negative dry friction": (
        lambda: DryFriction(-1.0),
        "joint 'panda_joint1' must be finite and 0 or more",
    ),
    "static below": (lambda: DryFriction(1.0, 0.5), "must not be below Coulomb's 1, got 0.5"),
    "sharp sign": (lambda: DryFriction(1.0, width=0.0), "width must be positive and finite, got 0"),
    "negative armature": (
        lambda: Armature(-0.1),
        "inertia of joint 'panda_joint1' must be finite and 0",
    ),
    "no armature in the model": (lambda: Armature(from_urdf=True), "states no armature"),
    "negative stiffness": (lambda: JointSprings(-2.0), "stiffness of joint 'panda_joint1'"),
    "rest nowhere": (
        lambda: JointSprings(2.0, np.nan),
        "joint 'panda_joint1' must be finite, got nan",
    ),
    "unknown frame": (
        lambda: Payload("panda_hand_tcpp", 1.0),
        "no frame 'panda_hand_tcpp': did you mean",
    ),
    "negative mass": (lambda: Payload(TIP, -1.0), "mass must be finite and 0 or more, got -1 kg"),
    "infinite mass": (
        lambda: Payload(TIP, np.inf),
        "mass must be finite and 0 or more, got inf kg",
    ),
    "NaN mass": (lambda: Payload(TIP, np.nan), "mass must be finite and 0 or more, got nan kg"),
    "mass of the base": (lambda: Payload("panda_link0", 1.0), "is fixed to the base"),
    "no center": (
        lambda: Payload(TIP, 1.0, (0.0, np.nan, 0.0)),
        "center must be three finite numbers",
    ),
    "flat center": (lambda: Payload(TIP, 1.0, (0.0, 0.0)), "center must be three"),  # type: ignore[arg-type]
    "half an inertia": (lambda: Payload(TIP, 1.0, inertia=(1.0,)), "six numbers"),  # type: ignore[arg-type]
    "flat wind": (lambda: Drag(TIP, wind=(1.0, 2.0)), "wind needs three components, got 2"),  # type: ignore[arg-type]
    "no body": (
        lambda: Payload(TIP, 1.0, inertia=(1.0, 1.0, -0.1, 0.0, 0.0, 0.0)),
        "must not have a negative principal value",
    ),
    "NaN wrench": (
        lambda: Wrench(TIP, (0.0, np.nan, 0.0)),
        "'wrench': force, component y must be a finite number or a formula, got nan",
    ),
    "wrench nowhere": (lambda: Wrench("tool1"), "has no frame 'tool1'"),
    "axes": (lambda: Wrench(TIP, axes="wrold"), "axes 'wrold': did you mean 'world'"),
    "negative area": (lambda: Drag(TIP, -1.0), "area must be finite and 0 or more"),
    "wind of joints": (
        lambda: Drag(TIP, wind=('q["x"]', 0.0, 0.0)),
        "brackets only after q, v and a",
    ),
    "base on a joint": (lambda: MovingBase(("x", 0.0, 0.0)), "names 'x', which is unknown"),
    "negative weight": (
        lambda: EffortWeight({"panda_joint1": -1.0}),
        "weight of joint 'panda_joint1' must be finite and 0 or more",
    ),
    "no effort weight": (
        lambda: EffortWeight(),
        "needs one of weight, matrix and from_urdf = true; none was given",
    ),
    "effort weights twice": (
        lambda: EffortWeight(1.0, ((1.0,),)),
        "weight, matrix and from_urdf = true; two were given",
    ),
    "flat matrix": (
        lambda: EffortWeight(matrix=((1.0, 0.0), (0.0, 1.0))),
        "needs 7 rows of 7, .* 2, 2",
    ),
    "no matrix": (lambda: EffortWeight(matrix=()), "needs 7 rows of 7, .* got rows of nothing"),
    "a matrix of one sign": (
        lambda: EffortWeight(matrix=matrix({(1, 2): 0.5})),
        "symmetric.* 0.5 and 0",
    ),
    "a matrix of two formulas": (
        lambda: EffortWeight(matrix=matrix({(1, 2): "sin(t)", (2, 1): "cos(t)"})),
        "must be symmetric, but rows 2 and 3 have 'sin.t.' and 'cos.t.'",
    ),
    "an indefinite matrix": (
        lambda: EffortWeight(matrix=matrix({(1, 2): 2.0, (2, 1): 2.0})),
        "must be positive semidefinite, but has the eigenvalue -1",
    ),
    "a matrix of torques": (
        lambda: EffortWeight(matrix=matrix({(0, 0): 'tau["panda_joint1"]'})),
        "brackets only after q, v and a",
    ),
    "a column for a cost": (
        lambda: RunningCost({"x": "tau*v"}),
        "the term 'x': the formula .* is a column of 7 numbers where one is needed",
    ),
    "columns of two sizes": (
        lambda: RunningCost({"x": "dot(tau, base_force)"}),
        "combines columns of 3 and 7 numbers",
    ),
    "a frame's name": (
        lambda: RunningCost({"x": 'velocity["hand", "x"]'}),
        "names the frame 'hand', which is unknown: did you mean 'panda_hand'",
    ),
    "a frame's axis": (
        lambda: RunningCost({"x": 'velocity["panda_hand", "w"]'}),
        "the component 'w' of 'velocity'",
    ),
    "no frame": (lambda: RunningCost({"x": "velocity"}), "needs a frame after 'velocity'"),
    "a joint's axis": (
        lambda: RunningCost({"x": 'tau["panda_joint1", "x"]'}),
        "the component 'x' of 'tau': give one name in brackets",
    ),
    "an unknown axis": (lambda: RunningCost({"x": 'base_force["w"]'}), "names the component 'w'"),
    "a cost of nobody": (lambda: RunningCost({"x": 'tau["elbow"]'}), "names the joint 'elbow'"),
    "an unbounded cost": (
        lambda: RunningCost({"x": np.inf}),
        "must be a finite number or a formula",
    ),
    "a cost that is a column": (
        lambda: CasadiCost(lambda q, v, a, tau, t: tau),
        r"one number as its result, got \(7, 1\)",
    ),
    "a cost of other arguments": (
        lambda: CasadiCost(lambda q, v: 1.0),
        "must map the SX symbols .* to one number, but it failed: .* 5 were given",
    ),
    "a cost of other symbols": (
        lambda: CasadiCost(lambda q, v, a, tau, t: tau[0] * ca.SX.sym("gain")),
        "the result contains gain, which is not among",
    ),
    "negative cost": (lambda: VelocityCost(-1.0), "velocity_cost': weight of joint 'panda_joint1'"),
    "negative reference": (lambda: ReferenceCost({}, -1.0), "weight must be finite and 0 or more"),
    "reference of nobody": (lambda: ReferenceCost({"joint": 1.0}), "has no joint 'joint'"),
    "negative power": (lambda: PowerCost(-1.0), "power_cost': weight of joint"),
    "endless power": (
        lambda: PowerCost(1.0, np.inf),
        "width must be positive and finite, got inf W",
    ),
    "endless sign": (
        lambda: DryFriction(1.0, width=np.inf),
        "width must be positive and finite, got inf",
    ),
    "slow Stribeck": (
        lambda: DryFriction(1.0, 2.0, 0.0),
        "stribeck_velocity must be positive and finite",
    ),
    "sharp power": (lambda: PowerCost(1.0, 0.0), "width must be positive and finite, got 0 W"),
    "nobody's torque": (
        lambda: Custom({"panda_joint": 1.0}),
        "no joint 'panda_joint': did you mean",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_an_invalid_effect_is_refused_in_one_sentence(panda: Robot, case: str) -> None:
    effect, sentence = CASES[case]
    with pytest.raises(SceneError, match=sentence) as refused:
        Scene(panda, [effect()])
    text = str(refused.value)
    assert "\n" not in text
    assert re.match("effect '[a-z_]+'", text)
    assert text.endswith((".", "?"))


FORMULAS = {
    "syntax": ("1 +", "is not arithmetic"),
    "a name": ("u", "names 'u', which is unknown"),
    "a function": ("sine(t)", "calls 'sine', which is unknown: did you mean 'sin'"),
    "arguments": ("atan2(t)", "calls 'atan2' with 1 arguments; it takes 2"),
    "keywords": ("sin(x=t)", "may contain only"),
    "attributes": ("t.__class__", "may contain only"),
    "calls of calls": ("(sin)(t)(t)", "may contain only"),
    "strings": ("'t'", "may contain only"),
    "truth": ("True", "may contain only"),
    "lambdas": ("(lambda: 1)()", "may contain only"),
    "a comparison": ("t > 1", "may contain only"),
    "a joint's name": ('v["elbwo"]', "the joint 'elbwo', which is unknown: did you mean 'elbow'"),
    "no joint": ("v", "needs a joint after 'v', as in v"),
    "a number for a joint": ("v[0]", "brackets only after q, v and a"),
    "an escape": (r"'\d'", "may contain only"),
    "infinity": ("1e999", "must be a finite number or a formula"),
    "a division by zero": ("1/0", "must be a finite number or a formula"),
    "powers of powers": ("9**9**9**9", "must be a finite number or a formula"),
    "length": ("+".join("t" * MAX_CHARACTERS), "has at most 2000 characters"),
    "depth": ("(" * 300 + "t" + ")" * 300, "is not arithmetic"),
    "signs": ("-" * 900 + "t", "is nested too deeply|is not arithmetic"),
}


@pytest.mark.parametrize("case", FORMULAS)
def test_a_formula_is_arithmetic_and_nothing_else(two_link: Robot, case: str) -> None:
    text, sentence = FORMULAS[case]
    with pytest.raises(SceneError, match=sentence):
        Scene(two_link, [Custom({"elbow": text})])


def test_formulas_are_evaluated_correctly(two_link: Robot) -> None:
    text = '-2*sin(pi*t)**2/4 + atan2(q["elbow"], 2) - max(v["shoulder"], +0.1)*abs(a["elbow"])'
    scene = Scene(two_link, [Custom({"shoulder": text})])
    random = np.random.default_rng(0)
    q, v, a = random.normal(size=(3, 20, 2))
    t = random.uniform(0, 2, 20)
    expected = -2 * np.sin(np.pi * t) ** 2 / 4 + np.arctan2(q[:, 1], 2)
    expected -= np.maximum(v[:, 0], 0.1) * np.abs(a[:, 1])
    bare = Scene(two_link).inverse_dynamics(q, v, a)
    added = scene.inverse_dynamics(q, v, a, t) - bare
    np.testing.assert_allclose(added[:, 0], expected, atol=1e-13)
    np.testing.assert_array_equal(added[:, 1], 0.0)


def test_a_floating_base_cannot_be_prescribed() -> None:
    robot = load_robot("solo8", free_flyer=True)
    with pytest.raises(SceneError, match="'root_joint' of robot 'solo8' floats"):
        Scene(robot, [MovingBase()])


def test_a_joint_with_nq_not_nv_cannot_have_a_spring() -> None:
    robot = load_robot("kinova")
    with pytest.raises(SceneError, match=r"'j2s6s200_joint_1' has no single position"):
        Scene(robot, [JointSprings({"j2s6s200_joint_1": 2.0})])
    Scene(robot, [JointSprings({"j2s6s200_joint_2": 2.0})])
    with pytest.raises(SceneError, match=r"names the joint 'j2s6s200_joint_1', which is unknown"):
        Scene(robot, [Custom({"j2s6s200_joint_2": 'q["j2s6s200_joint_1"]'})])


# In scene files

FILE = """robot = "two_link.urdf"
duration = 1.0
[start]
q = [0.0, 0.0]
[goal]
q = [1.0, 0.0]
"""
TABLES = {
    "number": (
        '[effects.viscous_friction]\ncoefficient = "much"',
        r"line 8: `effects.viscous_friction.coefficient` must be a finite number or a list, "
        r'each a finite number or a table of names, each with a finite number, but it is "much"',
    ),
    "truth": (
        "[effects.viscous_friction]\nfrom_urdf = 1",
        "line 8: `effects.viscous_friction.from_urdf` must be true or false, but it is 1",
    ),
    "negative": (
        "[effects.viscous_friction]\ncoefficient = { elbow = -1.0 }",
        "line 7: effect 'viscous_friction': coefficient of joint 'elbow' must be finite and 0",
    ),
    "no number": (
        "[effects.dry_friction]\ncoulomb = nan",
        "line 8: `effects.dry_friction.coulomb` must be a finite number or",
    ),
    "vector": (
        '[effects.wrench]\nframe = "lower_arm"\nforce = [1.0, 2.0]',
        r"line 9: `effects.wrench.force\[2\]` is missing; it must be given as well",
    ),
    "component": (
        '[effects.wrench]\nframe = "lower_arm"\nforce = [1.0, true, 0.0]',
        r"line 9: `effects.wrench.force\[1\]` must be a finite number or a string, but it is true",
    ),
    "key": (
        "[effects.payload]\nmas = 1.0",
        "line 8: unknown key `effects.payload.mas`; did you mean 'mass'",
    ),
    "missing": (
        "[effects.payload]\nmass = 1.0",
        "line 7: `effects.payload.frame` is missing; it must be a string",
    ),
    "scalar for a vector": (
        '[effects.wrench]\nframe = "lower_arm"\nforce = 1.0',
        "line 9: `effects.wrench.force` must be a list of 3, each a finite number or a string, but",
    ),
    "twice": ("[effects.gravity]\n[effects.gravity]", r"Cannot declare .* twice"),
    "effect": ("[effects.gravitation]", "no effect 'gravitation'; did you mean 'gravity'"),
}


@pytest.mark.parametrize("case", TABLES)
def test_an_error_in_a_table_is_reported_with_its_line(
    models: Path, tmp_path: Path, case: str
) -> None:
    table, sentence = TABLES[case]
    path = tmp_path / "scene.toml"
    path.write_text(FILE.replace("two_link.urdf", str(models / "two_link.urdf")) + table + "\n")
    with pytest.raises(SceneError, match=sentence):
        load_task(path)


@pytest.mark.parametrize(
    ("table", "effect"),
    [
        ("[effects.viscous_friction]\ncoefficient = 1", ViscousFriction(1.0)),
        ("[effects.viscous_friction]\ncoefficient = [1, 2.5]", ViscousFriction((1.0, 2.5))),
        ("[effects.armature]\ninertia = { elbow = 1 }", Armature({"elbow": 1.0})),
        (
            '[effects.moving_base]\nposition = [0, "sin(t)", 1.0]',
            MovingBase((0.0, "sin(t)", 1.0)),
        ),
    ],
    ids=["a number", "a list", "a table", "formulas"],
)
def test_tables_accept_all_forms_of_values(
    models: Path, tmp_path: Path, table: str, effect: Any
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(FILE.replace("two_link.urdf", str(models / "two_link.urdf")) + table + "\n")
    assert load_task(path).scene.effects == (effect,)

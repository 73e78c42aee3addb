"""Compiled effects: the same plan, and a library in the user's cache."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from hovi.cli.application import main
from hovi.effects import Gravity
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.sample_effects import sample_effects

SCENE = """robot = "two_link.urdf"
duration = 1.0
limits = "none"
[start]
q = [-0.5, 0.2]
[goal]
q = [0.6, 0.9]
[scheme]
intervals = 8
[effects.gravity]
[effects.dry_friction]
coulomb = 0.1
[effects.power_cost]
weight = 0.5
"""


@pytest.fixture(autouse=True)
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    if shutil.which("cc") is None and shutil.which("gcc") is None:
        pytest.skip("there is no C compiler")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "hovi" / "compiled"


def test_the_command_plans_with_compiled_effects(
    models: Path, tmp_path: Path, cache: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace("two_link.urdf", str(models / "two_link.urdf")))
    found = []
    for options in ([], ["--compile"]):
        assert main(["plan", str(path), "--json", "--no-certificate", *options]) == 0
        found.append(json.loads(capsys.readouterr().out))
        assert cache.exists() == bool(options)
    assert found[1]["cost"] == pytest.approx(found[0]["cost"], rel=1e-12)
    assert found[1]["nit"] == found[0]["nit"]


def test_compiled_terms_equal_interpreted_ones(two_link: Robot) -> None:
    named = sample_effects(two_link)
    effects = [named[key] for key in ("moving_base", "dry_friction", "power_cost", "velocity_cost")]
    plain = Scene(two_link, [Gravity(), *effects])
    random = np.random.default_rng(3)
    q, v, a = random.normal(size=(3, 5, 2))
    t = random.uniform(0, 1, 5)
    compiled = Scene(two_link, plain.effects, compile=True).effort_lagrangian()
    pairs = zip(
        plain.effort_lagrangian().evaluate(q, v, a, t=t),
        compiled.evaluate(q, v, a, t=t),
        strict=True,
    )
    for one, other in pairs:
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-13)

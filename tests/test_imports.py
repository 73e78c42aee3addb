"""The public names of hovi, and the modules that `import hovi` and a first plan load."""

from __future__ import annotations

import os
import pkgutil
import subprocess
import sys

import pytest

import hovi

SUBPACKAGES = {"accuracy", "effects", "schemes", "symbolic"}
FIRST_PLAN = """
import sys
import hovi
solution = hovi.plan_task(hovi.load_task(hovi.example("two_link_reach")))
assert solution.success
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


def python(code: str, **environment: str) -> list[str]:
    """The words printed by a program in a separate process."""
    run = [sys.executable, "-c", code]
    done = subprocess.run(
        run, capture_output=True, text=True, check=True, env=os.environ | environment
    )
    return done.stdout.split()


@pytest.mark.parametrize("name", hovi.__all__)
def test_a_public_name_exists(name: str) -> None:
    assert getattr(hovi, name) is not None
    assert name in dir(hovi)


def test_a_module_does_not_hide_a_public_name() -> None:
    """Importing hovi.robot binds that package to the name `robot` of hovi."""
    modules = {module.name for module in pkgutil.iter_modules(hovi.__path__)}
    assert modules & set(hovi.__all__) == SUBPACKAGES


def test_an_unknown_name_raises() -> None:
    unknown = "plann"
    with pytest.raises(AttributeError, match=unknown):
        getattr(hovi, unknown)
    with pytest.raises(ImportError, match=unknown):
        exec(f"from hovi import {unknown}")


def test_all_public_names_can_be_imported_at_once() -> None:
    """Eager loading of all names reveals import cycles that lazy loading hides."""
    assert python("import hovi; print('plan' in dir(hovi))", EAGER_IMPORT="1") == ["True"]


def test_importing_hovi_loads_no_submodule() -> None:
    code = "import sys; before = {*sys.modules}; import hovi; print(*{*sys.modules} - before)"
    loaded = python(code)
    assert "hovi" in loaded
    assert not [name for name in loaded if name.startswith("hovi.")]
    assert not {"numpy", "importlib.metadata"} & set(loaded)


def test_a_first_plan_loads_no_unused_package() -> None:
    loaded = python(FIRST_PLAN)
    assert "pinocchio" in loaded
    assert not {"scipy", "joblib", "matplotlib", "meshcat", "typer"} & set(loaded)


def test_a_plan_from_the_command_line_loads_only_its_own_modules() -> None:
    code = (
        "import sys; from hovi.cli.application import main\n"
        "assert main(['plan', 'two_link_reach', '--json', '--no-certificate']) == 0\n"
        "print(*sys.modules)"
    )
    loaded = set(python(code))
    assert "hovi.cli.commands.plan" in loaded
    assert not {"scipy", "rich.table", "matplotlib", "meshcat", "tornado", "numpy.ma"} & loaded
    assert (
        not {
            "hovi.cli.commands.study",
            "hovi.planning.search.joint_duration",
            "hovi.planning.sequence.sequence_planner",
            "hovi.planning.task_file.obstacle_tables",
            "hovi.viewing.replay_session",
        }
        & loaded
    )


def test_a_text_report_loads_no_plotting_package() -> None:
    loaded = python("import sys, hovi.cli.reports.plan; print(*sys.modules)")
    assert "hovi.cli.reports.plan" in loaded
    assert not {"matplotlib", "meshcat", "scipy"} & set(loaded)

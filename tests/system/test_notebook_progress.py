"""Progress in notebooks: a line that a kernel sends while a cell runs, and none that stays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("ipykernel")
manager: Any = pytest.importorskip("jupyter_client.manager")

SOON = "import hovi\nimport hovi.system.progress as p\np.BAR_DELAY = 0.01\n"
EFFECTS = "from hovi.accuracy.effect_study.study import study_effects\n"
TASK = "task = hovi.load_task(hovi.example('two_link_swing_up.toml'))\n"


@pytest.fixture(scope="module")
def kernel() -> Iterator[Any]:
    running, client = manager.start_new_kernel()
    yield client
    client.stop_channels()
    running.shutdown_kernel(now=True)


def shown_by(kernel: Any, code: str) -> list[dict[str, str]]:
    """What a cell displays and updates, in order of time."""
    number = kernel.execute(code)
    shown: list[dict[str, str]] = []
    while True:
        message = kernel.get_iopub_msg(timeout=120)
        if message["parent_header"].get("msg_id") != number:
            continue
        kind, content = message["msg_type"], message["content"]
        assert kind != "error", content
        if kind in ("display_data", "update_display_data"):
            shown.append(content["data"])
        if kind == "status" and content["execution_state"] == "idle":
            return shown


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (TASK + "hovi.plan_task(task, starts=4);", "refining"),
        (
            TASK + EFFECTS + "study_effects(task, [], time_limit=5.0);",
            "planning the unchanged scene",
        ),
    ],
)
def test_a_long_computation_shows_a_line_that_goes(kernel: Any, code: str, expected: str) -> None:
    shown = shown_by(kernel, SOON + code)
    lines = [each["text/plain"] for each in shown]
    assert any(expected in line and " % " in line for line in lines), set(lines)
    assert shown[-1]["text/plain"] == shown[-1]["text/html"] == ""


def test_a_study_shows_how_many_plans_are_done(kernel: Any, tmp_path: Any) -> None:
    vary = "[{'field': 'duration', 'grid': {'lower': 1.0, 'upper': 2.0, 'count': 60}}]"
    code = f"{SOON}hovi.Study('two_link_reach', {vary}).run({str(tmp_path / 'study')!r});"
    shown = shown_by(kernel, code)
    assert any(" of 60 plans" in each["text/plain"] for each in shown)


def test_what_is_done_at_once_shows_nothing(kernel: Any) -> None:
    shown = shown_by(
        kernel, SOON.replace("0.01", "60.0") + TASK + "hovi.plan_task(task, starts=1);"
    )
    assert shown == []

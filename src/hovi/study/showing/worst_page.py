"""One page with replays of several motions of a study."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

from hovi.errors import DisplayError, StudyError
from hovi.study.showing.plans import Plans
from hovi.study.study import Study
from hovi.system.files import reason, whole_file
from hovi.viewing.replay_session import page_of

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font-family: sans-serif; margin: 1.5em; }}
iframe {{ width: 100%; height: 32em; border: 1px solid #bbb; }}
summary {{ cursor: pointer; padding: 0.4em 0; }}
</style></head><body>
<h1>{title}</h1>
{motions}
</body></html>
"""
_MOTION = """<details{opened}><summary>{label}</summary>
<iframe loading="lazy" sandbox="allow-scripts" srcdoc="{source}"></iframe></details>
"""


def write_worst(plans: Plans, path: Path, count: int = 10) -> int:
    """Write a page with the minima that cost most, each of which is opened to be replayed.

    Returns how many there are. Raises StudyError without a stored motion, and DisplayError.
    """
    rows = plans.worst(count)
    if not rows:
        raise StudyError(f"the study in {plans.folder} has no minimum to be replayed.")
    motions = [_motion(plans, row, number == 0) for number, row in enumerate(rows)]
    title = f"the {len(rows)} costliest of {len(plans):,} plans"
    page = _PAGE.format(title=title, motions="".join(motions))
    try:
        with whole_file(path) as stream:
            stream.write(page.encode())
    except OSError as refused:
        raise DisplayError(f"cannot write the page {str(path)!r}: {reason(refused)}.") from None
    return len(rows)


def _motion(plans: Plans, row: int, opened: bool) -> str:
    trajectory = Study.motion(plans.folder, plans.columns["key"][row])
    source = page_of(trajectory).offline_html()
    label = f"cell {plans.columns['cell'][row]}: cost {plans.columns['cost'][row]:.6g}"
    label += "".join(f", {_parameter(name, plans, row)}" for name in _shown(plans.parameters))
    return _MOTION.format(
        label=html.escape(label),
        source=html.escape(source, quote=True),
        opened=" open" if opened else "",
    )


def _parameter(name: str, plans: Plans, row: int) -> str:
    value = plans.columns[name][row]
    return f"{name} = {value:.4g}" if isinstance(value, float) else f"{name} = {value}"


def _shown(names: Sequence[str]) -> Sequence[str]:
    return names[:8]

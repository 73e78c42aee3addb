"""One page with replays of several motions of a study, which bring what they share once."""

from __future__ import annotations

import html
import json
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from hovi.errors import DisplayError, StudyError
from hovi.study.showing.plans import Plans
from hovi.study.study import Study
from hovi.system.files import reason, whole_file
from hovi.viewing.replay_session import page_of

SHARED_LENGTH = 100
"""Characters from which a piece that several replays have is stored once."""
_PIECES = re.compile(r"(?<=[\n\"'])")
"""Where replays are cut: lines, and the strings in them, of which meshes are some."""
_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body {{ font-family: sans-serif; margin: 1.5em; }}
iframe {{ width: 100%; height: 32em; border: 1px solid #bbb; }}
summary {{ cursor: pointer; padding: 0.4em 0; }}
@media (max-width: 759px) {{
    body {{ margin: 0.7em; }}
    h1 {{ font-size: 1.3em; }}
    iframe {{ height: 85vh; }}
}}
</style></head><body>
<h1>{title}</h1>
{motions}
<script>
const SHARED = {shared};
const REPLAYS = {replays};
function show(details) {{
    const old = details.querySelector("iframe");
    if (old) old.remove();
    if (!details.open) return;
    const frame = document.createElement("iframe");
    frame.setAttribute("sandbox", "allow-scripts");
    const pieces = REPLAYS[Number(details.dataset.replay)];
    frame.srcdoc = pieces.map(each => typeof each === "number" ? SHARED[each] : each).join("");
    details.append(frame);
}}
for (const details of document.querySelectorAll("details")) {{
    details.addEventListener("toggle", () => show(details));
    show(details);
}}
</script>
</body></html>
"""
_MOTION = """<details data-replay="{number}"{opened}><summary>{label}</summary></details>
"""


def write_worst(
    plans: Plans, path: Path, count: int = 10, package_dirs: Iterable[str | Path] = ()
) -> int:
    """Write a page with the minima that cost most, each of which is opened to be replayed.

    package_dirs: folders with the packages of the robot's meshes.
    Returns how many there are. Raises StudyError without a stored motion, and DisplayError.
    """
    rows = plans.worst(count)
    if not rows:
        raise StudyError(f"the study in {plans.folder} has no minimum to be replayed.")
    motions = [_motion(plans, row, number) for number, row in enumerate(rows)]
    shared, replays = shared_pieces([_replay(plans, row, package_dirs) for row in rows])
    title = f"the {len(rows)} costliest of {len(plans):,} plans"
    page = _PAGE.format(
        title=title, motions="".join(motions), shared=_script(shared), replays=_script(replays)
    )
    try:
        with whole_file(path) as stream:
            stream.write(page.encode())
    except OSError as refused:
        raise DisplayError(f"cannot write the page {str(path)!r}: {reason(refused)}.") from None
    return len(rows)


def shared_pieces(texts: Sequence[str]) -> tuple[list[str], list[list[str | int]]]:
    """The long pieces that occur more than once, and each text as pieces and numbers of these."""
    cut = [_PIECES.split(text) for text in texts]
    often = Counter(piece for pieces in cut for piece in pieces if len(piece) >= SHARED_LENGTH)
    shared = [piece for piece, times in often.items() if times > 1]
    numbers = {piece: number for number, piece in enumerate(shared)}
    return shared, [_joined([numbers.get(piece, piece) for piece in pieces]) for pieces in cut]


def _joined(pieces: Sequence[str | int]) -> list[str | int]:
    """The same with texts that follow each other as one."""
    found: list[str | int] = []
    for piece in pieces:
        last = found[-1] if found else None
        if isinstance(piece, str) and isinstance(last, str):
            found[-1] = last + piece
        else:
            found.append(piece)
    return found


def _script(data: Any) -> str:
    """Data as an expression of JavaScript, in which nothing ends the script's element."""
    return json.dumps(data).replace("<", "\\u003c")


def _replay(plans: Plans, row: int, package_dirs: Iterable[str | Path]) -> str:
    motion = Study.motion(plans.folder, plans.columns["key"][row], package_dirs)
    return page_of(motion).offline_html()


def _motion(plans: Plans, row: int, number: int) -> str:
    label = f"cell {plans.columns['cell'][row]}: cost {plans.columns['cost'][row]:.6g}"
    label += "".join(f", {_parameter(name, plans, row)}" for name in _shown(plans.parameters))
    opened = " open" if number == 0 else ""
    return _MOTION.format(label=html.escape(label), number=number, opened=opened)


def _parameter(name: str, plans: Plans, row: int) -> str:
    value = plans.columns[name][row]
    return f"{name} = {value:.4g}" if isinstance(value, float) else f"{name} = {value}"


def _shown(names: Sequence[str]) -> Sequence[str]:
    return names[:8]

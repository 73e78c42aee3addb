"""The outputs that pages show right after their code, from running that code.

python docs/shown_outputs.py [PAGE ...]            print how they differ; by default of lessons
python docs/shown_outputs.py [PAGE ...] --write    and put what the code prints in their place
"""

from __future__ import annotations

import difflib
import sys
import tempfile
from pathlib import Path

TOP = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TOP / "tests"))

from oracles.documents import run, with_outputs  # noqa: E402

LESSONS = TOP / "docs" / "lessons"


def main(arguments: list[str]) -> None:
    """Run each page; its code has to end without an error."""
    named = [Path(each) for each in arguments if each != "--write"]
    for page in named or sorted(LESSONS.glob("[1-9]_*.md")):
        with tempfile.TemporaryDirectory() as folder:
            done = run(page, Path(folder))
        if done.returncode != 0:
            sys.exit(f"{page}: {done.stderr}")
        old, new = page.read_text(), with_outputs(page, done.stdout)
        lines = difflib.unified_diff(old.splitlines(), new.splitlines(), page.name, "printed", n=0)
        print(*lines, sep="\n")
        if "--write" in arguments:
            page.write_text(new)


if __name__ == "__main__":
    main(sys.argv[1:])

"""The blocks of code of a page, and a script that types them in the page's order."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*) -->\n)?^```(?P<language>\w+)\n(?P<code>.*?)^```$", re.M | re.S
)
INSTALLING = re.compile(r"^python3 -m venv \S+ && \S+/pip install \S+ && ", re.M)
LANGUAGES = "python", "sh", "toml", "text"
NOT_RUN, PART = "not run: ", "part of "
"""What a comment above a block begins with: why it is not run, and the scene that it belongs to."""
TYPED = '''
def typed(line):
    """Run a line of a shell; what is served until Ctrl-C is ended by it."""
    import signal, subprocess, sys

    child = subprocess.Popen(["bash", "-c", f"exec {line}" if line.startswith("hovi ") else line],
                             stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True,
                             preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    for said in child.stdout:
        print(said, end="")
        if "Ctrl-C ends" in said:
            child.send_signal(signal.SIGINT)
    assert child.wait() == 0, (line, child.returncode)
'''


@dataclass(frozen=True)
class Block:
    """Code of a page. mark: of the comment above it, or ""."""

    language: str
    code: str
    mark: str

    @property
    def runs(self) -> bool:
        """Whether the page says nothing against it."""
        return not self.mark.startswith(NOT_RUN)

    @property
    def lines(self) -> list[str]:
        """Of a shell, continued ones joined, without those parts that install hovi."""
        joined = INSTALLING.sub("", self.code.replace("\\\n", ""))
        return [line for line in joined.splitlines() if line.strip()]


def blocks(page: Path) -> Iterator[Block]:
    """The blocks of a page, in its order."""
    for found in BLOCK.finditer(page.read_text()):
        if found["language"] in LANGUAGES:
            yield Block(found["language"], found["code"], found["mark"] or "")


def script(page: Path) -> str:
    """The Python of a page and what it types, in its order."""
    parts = []
    for block in blocks(page):
        if block.runs and block.language == "python":
            parts.append(block.code)
        elif block.runs and block.language == "sh":
            parts += [f"typed({line!r})" for line in block.lines]
    return "\n".join([TYPED, *parts]) if parts else ""

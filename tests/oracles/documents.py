"""The blocks of code of a page, a script that types them in its order, and what they print."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]

BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*) -->\n)?^```(?P<language>\w+)\n(?P<code>.*?)^```$", re.M | re.S
)
INSTALLING = re.compile(r"^python3 -m venv \S+ && \S+/pip install (?:-v )?\S+ && ", re.M)
LANGUAGES = "python", "sh", "toml", "text"
NOT_RUN, PART = "not run: ", "part of "
"""What a comment above a block begins with: why it is not run, and the scene that it belongs to."""
END_OF_BLOCK = "\f\n"
"""What the script prints after each block, so that the output of each is known."""
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
        if not _typed(block):
            continue
        if block.language == "python":
            parts.append(block.code)
        else:
            parts += [f"typed({line!r})" for line in block.lines]
        parts.append(f"print(end={END_OF_BLOCK!r})")
    return "\n".join([TYPED, *parts]) if parts else ""


def run(page: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the script of a page in a folder with the bundled models, and with hovi as pages do."""
    (folder / "models").symlink_to(TOP / "models")
    (folder / ".venv").symlink_to(sys.prefix)
    file = (folder / "typed").with_suffix(".py")
    file.write_text(script(page))
    path = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    return subprocess.run(
        [sys.executable, file.name],
        cwd=folder,
        env=os.environ | path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def shown_outputs(page: Path) -> Iterator[tuple[int, int, int]]:
    """Blocks of text right after typed code: the number of that code, begin and end of the text."""
    text, typed, end = page.read_text(), -1, -1
    for found in BLOCK.finditer(text):
        language, mark = found["language"], found["mark"] or ""
        if language == "text" and end >= 0 and not text[end : found.start()].strip():
            yield typed, found.start("code"), found.end("code")
        end = -1
        if _typed(Block(language, found["code"], mark)):
            typed, end = typed + 1, found.end()


def with_outputs(page: Path, stdout: str) -> str:
    """The page with what its script printed in place of the outputs that it shows."""
    text, printed = page.read_text(), stdout.split(END_OF_BLOCK)
    for number, begin, end in reversed(list(shown_outputs(page))):
        lines = [line.rstrip() for line in printed[number].strip("\n").splitlines()]
        text = text[:begin] + "\n".join(lines) + "\n" + text[end:]
    return text


def _typed(block: Block) -> bool:
    """Whether the script has it."""
    return block.runs and block.language in ("python", "sh")

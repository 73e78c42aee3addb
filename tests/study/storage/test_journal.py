"""Journals: what a process that dies leaves is whole."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hovi.study.storage.index import Index
from hovi.study.storage.journal import FOLDER, JournalWriter, StorageError
from hovi.study.storage.rows import PlanRow


def entry(key: str, cost: float = 1.0, samples: int = 0) -> dict:
    return {
        "key": key,
        "row": PlanRow("minimum", True, cost=cost).to_dict(),
        "motion": None,
        "samples": None,
        "asked": [False, samples],
        "run": {"attempt": 1, "outcome": "done"},
    }


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / FOLDER).mkdir()
    return tmp_path


def index(folder: Path, samples: int = 0) -> Index:
    found = Index(folder, samples)
    found.read_new()
    return found


def test_what_is_written_is_read(folder: Path) -> None:
    writer = JournalWriter(folder)
    stored = writer.store(b"some bytes")
    assert writer.store(b"others").read(folder) == b"others"
    writer.add(entry("a", 2.5))
    done = index(folder).done("a")
    assert done is not None
    assert done.row == PlanRow("minimum", True, cost=2.5)
    assert stored.read(folder) == b"some bytes"
    assert index(folder).done("b") is None


@pytest.mark.parametrize("cut", [1, 2, 30, 200])
def test_a_line_that_was_cut_off_does_not_count(folder: Path, cut: int) -> None:
    writer = JournalWriter(folder)
    for key in "abc":
        writer.add(entry(key))
    (path,) = (folder / FOLDER).glob("*.lines")
    path.write_bytes(path.read_bytes()[:-cut])
    found = index(folder)
    assert [key in found for key in "abc"] == [True, True, False]


def test_a_damaged_line_does_not_count_and_others_do(folder: Path) -> None:
    writer = JournalWriter(folder)
    for key in "abc":
        writer.add(entry(key, cost=1.25))
    (path,) = (folder / FOLDER).glob("*.lines")
    lines = path.read_bytes().splitlines(keepends=True)
    lines[1] = lines[1].replace(b"1.25", b"9.25")
    path.write_bytes(b"".join(lines))
    found = index(folder)
    assert [key in found for key in "abc"] == [True, False, True]


def test_an_index_reads_on_from_where_it_was(folder: Path) -> None:
    one, other = JournalWriter(folder), JournalWriter(folder)
    one.add(entry("a"))
    found = Index(folder)
    assert found.read_new() == ["a"]
    other.add(entry("b"))
    one.add(entry("c"))
    assert sorted(found.read_new()) == ["b", "c"]
    assert found.read_new() == []


def test_of_a_plan_that_was_done_twice_the_one_with_the_wanted_samples_counts(folder: Path) -> None:
    writer = JournalWriter(folder)
    writer.add(entry("a"))
    assert not index(folder, samples=5).has("a", motion=False)
    for samples in (9, 5, 7):
        writer.add(entry("a", cost=samples, samples=samples))
    found = index(folder, samples=5)
    assert found.has("a", motion=False)
    assert not found.has("a", motion=True)
    done = found.done("a")
    assert done is not None
    assert done.row.cost == 5
    assert index(folder).has("a", motion=False)
    assert len(list(found.runs())) == 4


def test_a_full_disk_leaves_whole_lines(folder: Path) -> None:
    """The largest size of a file stands for the size of a disk."""
    program = f"""
import resource
from pathlib import Path
from hovi.study.storage.journal import JournalWriter, StorageError
writer = JournalWriter(Path({str(folder)!r}))
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
entry = {entry("KEY")!r}
try:
    for number in range(100):
        writer.add(entry | {{"key": str(number)}})
except StorageError as full:
    print(number, full)
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    number, _, reason = run.stdout.partition(" ")
    assert "File too large" in reason
    found = index(folder)
    assert [str(i) in found for i in range(int(number) + 1)] == [True] * int(number) + [False]
    (path,) = (folder / FOLDER).glob("*.lines")
    assert path.read_bytes().endswith(b"\n")


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(StorageError):
        JournalWriter(tmp_path / "missing").add(entry("a"))

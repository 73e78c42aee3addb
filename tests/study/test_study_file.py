"""Study files: errors name the file, the line and the key."""

from __future__ import annotations

from pathlib import Path

import pytest

from hovi.errors import SceneError
from hovi.study.study import Study

HEAD = 'scene = "two_link_reach"\n'


def read(folder: Path, text: str) -> Study:
    path = folder / "study.toml"
    path.write_text(text)
    return Study.read(path)


def test_a_file_and_python_say_the_same(tmp_path: Path) -> None:
    study = read(tmp_path, HEAD + '[[vary]]\nfield = "duration"\nvalues = [1.0, 2.0]\n')
    other = Study("two_link_reach", [{"field": "duration", "values": [1.0, 2.0]}])
    assert study.count == other.count == 2
    assert [study.cells.key(i) for i in range(2)] == [other.cells.key(i) for i in range(2)]


def test_paths_are_relative_to_the_file(tmp_path: Path, models: Path) -> None:
    for name in ("two_link_reach.toml", "two_link.urdf"):
        (tmp_path / name).write_text((models / name).read_text())
    (tmp_path / "t.csv").write_text("T\n1.0\n2.0\n3.0\n")
    text = 'scene = "two_link_reach.toml"\n[[vary]]\ntable = "t.csv"\ncolumns = {duration = "T"}\n'
    assert read(tmp_path, text).count == 3


def test_the_shipped_study_is_a_map_of_2500_poses(models: Path) -> None:
    study = Study.read(models / "studies" / "ur5_table_map.toml")
    assert study.count == 2500
    assert study.cells.ends == ("goal",)


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("seed = 1\n", None, "`scene` is missing"),
        ('scene = "two_lonk"\n', 1, "did you mean 'two_link"),
        (HEAD + "wram = true\n", 2, "unknown key `wram`; did you mean 'warm'?"),
        (HEAD + '[[vary]]\nfield = "duration"\n', 2, "takes one of values, grid"),
        (HEAD + "[[vary]]\nvalues = [1.0]\n", 2, "needs `field` or `fields`"),
        (HEAD + '[[vary]]\nfield = "duration"\nvalues = []\n', 2, "has no values"),
        (HEAD + '[[vary]]\nfield = "duratoin"\nvalues = [1]\n', 2, "unknown key `duratoin`"),
        (HEAD + '[[vary]]\nfield = "goal.q[7]"\nvalues = [1]\n', 2, "a list of at least 8"),
        (
            HEAD + '[[vary]]\nfield = "duration"\ngrid = {lower = 1, upper = 2, count = 0}\n',
            4,
            "`vary[0].grid.count` must be a whole number from 1",
        ),
        (
            HEAD
            + '[[vary]]\nfield = "goal.q"\nsample = {lower = [0], upper = [1, 1], count = 2}\n',
            2,
            "as many numbers in `lower` and `upper`",
        ),
        (HEAD + '[[vary]]\ntable = "t.csv"\n', 2, "belong together"),
        (HEAD + '[[vary]]\ntable = "t.csv"\ncolumns = {duration = "T"}\n', 2, "cannot be read"),
        (
            HEAD + '[[vary]]\nfield = "goal.q"\nposes = {frame = "tip", lower = [0, 0, 0], '
            "upper = [1, 1, 1], count = 2}\n",
            2,
            'need the field "goal" or "start"',
        ),
    ],
)
def test_an_error_names_the_line(tmp_path: Path, text: str, line: int | None, what: str) -> None:
    with pytest.raises(SceneError) as raised:
        read(tmp_path, text)
    sentence = str(raised.value)
    assert "study.toml" in sentence
    assert what in sentence
    if line is not None:
        assert f"line {line}:" in sentence

"""Fields of a scene file by their dotted paths."""

from __future__ import annotations

import pytest

from hovi.errors import SceneError
from hovi.study.cells.field_path import FieldPath


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("duration", ("duration",)),
        ("effects.payload.mass", ("effects", "payload", "mass")),
        ("goal.q[2]", ("goal", "q", 2)),
        ("obstacles[0].radius", ("obstacles", 0, "radius")),
        ('start.q."left.elbow"', ("start", "q", "left.elbow")),
        ("limits.v[1][0]", ("limits", "v", 1, 0)),
    ],
)
def test_a_path_has_the_keys_of_tables_and_lists(text: str, keys: tuple[str | int, ...]) -> None:
    assert FieldPath.of(text).keys == keys


@pytest.mark.parametrize(
    "text", ["", ".", "a.", ".a", "a..b", "[0]", "a[x]", "a[-1]", "a b", "a]", "a[1]b", "x" * 501]
)
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(SceneError, match="is no field of a scene file"):
        FieldPath.of(text)


def test_a_value_is_put_where_the_path_says() -> None:
    table = {"goal": {"q": [1.0, 2.0]}, "obstacles": [{"radius": 1.0}]}
    FieldPath.of("goal.q[1]").put(table, 5.0)
    FieldPath.of("obstacles[0].radius").put(table, 3.0)
    FieldPath.of("effects.payload.mass").put(table, 2.0)
    assert table == {
        "goal": {"q": [1.0, 5.0]},
        "obstacles": [{"radius": 3.0}],
        "effects": {"payload": {"mass": 2.0}},
    }


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("goal.q[2]", "a list of at least 3 under 'goal.q'"),
        ("goal.q.elbow", "a table under 'goal.q'"),
        ("goal.v[0]", "a list of at least 1 under 'goal.v', where the scene has nothing"),
        ("limits.v", "a table under 'limits', where the scene has 'none'"),
    ],
)
def test_a_path_that_does_not_fit_the_scene_says_what_is_there(text: str, what: str) -> None:
    table = {"goal": {"q": [1.0, 2.0]}, "limits": "none"}
    with pytest.raises(SceneError) as raised:
        FieldPath.of(text).put(table, 5.0)
    assert what in str(raised.value)

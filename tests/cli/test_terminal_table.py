"""Tables of reports: columns that align, and texts folded where a terminal is narrow."""

from __future__ import annotations

from hovi.cli.reports.terminal_table import NARROWEST, table_text

COLUMNS = ("joint", "q", "margin")
ROWS = [("shoulder_lift_joint", "-1.5 .. 0.25", "3 %"), ("elbow", "2", "*0.0 %")]


def test_texts_begin_at_the_left_and_numbers_end_at_the_right() -> None:
    assert table_text(COLUMNS, ROWS).splitlines() == [
        " joint                           q  margin",
        " ─────────────────────────────────────────",
        " shoulder_lift_joint  -1.5 .. 0.25     3 %",
        " elbow                           2  *0.0 %",
    ]


def test_texts_are_folded_to_the_width_of_a_terminal() -> None:
    whole = table_text(COLUMNS, ROWS)
    width = len(whole.splitlines()[0])
    assert table_text(COLUMNS, ROWS, width=width) == whole
    folded = table_text(COLUMNS, ROWS, width=width - 5).splitlines()
    assert max(map(len, folded)) == width - 5
    assert [line.split()[0] for line in folded[2:4]] == ["shoulder_lift_", "joint"]


def test_nothing_is_folded_where_that_would_not_suffice() -> None:
    least = len(table_text(COLUMNS, ROWS).splitlines()[0]) - len(ROWS[0][0]) + NARROWEST
    assert len(table_text(COLUMNS, ROWS, width=least).splitlines()[1]) == least
    assert table_text(COLUMNS, ROWS, width=least - 1) == table_text(COLUMNS, ROWS)


def test_an_empty_cell_and_a_table_without_rows_are_shown() -> None:
    assert table_text(("", "q"), [("", "1")]).splitlines()[2] == "   1"
    assert len(table_text(COLUMNS, []).splitlines()) == 2

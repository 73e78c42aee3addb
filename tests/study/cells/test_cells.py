"""The cells of a study: combinations, keys and neighbours."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from hovi.errors import SceneError
from hovi.study.axes.listed import listed
from hovi.study.cells.cells import Cells
from hovi.study.cells.field_path import FieldPath
from hovi.study.cells.parameters import parameters_of
from hovi.study.cells.template import Template

A, B, C = (FieldPath.of(name) for name in ("seed", "duration", "max_iterations"))


def cells(models: Path, *lengths: int, warm: bool = False) -> Cells:
    axes = [
        listed([field], list(range(1, n + 1))) for field, n in zip((A, B, C), lengths, strict=False)
    ]
    return Cells(Template.read(models / "two_link_reach.toml"), tuple(axes), warm)


def test_the_cells_are_all_combinations_with_the_last_axis_fastest(models: Path) -> None:
    found = cells(models, 2, 3, 4)
    values = [tuple(value for _, value in found.values(i)) for i in range(found.count)]
    assert values == list(itertools.product((1, 2), (1, 2, 3), (1, 2, 3, 4)))
    assert [found.number(found.places(i)) for i in range(found.count)] == list(range(24))


def test_a_study_without_axes_has_one_cell(models: Path) -> None:
    assert cells(models).count == 1
    assert cells(models).values(0) == ()


def test_keys_tell_cells_apart_and_depend_on_their_content_only(models: Path) -> None:
    small, large = cells(models, 2, 3), cells(models, 3, 4)
    keys = [small.key(i) for i in range(6)]
    assert len(set(keys)) == 6
    assert keys[4] == large.key(large.number(small.places(4)))


def test_a_file_that_the_scene_names_is_part_of_the_key(models: Path, tmp_path: Path) -> None:
    urdf = (models / "two_link.urdf").read_text()
    (tmp_path / "two_link.urdf").write_text(urdf)
    (tmp_path / "scene.toml").write_text((models / "two_link_reach.toml").read_text())
    before = Cells(Template.read(tmp_path / "scene.toml"), ()).key(0)
    assert before == cells(models).key(0)
    (tmp_path / "two_link.urdf").write_text(urdf + "\n<!-- changed -->\n")
    assert Cells(Template.read(tmp_path / "scene.toml"), ()).key(0) != before


@pytest.mark.parametrize("shape", [(1,), (9,), (3, 4, 2), (17, 5), (8, 8), (1, 6, 1)])
def test_parents_are_beside_a_cell_on_coarser_grids(models: Path, shape: tuple[int, ...]) -> None:
    found = cells(models, *shape, warm=True)
    assert found.parents(0) == ()
    done = {0}
    for number in sorted(range(1, found.count), key=lambda n: (found.rank(n), n)):
        assert found.parents(number)
        for parent in found.parents(number):
            pairs = zip(found.places(number), found.places(parent), strict=True)
            (step,) = (abs(a - b) for a, b in pairs if a != b)
            assert step & (step - 1) == 0
            assert all(place % step == 0 for place in found.places(number))
            assert found.rank(parent) <= found.rank(number) or parent == 0
    while True:  # each one can be begun when its parents are done
        more = {n for n in range(found.count) if n not in done and done >= {*found.parents(n)}}
        if not more:
            break
        done |= more
    assert done == set(range(found.count))


@pytest.mark.parametrize("shape", [(9,), (3, 4, 2), (17, 5), (1, 6, 1)])
def test_children_are_the_cells_with_this_parent(models: Path, shape: tuple[int, ...]) -> None:
    found = cells(models, *shape, warm=True)
    numbers = range(found.count)
    for number in numbers:
        own = [each for each in numbers if number in found.parents(each)]
        assert sorted(found.children(number)) == own


def test_cells_of_the_coarse_grid_start_from_their_own_guess_too(models: Path) -> None:
    found = cells(models, 9, 6, warm=True)
    own = [found.places(n) for n in range(found.count) if found.takes_own_guess(n)]
    assert own == [(i, j) for i in (0, 4, 8) for j in (0, 4)]


def test_a_warm_key_depends_on_all_cells_before_it(models: Path) -> None:
    warm, cold = cells(models, 1, 3, warm=True), cells(models, 1, 3)
    assert warm.key(2) != cold.key(2)
    other = Cells(warm.template, (warm.axes[0], listed([B], [9, 2, 3])), warm=True)
    assert cold.values(2) == other.values(2)
    assert other.key(2) != warm.key(2)


def test_one_field_inside_another_is_refused(models: Path) -> None:
    template = Template.read(models / "two_link_reach.toml")
    axes = (
        listed([FieldPath.of("goal.q")], [[0.0, 0.0]]),
        listed([FieldPath.of("goal.q[1]")], [1.0]),
    )
    with pytest.raises(SceneError, match="one contains the other"):
        Cells(template, axes)


def test_parameters_have_a_column_for_each_entry_of_values_of_one_form() -> None:
    axis = listed(
        [FieldPath.of("goal")], [{"q": [1, 2.0], "free": "x"}, {"q": [3, 4.0], "free": "y"}]
    )
    found = [(each.name, each.kind) for each in parameters_of([axis])]
    assert found == [("goal.q[0]", "whole"), ("goal.q[1]", "number"), ("goal.free", "text")]


def test_parameters_of_different_forms_are_one_text() -> None:
    axis = listed([FieldPath.of("goal")], [{"q": [1.0]}, {"q": [1.0, 2.0]}])
    (column,) = parameters_of([axis])
    assert (column.name, column.kind) == ("goal", "json")
    assert column.of({"q": [1.0]}) == '{"q": [1.0]}'

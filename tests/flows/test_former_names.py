"""Names of the last version: they still work, and a warning states the new one."""

import pytest

from hovi.flows import charted_interval, charted_segment, interval, segment


@pytest.mark.parametrize(
    ("former", "name", "module", "new"),
    [
        (segment, "Segment", interval, "Interval"),
        (segment, "SegmentLagrangian", interval, "FlatLagrangian"),
        (charted_segment, "ChartedSegment", charted_interval, "ChartedInterval"),
        (charted_segment, "symplectic_form", charted_interval, "symplectic_form"),
    ],
)
def test_a_former_name_is_the_new_one(former: object, name: str, module: object, new: str) -> None:
    with pytest.warns(DeprecationWarning, match=rf"{name} is now hovi\.flows\.\w+\.{new}\."):
        found = getattr(former, name)
    assert found is getattr(module, new)


def test_other_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Segments'"):
        getattr(segment, "Segments")  # noqa: B009

"""A narrow terminal gets more lines, not less of a number or a name."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.runs.fit_table import GAP, fit_table

words = st.text("abc19.-[]", min_size=1, max_size=9)
cells = st.lists(words, max_size=4).map(" ".join)


tables = st.integers(1, 7).flatmap(
    lambda n: st.lists(st.lists(cells, min_size=n, max_size=n), min_size=1, max_size=5)
)


@given(tables, st.integers(25, 120))
def test_every_word_fits_its_column_and_every_part_its_line(table, width):
    heads, rows = table[0], table[1:]
    parts = fit_table(heads, rows, width)
    shown = [parts[0].heads[0]]
    for part in parts:
        assert sum(part.widths) + GAP * (len(part.widths) - 1) <= width
        for i, columns in enumerate(part.widths):
            for cell in (part.heads[i], *(row[i] for row in part.rows)):
                assert all(len(word) <= columns for word in cell.split())
        assert part.heads[0] == heads[0]
        shown += part.heads[1:]
    assert shown == heads
    assert [row[0] for row in parts[-1].rows] == [row[0] for row in rows]


@pytest.mark.parametrize(("width", "count"), [(200, 1), (40, 1), (25, 2)])
def test_columns_that_find_no_place_go_below(width, count):
    rows = [["fr3_joint1", "-2.7437", "1.2912e-05"]]
    assert len(fit_table(["joint", "lower [rad]", "gravity [N·m]"], rows, width)) == count


def test_a_word_longer_than_a_line_stays_whole():
    (part,) = fit_table(["name"], [["x" * 50]], 30)
    assert part.widths == [50]

"""Labels move apart, and no further than they must."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.plots.labels import Line, label_ends, number, spread
from opspace.plots.style import dress, line_color, new_figure
from tests.plots import inspection

GAP, LOW, HIGH = 10.0, 5.0, 205.0
places = st.lists(st.floats(0.0, 210.0), min_size=1, max_size=20).map(sorted)


@given(places)
def test_labels_keep_their_distance_and_their_order(wanted):
    found = spread(np.array(wanted), GAP, LOW, HIGH)
    assert np.all(np.diff(found) >= GAP - 1e-9)
    assert found[0] >= LOW - 1e-9
    assert found[-1] <= HIGH + 1e-9


@given(places)
def test_labels_that_have_room_stay_where_they_are(wanted):
    apart = np.clip(wanted, LOW, HIGH)[:1]
    for place in wanted:
        if place - apart[-1] >= GAP and place <= HIGH:
            apart = np.append(apart, place)
    assert np.allclose(spread(apart, GAP, LOW, HIGH), apart)


def test_no_more_names_than_fit_and_the_liveliest_first():
    figure = new_figure(1.5)
    panel = figure.subplots()
    t = np.linspace(0.0, 1.0, 20)
    lines = [Line(f"line{i}", line_color(i), t, i * np.sin(6.0 * t)) for i in range(40)]
    for line in lines:
        panel.plot(line.x, line.y)
    dress(panel, x="time [s]", y="value [1]")
    label_ends({panel: lines})
    names = [text.get_text() for text in panel.texts]
    assert 3 <= len(names) < 15
    assert set(names) == {f"line{i}" for i in range(40 - len(names), 40)}
    assert inspection.overlaps(figure) == []


def test_a_line_without_a_value_has_no_name():
    panel = new_figure(1.5).subplots()
    label_ends({panel: [Line("nothing", line_color(0), np.arange(3.0), np.full(3, np.nan))]})
    assert not panel.texts


@given(st.floats(1e-6, 1e6))
def test_numbers_have_two_digits_that_count_and_no_exponent(value):
    text = number(value)
    assert "e" not in text
    assert abs(float(text) - value) <= 0.0501 * value
    assert len(text.replace(".", "").lstrip("0")) >= 2

"""Figures as pixels and as lines, each in a file of its own."""

import pytest

from opspace.errors import InputError
from opspace.plots import file_name, save
from opspace.plots.style import FORMATS, dress, new_figure

BEGINS = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


def drawn():
    figure = new_figure(2.0, 3.0)
    panel = figure.subplots()
    panel.plot([0.0, 1.0], [0.0, 1.0])
    panel.axvspan(0.2, 0.4)
    dress(panel, title="τ", x="time [s]")
    return figure


@pytest.mark.parametrize("ending", FORMATS)
def test_the_same_figure_gives_the_same_bytes(tmp_path, ending):
    first, second = (save(drawn(), tmp_path / f"{i}{ending}").read_bytes() for i in range(2))
    assert first == second
    assert first.startswith(BEGINS[ending])


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.png.txt"])
def test_another_ending_is_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"\.png, \.pdf, \.svg"):
        save(drawn(), tmp_path / name)


def test_figures_of_different_things_have_different_names():
    shown = [[], ["tau"], ["tau", "overlay"], ["tau", "tool/x"], ["b", "tau"], ["../b", "tau"]]
    shown += [[f"tasks/{i}" for i in range(n)] for n in (40, 41)]
    names = [file_name("plot", one) for one in shown]
    assert len(set(names)) == len(names)
    assert all("/" not in name and len(name) < 100 for name in names)
    assert names[0] == "plot"

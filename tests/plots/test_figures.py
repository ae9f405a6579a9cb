"""Every figure is there, is not blank, says what it shows and can be read."""

import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.image import imread

from opspace.errors import InputError, UnknownNameError
from opspace.plots import (
    joint_limit_figures,
    overlay_columns,
    overview_figure,
    plot_columns,
    singularity_figures,
)
from opspace.plots.joint_limit import limit_figure
from opspace.plots.joint_torque import torque_figure
from opspace.plots.overview import draw_overview
from opspace.plots.singular_directions_plot import (
    activation_figure,
    joint_speed_figure,
    position_figure,
)
from opspace.record import Column, Recorder, load
from tests.plots import inspection, synthetic

PICTURE = np.full((42, 48, 3), 128, dtype=np.uint8)

FIGURES = {
    "fig3": lambda s, j: joint_speed_figure(s),
    "fig4": lambda s, j: activation_figure(s["transition"]),
    "fig5": lambda s, j: position_figure(s["transition"]),
    "fig7": lambda s, j: limit_figure(j),
    "torque-singularity": lambda s, j: torque_figure(s),
    "torque-joint-limit": lambda s, j: torque_figure(j),
    "overview": lambda s, j: draw_overview({"singularity": s, "joint limit": j}, [PICTURE] * 2),
    "overview-one": lambda s, j: draw_overview({"singularity": s}),
    "columns": lambda s, j: plot_columns(s),
    "columns-one": lambda s, j: plot_columns({"run": j["switch"]}, ["tau", "tool/x", "levels"]),
    "overlay": lambda s, j: overlay_columns(s),
    "overlay-one": lambda s, j: overlay_columns(j, ["tool/x"]),
}


@pytest.fixture(params=FIGURES)
def figure(request, singularity, joint_limit):
    return FIGURES[request.param](singularity, joint_limit)


def test_a_figure_can_be_read(figure):
    assert inspection.unlabelled(figure) == []
    assert inspection.overlaps(figure) == []
    assert inspection.outside(figure) == []
    assert all(axes.has_data() for axes in figure.axes)


def test_files_are_written_and_not_blank(singularity, joint_limit, tmp_path):
    paths = singularity_figures(singularity, tmp_path / "new")
    paths += joint_limit_figures(joint_limit, tmp_path / "new")
    paths.append(overview_figure({"both": singularity}, tmp_path / "overview.png"))
    assert len(set(paths)) == 7
    for path in paths:
        image = imread(path)
        assert inspection.contrast(image[..., :3]) > 0.05
        assert image.shape[1] in (1350, 900)


def test_the_same_runs_give_the_same_file(singularity, tmp_path):
    paths = [overview_figure({"a": singularity}, tmp_path / f"{i}.png") for i in range(2)]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_nothing_global_changes(singularity, joint_limit):
    before = dict(mpl.rcParams)
    for name in ("fig4", "fig7", "overview"):
        FIGURES[name](singularity, joint_limit)
    assert dict(mpl.rcParams) == before
    code = "import sys, opspace.plots; sys.exit('matplotlib.pyplot' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("package", "module"),
    [("matplotlib", "plots"), ("mujoco", "pictures.snapshots"), ("PIL", "pictures.snapshots")],
)
def test_a_missing_package_is_named_with_its_extra(package, module):
    code = (
        f"import sys\nsys.modules[{package!r}] = None\n"
        "from opspace.errors import MissingExtraError\n"
        f"try:\n    import opspace.{module}\nexcept MissingExtraError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install 'opspace[sim]'" in done.stdout


def test_figures_show_the_runs_that_are_there(singularity, joint_limit, tmp_path):
    without = {"without": singularity["without"]}
    assert [path.stem for path in singularity_figures(without, tmp_path)] == [
        "fig3-joint-speed",
        "singularity-torque",
    ]
    assert len(joint_limit_figures({"transition": joint_limit["transition"]}, tmp_path)) == 2


def test_an_unknown_variant_is_refused(singularity, tmp_path):
    with pytest.raises(UnknownNameError, match=r"'transitions'.*did you mean 'transition'"):
        singularity_figures({"transitions": singularity["switch"]}, tmp_path)


@pytest.mark.parametrize("ticks", [0, 1])
def test_a_run_that_is_too_short_is_refused(ticks, tmp_path):
    run = synthetic.write(tmp_path / "run", {"t": np.zeros(ticks)})
    for draw in (singularity_figures, joint_limit_figures):
        with pytest.raises(InputError, match=f"{ticks} ticks"):
            draw({"transition": run}, tmp_path)
    with pytest.raises(InputError, match="no run"):
        singularity_figures({}, tmp_path)


def test_a_run_that_diverged_is_drawn(tmp_path):
    t = np.linspace(0.0, 1.0, 50)
    wild = np.where(t > 0.9, np.inf, 1.0)
    values = {"t": t, "tau/joint1": wild, "v/joint2": np.where(t > 0.9, np.nan, 2.0)}
    run = synthetic.write(tmp_path / "run", values, ended="stopped", reason="diverged")
    assert len(singularity_figures({"without": run}, tmp_path)) == 2
    draw_overview({"diverged": {"without": run}}).draw_without_rendering()


def test_a_run_in_which_nothing_happens_is_drawn(tmp_path):
    run = synthetic.write(tmp_path / "run", {"t": np.linspace(0.0, 1.0, 50)})
    assert len(singularity_figures({"transition": run}, tmp_path)) == 4
    assert len(joint_limit_figures({"transition": run}, tmp_path)) == 2
    draw_overview({"rest": {"switch": run}}).draw_without_rendering()


def test_points_of_the_activation_lie_on_the_curve_of_the_buffer(singularity):
    panel = activation_figure(singularity["transition"]).axes[0]
    points = next(line for line in panel.lines if line.get_marker() == "o")
    expected = [synthetic.FADING(float(sigma)).value for sigma in points.get_xdata()]
    assert np.allclose(points.get_ydata(), expected)
    fading = (points.get_ydata() > 0.05) & (points.get_ydata() < 0.95)
    assert fading.sum() >= 3


def test_a_joint_keeps_its_colour(singularity, joint_limit):
    colors = {
        tuple(line.get_color() for line in axes.lines[:6])
        for figure in (joint_speed_figure(singularity), torque_figure(joint_limit))
        for axes in figure.axes[:2]
    }
    assert len(colors) == 1


def test_columns_that_do_not_exist_are_refused(singularity):
    with pytest.raises(UnknownNameError, match=r"'tua'.*did you mean.*'tau'"):
        plot_columns(singularity, ["tua"])
    for draw in (plot_columns, overlay_columns):
        with pytest.raises(InputError, match="no recording"):
            draw({})


@pytest.fixture
def unlike(singularity, tmp_path):
    """A run, and one that lacks most columns and has another."""
    columns = [Column("t", "s"), Column("tool/x", "m"), Column("tool/w", "m")]
    with Recorder(tmp_path / "other", columns, {}) as recorder:
        for t in (0.0, 9.0):
            recorder.append([t, 0.5 + t, 1.0])
    return {"run": singularity["switch"], "other": load(tmp_path / "other")}


@pytest.mark.parametrize("draw", [plot_columns, overlay_columns])
def test_the_run_that_lacks_a_column_is_named(unlike, draw):
    with pytest.raises(UnknownNameError, match=r"column of \S*other 'tau'"):
        draw(unlike, ["tau"])
    with pytest.raises(InputError, match="none of q, v, tau, tasks"):
        draw(unlike)


def test_runs_of_other_columns_are_drawn_with_what_they_have(unlike):
    figure = plot_columns(unlike, ["tool"])
    run, other = figure.axes
    assert [len(axes.lines) for axes in (run, other)] == [3, 2]
    assert run.lines[0].get_color() == other.lines[0].get_color()
    assert {text.get_text() for text in run.texts} == {"y", "z"}
    assert {text.get_text() for text in other.texts} == {"x", "w"}
    assert inspection.overlaps(figure) == []


def test_overlaid_runs_have_a_line_each_with_their_name(unlike):
    figure = overlay_columns(unlike, ["tool"])
    assert [axes.get_title(loc="left") for axes in figure.axes] == [f"tool/{a}" for a in "xyzw"]
    x = figure.axes[0]
    shown = [line for line in x.lines if line.get_marker() == "None"]
    for line, recording in zip(shown, unlike.values(), strict=True):
        assert np.array_equal(
            line.get_xydata(), recording.data[:, [0, recording.names.index("tool/x")]]
        )
    assert {text.get_text() for text in x.texts} == {"run", "other"}
    ends = [line for line in x.lines if line.get_marker() == "x"]
    assert [line.get_xdata()[-1] for line in ends] == [unlike["run"].t[-1]]  # it ends before


@pytest.mark.parametrize("draw", [plot_columns, overlay_columns])
def test_a_run_without_a_tick_is_named(draw, tmp_path):
    empty = synthetic.write(tmp_path / "empty", {"t": np.zeros(0)})
    with pytest.raises(InputError, match=r"empty holds no tick"):
        draw({"empty": empty})

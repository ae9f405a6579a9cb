"""What the page reads from a recording and writes beside the robot."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import InputError, RecordingError
from opspace.record import Column, Recorder
from opspace.record.growing import GrowingRecording
from opspace.view import panels
from opspace.view.frame import Frame, FrameReader, LevelFrame, TaskFrame

NAMES = st.text(min_size=1, max_size=12)
PARTS = st.floats(0.0, 1.0)
NONE = np.zeros(0)


def columns(*tasks):
    names = ["t", "q/j", "v/j", "tau/j", "tool/x", "tool/y", "tool/z"]
    for task in tasks:
        names += [f"tasks/{task}/{part}" for part in ("activation", "level", "error/0")]
    names += ["levels/0.5/sigma/0", "levels/0.5/activation/0"]
    names += [f"levels/0.5/weakest/{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    return [Column(name, "1") for name in [*names, "limits/j/upper", "status"]]


def frame(tasks=(), levels=(), q=(0.5,), limits=None):
    values = np.array(q)
    return Frame(1.25, values, np.zeros(1), np.array([3.0]), tasks, levels, limits or {}, 1)


ABOUT = {"tasks": {"hold": {}}}


def test_a_growing_recording_shows_complete_rows_only(tmp_path):
    wanted = columns("hold")
    with Recorder(tmp_path, wanted, ABOUT) as recorder:
        growing = GrowingRecording(tmp_path)
        assert growing.refresh() == 0
        row = np.arange(len(wanted), dtype=float)
        recorder.append(row)
        assert growing.refresh() == 1
        with (tmp_path / "data.f64").open("ab") as file:
            file.write(b"half")
        assert growing.refresh() == 1
        assert not growing.ended
        found = FrameReader(growing).at(0)
        np.testing.assert_array_equal(found.q, row[1:2])
        assert found.tasks[0].name == "hold"
        assert found.levels[0].number == 0.5
        np.testing.assert_array_equal(found.levels[0].weakest, row[-8:-2])
        assert found.limits == {"j/upper": row[-2]}
        assert found.status == int(row[-1])
    assert growing.ended


def test_the_past_of_a_tick(tmp_path):
    with Recorder(tmp_path, columns(), {"tasks": {}}) as recorder:
        for k in range(1000):
            recorder.append(np.full(len(columns()), 0.001 * k))
        reader = FrameReader(GrowingRecording(tmp_path))
        history = reader.history(700, 0.5, 50, ["tau/j"])
        assert history[-1, 0] == 0.001 * 700
        assert 0.2 <= history[0, 0] <= 0.22
        assert len(history) <= 52
        np.testing.assert_array_equal(history[:, 0], history[:, 1])
        assert reader.row_at(0.25) == 250
        assert reader.row_at(99.0) == 999


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="cannot be read"):
        GrowingRecording(tmp_path)
    (tmp_path / "header.json").write_text('{"format": "other"}')
    with pytest.raises(RecordingError, match="not the header"):
        GrowingRecording(tmp_path)


def test_a_recording_without_torques_cannot_be_shown(tmp_path):
    with Recorder(tmp_path, [Column("t", "s")], ABOUT), pytest.raises(InputError, match="status"):
        FrameReader(GrowingRecording(tmp_path))


@given(NAMES, PARTS)
def test_a_bar_is_as_long_as_the_task_is_active(name, h):
    text = panels.tasks(frame([TaskFrame(name, h, 0.0, NONE)]))
    # Nothing of a name is ever read as HTML.
    assert text.count("<div") == text.count("</div")
    assert set(re.findall(r"</?(\w+)", text)) == {"div", "span"}
    assert re.search(rf"width:{100.0 * h:.1f}%", text)
    assert f">{h:.2f}<" in text


def test_tasks_stand_under_their_levels_and_absent_ones_below():
    levels = [LevelFrame(n, np.ones(1), np.ones(1), np.full(6, np.nan)) for n in (0.0, 1.0)]
    tasks = [
        TaskFrame("third", math.nan, math.nan, NONE),
        TaskFrame("second", 0.5, 1.0, NONE),
        TaskFrame("first", 1.0, 0.0, NONE),
    ]
    text = panels.tasks(frame(tasks, levels))
    order = [text.index(word) for word in ("level 0", ">first", "level 1", ">second", ">third")]
    assert order == sorted(order)
    gone = LevelFrame(7.0, np.full(1, np.nan), np.full(1, np.nan), np.full(6, np.nan))
    assert "level 7" not in panels.tasks(frame(tasks, [*levels, gone]))


@given(st.floats(-2.0, 2.0), PARTS)
def test_the_marker_of_a_joint_is_where_it_is_in_its_range(q, h):
    robot = {
        "lower": [-1.0], "upper": [1.0], "torque_limit": [6.0], "buffer": 0.2, "brake": {},
    }  # fmt: skip
    text = panels.joints(frame(q=[q], limits={"j/upper": h}), ["j"], robot)
    place = 100.0 * min(max(0.5 * (q + 1.0), 0.0), 1.0)
    assert f"left:{place:.1f}%" in text
    assert f"opacity:{0.25 + 0.75 * h:.2f}" in text
    assert "width:25.0%" in text  # the torque: half of its limit, on one half of the gauge
    assert "width:10.0%" in text  # the buffer: a tenth of the range


def test_colors_go_from_fading_to_active():
    assert panels.blend_color(1.0) == panels.ACTIVE.lower()
    assert panels.blend_color(0.0) == panels.FADED.lower()


def test_names_of_joints_lose_what_they_share():
    names = ["panda_joint1", "panda_joint2"]
    assert [panels.short(name, names) for name in names] == ["joint1", "joint2"]
    assert panels.short("elbow", ["elbow"]) == "elbow"

"""Words are recordings or columns, and which is never in doubt."""

import os

import numpy as np
import pytest

from opspace.errors import InputError, RecordingError, UnknownNameError
from opspace.record import Column, Recorder
from opspace.record.selection import select


def write(directory, *names):
    columns = [Column("t", "s"), *(Column(name, "1") for name in names)]
    with Recorder(directory, columns, {}) as recorder:
        recorder.append(np.zeros(len(columns)))


@pytest.fixture(autouse=True)
def runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("a", "tau/joint1", "tau/joint2", "tasks/position/activation")
    write("other/a", "tau/joint1", "v/joint1")
    write("tau", "tau/joint1")


def test_recordings_and_columns_come_in_any_order():
    found = select(["a", "tau/joint1", "other/a", "tasks/position"])
    assert [str(r.directory) for r in found.recordings.values()] == ["a", "other/a"]
    assert found.columns == ["tau/joint1", "tasks/position"]


def test_a_column_wins_over_a_directory_of_its_name_and_a_path_never_is_a_column():
    assert select(["a", "tau"]).columns == ["tau"]
    assert len(select(["a", "./tau"]).recordings) == 2
    assert [str(r.directory) for r in select(["tau", "a"]).recordings.values()] == ["tau", "a"]


def test_titles_tell_recordings_apart(tmp_path):
    assert list(select(["a"]).recordings) == ["a"]
    top = tmp_path.name
    assert list(select(["a", "other/a", "./tau"]).recordings) == [
        f"{top}/a",
        "other/a",
        f"{top}/tau",
    ]
    os.chdir("a")
    assert list(select(["."]).recordings) == ["a"]


def test_a_column_that_only_another_recording_has_is_left_to_who_draws():
    assert select(["a", "other/a", "v"]).columns == ["v"]


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        ([], InputError, "no recording"),
        (["tasks"], RecordingError, "tasks: there is no such directory"),
        (["a", "other"], RecordingError, "other is not a recording.*below it: other/a"),
        (["a", "a/"], InputError, "a is given twice"),
        (["a", "tua"], UnknownNameError, r"recording, or column of a 'tua'.*did you mean 'tau'"),
        (["a", "othr/a"], UnknownNameError, "othr/a"),
    ],
)
def test_other_words_are_refused(words, error, message):
    with pytest.raises(error, match=message):
        select(words)

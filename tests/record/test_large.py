"""A recording that is larger than the memory is read as far as somebody asks."""

import json
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

from opspace.errors import UnknownNameError
from opspace.record import Column, Recorder, load, reader
from opspace.record.format import DATA, END, HEADER
from opspace.record.pick_columns import pick_columns

NAMES = ("t", "q/a", "q/b", "tau/a", "tau/b")
READ = """
import resource
from opspace.record import load
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
run = load({directory!r})
{ask}
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.fixture
def rows(tmp_path):
    rows = np.random.default_rng(0).normal(size=(70, len(NAMES)))
    recorder = Recorder(tmp_path / "run", [Column(name, "1", name) for name in NAMES], {})
    for row in rows:
        recorder.append(row)
    recorder.close()
    return rows


@pytest.mark.parametrize("at_once", [1, 5, 35, 64, 10**6])
def test_it_holds_the_numbers_of_a_small_one(rows, tmp_path, monkeypatch, at_once):
    monkeypatch.setattr(reader, "LARGE", 0)
    monkeypatch.setattr("opspace.record.pick_columns._AT_ONCE", at_once)
    run = load(tmp_path / "run")
    assert isinstance(run.data, np.memmap)
    for i, name in enumerate(NAMES):
        np.testing.assert_array_equal(run[name], rows[:, i])
        assert not run[name].flags.writeable
        assert not isinstance(run[name], np.memmap)
    np.testing.assert_array_equal(run.group("tau"), rows[:, 3:])
    np.testing.assert_array_equal(pick_columns(run.data[10:20], [4, 0]), rows[10:20, [4, 0]])
    assert run.row(-1) == dict(zip(NAMES, rows[-1], strict=True))
    with pytest.raises(UnknownNameError, match="'q/a'"):
        run["q/c"]
    copy = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(copy["tau/a"], rows[:, 3])
    assert copy.header == dict(run.header)


@pytest.mark.skipif(sys.platform != "linux", reason="measures memory as Linux tells it, kB")
@pytest.mark.parametrize("ask", ["run['q/b'][-1]", "run['tau/a'].max()", "run.group('q').sum()"])
def test_a_column_takes_its_own_size_and_little_more(rows, tmp_path, ask):
    directory, count = tmp_path / "run", 15_000_000
    width = len(json.loads((directory / HEADER).read_text())["columns"])
    os.truncate(directory / DATA, 8 * width * count)  # 600 MB of nothing, which take no disk
    (directory / END).write_text(json.dumps({"ended": "completed", "reason": "", "rows": count}))
    code = READ.format(directory=str(directory), ask=ask)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    columns = 2 if "group" in ask else 1
    assert int(done.stdout) < 1.3 * 8e-3 * count * columns + 80_000

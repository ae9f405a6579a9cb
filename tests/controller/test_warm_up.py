"""The first start and every later one run the same compiled code."""

import os
import subprocess
import sys

import numpy as np
import pytest

from opspace.record import load

SMALL = """
import numpy as np
from opspace.machine.jit import jit

def total(x):
    return x.sum()

total = jit(total)

def calls():
    return [(total, (np.ones(3),))]
"""
START = """
import sys
import small
from opspace.controller.warm_up import ready
sys.executable = {python!r}
ready("a sum", small.calls)
stats = small.total.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""
RUN = "from opspace.cli import main; main()"


@pytest.fixture
def empty(tmp_path):
    """Run a program that finds nothing compiled in its first call, what the first left in the next."""
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "kept"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]),
    }

    def start(*words):
        return subprocess.run(
            [sys.executable, *words], env=environment, capture_output=True, text=True, check=True
        )

    return start


def test_another_process_compiles_at_the_first_start(empty, tmp_path):
    (tmp_path / "small.py").write_text(SMALL)
    program = START.format(python=sys.executable)
    first, second = (empty("-c", program) for _ in range(2))
    assert first.stdout.split() == second.stdout.split() == ["1", "0"]
    assert "compiled a sum" in first.stderr
    assert "compiled" not in second.stderr


def test_where_it_is_kept_may_be_set_in_the_program_and_paths_may_be_anything(empty, tmp_path):
    (tmp_path / "small.py").write_text(SMALL)
    own = f"""
import pathlib, sys, numba
sys.path.append(pathlib.Path("somewhere"))
numba.config.CACHE_DIR = {str(tmp_path / "own")!r}
"""
    assert empty("-c", own + START.format(python=sys.executable)).stdout.split() == ["1", "0"]


def test_what_the_other_process_says_is_of_no_importance(empty, tmp_path):
    noise = "import sys; sys.stderr.buffer.write(bytes([0xE9])); sys.stderr.buffer.flush()\n"
    (tmp_path / "small.py").write_text(noise + SMALL)
    program = "import io, sys; sys.stderr = io.TextIOWrapper(io.BytesIO())\n"
    program += START.format(python=sys.executable)
    assert empty("-c", program).stdout.split() == ["1", "0"]


@pytest.mark.parametrize("python", ["", "/opt/somewhere/robot-studio", "/nowhere/python3"])
def test_without_another_process_it_compiles_by_itself(empty, tmp_path, python):
    (tmp_path / "small.py").write_text(SMALL)
    assert empty("-c", START.format(python=python)).stdout.split() == ["0", "1"]


@pytest.mark.slow
def test_the_first_run_ever_gives_the_numbers_of_every_later_one(empty, tmp_path):
    for name in ("first", "second"):
        empty("-c", RUN, "run", "singularity", "--out", str(tmp_path / name))
    first, second = (load(tmp_path / name).data for name in ("first", "second"))
    np.testing.assert_array_equal(first, second)


UNWRITABLE = """
import numba.core.caching as caching
def refused(*args, **options):
    raise {error}
caching.tempfile.TemporaryFile = refused
caching.IndexDataCacheFile._open_for_write = refused
"""
FULL = """
import errno, numba.core.caching as caching
def full(*args, **options):
    raise OSError(errno.ENOSPC, "no space")
caching.IndexDataCacheFile._open_for_write = full
"""


@pytest.mark.parametrize("error", ["PermissionError()", "OSError(30, 'read-only')"])
@pytest.mark.parametrize("set_by_user", [True, False])
def test_who_may_only_read_starts_from_what_others_compiled(empty, tmp_path, error, set_by_user):
    own = "" if set_by_user else "import os; del os.environ['NUMBA_CACHE_DIR']\n"
    (tmp_path / "small.py").write_text(SMALL)
    program = START.format(python=sys.executable)
    first = empty("-c", own + program)
    assert first.stdout.split() == ["1", "0"]
    again = empty("-c", own + UNWRITABLE.format(error=error) + program)
    assert again.stdout.split() == ["1", "0"]
    assert not again.stderr


def test_where_nothing_can_be_kept_one_line_says_what_to_do(empty, tmp_path):
    (tmp_path / "small.py").write_text(SMALL)
    program = UNWRITABLE.format(error="PermissionError()") + START.format(python=sys.executable)
    for _ in range(2):
        done = empty("-c", program)
        assert done.stdout.split() == ["0", "1"]
        assert "every start" in done.stderr
        assert done.stderr.count("NUMBA_CACHE_DIR") == 1
        assert "it is kept" not in done.stderr


def test_a_full_disk_stops_nothing(empty, tmp_path):
    (tmp_path / "small.py").write_text(SMALL)
    done = empty("-c", FULL + START.format(python=""))
    assert done.stdout.split() == ["0", "1"]
    assert "compiled a sum" in done.stderr
    assert "it is kept" not in done.stderr

"""Exported controllers are timed beside others."""

import numpy as np
import pytest

import opspace as osc
from opspace.bench.scenes import SCENES
from opspace.bench.timing import TimesItself, interleaved
from opspace.export.timed_in_c import NAMES, check_in_c, timed_in_c
from tests.export.in_c import with_cc


@with_cc
def test_scenes_that_cannot_be_timed_in_c_are_refused_by_name():
    check_in_c(["puma", "panda", "standing"])
    for name in ("chain-2", "press"):
        with pytest.raises(osc.UnknownNameError, match=rf"timed in C '{name}'.*puma"):
            check_in_c(["puma", name])
    with pytest.raises(osc.UnknownNameError, match=r"scene 'pandas'"):
        check_in_c(["pandas"])


def test_a_compiler_is_needed(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(osc.InputError, match="needs a C compiler"):
        check_in_c(["puma"])


def test_what_times_itself_takes_its_turns_with_the_states_of_the_others():
    seen = []

    def block(q, v, durations):
        seen.append((q.copy(), durations.size))
        durations[:] = 7.0

    q = np.arange(5.0)[:, None]
    times = interleaved({"python": lambda q, v: None, "c": TimesItself(block)}, q, q, 700)
    assert [size for _, size in seen] == [500, 500, 200]
    assert all(np.array_equal(given, q) for given, _ in seen)
    np.testing.assert_array_equal(times["c"], 7.0)
    assert times["python"].shape == (700,)


@with_cc
@pytest.mark.slow
def test_both_kinds_of_kernels_are_timed():
    scene = SCENES["puma"]
    q, v = scene.states(scene.robot())
    times = interleaved(timed_in_c(scene), q, v, 100)
    assert set(times) == set(NAMES.values())
    assert all((found > 0.0).all() for found in times.values())

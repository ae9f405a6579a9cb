"""A paced run waits for the clock, and for people."""

import math
import time
from threading import Thread
from types import SimpleNamespace

import numpy as np
import pytest

from opspace.errors import InputError
from opspace.loop.pacing import Pacing

NOTHING = np.zeros(0)


def ticks(pacing, count, dt=0.001, done=None):
    for k in range(count):
        pacing.observe(NOTHING, NOTHING, SimpleNamespace(t=k * dt))
        if done is not None:
            done.append(k)


def until(condition):
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def test_a_run_takes_its_real_time_and_not_less():
    start = time.perf_counter()
    ticks(Pacing(2.0), 101)
    assert time.perf_counter() - start >= 0.05


def test_without_pacing_nothing_waits():
    start = time.perf_counter()
    ticks(Pacing(math.inf), 1000, dt=10.0)
    assert time.perf_counter() - start < 60.0


def test_a_paused_run_does_the_steps_asked_for_and_goes_on():
    pacing, done = Pacing(math.inf), []
    pacing.pause()
    thread = Thread(target=ticks, args=(pacing, 50), kwargs={"done": done}, daemon=True)
    thread.start()
    time.sleep(0.05)
    assert done == []
    pacing.step(3)
    until(lambda: len(done) == 3)
    time.sleep(0.05)
    assert done == [0, 1, 2]
    pacing.resume()
    thread.join(20.0)
    assert len(done) == 50


def test_a_run_that_waits_hears_of_another_speed():
    pacing, done = Pacing(0.01), []
    thread = Thread(target=ticks, args=(pacing, 20), kwargs={"done": done, "dt": 1.0})
    thread.start()
    until(lambda: len(done) == 1)
    pacing.speed = math.inf
    thread.join(20.0)
    assert len(done) == 20


def test_steps_that_were_not_taken_are_forgotten():
    pacing, done = Pacing(math.inf), []
    pacing.pause()
    pacing.step(3)
    pacing.resume()
    pacing.pause()
    thread = Thread(target=ticks, args=(pacing, 5), kwargs={"done": done}, daemon=True)
    thread.start()
    time.sleep(0.05)
    assert done == []
    pacing.resume()
    thread.join(20.0)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, 1e-300, "fast", None])
def test_a_speed_that_is_none_is_refused(speed):
    with pytest.raises(InputError, match="speed"):
        Pacing(speed)

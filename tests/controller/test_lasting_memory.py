"""What a compiled function is given the address of lasts until it returns."""

import ctypes

import numpy as np
import pytest

import opspace as osc
from opspace.machine.answer_call import AnswerParts
from opspace.plan.entries import ENTRIES, KERNELS

WORDS = 8
PANDA = osc.load_robot("panda")


def stack():
    tool = osc.PoseTask(target=([0.4, 0.2, 0.5], np.eye(3)))
    return osc.Stack([tool, osc.PostureTask(PANDA.q_reference)])


def watched(entry, function, seen):
    """A kernel whose caller is held up, while others make arrays, before it begins."""
    records = [i for i, kind in enumerate(entry.takes) if kind not in (int, float)]
    if entry.gives is AnswerParts:  # one place for all that it needs
        records = [entry.takes.index(np.ndarray) + 2]

    def call(*given):
        before = [(ctypes.c_uint64 * WORDS).from_address(given[i]) for i in records]
        kept = [tuple(words) for words in before]
        others = [np.full(size, 7.0) for size in range(1, 127) for _ in range(8)]
        assert [tuple(words) for words in before] == kept, (entry.name, len(others))
        seen.add(entry.name)
        return function(*given)

    return call


@pytest.fixture
def seen(monkeypatch):
    KERNELS.load()
    names = set()
    for entry in ENTRIES:
        call = watched(entry, KERNELS[entry.name], names)
        monkeypatch.setitem(KERNELS._functions, entry.name, call)
    return names


def test_no_kernel_is_given_memory_that_is_free_again(seen):
    q, v = PANDA.q_reference, np.zeros(7)
    driver = osc.Controller(PANDA, stack(), gravity="robot")
    assert driver.step(0.0, q, v).levels[0].sigma.size == 6
    driver.step(0.5, q, v)
    driver.torque_batch(np.stack([q, q]), np.stack([v, v]))
    learner = osc.Controller(PANDA, osc.Stack([osc.PoseTask(ki=10.0), osc.PostureTask()]))
    for tick in range(3):
        learner.step(0.001 * tick, q, v)
    # The record of cycles lasts as long as the loop that goes through them.
    assert seen == {entry.name for entry in ENTRIES} - {"cycles"}

"""What may be asked of a stack, what is refused, and when it happens."""

import threading

import numpy as np
import pytest

from opspace.errors import InputError, UnknownNameError
from opspace.stack import Stack
from opspace.tasks import JointLimits, JointTask, PositionTask


def joint(name):
    return JointTask("joint1", 0.0, name=name)


@pytest.fixture
def tasks():
    return {name: joint(name) for name in "abcd"}


@pytest.fixture
def stack(tasks):
    stack = Stack([JointLimits(), tasks["a"], [], tasks["b"]])
    stack.begin_tick(0.0)
    return stack


def names(stack):
    return {n: [t.name for t in level] for n, level in stack.levels_by_number.items()}


def after(stack, start=0.0, duration=1.0, dt=0.125):
    for t in np.arange(start, start + duration + dt, dt):
        members = stack.begin_tick(float(t))
    return {m.task.name: m for m in members}


def test_levels_are_numbered_and_new_ones_go_between(stack, tasks):
    assert names(stack) == {0.0: ["a"], 1.0: ["b"]}
    stack.insert(tasks["c"], 0.5, 0.1)
    stack.insert(tasks["d"], 1, 0.1)
    assert names(stack) == {0.0: ["a"], 1.0: ["b"]}  # not before the next tick
    after(stack)
    assert names(stack) == {0.0: ["a"], 0.5: ["c"], 1.0: ["b", "d"]}
    stack.move("b", -1, 0.1)
    stack.remove(tasks["c"], 0.1)
    after(stack)
    assert names(stack) == {-1.0: ["b"], 0.0: ["a"], 1.0: ["d"]}
    assert [task.name for task in stack] == ["b", "a", "d"]


@pytest.mark.parametrize(
    ("ask", "error", "message"),
    [
        (
            lambda s, t: s.insert(joint("a"), 3),
            InputError,
            "another task named 'a' is in the stack",
        ),
        (lambda s, t: s.insert(t["a"], 3), InputError, r"level 0; use move\('a', 3\)"),
        (lambda s, t: s.insert("c", 3), InputError, "takes a task, not str"),
        (lambda s, t: s.insert(JointLimits(), 3), InputError, "joint limits are always above"),
        (lambda s, t: s.insert(t["c"], "top"), InputError, "finite number, got 'top'"),
        (lambda s, t: s.insert(t["c"], float("nan")), InputError, "finite number, got nan"),
        (lambda s, t: s.insert(t["c"], True), InputError, "finite number, got True"),
        (lambda s, t: s.insert(t["c"], 1, -0.5), InputError, "duration must be .*got -0.5"),
        (lambda s, t: s.insert(t["c"], 1, float("inf")), InputError, "duration must be .*got inf"),
        (lambda s, t: s.insert(t["c"], 1, "1 s"), InputError, "duration must be .*got '1 s'"),
        (lambda s, t: s.insert(t["c"], 1, start_time=np.nan), InputError, "start time"),
        (lambda s, t: s.insert(t["c"], 1, profile="quintc"), UnknownNameError, "'quintic'"),
        (lambda s, t: s.remove("A"), UnknownNameError, r"unknown task .* 'A' \(valid: a, b\)"),
        (lambda s, t: s.remove(t["c"]), UnknownNameError, "'c'"),
        (lambda s, t: s.remove(joint("a")), InputError, "'a' in the stack is another one"),
        (lambda s, t: s.remove(3), InputError, "a task or its name is needed, not int"),
        (lambda s, t: s.move("c", 1), UnknownNameError, "'c'"),
        (lambda s, t: s.move("a", None), InputError, "finite number, got None"),
        (lambda s, t: s.swap("a", "a"), InputError, "two different tasks"),
        (lambda s, t: s.swap("a", "c"), UnknownNameError, "'c'"),
    ],
)
def test_impossible_requests_are_refused_at_once_and_change_nothing(
    stack, tasks, ask, error, message
):
    with pytest.raises(error, match=message):
        ask(stack, tasks)
    after(stack)
    assert names(stack) == {0.0: ["a"], 1.0: ["b"]}
    assert stack.settled


def test_requests_are_judged_with_those_that_wait(stack, tasks):
    stack.insert(tasks["c"], 2, 0.1)
    stack.move("c", 3, 0.1)  # not in yet, but asked for
    with pytest.raises(InputError, match="another task named 'c'"):
        stack.insert(joint("c"), 2)
    stack.remove("a", 0.1)
    with pytest.raises(UnknownNameError, match=r"valid: b, c"):
        stack.move("a", 5)
    with pytest.raises(InputError, match="'a' is still leaving"):
        stack.insert(joint("a"), 2)
    after(stack)
    assert names(stack) == {1.0: ["b"], 3.0: ["c"]}
    stack.insert(joint("a"), 2)  # the name is free now


def test_start_times_are_kept_to_the_fraction_of_a_tick(stack, tasks):
    stack.insert(tasks["c"], 2, 1.0, start_time=1.05)
    assert after(stack, 0.0, 1.0).keys() == {"a", "b"}
    assert stack.settled
    late = after(stack, 1.125, 0.125)["c"]
    assert late.presence.ramp.start_time == 1.05
    # What is in the past starts with the tick that finds it: an earlier start would be a step.
    stack.insert(tasks["d"], 2, 1.0, start_time=0.5)
    assert after(stack, 1.25, 0.0)["d"].presence.value(1.25) == 0.0


def test_later_requests_must_stay_possible(stack, tasks):
    stack.swap("a", "b", start_time=5.0)
    with pytest.raises(InputError, match=r"a request for t = 5 s impossible: unknown task .*'a'"):
        stack.remove("a")
    stack.remove("a", start_time=6.0)
    stack.cancel_scheduled()
    stack.remove("a", 0.1)
    after(stack, 0.0, 7.0)
    assert names(stack) == {1.0: ["b"]}


def test_a_removal_turns_an_insertion_around(stack, tasks):
    stack.insert(tasks["c"], 2, 1.0)
    half = after(stack, 0.0, 0.5)["c"].presence
    before = half.value(0.625)
    stack.remove("c", 1.0)
    stack.begin_tick(0.625)
    assert half.value(0.625) == before
    stack.insert(tasks["c"], 4, 1.0)  # back again, and to another level
    member = after(stack, 0.75, 0.0)["c"]
    assert member.presence is half
    assert [place.level for place in member.places] == [2.0, 4.0]
    member = after(stack, 0.875, 1.0)["c"]
    assert [place.level for place in member.places] == [4.0]
    assert stack.settled


def test_a_move_turned_around_goes_back_over_its_own_steps(stack, tasks):
    stack.move("a", 2, 1.0)
    member = after(stack, 0.0, 0.25)["a"]
    arrival = member.places[1].arrival
    stack.move("a", 0, 1.0)
    stack.begin_tick(0.5)
    assert [place.arrival for place in member.places] == [None, arrival]
    assert arrival.target == 0.0
    after(stack, 0.625, 1.0)
    assert [place.level for place in member.places] == [0.0]


def test_a_swap_moves_both_by_one_activation(stack, tasks):
    stack.swap("a", "b", 1.0)
    members = after(stack, 0.0, 0.25)
    shared = members["a"].places[1].arrival
    assert members["b"].places[1].arrival is shared
    stack.swap("b", "a", 0.5)
    stack.begin_tick(0.5)
    assert shared.target == 0.0
    stack.swap("b", "a", 0.5)
    stack.begin_tick(0.625)
    # One of them is wanted elsewhere: the other one's swap goes on.
    stack.move("a", 0, 0.25)
    after(stack, 0.75, 1.0)
    assert names(stack) == {0.0: ["a", "b"]}


def test_a_task_that_comes_again_holds_what_it_finds_then(stack):
    class Counting(PositionTask):
        resets = 0

        def reset(self):
            super().reset()
            self.resets += 1

    task = Counting(name="c")
    before = task.resets
    for start in (0.0, 2.0):
        stack.insert(task, 2, 0.25)
        after(stack, start, 0.5)
        stack.remove(task, 0.25)
        after(stack, start + 0.75, 0.5)
    assert task.resets == before + 2


def test_a_tick_never_waits_for_a_request(stack, tasks):
    """While another thread is inside a request, the tick goes on with what it knows."""
    inside, leave = threading.Event(), threading.Event()

    def dawdle():
        with stack._transitions._lock:
            inside.set()
            leave.wait(5.0)

    thread = threading.Thread(target=dawdle)
    thread.start()
    assert inside.wait(5.0)
    assert {m.task.name for m in stack.begin_tick(0.125)} == {"a", "b"}
    leave.set()
    thread.join()

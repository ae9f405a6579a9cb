"""A tick in which nothing has happened but that the robot has moved is one call, and no other tick."""

import pickle
import threading
import tracemalloc
import weakref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.controller import controller as under_test
from opspace.controller.controller import Controller
from opspace.errors import InputError
from opspace.machine.answer_call import layout_is_known
from opspace.robots import load_robot
from opspace.stack import Stack
from tests.budget import examples

DT = 1e-3
ROBOT = load_robot("puma560")


def controller_of(kind=Controller, **options):
    tasks = [osc.PositionTask(name="hand"), osc.PostureTask()]
    return kind(ROBOT.fresh(), Stack([osc.JointLimits(), *tasks]), **options)


class Looking(Controller):
    """Looks at everything at every tick."""

    def step(self, t, q, v, *, wrenches=None):
        return self._look(t, q, v, wrenches)


class Counting(Controller):
    """Counts the ticks that were not quiet."""

    looks = 0

    def _look(self, *args):
        self.looks += 1
        return super()._look(*args)


def state(k):
    return ROBOT.q_reference + 0.3 * np.sin(0.01 * k + np.arange(6)), np.cos(0.01 * k) * np.ones(6)


def assert_equal(one, other):
    assert (one.t, one.status, one.hard_solves) == (other.t, other.status, other.hard_solves)
    assert type(one.t) is float
    assert one.tau.tobytes() == other.tau.tobytes()
    assert one.report.memory == other.report.memory
    assert repr(one) == repr(other)


def test_this_interpreter_and_its_arrays_lie_as_they_are_read():
    assert layout_is_known()


@pytest.mark.parametrize("period", [None, DT])
@pytest.mark.parametrize("options", [{}, {"gravity": "robot"}, {"torque_limits": "priority"}])
def test_a_quiet_tick_is_what_a_look_at_everything_gives(period, options):
    quiet = controller_of(Counting, period=period, **options)
    looking = controller_of(Looking, period=period, **options)
    found = []
    for k in range(200):
        found.append((quiet.step(k * DT, *state(k)), looking.step(k * DT, *state(k))))
    for pair in found:  # the reports of all ticks, after the last
        assert_equal(*pair)
    assert quiet.looks <= 2


def test_no_tick_is_quiet_where_arrays_lie_otherwise(monkeypatch):
    monkeypatch.setattr(under_test, "layout_is_known", lambda: False)
    other, quiet = controller_of(Counting), controller_of()
    for k in range(5):
        assert_equal(other.step(k * DT, *state(k)), quiet.step(k * DT, *state(k)))
    assert other.looks == 5


@pytest.mark.parametrize("kept", range(7))
@pytest.mark.parametrize("view", [False, True])
def test_torques_that_somebody_has_stay_as_they_were(kept, view):
    quiet, looking = controller_of(Counting), controller_of(Looking)
    held = []
    for k in range(100):
        one, other = (c.step(k * DT, *state(k)).tau for c in (quiet, looking))
        held.append((one[:] if view else one, other))
        held = held[-kept:] if kept else []
        for ours, expected in held:
            assert ours.tobytes() == expected.tobytes()
        assert len({ours.ctypes.data for ours, _ in held}) == len(held)
    assert quiet.looks <= 2


def test_a_torque_that_nobody_has_is_an_array_again():
    quiet = controller_of(Counting)
    for k in range(3):  # from then on ticks are quiet
        last = weakref.ref(quiet.step(k * DT, *state(k)).tau)
    for k in range(3, 20):
        assert quiet.step(k * DT, *state(k)).tau is last()


def reshape(tau):
    tau.shape = (2, 3)


def shrink(tau):
    tau.resize(3, refcheck=False)


def lock(tau):
    tau.flags.writeable = False


def reinterpret(tau):
    tau.dtype = np.int64


def swap(tau):
    tau.dtype = np.dtype(">f8")


@pytest.mark.parametrize("change", [reshape, shrink, lock, reinterpret, swap])
def test_arrays_that_were_changed_are_not_used_again(change):
    quiet, looking = controller_of(Counting), controller_of(Looking)
    for k in range(30):
        one, other = (c.step(k * DT, *state(k)) for c in (quiet, looking))
        assert one.tau.flags.writeable
        assert one.tau.flags.owndata
        assert (one.tau.shape, one.tau.dtype) == (other.tau.shape, other.tau.dtype)
        assert one.tau.tobytes() == other.tau.tobytes()
        change(one.tau)
    assert quiet.looks <= 2


@given(
    st.lists(
        st.tuples(
            st.sampled_from([DT, 1.4e-3, 2e-3, 0.02, 0.0, -0.5, 1e-10]),
            st.sampled_from(["new", "same", "still"]),
        ),
        min_size=1,
        max_size=12,
    ),
    st.sampled_from(["report", "hold"]),
)
@examples(40)
def test_what_the_watchdog_says_is_said(steps, policy):
    quiet, looking = (
        controller_of(kind, period=DT, on_time_jump=policy) for kind in (Controller, Looking)
    )
    t, k, v = 0.0, 0, np.zeros(6)
    for passed, what in [(DT, "new"), (DT, "new"), *steps]:
        t += passed
        k += what == "new"
        v = np.zeros(6) if what == "still" else state(k)[1]
        one, other = (c.step(t, state(k)[0], v) for c in (quiet, looking))
        assert (one.t, one.status) == (other.t, other.status)
        assert one.tau.tobytes() == other.tau.tobytes()


FORMS = {
    "a list": list,
    "another dtype": lambda x: x.astype(np.float32).astype(">f8"),
    "every second number": lambda x: np.repeat(x, 2)[::2],
    "no aligned memory": lambda x: np.frombuffer(b"x" + x.tobytes(), np.uint8)[1:].view(float),
    "through a pipe": lambda x: pickle.loads(pickle.dumps(x)),
    "a view of memory": lambda x: x.data,
    "a class of its own": lambda x: x.view(np.recarray),
}


@pytest.mark.parametrize("form", FORMS)
def test_states_of_other_forms_are_taken_as_ever(form):
    given, plain = controller_of(Counting), controller_of()
    for k in range(4):
        q, v = state(k)
        forms = FORMS[form]
        assert_equal(given.step(k * DT, forms(q), forms(v)), plain.step(k * DT, forms(q), forms(v)))
    assert given.looks == 4
    given.step(1.0, *state(5))
    assert given.looks == 4


@pytest.mark.parametrize("time", [np.float64(0.5), 1, True, np.array(0.5)])
def test_times_of_other_forms_are_floats_in_the_command(time):
    controller = controller_of()
    controller.step(0.0, *state(0))
    command = controller.step(time, *state(1))
    assert type(command.t) is float
    assert command.t == float(time)


@pytest.mark.parametrize("period", [None, DT])
@pytest.mark.parametrize(
    "broken",
    [
        lambda q, v: (q[:5], v),
        lambda q, v: (q, np.append(v, 0.0)),
        lambda q, v: (q[:, None], v),
        lambda q, v: (np.where(np.arange(6) == 2, np.nan, q), v),
        lambda q, v: (q, np.where(np.arange(6) == 1, np.inf, v)),
        lambda q, v: ("six", v),
        lambda q, v: (None, v),
    ],
)
def test_what_is_no_state_is_refused_in_the_same_words(broken, period):
    words, after = [], []
    for kind in (Controller, Looking):
        controller = controller_of(kind, period=period)
        for k in range(3):
            controller.step(k * DT, *state(k))
        with pytest.raises(InputError) as error:
            controller.step(3 * DT, *broken(*state(3)))
        words.append(str(error.value))
        after.append(controller.step(4 * DT, *state(4)))
    assert words[0] == words[1]
    assert_equal(*after)


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -float("inf"), "now", None])
def test_what_is_no_time_is_refused(time):
    controller = controller_of()
    controller.step(0.0, *state(0))
    with pytest.raises(InputError, match="time must be"):
        controller.step(time, *state(1))


def test_a_state_without_a_finite_torque_brakes():
    commands = []
    for kind in (Controller, Looking):
        controller = controller_of(kind, period=DT)
        controller.step(0.0, *state(0))
        commands.append(controller.step(DT, state(1)[0], np.full(6, 1e200)))
        assert controller.step(2 * DT, *state(2)).status is not osc.Status.FAULT
    assert commands[0].status == commands[1].status
    assert osc.Status.FAULT in commands[0].status
    assert commands[0].tau.tobytes() == commands[1].tau.tobytes()


CHANGES = {
    "a target": lambda c: setattr(c.stack["hand"], "target", np.array([0.4, 0.1, 0.5])),
    "a gain": lambda c: setattr(c.stack["hand"], "kp", 50.0),
    "an activation": lambda c: setattr(c.stack["hand"], "activation", lambda robot, t: 0.5),
    "a payload": lambda c: c.carry(osc.Payload(1.5), 0.01),
    "a request": lambda c: c.stack.remove("hand", 0.01),
    "one for later": lambda c: c.stack.insert(osc.JointTask("joint3"), 0.5, start_time=0.011),
    "a hand-over": lambda c: c.hand_back(np.zeros(6), 0.01),
    "a take-over": lambda c: c.take_over(np.ones(6), 0.01),
    "a restart": lambda c: c.restart(),
}


@pytest.mark.parametrize("elsewhere", [False, True])
@pytest.mark.parametrize("what", CHANGES)
def test_whatever_is_asked_is_seen_by_the_next_tick(what, elsewhere):
    quiet, looking = controller_of(Counting, period=DT), controller_of(Looking, period=DT)
    for k in range(40):
        if k == 5:
            for one in (quiet, looking):
                if elsewhere:
                    thread = threading.Thread(target=CHANGES[what], args=(one,))
                    thread.start()
                    thread.join()
                else:
                    CHANGES[what](one)
        one, other = (c.step(k * DT, *state(k)) for c in (quiet, looking))
        assert one.tau.tobytes() == other.tau.tobytes()
        assert one.status == other.status
        assert one.tasks.keys() == other.tasks.keys()
        if k == 34:
            before = quiet.looks
    assert quiet.looks == before + (5 if what == "an activation" else 0), "quiet when it is over"


def test_the_robot_answers_for_the_state_of_a_quiet_tick():
    controller, robot = controller_of(), ROBOT.fresh()
    for k in range(4):
        controller.step(k * DT, *state(k))
        robot.update(*state(k))
        for ask in ("com_position", "com_jacobian"):
            np.testing.assert_allclose(
                getattr(controller.robot, ask)(), getattr(robot, ask)(), atol=1e-12
            )
        np.testing.assert_allclose(controller.robot.M, robot.M, atol=1e-12)


def test_a_command_keeps_nothing_alive_when_it_goes():
    controller = controller_of(Counting)
    q, v = state(0)
    for _ in range(100):
        controller.step(0.0, q, v)
    before = controller.looks
    tracemalloc.start()
    try:
        held = tracemalloc.get_traced_memory()[0]
        for _ in range(2000):
            controller.step(0.0, q, v)
        grown = tracemalloc.get_traced_memory()[0] - held
    finally:
        tracemalloc.stop()
    assert controller.looks == before
    assert grown < 10_000

"""Whatever a running controller or a recording is given: an answer, or an error of the library."""

import json
import random
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import OpspaceError
from opspace.plots.plot_columns import plot_columns
from opspace.record.format import DATA, END, HEADER, META
from opspace.runs.replay_run import replay
from opspace.scenario.build import build
from tests.budget import examples
from tests.scenario.short import short
from tests.scenario.test_fuzz import ODD, damaged, mutated, named

SEEDS = st.integers(0, 2**32 - 1)
ROBOT = osc.load_robot("puma560")
CONTROLLER = osc.Controller(
    ROBOT,
    osc.Stack(
        [osc.PositionTask(), osc.OrientationTask(), osc.PostureTask()],
        limits=osc.JointLimits(observer_time=0.01),
    ),
    torque_limits="priority",
)
NUMBERS = [0.0, -0.0, 1.0, -3.0, 1e200, -1e308, 5e-324, np.nan, np.inf, -np.inf]
ARRAYS = [
    np.zeros(6), np.ones(5), np.ones(7), np.zeros((6, 1)), np.zeros((1, 6)), np.zeros(0),
    np.full(6, 1j), np.array(["a"] * 6), np.array([None] * 6), np.zeros(6, dtype=np.float32),
    np.arange(6), np.array([True] * 6), np.zeros(6, dtype="datetime64[s]"), np.array(3.0),
    np.zeros(6, dtype=[("x", float)]), np.ma.masked_all(6), np.zeros(12)[::2], [0.0] * 6,
    [[0.0] * 3] * 2, "abcdef", b"abcdef", None, {}, {1, 2}, object(), lambda t: t, [0.0, [1.0], 2],
    [10**400] * 6, range(6), 1, 1.5, np.eye(3), [1.0, 0.0, 0.0, 0.0], np.zeros(4), np.ones(3),
]  # fmt: skip


def odd(rng):
    """A number, an array or something else that nobody should give."""
    kind = rng.random()
    if kind < 0.5:
        return rng.choice(ARRAYS)
    if kind < 0.9:
        return np.array([rng.choice(NUMBERS) for _ in range(rng.choice([3, 4, 6, 6, 6, 6]))])
    return rng.choice([*NUMBERS, *ODD])


def finite(command):
    assert np.isfinite(command.tau).all()
    assert np.all(np.abs(command.tau) <= ROBOT.torque_limit)


@given(SEEDS)
@examples(40)
def test_odd_states_and_times_get_an_answer_or_are_refused(seed):
    rng = random.Random(seed)
    state = [rng.choice([0.0, 1, "1", None, np.float32(2), *NUMBERS, object()]), odd(rng), odd(rng)]
    for i, good in enumerate((rng.uniform(0.0, 9.0), ROBOT.q_reference, np.zeros(6))):
        if rng.random() < 0.4:
            state[i] = good
    with np.errstate(all="ignore"):
        try:
            finite(CONTROLLER.step(*state))
        except OpspaceError as error:
            named(error)
        # And no state can spoil the ticks after it.
        finite(CONTROLLER.step(10.0, ROBOT.q_reference, np.zeros(6)))


@given(SEEDS)
@examples(40)
def test_odd_torques_to_take_over_or_hand_back_are_taken_or_refused(seed):
    rng = random.Random(seed)
    controller = CONTROLLER
    hand = rng.choice([controller.take_over, controller.hand_back])
    duration = rng.choice([0.5, 0.5, 0.5, odd(rng)])
    with np.errstate(all="ignore"):
        try:
            hand(odd(rng), duration)
        except OpspaceError as error:
            named(error)
        command = controller.step(rng.uniform(0.0, 9.0), ROBOT.q_reference, np.zeros(6))
    assert np.isfinite(command.tau).all()
    controller._handover = None


TASKS = {task.name: task for task in CONTROLLER.stack}
GOOD = {"position": [0.7, 0.2, 0.4], "orientation": np.eye(3), "posture": ROBOT.q_reference}
GIVEN = ("target", "target_velocity", "target_acceleration", "kp", "kv", "max_speed", "activation")


def make_good():
    for name, task in TASKS.items():
        task.activation, task.target = None, GOOD[name]
        task.max_speed, task.kp, task.kv = None, 100.0, None


@given(SEEDS)
@examples(40)
def test_odd_targets_and_gains_are_taken_or_refused(seed):
    """At their assignment or at the next tick, and good ones make everything good again."""
    rng = random.Random(seed)
    task, what, value = TASKS[rng.choice(list(TASKS))], rng.choice(GIVEN), odd(rng)
    timed = what == "activation" or (what == "target" and rng.random() < 0.3)
    with np.errstate(all="ignore"):
        try:
            setattr(task, what, (lambda *_: value) if timed else value)
            finite(CONTROLLER.step(1.0, ROBOT.q_reference, np.zeros(6)))
        except OpspaceError as error:
            named(error)
        make_good()
        finite(CONTROLLER.step(1.0, ROBOT.q_reference, np.zeros(6)))


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    """What a black box wrote."""
    built = build(short(duration=0.1))
    box = osc.BlackBox(
        built.controller, tmp_path_factory.mktemp("box"), ticks=8, header=built.header
    )
    q = built.plant.q
    for i in range(12):
        box.step(0.001 * i, q, np.zeros(6))
    box.step(0.012, q, np.full(6, 1e200))
    box.wait()
    return box.written[0]


@given(seed=SEEDS)
@examples(20)
def test_a_damaged_recording_is_one_or_is_refused(box, tmp_path_factory, seed):
    rng = random.Random(seed)
    path = tmp_path_factory.mktemp("fuzz") / "recording"
    shutil.copytree(box, path)
    file = path / rng.choice([HEADER, HEADER, END, META, DATA])
    if file.name == DATA:
        content = bytearray(file.read_bytes())
        for _ in range(rng.randint(1, 4)):
            content[rng.randrange(len(content))] = rng.randrange(256)
        file.write_bytes(bytes(content[: rng.choice([len(content), rng.randrange(len(content))])]))
    elif rng.random() < 0.6:
        content = mutated(json.loads(file.read_text()), rng)
        file.write_text(json.dumps(content, default=str))
    else:
        file.write_text(damaged(file.read_text(), rng))
    with np.errstate(all="ignore"):
        for use in (osc.load, replay, lambda path: plot_columns({"it": osc.load(path)})):
            try:
                use(path)
            except OpspaceError as error:
                named(error)
    shutil.rmtree(path)

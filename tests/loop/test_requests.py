"""What is asked for during a run is done between ticks, written down, and can be asked for again."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.controller import Controller
from opspace.errors import InputError, OpspaceError, RecordingError, UnknownNameError
from opspace.loop import simulate
from opspace.loop.requests import KINDS, Changes, RequestDesk, RequestPlayer, RunRequest
from opspace.robots import load_robot
from opspace.sim import Plant
from opspace.stack import Stack
from opspace.tasks import JointTask, OrientationTask, PoseTask, PositionTask, PostureTask

LEVELS = st.floats(-3.0, 3.0)
DURATIONS = st.floats(0.0, 2.0)
POINTS = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
NAMES = st.text(min_size=1, max_size=5)
REQUESTS = st.one_of(
    st.builds(RunRequest, st.just("insert"), st.tuples(NAMES), LEVELS, DURATIONS),
    st.builds(RunRequest, st.just("remove"), st.tuples(NAMES), st.none(), DURATIONS),
    st.builds(RunRequest, st.just("move"), st.tuples(NAMES), LEVELS),
    st.builds(RunRequest, st.just("swap"), st.tuples(NAMES, NAMES), duration=DURATIONS),
    st.builds(RunRequest, st.just("lead"), st.tuples(NAMES), position=POINTS),
    st.builds(RunRequest, st.just("gain"), st.tuples(NAMES), kp=st.floats(0.0, 1e3)),
    st.builds(RunRequest, st.just("press"), st.tuples(NAMES), force=POINTS),
    st.builds(RunRequest, st.just("spring"), st.tuples(NAMES), stiffness=POINTS),
)


class Run:
    """A PUMA with tasks to play with; every tick is kept."""

    def __init__(self):
        self.robot = load_robot("puma560")
        self.position = PositionTask(kp=100.0)
        self.elbow = JointTask("joint3", kp=50.0, name="elbow")
        tasks = [OrientationTask(), self.position, PostureTask(kp=20.0)]
        self.controller = Controller(self.robot, Stack(tasks))
        self.plant = Plant(self.robot, self.robot.q_reference)
        self.changes = Changes(self.controller, [self.elbow])
        self.rows = []

    def observe(self, q, v, command):
        self.rows.append(np.concatenate([[command.t], q, v, command.tau]))

    def go(self, duration, *observers):
        simulate(self.plant, self.controller, duration, [self, *observers])
        return np.array(self.rows)

    @property
    def tool(self):
        return self.robot.position(self.robot.frame_id(self.robot.tool)).copy()


class Asking:
    """Puts requests on a desk at some ticks."""

    def __init__(self, desk, requests):
        self.desk, self.requests, self.tick = desk, requests, 0

    def observe(self, q, v, command):
        for request in self.requests.get(self.tick, ()):
            self.desk.ask(request)
        self.tick += 1


@given(REQUESTS)
def test_a_request_survives_being_written_down(request_):
    text = json.dumps(request_.plain())
    assert RunRequest.read(json.loads(text)) == request_


JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=4,
)
ODD = st.sampled_from([True, 10**400, -1, [], {}, [1.0, 2.0], "5", [0.0] * 4, [1e30] * 3])
KEYS = st.sampled_from(
    ["level", "duration", "position", "orientation", "kp", "force", "stiffness", "color"],
)
VALUES = JSON | ODD | st.floats(-1e3, 1e3) | POINTS.map(list)
TASKS = st.sampled_from(["position", "elbow", "posture", "nobody"])
CONTENT = st.builds(
    lambda kind, tasks, rest: {"kind": kind, "tasks": tasks, **rest},
    st.sampled_from(sorted(KINDS)) | JSON,
    st.lists(TASKS, min_size=1, max_size=2) | JSON,
    st.dictionaries(KEYS, VALUES, max_size=3),
)


@given(CONTENT)
def test_anything_else_is_refused_with_an_error_of_ours(content):
    run = _shared_run()
    try:
        request = RunRequest.read(content)
        run.changes.apply(request, 0.0)
        run.changes.follow(1e3)
    except OpspaceError:
        return
    # What is taken is a request in every respect.
    assert content["kind"] in KINDS
    assert {k for k, v in content.items() if v is not None} <= {
        "kind", "tasks", *KINDS[content["kind"]],
    }  # fmt: skip
    json.dumps(request.plain(), allow_nan=False)


def _shared_run(found=[]):  # noqa: B006 - one for all examples, which change nothing when refused
    if not found:
        found.append(Run())
    return found[0]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({"kind": "inset", "tasks": ["a"]}, "insert"),
        ({"kind": "swap", "tasks": ["a"]}, "takes 2"),
        ({"kind": "remove", "tasks": ["a"], "level": 1.0}, "level"),
        ({"kind": "move", "tasks": ["a"]}, "needs level"),
        ({"kind": "insert", "tasks": ["a"], "wait": True}, "does not take wait"),
        ({"kind": "remove", "tasks": ["a"], "wait": 1}, "true or false"),
        ({"kind": "gain", "tasks": ["a"]}, "needs kp"),
        ({"kind": "press", "tasks": ["a"]}, "needs force"),
        ({"kind": "press", "tasks": ["a"], "force": 5.0}, "list of numbers"),
        ({"kind": "press", "tasks": ["a"], "force": [True]}, "must be a number"),
        ({"kind": "press", "tasks": ["a"], "force": [5.0], "duration": 1.0}, "duration"),
        ({"kind": "spring", "tasks": ["a"], "stiffness": [[5.0]]}, "must be a number"),
        ({"tasks": ["a"]}, "kind"),
        ({"kind": "gain", "tasks": ["a"], "kp": "5"}, "kp"),
        ({"kind": "gain", "tasks": ["a"], "kp": True}, "kp"),
        ({"kind": "remove", "tasks": "a"}, "tasks"),
        ({"kind": "lead", "tasks": ["a"], "position": [0.0, 1.0]}, "position"),
    ],
)
def test_the_error_says_what_is_wrong(content, says):
    with pytest.raises((InputError, UnknownNameError), match=says):
        RunRequest.read(content)


def test_the_same_requests_at_the_same_ticks_give_the_same_run(tmp_path):
    live = Run()
    answers = []
    log = tmp_path / "requests.jsonl"
    desk = RequestDesk(live.changes, log, lambda request, reason: answers.append(reason))
    goal = tuple(live.tool + [0.1, -0.05, 0.05])
    other = tuple(live.tool + [-0.05, 0.1, 0.0])
    asked = {
        20: [RunRequest("insert", ("elbow",), level=0.5, duration=0.1)],
        40: [RunRequest("lead", ("position",), position=goal)],
        70: [RunRequest("lead", ("position",), position=other)],
        90: [RunRequest("gain", ("position",), kp=250.0, duration=0.05)],
        100: [RunRequest("swap", ("elbow", "posture"), duration=0.05)],
        120: [RunRequest("remove", ("nobody",)), RunRequest("move", ("elbow",), level=-1.0)],
    }
    seen = live.go(0.2, Asking(desk, asked), desk)
    desk.close()
    assert [bool(reason) for reason in answers] == [False] * 5 + [True, False]
    assert "nobody" in answers[5]

    again = Run()
    repeated = again.go(0.2, RequestPlayer(again.changes, log))
    np.testing.assert_array_equal(repeated, seen)
    quiet = Run().go(0.2)
    assert np.abs(quiet - seen).max() > 0.1


def test_a_hundred_requests_at_once_are_dealt_with_one_after_each_tick(tmp_path):
    log = tmp_path / "requests.jsonl"
    live = Run()
    desk = RequestDesk(live.changes, log)
    asked = [RunRequest("move", ("posture",), level=2.0 + k % 2, duration=0.01) for k in range(100)]
    live.go(0.15, Asking(desk, {20: asked}), desk)
    desk.close()
    done = [json.loads(line) for line in log.read_text().splitlines()]
    assert [entry["level"] for entry in done] == [request.level for request in asked]
    np.testing.assert_allclose(np.diff([entry["at"] for entry in done]), 1e-3, atol=1e-9)


def test_of_many_gains_and_places_that_wait_only_the_last_counts(tmp_path):
    log, answers = tmp_path / "requests.jsonl", []
    live = Run()
    desk = RequestDesk(live.changes, log, lambda request, reason: answers.append(reason))
    asked = [RunRequest("gain", ("position",), kp=100.0 + k, duration=0.1) for k in range(40)]
    asked.insert(20, RunRequest("gain", ("posture",), kp=7.0, duration=0.1))
    asked.append(RunRequest("remove", ("posture",), duration=0.1))
    live.go(0.05, Asking(desk, {20: asked}), desk)
    desk.close()
    done = [json.loads(line) for line in log.read_text().splitlines()]
    assert [entry.get("kp") for entry in done] == [7.0, 139.0, None]
    assert answers == [""] * 42


def test_what_waits_when_the_run_ends_is_answered():
    answers = []
    live = Run()
    desk = RequestDesk(live.changes, None, lambda request, reason: answers.append(reason))
    asked = [RunRequest("move", ("posture",), level=5.0 + k, duration=0.1) for k in range(3)]
    live.go(0.02, Asking(desk, {19: asked}), desk)
    desk.close()
    assert answers == ["", "the run has ended", "the run has ended"]


def test_a_dragged_target_and_a_gain_make_no_step():
    # Half the tick halves the largest change of torque; a step would stay as it is.
    steps = []
    for dt in (0.001, 0.0005):
        run = Run()
        run.plant = Plant(run.robot, run.robot.q_reference, dt=dt)
        desk = RequestDesk(run.changes)
        asked = {}
        for k in range(6):
            goal = tuple(run.tool + 0.08 * np.array([np.cos(2.0 * k), np.sin(2.0 * k), 0.3 * k]))
            asked[round(0.03 * (k + 1) / dt)] = [
                RunRequest("lead", ("position",), position=goal),
                RunRequest("gain", ("position",), kp=100.0 + 60.0 * (k % 2), duration=0.05),
            ]
        rows = run.go(0.3, Asking(desk, asked), desk)
        steps.append(np.abs(np.diff(rows[:, -6:], axis=0)).max())
    assert steps[1] < 0.65 * steps[0]


@pytest.mark.parametrize("kind", [PositionTask, OrientationTask, PoseTask])
def test_a_led_task_arrives(kind):
    robot = load_robot("puma560")
    task = kind(kp=400.0)
    controller = Controller(robot, Stack([task, PostureTask(kp=20.0)]))
    changes = Changes(controller)
    plant = Plant(robot, robot.q_reference)
    simulate(plant, controller, 0.002)
    place = robot.frame_id(robot.tool)
    goal = {"position": tuple(robot.position(place) + [0.05, -0.04, 0.03])}
    if kind is OrientationTask:
        goal = {"orientation": (0.99, 0.1, 0.0, 0.0995)}
    changes.apply(RunRequest("lead", (task.name,), **goal), plant.t)
    simulate(plant, controller, 1.5)
    last = controller.step(plant.t, plant.q, plant.v)
    assert last.tasks[task.name].error_norm < 1e-4
    if "position" in goal:
        np.testing.assert_allclose(robot.position(place), goal["position"], atol=1e-4)


def test_what_cannot_be_led_says_so():
    run = Run()
    with pytest.raises(InputError, match="posture"):
        run.changes.apply(RunRequest("lead", ("posture",), position=(0.0, 0.0, 0.0)), 0.0)
    with pytest.raises(InputError, match="position"):
        run.changes.apply(RunRequest("lead", ("position",), orientation=(1.0, 0.0, 0.0, 0.0)), 0.0)
    with pytest.raises(InputError, match="kp"):
        run.changes.apply(RunRequest("gain", ("position",), kp=-1.0), 0.0)


def test_a_log_that_is_none_is_refused(tmp_path):
    run, log = Run(), tmp_path / "requests.jsonl"
    with pytest.raises(RecordingError, match="cannot be read"):
        RequestPlayer(run.changes, log)
    log.write_text('{"at": 0.1, "kind": "remove", "tasks": ["position"]}\n{"at": 1}\n')
    with pytest.raises(RecordingError, match=":2"):
        RequestPlayer(run.changes, log)


def test_numbers_of_numpy_are_numbers(tmp_path):
    run, answers = Run(), []
    log = tmp_path / "requests.jsonl"
    desk = RequestDesk(run.changes, log, lambda request, reason: answers.append(reason))
    desk.ask(RunRequest("lead", ("position",), position=np.array([0.4, 0.1, 0.5])))
    desk.ask(RunRequest("gain", ("position",), kp=np.float32(50.0)))
    desk.ask(RunRequest("insert", ("elbow",), level=np.int64(1)))
    run.go(0.01, desk)
    desk.close()
    assert answers == ["", "", ""]
    assert len(log.read_text().splitlines()) == 3


def test_a_gain_that_a_task_cannot_have_is_refused_before_it_is_on_its_way():
    robot = load_robot("puma560")
    task = PositionTask(kp=0.0, kv=0.0, max_speed=0.5)
    controller = Controller(robot, Stack([task, PostureTask()]))
    answers = []
    desk = RequestDesk(Changes(controller), None, lambda request, reason: answers.append(reason))
    desk.ask(RunRequest("gain", ("position",), kp=10.0))
    simulate(Plant(robot, robot.q_reference), controller, 0.01, [desk])
    assert "max_speed" in answers[0]
    assert task.kp == 0.0


def test_however_far_a_goal_is_it_is_led_to_at_the_speed_there_is():
    run, answers = Run(), []
    desk = RequestDesk(run.changes, None, lambda request, reason: answers.append(reason))
    desk.ask(RunRequest("lead", ("position",), position=(1e9, 0.0, 0.0)))
    torques = run.go(0.01, desk)
    assert answers == [""]
    assert len(torques) == 10
    assert np.abs(np.diff(torques, axis=0)).max() < 1.0


def test_the_goal_of_a_pose_that_is_not_given_is_kept():
    robot = load_robot("puma560")
    task = PoseTask(kp=400.0)
    controller = Controller(robot, Stack([task, PostureTask(kp=20.0)]))
    changes, plant = Changes(controller), Plant(robot, robot.q_reference)
    simulate(plant, controller, 0.002)
    place = robot.position(robot.frame_id(robot.tool)) + [0.03, 0.0, -0.02]
    changes.apply(RunRequest("lead", ("pose",), orientation=(0.99, 0.1, 0.0, 0.0995)), plant.t)
    simulate(plant, controller, 0.1)
    changes.apply(RunRequest("lead", ("pose",), position=place), plant.t)
    reference = task.target(plant.t + 60.0)
    np.testing.assert_allclose(reference.x[:3, 3], place)
    turned = task.quantity.check((place, (0.99, 0.1, 0.0, 0.0995)), "goal")
    np.testing.assert_allclose(reference.x, turned, atol=1e-12)


def test_a_log_must_go_forward_in_time(tmp_path):
    run, log = Run(), tmp_path / "requests.jsonl"
    line = '{{"at": {}, "kind": "remove", "tasks": ["position"]}}\n'
    for times, says in (((0.2, 0.1), "before"), (("NaN",), "finite")):
        log.write_text("".join(line.format(t) for t in times))
        with pytest.raises(RecordingError, match=says):
            RequestPlayer(run.changes, log)

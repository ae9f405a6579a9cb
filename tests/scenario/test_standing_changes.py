"""Robots that stand, while much changes at once, changes its mind half-way, or pushes them."""

import numpy as np
import pytest

from opspace.command import Status
from opspace.scenario import load_scenario, scenario_from
from tests.scenario.standing_runs import Seen

ONE_SIDE = {
    "g1": {"half": [0.085, 0.025], "offset": [0.035, 0.0, -0.035]},
    "talos": {"half": [0.1, 0.06]},
}
FRAMES = {
    "g1": ("{}_ankle_roll_link", "torso_link", "pelvis"),
    "talos": ("{}_sole_link", "torso_2_link", "base_link"),
}
MIDDLE = {"g1": 0.0, "talos": -0.017}
"""How far the centre of mass moves before the push, to be over the middle of the soles, m."""
PUSHED = 1.0


@pytest.mark.slow
def test_four_changes_at_once_move_the_torque_no_more_than_one():
    ours, hard = (
        Seen(load_scenario("humanoid-four-at-once", [f"method={method}"]))
        for method in ("transition", "switch")
    )
    print("four at once", ours.step(), hard.step(), max(ours.com))
    assert ours.outcome.completed
    assert ours.upright
    assert list(ours.controller.stack.contacts) == ["left", "right"]
    assert ours.controller.stack.settled
    assert ours.step() <= 0.5
    assert hard.step() >= 20.0 * ours.step()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_four_changes_at_once_with_masses_that_are_ten_per_cent_wrong(seed):
    seen = Seen(load_scenario("humanoid-four-at-once", ["plant.mass_error=0.1", f"seed={seed}"]))
    print(seed, seen.step(), max(seen.com))
    assert seen.upright
    assert "right" in seen.controller.stack.contacts
    assert seen.step() <= 0.5
    assert max(seen.com) <= 4e-3


def turned(events):
    """Turn every change of a list around half-way, and begin it again."""
    back = {"insert": "remove", "remove": "insert", "swap": "swap"}
    found = []
    for event in events:
        found.append(event)
        (kind,) = set(event) & set(back)
        if "when" in event or event["duration"] == 0.0:
            continue
        half, name = 0.5 * event["duration"], event[kind]
        returns = {"at": event["at"] + half, back[kind]: name, "duration": event["duration"]}
        found += [returns, {**event, "at": event["at"] + 1.5 * half}]
    return found


class Lands:
    """Turns the landing around: once half of the force is there it goes again, and comes back."""

    def __init__(self):
        self.turn = None

    def __call__(self, controller, command):
        stack, right = controller.stack, command.contacts.get("right")
        if command.t < 4.5 or right is None:
            return
        if self.turn is None and right.progress > 0.6:
            self.turn = command.t
            stack.remove("right", 0.3)
            stack.insert(next(task for task in stack if task.name == "foot"), 0.5, 0.3)
        elif self.turn is not None and command.t > self.turn + 0.1:
            self.turn = np.inf
            stack.insert(stack.contacts["right"], 0.3)
            stack.remove("foot", 0.3)


@pytest.mark.slow
def test_a_humanoid_that_turns_every_change_around_half_way():
    data = load_scenario("humanoid").model_dump(mode="json", exclude_none=True)
    data["events"] = turned(data["events"])
    seen = Seen(scenario_from(data), Lands())
    print("turned", seen.step(0.0, 4.5), seen.step(), max(seen.com), seen.controller.stack)
    assert seen.upright
    assert seen.asks.turn == np.inf
    assert "palm" not in seen.controller.stack.contacts
    assert seen.step(0.01, 4.5) <= 0.15
    assert seen.step() <= 0.5
    assert max(seen.com) <= 2e-3


def pushed(robot, impulse, axis, **options):
    """A standing robot that gets an impulse [N·s] at the pelvis within a tenth of a second."""
    foot, torso, pelvis = FRAMES[robot]
    soles = {
        side: {"type": "sole", "frame": foot.format(side), **ONE_SIDE[robot]}
        for side in ("left", "right")
    }
    middle = {"type": "minimum_jerk", "offset": [MIDDLE[robot], 0.0, 0.0], "duration": 0.9}
    force = (10.0 * impulse * np.eye(3)[axis]).tolist()
    return Seen(
        scenario_from(
            {
                "robot": robot,
                "duration": PUSHED + 2.5,
                "torque_limits": "priority",
                "contacts": soles,
                "tasks": {
                    "com": {"type": "com", "level": 0, "target": middle},
                    "torso": {"type": "orientation", "level": 1, "frame": torso},
                    "posture": {"type": "posture", "level": 2, "kp": 25.0},
                },
                "plant": {
                    "pushes": [{"at": PUSHED, "duration": 0.1, "force": force, "frame": pelvis}]
                },
                **options,
            }
        )
    )


def at_best(robot, impulse, lean, height):
    """How far an inverted pendulum goes whose foot presses with its edge from the push on, m.

    Args:
        robot: What is pushed, for a tenth of a second.
        impulse: Of the push, N·s.
        lean: Distance from the centre of mass to the edge that it is pushed to, m.
        height: Of the centre of mass, m.
    """
    speed = np.sqrt(9.81 / height)
    mass = np.linalg.norm(robot.gravity[:3]) / 9.81
    push = 10.0 * impulse / (mass * speed**2)
    after = (push - lean) * np.cosh(0.1 * speed) - push, (push - lean) * np.sinh(0.1 * speed)
    return lean - np.sqrt(after[0] ** 2 - after[1] ** 2)


def assert_it_stands_within_all_limits(seen, most):
    assert seen.upright
    assert seen.com[-1] < 1e-3
    assert seen.step(PUSHED + 0.102) <= most
    assert seen.beyond_joints() <= 0.05
    assert seen.beyond_motors() <= 0.0
    assert seen.cone_use <= 1.0 + 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "impulse", "axis", "most"),
    [
        ("g1", 8.0, 0, 1.0),
        ("g1", 8.0, 1, 1.0),
        ("g1", -8.0, 1, 1.0),
        ("talos", 25.0, 0, 4.0),
        ("talos", -25.0, 0, 4.0),
        ("talos", 25.0, 1, 4.0),
        ("talos", 30.0, 0, 30.0),
        ("talos", -30.0, 0, 30.0),
        ("talos", 30.0, 1, 4.0),
    ],
)
def test_a_push_is_taken_back_within_all_limits(robot, impulse, axis, most):
    seen = pushed(robot, impulse, axis)
    after = seen.step(PUSHED + 0.102)
    print(robot, impulse, axis, after, max(seen.com), seen.beyond_joints(), seen.beyond_motors())
    assert_it_stands_within_all_limits(seen, most)
    assert max(seen.com) <= (0.015 if robot == "g1" else 0.06)


@pytest.mark.slow
def test_a_push_from_the_front_goes_little_further_than_feet_without_a_step_let_it():
    """G1 stands nearer to its heels than to its toes."""
    seen = pushed("g1", -8.0, 0)
    robot = seen.controller.robot
    robot.update(seen.q[0], np.zeros(robot.nv))
    com, ankle = robot.com_position(), robot.position(robot.frame_id("left_ankle_roll_link"))
    heel = ankle[0] + ONE_SIDE["g1"]["offset"][0] - ONE_SIDE["g1"]["half"][0]
    least = at_best(robot, 8.0, com[0] - heel, com[2])
    print("from the front", seen.step(PUSHED + 0.102), max(seen.com), least)
    assert_it_stands_within_all_limits(seen, 1.0)
    assert least > 0.015
    assert max(seen.com) <= 1.3 * least


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "impulse", "axis"),
    [
        ("g1", 14.0, 0),
        ("g1", 20.0, 1),
        ("talos", 32.0, 0),
        ("talos", -32.0, 0),
        ("talos", 40.0, 1),
    ],
)
def test_as_much_as_feet_can_take_is_taken(robot, impulse, axis):
    """These are not balanced for much longer than a rule by the clock would let them be."""
    seen = pushed(robot, impulse, axis)
    unbalanced = sum(Status.NOT_BALANCED in status for status in seen.status)
    print(robot, impulse, axis, seen.step(PUSHED + 0.102), max(seen.com), unbalanced)
    assert seen.upright
    assert unbalanced > 300
    assert seen.com[-1] < 5e-3
    assert seen.beyond_motors() <= 0.0


@pytest.mark.slow
@pytest.mark.parametrize("impulse", [40.0, -40.0])
def test_who_cannot_be_saved_is_given_up_before_it_lies(impulse):
    seen = pushed("talos", impulse, 0)
    fell = next(i for i, status in enumerate(seen.status) if Status.FALLING in status)
    assert seen.q[fell][2] > 0.9 * seen.q[0][2]


SOLE = {"type": "sole", "frame": "{}_ankle_roll_link", **ONE_SIDE["g1"]}
TOES = {
    "robot": "g1",
    "duration": 4.6,
    "torque_limits": "priority",
    "contacts": {
        "left": {**SOLE, "frame": "left_ankle_roll_link"},
        "right": {**SOLE, "frame": "right_ankle_roll_link"},
        "toes": {
            "type": "edge",
            "frame": "right_ankle_roll_link",
            "half": 0.025,
            "offset": [0.12, 0.0, -0.03],
        },
    },
    "tasks": {
        "com": {
            "type": "com",
            "level": 0,
            "target": {
                "type": "minimum_jerk",
                "offset": [0.03, 0.04, 0.0],
                "start_time": 0.2,
                "duration": 1.0,
            },
        },
        "torso": {"type": "orientation", "level": 1, "frame": "torso_link"},
        "roll": {
            "type": "orientation",
            "level": 2,
            "frame": "right_ankle_roll_link",
            "present": False,
            "target": {
                "type": "stops",
                "moves": [
                    {"at": 2.1, "duration": 0.8, "offset": [0.0, 0.35, 0.0]},
                    {"at": 3.0, "duration": 0.8, "offset": [0.0, 0.0, 0.0]},
                ],
            },
        },
        "posture": {"type": "posture", "level": 9, "kp": 25.0},
    },
    "events": [
        {"at": 1.4, "insert": "roll", "level": 2, "duration": 0.0},
        {"at": 1.4, "insert": "toes", "duration": 0.3},
        {"at": 1.7, "remove": "right", "duration": 0.3},
        {"at": 3.9, "insert": "right", "duration": 0.3},
        {"at": 4.2, "remove": "toes", "duration": 0.3},
    ],
}
"""A foot rolls on its toes by 0.35 rad and back; its front is a part of the sole and the edge."""


class OnToes(Seen):
    """Watches the edge while it is what the right foot has."""

    def __init__(self, scenario):
        self.use, self.apart, self.turned, self.where = [], [], [], []
        super().__init__(scenario)

    def observe(self, q, v, command):
        super().observe(q, v, command)
        if "toes" not in command.contacts or "right" in command.contacts:
            return
        toes, robot, felt = (
            command.contacts["toes"],
            self.controller.robot,
            self.plant.contact_forces,
        )
        R, p = (of("right_ankle_roll_link") for of in (robot.rotation, robot.position))
        self.use.append(toes.cone_use)
        self.apart.append(toes.force - felt["toes"] - felt["right"])
        self.turned.append(np.arcsin(-R[2, 0]))
        self.where.append(p + R @ (0.12, 0.0, -0.03))


@pytest.mark.slow
def test_a_foot_rolls_on_its_toes_and_back_without_a_step():
    seen = OnToes(scenario_from(TOES))
    apart = np.sqrt(np.mean(np.square(seen.apart)))
    print("toes", seen.step(1.4), max(seen.com), max(seen.turned), max(seen.use), apart)
    assert seen.outcome.completed
    assert list(seen.controller.stack.contacts) == ["left", "right"]
    assert seen.step(1.4) <= 0.15
    assert max(seen.com) <= 2e-3
    assert max(seen.turned) == pytest.approx(0.35, abs=0.01)
    assert 0.0 < max(seen.use) <= 1.0 + 1e-6
    # The ball that stands for the toes rolls by its radius; it does not slide.
    assert np.max(np.ptp(seen.where, axis=0)) <= 0.35 * 0.005 + 5e-4
    assert apart <= 1.0

"""Scenarios of robots that stand: contacts that come and go by the clock and by what is felt."""

import numpy as np
import pytest

from opspace.command import Command, ContactStatus, Found, Status
from opspace.contacts import EdgeContact, PointContact, SoleContact
from opspace.errors import ScenarioError
from opspace.record import load
from opspace.record.contact_columns import felt_in
from opspace.runs.event_times import began
from opspace.runs.replay_run import replay
from opspace.runs.run import run_scenario
from opspace.scenario import scenario_from
from opspace.scenario.build import build
from opspace.scenario.document import parse
from opspace.scenario.events import Event
from opspace.scenario.triggers import Triggers
from tests.scenario.examples import STANDING

WEIGHT = 33.34114202 * 9.81


def standing(*overrides, **changes):
    return scenario_from({**parse(STANDING).data, **changes}, overrides)


# -- what is built ---------------------------------------------------------------------------------


def test_contacts_ground_and_events_are_built_from_their_entries():
    built = build(standing())
    assert {name: type(one) for name, one in built.contacts.items()} == {
        "left": SoleContact,
        "right": SoleContact,
        "palm": PointContact,
    }
    assert set(built.stack.contacts) == {"left", "right"}
    assert built.contacts["palm"].max_force == 50.0
    assert np.allclose(built.contacts["palm"].normal, [-1.0, 0.0, 0.0])
    assert built.plant.model.geom("opspace_touch/left/0").friction[0] == 0.7
    assert built.controller.singularity is None
    command = built.controller.step(0.0, built.plant.q, built.plant.v)
    assert set(command.contacts) == {"left", "right"}
    assert sum(c.force[2] for c in command.contacts.values()) == pytest.approx(WEIGHT, rel=0.02)


def test_a_foot_may_stand_on_an_edge():
    toes = {"type": "edge", "frame": "right_ankle_roll_link", "half": 0.025}
    left = parse(STANDING).data["contacts"]["left"]
    contacts = {"left": left, "right": {**toes, "offset": [0.12, 0.0, -0.035]}}
    built = build(standing(contacts=contacts, events=[]))
    edge = built.contacts["right"]
    assert isinstance(edge, EdgeContact)
    assert np.allclose(edge.along, [0.0, 1.0, 0.0])
    balls = [built.plant.model.geom(f"opspace_touch/right/{i}").pos[1] for i in range(2)]
    assert sorted(balls) == pytest.approx([-0.025, 0.025])
    command = built.controller.step(0.0, built.plant.q, built.plant.v)
    # Its own x is along the line, the world's y: it turns the foot about everything else.
    assert command.contacts["right"].force[2] > 10.0
    assert abs(command.contacts["right"].moment[1]) < 1e-9
    wrong = {**contacts, "right": {**toes, "along": [0.0, 0.0, 0.0]}}
    with pytest.raises(ScenarioError, match="zero"):
        standing(contacts=wrong, events=[])


def test_a_named_configuration_is_set_down_and_a_written_one_is_left():
    named = build(standing())
    foot = named.robot.frame_id("left_ankle_roll_link")
    named.robot.update(named.plant.q, named.plant.v)
    assert named.robot.position(foot)[2] == pytest.approx(0.035, abs=1e-9)
    written = [*named.robot.q_reference[:2], 0.9, *named.robot.q_reference[3:]]
    assert build(standing(start=written)).plant.q[2] == 0.9


def test_a_buffer_is_what_somebody_asked_for():
    assert standing().singularity is None
    assert standing("singularity.lower=0.1").singularity.lower == 0.1
    assert build(standing("falling=null")).controller._fall is None


@pytest.mark.parametrize(
    ("override", "key", "says"),
    [
        ("contacts.left.frame=nose", "contacts.left.frame", "unknown frame 'nose'"),
        ("contacts.left.half=[0.1, 0]", "contacts.left.half[1]", "above 0"),
        ("contacts.palm.normal=[0, 0, 0]", "contacts.palm.normal", "zero"),
        ("contacts.left.type=ball", "contacts.left.type", "sole, edge, point"),
        ("contacts.com={type: point, frame: pelvis}", "contacts.com", "name of a task"),
        ("ground.boards[0].contact=foot", "ground", "unknown contact 'foot'"),
        ("events[0].when.contact=foot", "events[0]", "unknown contact 'foot'"),
        ("events[0].when.force_below=1", "events[0].when", "either the key"),
        ("events[0].insert=foot", "events[0]", "unknown task or contact 'foot'"),
        ("events[0].level=1", "events[0]", "is a contact and has no level"),
        ("events[0].wait=true", "events[0].wait", "takes no wait"),
        ("events[1].remove=posture", "events[1]", "only contacts wait"),
        ("tasks.still.kp=5", "tasks.still.kp", "unknown key"),
        ("tasks.com.target.moves[1].at=0.2", "tasks.com.target.moves", "before 0.3 s"),
        ("falling.after=0", "falling.after", "above 0"),
        ("plant.pushes[0].frame=nose", "plant", "unknown frame of g1 'nose'"),
    ],
)
def test_what_cannot_be_is_refused_where_it_stands(override, key, says):
    with pytest.raises(ScenarioError) as refused:
        build(standing(override))
    assert refused.value.key == key
    assert says in str(refused.value)


def test_an_arm_has_no_contacts():
    with pytest.raises(ScenarioError, match="bolted down"):
        build(
            standing(robot="panda", tasks={"posture": {"type": "posture", "level": 0}}, events=[])
        )


# -- what is felt ----------------------------------------------------------------------------------


def told(t, **progress):
    zero = np.zeros(3)
    contacts = {
        name: ContactStatus(s, s, s, zero, zero, zero[:2], 0.0, False)
        for name, s in progress.items()
    }
    return Command(t, np.zeros(35), Status.OK, 1, Found({}, (), {}, contacts=contacts))


class Felt:
    """Triggers over made-up forces."""

    def __init__(self, when, at=0.0):
        self.force, self.asked = np.zeros(3), []
        foot = SoleContact("foot", (0.1, 0.1))
        wall = PointContact("hand", normal=(-1.0, 0.0, 0.0))
        self.triggers = Triggers(
            lambda: {"foot": self.force, "hand": self.force}, {"foot": foot, "hand": wall}
        )
        event = {"at": at, "when": when, "remove": when["contact"]}
        self.triggers.wait(Event.model_validate(event), self.asked.append)

    def see(self, t, force, **progress):
        self.force = np.asarray(force, dtype=float)
        self.triggers.observe(np.zeros(36), np.zeros(35), told(t, **progress))
        return len(self.asked)


def test_a_touch_starts_once_and_not_before_its_time():
    felt = Felt({"contact": "foot", "force_above": 7.0}, at=0.5)
    assert felt.see(0.4, [0, 0, 9.0]) == 0
    assert felt.see(0.5, [0, 0, 7.0]) == 0
    assert felt.see(0.6, [9.0, 0, 7.0]) == 0
    assert felt.see(0.7, [0, 0, np.nan]) == 0
    assert felt.see(0.8, [0, 0, 7.1]) == 1
    assert felt.see(0.9, [0, 0, 9.0]) == 1


def test_a_wall_is_felt_along_its_normal():
    felt = Felt({"contact": "hand", "force_above": 1.0})
    assert felt.see(0.0, [0, 5.0, 5.0]) == 0
    assert felt.see(0.1, [5.0, 0, 0]) == 0
    assert felt.see(0.2, [-1.1, 0, 0]) == 1


def test_a_loss_is_one_of_a_contact_that_is_in_and_must_last():
    felt = Felt({"contact": "foot", "force_below": 5.0, "lasting": 0.02})
    assert felt.see(0.00, [0, 0, 0]) == 0
    assert felt.see(0.01, [0, 0, 0], foot=0.99) == 0
    assert felt.see(0.02, [0, 0, 0], foot=1.0) == 0
    assert felt.see(0.03, [0, 0, 6.0], foot=1.0) == 0
    assert felt.see(0.04, [0, 0, 0], foot=1.0) == 0
    assert felt.see(0.05, [0, 0, 0], foot=1.0) == 0
    assert felt.see(0.06, [0, 0, 0], foot=1.0) == 1


# -- what is recorded ------------------------------------------------------------------------------

SHORT = [
    {
        "at": 0.0,
        "when": {"contact": "left", "force_above": 20.0},
        "insert": "palm",
        "duration": 0.02,
    },
    {"at": 0.04, "remove": "palm", "duration": 0.02},
    {"at": 0.02, "remove": "right", "duration": 0.1},
]


def test_a_run_is_recorded_with_its_contacts_and_replayed(tmp_path):
    scenario = standing(duration=0.06, events=SHORT, falling=None)
    run_scenario(scenario, tmp_path / "a")
    recording = load(tmp_path / "a")
    assert set(recording.header["contacts"]) == {"left", "right", "palm"}
    assert recording.units["contacts/left/force/z"] == "N"
    progress = recording["contacts/palm/progress"]
    begins = int(np.flatnonzero(np.isfinite(progress))[0])
    measured = np.array([found["left"][2] for found in felt_in(recording)])
    # Felt in one tick, inserted in the next; and gone again by the clock.
    assert measured[begins - 1] > 20.0
    assert np.all(measured[: begins - 1] <= 20.0)
    assert np.nanmax(progress) == 1.0
    assert progress[-1] < 1.0
    assert recording["contacts/right/progress"][-1] < 1.0
    assert np.allclose(recording.group("com")[0], recording.group("com")[-1], atol=0.01)
    assert began(scenario.events[0], recording) == recording.t[begins]
    assert began(scenario.events[1], recording) == 0.04
    found = replay(tmp_path / "a")
    assert found.gap == 0.0
    assert found.repeated

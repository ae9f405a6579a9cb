"""Events in a scenario do what the same requests to the stack do, and are told about."""

import numpy as np
import pytest

from opspace.cli import main
from opspace.errors import ScenarioError
from opspace.record import load
from opspace.runs.metrics import largest_torque_step
from opspace.runs.run import run_scenario
from opspace.runs.tables import timeline_table
from opspace.scenario import dump_scenario
from opspace.scenario.build import build
from tests.scenario.short import HOLD, short

TASKS = {
    **HOLD["tasks"],
    "elbow": {"type": "joint", "joint": "joint3", "level": 1, "kp": 50.0, "target": -2.5},
}
EVENTS = [
    {"at": 0.03, "remove": "elbow", "duration": 0.01},
    {"at": 0.005, "insert": "elbow", "level": 0.5, "duration": 0.01},
    {"at": 0.012, "swap": ["orientation", "position"], "duration": 0.02},
    {"at": 0.02, "move": "posture", "level": -1, "duration": 0.01},
]


def torques(built, ticks):
    found = []
    for _ in range(ticks):
        command = built.controller.step(built.plant.t, built.plant.q, built.plant.v)
        found.append(command.tau)
        built.plant.advance(command.tau)
    return np.array(found), command


def test_events_are_the_requests_of_the_same_names():
    ticks = 50
    with_events, last = torques(build(short(tasks=TASKS, events=EVENTS)), ticks)
    plain = build(short(tasks=TASKS, events=[{"at": 9.0, "insert": "elbow"}]))
    plain.stack.cancel_scheduled()
    elbow = plain.tasks["elbow"]
    plain.stack.insert(elbow, 0.5, 0.01, start_time=0.005)
    plain.stack.swap("orientation", "position", 0.02, start_time=0.012)
    plain.stack.move("posture", -1, 0.01, start_time=0.02)
    plain.stack.remove(elbow, 0.01, start_time=0.03)
    by_requests, _ = torques(plain, ticks)
    assert np.array_equal(with_events, by_requests)
    levels = {name: found.levels for name, found in last.tasks.items()}
    assert levels == {
        "orientation": ((1.0, 1.0),),
        "position": ((0.0, 1.0),),
        "posture": ((-1.0, 1.0),),
    }


def test_levels_have_the_numbers_of_the_file():
    entries = {name: {**entry, "level": 3 * entry["level"]} for name, entry in TASKS.items()}
    built = build(short(tasks=entries))
    assert {n: [t.name for t in tasks] for n, tasks in built.stack.levels_by_number.items()} == {
        0.0: ["orientation"],
        3.0: ["position", "elbow"],
        6.0: ["posture"],
    }


def test_a_switch_happens_within_a_tick():
    built = build(short(tasks=TASKS, events=EVENTS, method="switch"))
    seen = set()
    for _ in range(50):
        command = built.controller.step(built.plant.t, built.plant.q, built.plant.v)
        built.plant.advance(command.tau)
        seen |= {found.activation for found in command.tasks.values()}
        assert all(len(found.levels) == 1 for found in command.tasks.values())
    assert seen == {1.0}


def test_everything_that_appears_is_recorded(tmp_path):
    run = run_scenario(short(tasks=TASKS, events=EVENTS), tmp_path)
    h = run.recording["tasks/elbow/activation"]
    t = run.recording.t
    assert np.all(np.isnan(h[t < 0.005]))
    assert np.all(h[(t > 0.0155) & (t < 0.0295)] == 1.0)
    assert np.nanmax(np.abs(run.recording["levels/-1/sigma/5"])) > 0.0
    assert np.nanmax(np.abs(run.recording["levels/0.5/sigma/0"])) > 0.0


def test_the_timeline_is_in_order_and_measured(tmp_path):
    scenario = short(tasks=TASKS, events=EVENTS)
    run = run_scenario(scenario, tmp_path)
    heads, rows = timeline_table(scenario.events, run.recording)
    assert [row[0] for row in rows] == ["0.005", "0.012", "0.020", "0.030"]
    assert [row[2] for row in rows] == [
        "insert elbow",
        "swap orientation, position",
        "move posture",
        "remove elbow",
    ]
    assert len({len(heads), *map(len, rows)}) == 1
    steps = np.abs(np.diff(run.recording.group("tau"), axis=0)).max(axis=1)
    assert largest_torque_step(run.recording, 0.0, 0.05) == steps.max()
    assert float(rows[0][4]) == pytest.approx(steps[3:16].max(), rel=0.01)


def test_the_command_prints_the_timeline(tmp_path, capsys):
    path = tmp_path / "my.yaml"
    path.write_text(dump_scenario(short(tasks=TASKS, events=EVENTS)), encoding="utf-8")
    with pytest.raises(SystemExit) as raised:
        main(["run", str(path), "--out", str(tmp_path / "out")])
    assert raised.value.code == 0
    printed = capsys.readouterr().out
    assert printed.index("insert elbow") < printed.index("swap orientation, position")
    assert load(tmp_path / "out").ended.how == "completed"


@pytest.mark.parametrize(
    ("events", "place", "says"),
    [
        ([{"at": 0.0, "insert": "elbow"}, {"at": 0.01, "insert": "elbow", "level": 3}], 1, "move"),
        ([{"at": 0.02, "move": "elbow", "level": 0}, {"at": 0.01, "remove": "elbow"}], 0, "elbow"),
    ],
)
def test_an_event_that_cannot_happen_is_named(events, place, says):
    with pytest.raises(ScenarioError, match=says) as raised:
        build(short(tasks=TASKS, events=events))
    assert raised.value.key == f"events[{place}]"


def test_a_task_that_is_not_present_waits_until_it_is_asked_for():
    tasks = {
        **HOLD["tasks"],
        "guest": {"type": "joint", "joint": "joint1", "level": 1, "present": False},
    }
    built = build(short(tasks=tasks))
    assert "guest" in built.tasks
    assert "guest" not in [task.name for task in built.stack]
    built.stack.insert(built.tasks["guest"], level=0.5)
    built.controller.step(0.0, built.plant.q, built.plant.v)
    assert built.stack.levels_by_number[0.5] == (built.tasks["guest"],)

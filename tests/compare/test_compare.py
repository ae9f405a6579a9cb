"""Other methods run under the same protocol, and are what their names say."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from tests.scenario.short import HOLD, short

from opspace.cli import main
from opspace.compare import METHODS, compare_scenario
from opspace.compare.laws import continuous_inverse, damped_inverse, stack_of_tasks
from opspace.compare.methods import methods_left_out
from opspace.compare.tsid_model import tsid_installed
from opspace.errors import InputError, UnknownNameError
from opspace.law import TaskSet, task_torque
from opspace.scenario import dump_scenario, load_scenario
from opspace.scenario.build import build

TASKS = {
    **HOLD["tasks"],
    "elbow": {"type": "joint", "joint": "joint3", "level": 1, "kp": 50.0, "target": -2.5},
}
ONE = [{"at": 0.01, "insert": "elbow", "level": -1, "duration": 0.03, "profile": "linear"}]
FOR_THE_PUMA = [n for n, m in METHODS.items() if m.installed() and m.bolted and n != "tsid"]
"""TSID takes robots from a URDF only."""
BOTH = [
    {"at": 0.02, "insert": "elbow", "level": -1, "duration": 0.1},
    {"at": 0.08, "swap": ["orientation", "position"], "duration": 0.1},
]


def torques(scenario, name, ticks):
    """Torques of a method along the states of the library's own run."""
    own = build(scenario)
    other = build(METHODS[name].scenario(scenario), METHODS[name].controller)
    found = []
    for _ in range(ticks):
        t, q, v = own.plant.t, own.plant.q, own.plant.v
        command = own.controller.step(t, q, v)
        found.append((command.tau, other.controller.step(t, q, v).tau))
        own.plant.advance(command.tau)
    return np.array(found)


@pytest.mark.parametrize("event", ["insert", "remove", "swap"])
def test_a_single_transition_is_the_cross_fade_of_the_two_hard_torques(event):
    events = {
        "insert": ONE,
        "remove": [{"at": 0.01, "remove": "elbow", "duration": 0.03, "profile": "linear"}],
        "swap": [{"at": 0.01, "swap": ["posture", "elbow"], "duration": 0.03, "profile": "linear"}],
    }[event]
    found = torques(short(tasks=TASKS, events=events, blending="idv"), "cross-fade", 50)
    hard = torques(short(tasks=TASKS, events=events), "switch", 50)
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=0, atol=1e-9 * np.abs(found).max())
    assert np.abs(hard[:, 0] - hard[:, 1]).max() > 1.0


def test_cross_fades_that_overlap_are_continuous_and_end_where_they_should():
    scenario = short(tasks=TASKS, events=BOTH, duration=0.25)
    found = torques(scenario, "cross-fade", 250)
    steps = np.abs(np.diff(found[:, 1], axis=0)).max(axis=1)
    hard = torques(scenario, "switch", 250)
    assert steps.max() < 0.2 * np.abs(np.diff(hard[:, 1], axis=0)).max()
    np.testing.assert_allclose(found[-1, 0], found[-1, 1], rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def compared():
    return compare_scenario(short(tasks=TASKS, events=BOTH, duration=0.25), FOR_THE_PUMA)


def test_every_method_is_measured(compared):
    assert list(compared.rows) == FOR_THE_PUMA
    assert set(METHODS) - set(methods_left_out(short())) - {"tsid"} == set(FOR_THE_PUMA)
    for name, row in compared.rows.items():
        assert row.torque_step > 0.0, name
        assert row.tick > 0.0
        assert row.overshoot >= 0.0
    heads, rows = compared.table()
    assert {len(row) for row in rows} == {len(heads)}


def test_a_switch_steps_and_a_transition_does_not(compared):
    rows = compared.rows
    assert rows["switch"].torque_step > 5.0 * rows["opspace"].torque_step
    assert rows["gain-ramp"].torque_step > 1.2 * rows["opspace"].torque_step
    assert rows["rate-clamp"].torque_step <= 1.0 + 1e-9
    assert rows["as-printed"].leak is not None


def test_priorities_leak_where_they_are_weights(compared):
    assert compared.rows["opspace"].leak < 1e-6
    assert compared.rows["soft-weights"].leak > 100.0 * compared.rows["opspace"].leak


@pytest.mark.parametrize("inverse", [continuous_inverse, damped_inverse])
def test_baseline_laws_are_the_hard_law_where_nothing_moves(inverse):
    rng = np.random.default_rng(3)
    B = rng.normal(size=(7, 7))
    M = B @ B.T + np.eye(7)
    tasks = [
        TaskSet(3.0 * rng.normal(size=(3, 7)), rng.normal(size=3), k, sigma_reference=0.05)
        for k in range(2)
    ]
    tau = stack_of_tasks(np.linalg.cholesky(M), tasks, [1.0, 1.0], inverse)
    np.testing.assert_allclose(tau, task_torque(M, tasks), rtol=0, atol=1e-9)


def test_the_continuous_inverse_is_the_blend_on_one_level():
    rng = np.random.default_rng(4)
    M = np.diag(rng.uniform(0.5, 2.0, 7))
    h = [0.3, 0.8]
    tasks = [TaskSet(3.0 * rng.normal(size=(2, 7)), rng.normal(size=2), 0, x) for x in h]
    tau = stack_of_tasks(np.linalg.cholesky(M), tasks, h, continuous_inverse)
    np.testing.assert_allclose(tau, task_torque(M, tasks), rtol=0, atol=1e-10)


def test_an_unknown_method_is_refused_with_the_valid_ones():
    with pytest.raises(UnknownNameError, match=r"swich.*switch"):
        compare_scenario(short(), ["swich"])


def test_a_run_that_is_given_up_is_a_row(tmp_path):
    scenario = short("stop.max_torque=30", tasks=TASKS, events=BOTH)
    (row,) = compare_scenario(scenario, ["switch"], tmp_path).rows.values()
    assert not row.completed
    assert row.stopped_at is not None


def test_the_command_writes_table_figure_and_numbers(tmp_path, capsys):
    path = tmp_path / "my.yaml"
    path.write_text(dump_scenario(short(tasks=TASKS, events=ONE)), encoding="utf-8")
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as raised:
        main(["compare", str(path), "--method", "opspace", "--method", "switch", "--out", str(out)])
    assert raised.value.code == 0
    printed = capsys.readouterr().out
    assert "hard switch" in printed
    found = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    assert list(found["methods"]) == ["opspace", "switch"]
    assert (out / "compare.png").stat().st_size > 5000


def test_tsid_is_left_out_where_it_is_not_installed(monkeypatch):
    monkeypatch.setattr("opspace.compare.tsid_model.tsid_installed", lambda: False)
    assert "tsid" in METHODS
    built = build(short(), METHODS["tsid"].controller)
    with pytest.raises(InputError, match="needs TSID's Python package"):
        built.controller.step(0.0, built.plant.q, built.plant.v)


@pytest.fixture
def with_tsid(monkeypatch):
    """A TSID that is there, as far as is asked of it."""
    there = replace(METHODS["tsid"], installed=lambda: True)
    few = {"opspace": METHODS["opspace"], "cbf-qp": METHODS["cbf-qp"], "tsid": there}
    for place in ("methods", "run_methods"):
        monkeypatch.setattr(f"opspace.compare.{place}.METHODS", few)
    monkeypatch.setattr("opspace.compare.tsid_model.tsid_module", lambda: None)


def test_a_method_that_cannot_run_a_scenario_is_left_out_and_says_why(with_tsid):
    seen = {"type": "relative_position", "level": 3, "reference_frame": "link1"}
    for scenario, why in (
        (short(robot="ur5", collisions={}), "keeps nothing apart"),
        (short(tasks={**TASKS, "seen": seen}), "no task like 'seen'"),
        (short(), "needs a robot from a URDF, not .*xml"),
    ):
        assert re.search(why, methods_left_out(scenario)["tsid"])
    assert set(methods_left_out(load_scenario("humanoid"))) == {"cbf-qp"}


def test_what_is_left_out_is_told_and_what_is_named_is_not(with_tsid, tmp_path, capsys):
    path, out = tmp_path / "my.yaml", tmp_path / "out"
    path.write_text(dump_scenario(short()), encoding="utf-8")
    with pytest.raises(SystemExit) as raised:
        main(["compare", str(path), "--out", str(out)])
    assert raised.value.code == 0
    assert "left out: tsid, the method tsid needs a robot from a URDF" in capsys.readouterr().out
    found = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    assert list(found["methods"]) == ["opspace", "cbf-qp"]
    assert list(found["left_out"]) == ["tsid"]
    with pytest.raises(InputError, match="needs a robot from a URDF"):
        compare_scenario(short(), ["tsid"])


def test_a_tsid_that_does_not_import_is_left_out(with_tsid, monkeypatch):
    def broken():
        raise InputError("the one that is there does not import")

    monkeypatch.setattr("opspace.compare.tsid_model.tsid_module", broken)
    assert methods_left_out(short(robot="ur5"))["tsid"].endswith("does not import")


@pytest.mark.skipif(not tsid_installed(), reason="needs TSID's Python package")
def test_tsid_asks_for_the_same_accelerations():
    """Without conflict and with one task in each level a weighted program is nearly a hierarchy."""
    bent = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8]
    posture = {"type": "posture", "level": 2, "kp": 25.0}
    tasks = {"position": HOLD["tasks"]["position"], "posture": posture}
    scenario = short(robot="panda", start=bent, tasks=tasks)
    found = torques(scenario, "tsid", 3)
    np.testing.assert_allclose(found[:, 1], found[:, 0], rtol=0, atol=0.5)


def test_a_robot_that_stands_is_measured_with_the_forces_of_its_contacts():
    scenario = load_scenario("humanoid-push", ["duration=0.01"])
    found = compare_scenario(scenario, ["opspace", "soft-weights"])
    ours, weighted = found.rows["opspace"], found.rows["soft-weights"]
    assert ours.completed
    assert weighted.completed
    assert ours.leak < 1e-6
    assert 1e-6 < weighted.leak < 1.0
    assert ours.overshoot == 0.0
    assert not {"opspace", "soft-weights"} & set(methods_left_out(scenario))
    assert "cbf-qp" in methods_left_out(scenario)
    assert "cbf-qp" not in methods_left_out(short())
    with pytest.raises(InputError, match="knows no contacts"):
        compare_scenario(scenario, ["cbf-qp"])

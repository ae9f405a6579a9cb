"""Scenarios that press: what they say is built, what cannot be is refused by its place."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.errors import ScenarioError
from opspace.runs.reproduce_forces import measured, run_ways, sweep_stiffness
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario, scenario_from
from opspace.sim import Surface

PRESSING = {
    "robot": "puma560",
    "duration": 0.2,
    "tasks": {
        "press": {"type": "force", "level": 0, "force": -10, "axes_frame": "world"},
        "hand": {"type": "position", "level": 1, "give_way": "press"},
        "spring": {"type": "impedance", "level": 2, "stiffness": 100},
    },
    "plant": {"surfaces": [{"point": [0.64, -0.15, 0.777]}]},
}

HARD_EDGE = [
    "tasks.press.reach=0.001",
    "plant.surfaces=[{point: [0.64, -0.15, 0.756], size: 0.12, bevel: 0.015, stiffness: 100000}]",
]
"""Ten times as hard as shipped; the less is followed, the lower on its rim the tool comes back."""


def changed(*path, value):
    data = copy.deepcopy(PRESSING)
    here = data
    for key in path[:-1]:
        here = here.setdefault(key, {}) if isinstance(here, dict) else here[key]
    here[path[-1]] = value
    return scenario_from(data)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("tasks", "hand", "give_way"), "prss", "tasks.hand.give_way.*did you mean 'press'"),
        (("tasks", "hand", "activation"), {"contact": "hand"}, "tasks.hand.activation.contact"),
        (("tasks", "hand", "activation"), {}, "needs the key 'contact'"),
        (
            ("tasks", "hand", "activation"),
            {"near": {"point": [0, 0, 0], "off": 1.0, "on": 0.5, "frame": "nose"}},
            "tasks.hand.activation.near.*'nose'",
        ),
        (("plant", "surfaces"), [], "tasks.press.*no surfaces"),
        (("plant", "surfaces"), [{"point": [0, 0, 0], "normal": [0, 0, 0]}], "plant.*normal"),
        (("tasks", "press", "frame"), "link2", "tasks.press.frame.*nothing measures"),
        (("tasks", "press", "kv"), 1.0, "tasks.press.*ki"),
        (("tasks", "press", "contact"), [4, 1], "tasks.press.*off < on"),
        (("tasks", "press", "give_way"), "press", "give_way"),
        (("tasks", "spring", "kp"), 100.0, "kp"),
        (("tasks", "spring", "stiffness"), [1, 2, 3, 4, 5], "stiffness"),
    ],
)
def test_what_cannot_be_is_refused_by_its_place(path, value, said):
    with pytest.raises(ScenarioError, match=said):
        build(changed(*path, value=value))


def test_what_a_file_says_is_what_is_built():
    scenario = changed("tasks", "press", "activation", value={"contact": "press"})
    built = build(scenario)
    press, hand = built.tasks["press"], built.tasks["hand"]
    assert isinstance(press.activation, osc.Contact)
    assert hand.target.task is press
    assert built.tasks["spring"].stiffness.tolist() == [100.0] * 3
    defaults = Surface((0.64, -0.15, 0.777))
    assert built.plant._world.surfaces == (defaults,)


@pytest.mark.parametrize("name", ["wipe", "button", "edge", "push", "peg"])
def test_a_shipped_scenario_presses_with_what_it_says(name):
    """In both forms alike; the first moments of the touch."""
    scenario = load_scenario(name)
    built = [build(scenario, kind) for kind in (osc.Controller, ReferenceController)]
    a, b = built
    for i in range(20):
        q, v = a.plant.measure()
        wrenches = {a.robot.tool: np.array([0.0, 0.3 * i, -0.5 * i, 0.0, 0.0, 0.0])}
        tau = [one.controller.step(i * 1e-3, q, v, wrenches=wrenches).tau for one in built]
        np.testing.assert_allclose(tau[0], tau[1], rtol=0, atol=1e-9 * np.max(np.abs(tau[1])))
        a.plant.advance(tau[0])
    assert a.tasks["press"].touch.confidence > 0.1
    assert b.tasks["press"].touch.confidence == pytest.approx(a.tasks["press"].touch.confidence)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides", "force", "step", "peak"),
    [
        ("wipe", [], 10.0, 1.2, 60.0),
        ("button", [], 15.0, 1.2, 60.0),
        ("edge", [], 10.0, 0.8, 35.0),
        ("edge", HARD_EDGE, 10.0, 1.2, 60.0),
        ("push", [], 10.0, 1.3, 20.0),
    ],
)
def test_a_shipped_scenario_ends_with_its_force_and_without_a_jolt(
    name, overrides, force, step, peak
):
    built = build(load_scenario(name, overrides))
    normal = np.array(load_scenario(name).plant.surfaces[0].normal)
    tau, pushed, sure = [], [], []
    for i in range(round(built.scenario.duration / built.scenario.dt)):
        q, v = built.plant.measure()
        wrenches = built.plant.wrenches()
        tau.append(built.controller.step(i * built.scenario.dt, q, v, wrenches=wrenches).tau)
        pushed.append(-float(normal @ built.plant.exerted[:3]))
        sure.append(built.tasks["press"].touch.confidence > 0.5)
        built.plant.advance(tau[-1])
    touching = np.array(pushed) > 0.0
    touches = np.sum(touching[1:] & ~touching[:-1])
    assert np.sum(np.diff(sure)) <= 2 * touches
    assert pushed[-1] == pytest.approx(force, abs=0.5)
    assert max(pushed) <= peak
    assert np.max(np.abs(np.diff(tau, axis=0))) <= step


def test_the_method_switch_touches_all_or_nothing():
    """What fades by contact is there or not, as events, limits and directions are."""
    data = {
        **changed("tasks", "hand", "activation", value={"contact": "press"}).model_dump(mode="json")
    }
    built = build(scenario_from({**data, "method": "switch"}))
    press, found = built.tasks["press"], set()
    for i in range(30):
        q, v = built.plant.measure()
        wrench = np.array([0.0, 0.0, -0.5 * i, 0.0, 0.0, 0.0])
        command = built.controller.step(i * 1e-3, q, v, wrenches={built.robot.tool: wrench})
        found.add(command.tasks["hand"].activation)
        assert press.touch.confidence in (0.0, 1.0)
    assert found == {0.0, 1.0}


@pytest.mark.slow
def test_touching_in_several_ways_gives_the_promised_numbers():
    found = measured(run_ways("puma560"))
    assert found["contact"]["torque_step"] <= 1.6
    assert found["alone"]["torque_step"] <= 0.7
    for way in ("switch", "sai"):
        assert found[way]["torque_step"] > 8.0
    for way in ("contact", "alone"):
        assert found[way]["force_rms"] <= 0.1
        assert found[way]["away_rms"] <= 0.2
        assert found[way]["turned_rms"] <= 1.0
    assert found["rough arm"]["force_rms"] <= 0.3


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["puma560", "panda", "ur5", "xarm7"])
def test_default_gains_hold_on_every_surface(robot):
    for stiffness, found in sweep_stiffness(robot, (3e2, 1e4, 1e6)).items():
        assert found["force_rms"] <= (1.5 if stiffness == "3e+02" else 0.1)
        assert found["losses"] <= 8

"""A peg that is put into a hole which is not where the arm takes it to be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import InputError, ScenarioError
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario, scenario_from

DT = 1e-3

STILL = np.zeros(6)


def number(low, high):
    return st.floats(low, high)


def placed(hole, depth, across=(0.0, 0.0), tilt=(0.0, 0.0)):
    """Where a peg is that points into a hole: its end, m, and its rotation."""
    turn = osc.tasks.rotation.exp_rotation(np.array([*tilt, 0.0]))
    x = hole.axes @ np.array([*across, -depth])
    return np.asarray(hole.point) + x, hole.axes @ turn @ np.diag([1.0, -1.0, -1.0])


@given(number(-0.002, 0.0199), number(0.0, 6.28), number(0.0, 0.99), number(-1.0, 1.0))
def test_a_peg_within_the_clearance_feels_nothing(depth, angle, part, lean):
    hole = osc.Hole([0.1, 0.2, 0.3], normal=[0.3, -0.2, 1.0])
    away = 0.5 * part * hole.clearance * np.array([math.cos(angle), math.sin(angle)])
    x, rotation = placed(hole, depth, 0.0 * away if depth < 0 else away)
    if depth > 0.0 or hole.inserted(x) < 0.0:
        assert not hole.wrench(x, rotation, STILL).any()
    leaning = placed(hole, 0.015, tilt=(lean * 0.45 * hole.clearance / 0.015, 0.0))
    assert not hole.wrench(*leaning, STILL).any()


@given(number(1e-6, 5e-4), number(0.0, 6.28), number(0.0, 0.01))
def test_wall_plate_and_bottom_push_straight_out_of_themselves(sunk, angle, slide):
    hole = osc.Hole([0.1, 0.2, 0.3], normal=[0.3, -0.2, 1.0], stiffness=1e4, friction=0.0)
    outwards = np.array([math.cos(angle), math.sin(angle)])
    up = hole.axes[:, 2]
    wall = hole.wrench(*placed(hole, 0.01, (0.5 * hole.clearance + sunk) * outwards), STILL)
    assert -hole.axes[:, :2].T @ wall[:3] @ outwards >= 0.999 * 1e4 * (sunk - 6e-6)
    bottom = hole.wrench(*placed(hole, hole.depth + sunk), STILL)
    plate = hole.wrench(*placed(hole, sunk, (0.03 + slide) * outwards), STILL)
    for wrench in (bottom, plate):
        assert up @ wrench[:3] >= 1e4 * sunk
        np.testing.assert_allclose(wrench[:3], (up @ wrench[:3]) * up, atol=1e-9)
        np.testing.assert_allclose(wrench[3:], 0.0, atol=1e-9)


@settings(max_examples=15)
@given(
    number(-1e-4, 0.0205), number(-2e-4, 2e-4), number(-2e-4, 2e-4), number(-0.03, 0.03),
    number(-0.03, 0.03), st.integers(0, 2),
)  # fmt: skip
def test_what_touches_without_friction_takes_no_energy(depth, x, y, a, b, turned):
    """Once round a small loop of positions and of an angle the work is nothing."""
    hole = osc.Hole([0.0, 0.0, 0.0], friction=0.0, damping=0.0)
    here, rotation = placed(hole, depth, (x, y), (a, b))
    axis, around = np.eye(3)[turned], np.linspace(0.0, 2.0 * math.pi, 161)
    way = np.column_stack([1e-5 * np.cos(around), 2e-5 * np.sin(around), 1e-5 * np.sin(around)])
    angle = 1e-3 * np.cos(around + 1.0)
    works = []
    for i in range(160):
        middle = here + 0.5 * (way[i] + way[i + 1])
        turn = osc.tasks.rotation.exp_rotation(0.5 * (angle[i] + angle[i + 1]) * axis)
        wrench = hole.wrench(middle, turn @ rotation, STILL)
        step = np.concatenate([way[i + 1] - way[i], (angle[i + 1] - angle[i]) * axis])
        works.append(float(wrench @ step))
    assert abs(sum(works)) <= 5e-3 * sum(map(abs, works)) + 1e-12


def inserted(point, normal, duration=None, **hole):
    """Run the shipped scenario with a hole: how deep the peg ends, m, and the largest force, N."""
    data = load_scenario("peg").model_dump(mode="json")
    data["plant"]["holes"][0] |= {"point": list(point), "normal": list(normal), **hole}
    data["duration"] = duration or data["duration"]
    built = build(scenario_from(data))
    hole, most = built.plant.holes[0], 0.0
    for i in range(round(built.scenario.duration / DT)):
        q, v = built.plant.measure()
        tau = built.controller.step(i * DT, q, v, wrenches=built.plant.wrenches()).tau
        built.plant.advance(tau)
        most = max(most, float(np.linalg.norm(built.plant.exerted[:3])))
    return hole.inserted(built.robot.position(built.robot.frame_id(built.robot.tool))), most


def off_by(distance, angle, lean, direction):
    """A hole that is off from the middle of the circle, m, and leans from the peg, rad."""
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    tool = robot.frame_id(robot.tool)
    middle = robot.position(tool) - [0.001, 0.0, 0.0105]
    point = middle + distance * np.array([math.cos(angle), math.sin(angle), 0.0])
    axis = np.array([math.cos(direction), math.sin(direction), 0.0])
    return point, osc.tasks.rotation.exp_rotation(lean * axis) @ -robot.rotation(tool)[:, 2]


def test_a_peg_goes_into_a_hole_just_below_it():
    """By its chamfer and by giving way alone: it is still when it touches, 1 mm and 1° off."""
    point, normal = off_by(1e-3, 3.0, math.radians(1.0), 2.0)
    point = point + [0.001, 0.0, 0.009]
    depth, most = inserted(point, normal, duration=0.65, depth=0.003)
    assert depth == pytest.approx(0.003, abs=2e-4)
    assert most <= 30.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_a_peg_goes_in_wherever_the_hole_is(seed):
    """Off by 2 mm and 1° in directions that the seed decides; the clearance is 0.1 mm."""
    angle, direction = 2.0 * math.pi * np.random.default_rng(seed).random(2)
    depth, most = inserted(*off_by(2e-3, angle, math.radians(1.0), direction))
    assert depth == pytest.approx(0.02, abs=5e-4)
    assert most <= 30.0


def test_the_shipped_peg_is_off_by_what_it_says():
    hole = build(load_scenario("peg")).plant.holes[0]
    point, straight = off_by(0.0, 0.0, 0.0, 0.0)
    assert np.linalg.norm((np.array(hole.point) - point)[:2]) == pytest.approx(2e-3, rel=0.02)
    lean = math.acos(float(hole.axes[:, 2] @ straight))
    assert math.degrees(lean) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"point": [0.0]}, "point"),
        ({"normal": [0, 0, 0]}, "normal"),
        ({"clearance": 0.0}, "clearance"),
        ({"diameter": math.nan}, "diameter"),
        ({"friction": -1.0}, "friction"),
        ({"chamfer": 0.02}, "chamfer"),
    ],
)
def test_a_hole_that_cannot_be_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        osc.Hole(**{"point": [0.0, 0.0, 0.0], **options})


def test_a_scenario_says_where_a_hole_or_a_spring_is_wrong():
    for path, value, said in (
        (("plant", "holes", 0, "chamfer"), 0.03, "plant.*chamfer"),
        (("tasks", "hold", "stiffness"), [1.0] * 5, "stiffness.*3 or 6"),
        (("tasks", "hold", "give_way"), "press", "give_way.*position"),
        (("plant", "holes"), [], "no holes"),
    ):
        data = load_scenario("peg").model_dump(mode="json")
        here = data
        for key in path[:-1]:
            here = here[key]
        here[path[-1]] = value
        with pytest.raises(ScenarioError, match=said):
            build(scenario_from(data))

"""What a tool touches, and what arms do that press on it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import InputError
from opspace.sim import Disturbances
from tests.sim.touching import DT, touch_and_wipe

PANDA = any(info.name == "panda" and info.installed for info in osc.available_robots())
ARM = "panda" if PANDA else "puma560"


def number(low, high):
    return st.floats(low, high)


@given(number(-0.01, 0.01), number(-1.0, 1.0), number(-1.0, 1.0), number(1e2, 1e6), number(0, 1))
def test_a_surface_pushes_and_rubs_and_never_pulls(depth, along, out, stiffness, friction):
    surface = osc.Surface([0.0, 0.0, 0.0], stiffness=stiffness, friction=friction, damping=5.0)
    force = surface.force(np.array([0.3, 0.2, -depth]), np.array([along, 0.0, out]))
    assert force[2] >= 0.0
    assert depth > 0.0 or not force.any()
    assert abs(force[0]) <= friction * force[2] * (1.0 + 1e-12)
    assert force[0] * along <= 0.0
    if depth > 0.0:
        assert force[2] == pytest.approx(max(stiffness * depth - 5.0 * out, 0.0), rel=1e-9)


def test_a_button_is_soft_first_and_an_edge_ends():
    button = osc.Surface([0, 0, 0], give=0.003, soft_stiffness=800.0, stiffness=1e5, size=0.02)
    still = np.zeros(3)
    assert button.force(np.array([0.0, 0.0, -0.003]), still)[2] == pytest.approx(2.4)
    assert button.force(np.array([0.0, 0.0, -0.004]), still)[2] == pytest.approx(102.4)
    assert not button.force(np.array([0.03, 0.0, -0.003]), still).any()


@given(number(-0.02, 0.02), number(0.0, 0.13), number(0.0, 6.3))
def test_a_rim_takes_no_energy_and_gives_none(depth, radius, angle):
    """The force is the gradient of what the spring holds, on the flat and on the rim."""
    surface = osc.Surface([0, 0, 0], stiffness=1e3, friction=0.0, size=0.1, bevel=0.02)
    x = np.array([radius * np.cos(angle), radius * np.sin(angle), -depth])

    def energy(at):
        past = max(np.hypot(at[0], at[1]) - 0.1, 0.0)
        sunk = max(-at[2] - past**2 / 0.04, 0.0)
        return 0.5 * 1e3 * sunk**2 * (past <= 0.02)

    h = 1e-6
    slope = [(energy(x - h * e) - energy(x + h * e)) / (2.0 * h) for e in np.eye(3)]
    if abs(radius - 0.12) > 2e-6:
        np.testing.assert_allclose(surface.force(x, np.zeros(3)), slope, atol=2e-3)


@pytest.mark.parametrize(
    "options",
    [{"point": [0.0]}, {"normal": [0, 0, 0]}, {"stiffness": 0.0}, {"friction": -1.0}, {"size": 0}],
)
def test_a_surface_that_cannot_be_is_refused(options):
    with pytest.raises(InputError):
        osc.Surface(**{"point": [0.0, 0.0, 0.0], **options})


def test_wrenches_come_late_and_with_noise_that_the_seed_decides():
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    x = robot.position(robot.frame_id(robot.tool))

    def measured(disturbances):
        surface = osc.Surface(x + [0, 0, 1e-3], stiffness=1e3)
        plant = osc.Plant(robot, robot.q_reference, surfaces=[surface], disturbances=disturbances)
        found = []
        for _ in range(6):
            found.append((plant.wrenches()[robot.tool], plant.exerted))
            plant.advance(robot.gravity)
        return map(np.array, zip(*found, strict=True))

    late, true = measured(Disturbances(wrench_delay=2 * DT))
    assert true[0, 2] == pytest.approx(-1.0)
    np.testing.assert_array_equal(late[2:], true[:-2])
    a, b, c = (next(iter(measured(Disturbances(wrench_noise=0.3, seed=s)))) for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)


def test_without_surfaces_no_wrench_is_measured_and_nothing_changes():
    robot = osc.load_robot("puma560")
    plants = [osc.Plant(robot, robot.q_reference, substeps=n) for n in (None, 1)]
    for plant in plants:
        plant.advance(robot.gravity)
    assert plants[0].wrenches() == {}
    np.testing.assert_array_equal(plants[0].q, plants[1].q)


def test_an_arm_comes_down_on_a_table_and_presses():
    run = touch_and_wipe("contact", seconds=0.9, speed=0.1, table=0.03)
    late = run.force[-100:]
    assert np.mean(late) == pytest.approx(10.0, abs=1.0)
    assert run.confidence[-1] > 0.99


@pytest.mark.slow
@pytest.mark.parametrize(("way", "most"), [("alone", 0.5), ("distance", 0.5), ("contact", 1.6)])
def test_a_touch_is_no_step_of_the_torque(way, most):
    """At 1e5 N/m, the reference at 0.1 m/s: N·m per millisecond."""
    run = touch_and_wipe(way, robot=ARM, seconds=2.6)
    assert run.force.max() > 10.0
    assert run.step <= most
    assert run.confidence[-1] > 0.999


@pytest.mark.slow
def test_the_hard_switch_on_the_same_table_is_one():
    assert touch_and_wipe("hard", robot=ARM, seconds=2.6).step > 8.0


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1e3, 1e4, 1e5])
def test_wiping_keeps_the_force(stiffness):
    run = touch_and_wipe("distance", robot=ARM, stiffness=stiffness, seconds=7.0)
    assert run.wiping["force"] <= 0.1
    assert run.wiping["away"] <= 2e-4
    assert run.wiping["turned"] <= 1e-3
    assert run.crossings <= 2


@pytest.mark.slow
@pytest.mark.parametrize("off", [0.005, -0.005])
def test_a_table_that_is_not_where_it_is_believed_is_touched_and_wiped_alike(off):
    known, told_wrong = (
        touch_and_wipe("distance", robot=ARM, seconds=7.0, off=one) for one in (0.0, off)
    )
    assert told_wrong.step == pytest.approx(known.step, rel=0.05)
    assert told_wrong.force.max() == pytest.approx(known.force.max(), rel=0.05)
    assert told_wrong.wiping == pytest.approx(known.wiping, rel=0.05)
    assert told_wrong.crossings == known.crossings


@pytest.mark.slow
def test_a_soft_touch_is_softer():
    assert touch_and_wipe("contact", robot=ARM, stiffness=1e3, seconds=2.6).step <= 0.7


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1e4, 1e5])
def test_a_circle_over_the_edge_finds_the_table_again(stiffness):
    run = touch_and_wipe(
        "distance", robot=ARM, stiffness=stiffness, seconds=7.5, size=0.12, table=0.05
    )
    wiping = slice(round(3.0 / DT), None)
    assert run.losses >= 1
    assert run.crossings <= 2 * (run.losses + 1)
    assert run.force[-1] == pytest.approx(10.0, abs=0.5)
    assert np.max(np.abs(np.diff(run.tau[wiping], axis=0))) <= 1.2
    assert run.force[wiping].max() <= 40.0

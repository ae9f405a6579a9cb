"""A robot that stands on contacts does so in C as in Python, to the last bit."""

import numpy as np
import pytest

import opspace as osc
from tests.controller.test_standing_compiled import ROBOTS
from tests.export.in_c import InC, with_cc
from tests.export.test_c_library import start

DT = 0.01


def standing(name, **options):
    """A robot on all contacts that it may have, and its tasks with targets that stay."""
    tasks, contacts, other = ROBOTS[name]()
    robot = osc.load_robot(name)
    controller = osc.Controller(
        robot,
        osc.Stack(tasks, osc.JointLimits(), [*contacts, other]),
        torque_limits="priority",
        period=DT,
        **options,
    )
    robot.update(robot.q_reference, np.zeros(robot.nv))
    for task in controller.stack:
        if isinstance(task, osc.ComTask):
            task.target = robot.com_position()
        elif isinstance(task, osc.PositionTask):
            task.target = task.source.measure(robot).position
        elif isinstance(task, osc.OrientationTask):
            task.target = task.source.measure(robot).rotation
        elif isinstance(task, osc.PostureTask):
            task.target = robot.q_reference[7:]
    return controller, contacts, other


def states(robot, count, spread, seed=0):
    chance = np.random.default_rng(seed)
    for k in range(count):
        v = spread * chance.normal(size=robot.nv)
        q = robot.integrate(robot.q_reference, spread * chance.normal(size=robot.nv), 0.2)
        q[3:7] *= 1.0 + 0.1 * chance.random()  # which the tick takes as a direction
        yield k, DT * k, q, v


@with_cc
@pytest.mark.parametrize("name", ["solo12", "talos"])
def test_contacts_come_and_go_as_in_a_stack(name, tmp_path):
    controller, (first, *_), other = standing(name)
    controller.stack.remove(other, duration=0.0)
    c = InC(tmp_path, standing(name)[0], absent=[other.name])
    stack, statuses = controller.stack, set()
    for k, t, q, v in states(controller.robot, 120, 0.02):
        if k == 5:
            stack.insert(other, 0.1)
            assert c.touch(other, 1, 0.1) == 0
        if k == 30:
            stack.remove(first, duration=0.3)
            assert c.touch(first, 0, 0.3) == 0
        if k == 40:  # turned on its way
            stack.insert(first, 0.2)
            assert c.touch(first, 1, 0.2) == 0
        if k == 70:
            stack.remove(other, duration=0.1, wait=False)
            assert c.touch(other, 0, 0.1, wait=False) == 0
        if k == 90:  # all that carries
            stack.remove(first, duration=0.1)
            assert c.touch(first, 0, 0.1) == 0
        command, (status, tau) = controller.step(t, q, v), c.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        assert [c.contact_row(one) for one in (first, other)] == [
            list(command.contacts).index(one.name) if one.name in command.contacts else -2
            for one in (first, other)
        ]
        statuses.add(status)
    assert any(status & osc.Status.CONTACT_WAITS for status in statuses)


@with_cc
def test_a_foot_rolls_over_its_toes_and_back_as_in_a_stack(tmp_path):
    """An edge comes, carries what a sole has carried, which waits and then leaves anyhow, and goes."""

    def on_its_toes():
        controller, (left, *_), _ = standing("g1")
        middle = np.add(left.offset, (left.half[0], 0.0, 0.0))
        toes = osc.EdgeContact(left.frame, left.half[1], offset=middle, name="toes")
        controller.stack.insert(toes, 0.0)
        controller.stack.remove("wall", 0.0)
        controller.stack.begin_contacts(0.0)
        return controller, left, toes

    controller, left, toes = on_its_toes()
    controller.stack.remove(toes, 0.0)
    c, stack = InC(tmp_path, on_its_toes()[0], absent=["toes"]), controller.stack
    carried, gone, waited = 0.0, False, False
    for k, t, q, v in states(controller.robot, 130, 0.003):
        for at, contact, present, duration in (
            (5, toes, 1, 0.1), (20, left, 0, 0.2), (60, left, 1, 0.1), (63, left, 0, 0.1),
            (80, left, 1, 0.05), (95, toes, 0, 0.2), (100, toes, 1, 0.1), (115, toes, 0, 0.05),
        ):  # fmt: skip
            if k == at:
                wait = k != 63
                if present:
                    stack.insert(contact, duration)
                else:
                    stack.remove(contact, duration=duration, wait=wait)
                assert c.touch(contact, present, duration, wait=wait) == 0
        command, (status, tau) = controller.step(t, q, v), c.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        gone |= "left" not in command.contacts
        waited |= bool(osc.Status.CONTACT_WAITS & status)
        if "toes" in command.contacts:
            row = c.contact_row(toes)
            force = controller._plan.tick.contact_force[row]
            np.testing.assert_array_equal(c.read("contact_force").reshape(-1, 6)[row], force)
            carried = max(carried, force[2])
    assert carried > 120.0
    assert waited
    assert gone
    assert "toes" not in command.contacts


@with_cc
@pytest.mark.parametrize("robot_adds", [None, False, True])
def test_brakes_give_the_same_bits(robot_adds, tmp_path):
    """A target that is no number brakes; a robot that stands, from the torque that carried it."""
    if robot_adds is None:
        controller, *_ = standing("solo12")
    else:
        controller, _ = start(gravity="robot" if robot_adds else "controller")
    robot = controller.robot
    c = InC(tmp_path, controller)
    for k in range(6):
        chance = np.random.default_rng(k)
        q = robot.integrate(robot.q_reference, 0.01 * chance.normal(size=robot.nv), 0.2)
        v = 0.1 * chance.normal(size=robot.nv)
        if k == 3:
            controller._plan.tick.goal[:, 0] = np.nan
            c.write("goal", np.nan)
        command, (status, tau) = controller.step(DT * k, q, v), c.step(DT * k, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        assert (k >= 3) == (osc.Status.FAULT in command.status)


@with_cc
def test_a_restart_finds_contacts_where_they_were(tmp_path):
    controller, (first, second, *_), _ = standing("solo12")
    c, clock, statuses = InC(tmp_path, standing("solo12")[0]), 0.0, 0
    for k, t, q, v in states(controller.robot, 60, 0.02):
        if k == 10:
            controller.stack.remove(first, duration=0.1)
            assert c.touch(first, 0, 0.1) == 0
        if k in (16, 20):  # with a wish that nobody has read yet
            one, come = (second, 0) if k == 16 else (first, 1)
            if come:
                controller.stack.insert(one, 0.1)
            else:
                controller.stack.remove(one, duration=0.1)
            assert c.touch(one, come, 0.1) == 0
            controller.restart()
            c.restart()
            clock += 5.0 if come else -3.0
        command, (status, tau) = controller.step(t + clock, q, v), c.step(t + clock, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        statuses |= status
    assert statuses & osc.Status.CONTACT_WAITS


@with_cc
def test_a_tick_that_fails_brakes_from_the_torque_that_carried(tmp_path):
    controller, _, _ = standing("solo12")
    c = InC(tmp_path, standing("solo12")[0])
    for k, t, q, v in states(controller.robot, 8, 0.02):
        if k in (3, 6):
            v[8] = 1e200
        command, (status, tau) = controller.step(t, q, v), c.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
    assert c.step(1.0, np.zeros(controller.robot.nq), v)[0] == -1, (
        "a quaternion without a direction"
    )


def with_a_pause(found):
    """States of which those from 3 to 29 are nearly one: nothing gets better."""
    first = None
    for k, t, q, v in found:
        first = (q, v) if k == 3 else first
        yield (k, t, first[0].copy(), first[1] * (1.0 + 1e-4 * k)) if 3 <= k < 30 else (k, t, q, v)


@with_cc
@pytest.mark.parametrize("name", ["solo12", "talos"])
def test_a_robot_that_falls_is_given_up_in_the_same_tick_with_the_same_torque(name, tmp_path):
    rule = osc.FallRule(after=0.055, tilt=0.5)
    controller, _, _ = standing(name, falling=rule)
    robot, fell, contacts = controller.robot, [], list(controller.stack.contacts.values())
    c = InC(tmp_path, standing(name, falling=rule)[0])
    for k, t, q, v in with_a_pause(states(robot, 70, 0.05)):
        if k == 3:
            for contact in contacts:
                controller.stack.remove(contact, duration=0.0)
                assert c.touch(contact, 0, 0.0) == 0
        if k in (30, 60):
            for contact in contacts:
                controller.stack.insert(contact, 0.0)
                assert c.touch(contact, 1, 0.0) == 0
            controller.restart()
            c.restart()
        if 45 <= k < 60:  # turned, and whatever else there is, by more than the tilt
            q[3:7] = np.cos(0.3), np.sin(0.3), 0.0, 0.0
        command, (status, tau) = controller.step(t, q, v), c.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        fell.append(bool(osc.Status.FALLING & status))
    assert [fell[k] for k in (2, 29, 31, 44, 46, 59, 61)] == [0, 1, 0, 0, 1, 1, 0]


def test_what_only_python_can_do_is_refused_by_name(tmp_path):
    controller, (first, *_), _ = standing("solo12")
    with pytest.raises(osc.UnknownNameError, match="contact"):
        osc.export_c(controller, tmp_path, absent=["foot"])
    first.activation = lambda robot, t: 1.0
    with pytest.raises(osc.InputError, match=f"activation of '{first.name}'"):
        osc.export_c(controller, tmp_path)
    assert not list(tmp_path.iterdir())

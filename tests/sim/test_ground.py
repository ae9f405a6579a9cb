"""What a simulated robot stands on: it carries the weight, measures it, and walls push back."""

import numpy as np
import pytest

import opspace as osc
from opspace.errors import InputError, UnknownNameError
from opspace.sim import Board, Disturbances, Ground, Wall

HALF, OFFSET = (0.085, 0.025), (0.035, 0.0, -0.035)
WEIGHT = 33.34114202 * 9.81


def soles():
    return [
        osc.SoleContact(f"{side}_ankle_roll_link", HALF, offset=OFFSET, name=side)
        for side in ("left", "right")
    ]


def standing(robot):
    """The reference posture with its soles on the floor."""
    robot.update(robot.q_reference, np.zeros(robot.nv))
    q = robot.q_reference.copy()
    q[2] -= robot.position("left_ankle_roll_link")[2] + OFFSET[2]
    return q


def test_g1_stands_and_what_is_measured_is_what_was_planned():
    robot, feet = osc.load_robot("g1"), soles()
    tasks = [
        osc.ComTask(),
        osc.OrientationTask("torso_link", name="torso"),
        osc.PostureTask(kp=25.0),
    ]
    controller = osc.Controller(robot, osc.Stack(tasks, contacts=feet))
    plant = osc.Plant(robot, standing(robot), ground=Ground(feet), substeps=2)
    outcome = osc.simulate(plant, controller, 0.15)
    command = controller.step(plant.t, plant.q, plant.v)
    measured = plant.contact_forces
    assert outcome is not None
    assert abs(sum(measured.values())[2] - WEIGHT) < 0.01 * WEIGHT
    for foot in feet:
        assert np.max(np.abs(measured[foot.name] - command.contacts[foot.name].force)) < 2.0
    assert command.tasks["com"].error_norm < 1e-3


def test_without_ground_nothing_touches():
    robot = osc.load_robot("g1")
    plant = osc.Plant(robot, standing(robot))
    for _ in range(100):
        plant.advance(np.zeros(robot.nv))
    assert plant.contact_forces == {}
    robot.update(plant.q, plant.v)
    assert abs(robot.com_jacobian()[2] @ plant.v + 9.81 * 0.1) < 1e-3


def test_no_command_pulls_at_the_base_and_friction_is_that_of_joints():
    robot = osc.load_robot("g1")
    disturbances = Disturbances(dry_friction=0.05)
    for limits in (True, False):
        plant = osc.Plant(robot, standing(robot), torque_limits=limits, disturbances=disturbances)
        assert np.all(plant.model.dof_frictionloss[:6] == 0.0)
        assert np.all(plant.model.dof_frictionloss[6:] > 0.0)
        for _ in range(10):
            plant.advance(1e3 * (np.arange(robot.nv) < 6))
        robot.update(plant.q, plant.v)
        assert abs(robot.com_jacobian()[2] @ plant.v + 9.81 * 0.01) < 1e-3


def test_substeps_are_smaller_steps_in_the_same_time():
    robot = osc.load_robot("ur5")
    q = robot.q_reference
    fine = osc.Plant(robot, q, dt=0.001)
    both = osc.Plant(robot, q, dt=0.002, substeps=2)
    for _ in range(20):
        fine.advance(np.zeros(robot.nv))
    for _ in range(10):
        both.advance(np.zeros(robot.nv))
    assert both.t == pytest.approx(fine.t)
    assert np.array_equal(both.q, fine.q)


def test_a_wall_pushes_out_of_itself():
    robot = osc.load_robot("g1")
    q = standing(robot)
    robot.update(q, np.zeros(robot.nv))
    hand = osc.PointContact("right_rubber_hand", normal=(-1.0, 0.0, 0.0), name="hand")
    place = robot.position("right_rubber_hand")
    wall = Wall((place[0] + 0.003, 0.0, 0.0), (-1.0, 0.0, 0.0))
    plant = osc.Plant(robot, q, ground=Ground([hand], walls=[wall]))
    force = plant.contact_forces["hand"]
    assert force[0] < 0.0
    # The robot begins to fall, and the hand slides along the wall at most as hard as friction holds.
    assert np.hypot(force[1], force[2]) < 0.81 * -force[0]


def test_a_board_lifts_the_floor_below_one_contact_when_it_comes_and_a_hole_takes_it_away():
    robot, feet = osc.load_robot("g1"), soles()
    for height in (0.003, -0.2):
        ground = Ground(feet, boards=[Board("right", height, 0.02)])
        plant = osc.Plant(robot, standing(robot), ground=ground)
        level = osc.Plant(robot, standing(robot), ground=Ground(feet))
        for _ in range(20):
            plant.advance(np.zeros(robot.nv))
            level.advance(np.zeros(robot.nv))
        assert np.allclose(plant.q, level.q, atol=1e-9)
        before = plant.contact_forces["right"][2]
        for _ in range(2):
            plant.advance(np.zeros(robot.nv))
        after = plant.contact_forces
        assert after["right"][2] > 2.0 * before if height > 0.0 else after["right"][2] == 0.0
        assert after["left"][2] > 0.0
    with pytest.raises(InputError, match="a height and a time"):
        Ground(feet, boards=[Board("right", np.nan)])
    with pytest.raises(UnknownNameError, match="unknown contact of the ground 'tail'"):
        Ground(feet, boards=[Board("tail", 0.1)])


def test_what_cannot_be_is_refused():
    robot = osc.load_robot("g1")
    with pytest.raises(InputError, match="ground needs contacts"):
        Ground([])
    with pytest.raises(InputError, match="friction must be above 0"):
        Ground(soles(), friction=0.0)
    with pytest.raises(InputError, match="no body or site 'nose'"):
        osc.Plant(robot, standing(robot), ground=Ground([osc.PointContact("nose")]))
    with pytest.raises(InputError, match="at least one step of the simulation"):
        osc.Plant(robot, standing(robot), substeps=0)

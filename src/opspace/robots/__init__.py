"""Robots behind one protocol, on Pinocchio or MuJoCo."""

from opspace.robots.joint_torque_sensor import JointTorqueSensor as JointTorqueSensor
from opspace.robots.payload import Payload as Payload
from opspace.robots.protocol import Robot as Robot
from opspace.robots.registry import RobotInfo as RobotInfo
from opspace.robots.registry import available_robots as available_robots
from opspace.robots.registry import load_robot as load_robot
from opspace.robots.wrist_sensor import WristSensor as WristSensor

"""The driver of ROS 2 topics, against a simulated arm behind them."""

import threading

import numpy as np
import pytest

import opspace as osc
from opspace.loop.driver import DriverFacts

rclpy = pytest.importorskip("rclpy", reason="needs the extra ros2")
# What ROS 2 imports for its messages is not ours.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

FACTS = DriverFacts(period=2e-3, gravity="robot", torque_rate=None)


class Arm:
    """A PUMA 560 that tells its joints in another order, waits for each command, and adds gravity."""

    def __init__(self):
        from rclpy.executors import SingleThreadedExecutor
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray

        self.robot = osc.load_robot("puma560")
        self.plant = osc.Plant(self.robot, self.robot.q_reference, dt=2e-3, adds_gravity=True)
        self.kind, self.commands, self.over = JointState, [], threading.Event()
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("arm", context=self.context)
        self.publisher = self.node.create_publisher(JointState, "joint_states", 1)
        self.node.create_subscription(
            Float64MultiArray, "effort_controller/commands", self.commands.append, 1
        )
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self.live)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def live(self):
        count, tau, driven = 0, np.zeros(6), False
        while not self.over.is_set():
            count += 1
            nanoseconds = count * 2_000_000
            q, v = self.plant.measure()
            message = self.kind(
                name=["other", *self.robot.joint_names[::-1]],
                position=[7.0, *q[::-1].tolist()],
                velocity=[7.0, *v[::-1].tolist()],
            )
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, 10**9)
            self.publisher.publish(message)
            self.executor.spin_once(timeout_sec=0.2 if driven else 0.01)
            if self.commands:
                driven, tau = True, np.array(self.commands.pop().data)
                self.commands.clear()
            if driven:
                self.plant.advance(tau)


def test_an_arm_behind_topics_goes_to_its_target():
    from opspace.drivers.ros2 import Ros2Driver

    with Arm() as arm:
        robot = osc.load_robot("puma560")
        hand = osc.PositionTask(kp=50.0, max_speed=0.25, max_acceleration=1.0)
        stack = osc.Stack([hand, osc.PostureTask(kp=16.0)])
        controller = osc.Controller(robot, stack, gravity="robot", period=2e-3, on_time_jump="hold")
        driver = Ros2Driver(robot.joint_names, facts=FACTS)
        loop = osc.Loop(controller, driver, patience=3000, handover=0.1)
        with loop:
            target = hand.target = robot.position("tool") + [0.0, 0.05, 0.0]
            begun = loop.report.t
            while loop.report.t < begun + 2.0:
                assert loop.wait(0.02), loop.report
        assert loop.report.completed
        assert loop.report.standstill
        robot.update(arm.plant.q, arm.plant.v)
        assert np.abs(robot.position("tool") - target).max() < 5e-3


def test_what_the_states_lack_is_named():
    from opspace.drivers.ros2 import Ros2Driver

    with pytest.raises(osc.InputError, match="named once"):
        Ros2Driver(["a", "a"], facts=FACTS)
    with Arm():
        driver = Ros2Driver([*(f"joint{k}" for k in range(1, 6)), "elbow"], facts=FACTS)
        driver.start()
        with pytest.raises(osc.InputError, match="no joint 'elbow', only"):
            driver.read(10.0)
        driver.stop()
        driver.stop()


def test_a_driver_that_is_stopped_leaves_whether_ros_goes_on_or_not_and_begins_again():
    from opspace.drivers.ros2 import Ros2Driver

    with Arm() as arm:
        driver = Ros2Driver(arm.robot.joint_names, facts=FACTS)
        driver.start()
        assert driver.read(10.0) is not None
        driver.stop()
        driver.start()
        assert driver.read(10.0) is not None
        driver._context.shutdown()
        with pytest.raises(osc.RobotStoppedError, match="ROS 2 is shut down"):
            driver.read(10.0)
        driver.stop()
        driver.start()
        driver.stop()

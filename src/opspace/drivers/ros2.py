"""Robots behind ROS 2 topics, through `rclpy`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from opspace.errors import InputError, RobotStoppedError, missing_extra
from opspace.loop.driver import DriverFacts, RobotState


def _import_rclpy() -> tuple[Any, Any, Any]:
    try:
        import rclpy  # noqa: PLC0415 - an extra  # pyright: ignore[reportMissingImports]
        import sensor_msgs.msg  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
        import std_msgs.msg  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise missing_extra("rclpy", "ros2") from None
    return rclpy, sensor_msgs.msg.JointState, std_msgs.msg.Float64MultiArray


class Ros2Driver:
    """Joints that tell `sensor_msgs/JointState` and take efforts as `std_msgs/Float64MultiArray`.

    That is what the controllers of ros2_control speak: a `joint_state_broadcaster`, and an effort
    controller whose commands are the torques of its joints in their order. A topic keeps nothing but the
    newest message, and is no real-time channel: the robot must brake by itself when commands stay away,
    and the loop needs ``patience``. Which torque was accepted is not told. Time is the stamp of the
    states.

    Args:
        joints: Names of the joints as the states have them, in the order of the model and of the
            commands; others are not looked at.
        facts: What the robot does by itself; who adds gravity depends on its hardware interface.
        states: Topic of the states.
        commands: Topic of the commands.

    Raises:
        MissingExtraError: `rclpy` or its messages are not installed.
        InputError: No joint, or one named twice.
    """

    def __init__(
        self,
        joints: Sequence[str],
        *,
        facts: DriverFacts,
        states: str = "joint_states",
        commands: str = "effort_controller/commands",
    ) -> None:
        if not joints or len(set(joints)) < len(joints):
            raise InputError(f"joints are named once each, got {list(joints)}")
        self._ros, self._state, self._command = _import_rclpy()
        self.facts = facts
        self._joints, self._topics = tuple(joints), (states, commands)
        self._context: Any = None
        self._node: Any = None
        self._publisher: Any = None
        self._executor: Any = None
        self._heard: Any = None

    def start(self) -> None:
        """Join the network."""
        from rclpy.executors import (  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
            SingleThreadedExecutor,
        )
        from rclpy.qos import (  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
            QoSProfile,
            ReliabilityPolicy,
        )

        self._context = self._ros.Context()
        self._ros.init(context=self._context)
        self._node = self._ros.create_node("opspace", context=self._context)
        # The newest state, from publishers of either kind; a late one is not sent again.
        newest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node.create_subscription(self._state, self._topics[0], self._hear, newest)
        self._publisher = self._node.create_publisher(self._command, self._topics[1], 1)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def _hear(self, message: Any) -> None:
        self._heard = message

    def read(self, timeout: float) -> RobotState | None:
        """Wait for the next state.

        Raises:
            InputError: The states lack a joint, or its position or velocity.
            RobotStoppedError: ROS is shut down.
        """
        end, self._heard = time.perf_counter() + timeout, None
        while self._heard is None:
            left = end - time.perf_counter()
            if not self._context.ok():
                raise RobotStoppedError("ROS 2 is shut down")
            if left <= 0.0:
                return None
            self._executor.spin_once(timeout_sec=left)
        message = self._heard
        place = {name: i for i, name in enumerate(message.name)}
        if missing := [name for name in self._joints if name not in place]:
            raise InputError(f"{self._topics[0]} has no joint {missing[0]!r}, only {sorted(place)}")
        order = [place[name] for name in self._joints]
        q, v = np.array(message.position), np.array(message.velocity)
        if max(order) >= min(q.size, v.size):
            raise InputError(f"{self._topics[0]} has joints without a position or a velocity")
        stamp = message.header.stamp
        return RobotState(stamp.sec + 1e-9 * stamp.nanosec, q[order], v[order], None)

    def write(self, tau: np.ndarray) -> None:
        """Publish torques."""
        self._publisher.publish(self._command(data=tau.tolist()))

    def stop(self) -> None:
        """Command nothing more: zeros once, which is for a robot that brakes by itself, and leave."""
        if self._context is None:
            return
        if self._publisher is not None and self._context.ok():
            self.write(np.zeros(len(self._joints)))
        if self._executor is not None:
            self._executor.shutdown()
        if self._node is not None:
            self._node.destroy_node()
        self._context.try_shutdown()
        self._context = self._node = self._publisher = self._executor = None

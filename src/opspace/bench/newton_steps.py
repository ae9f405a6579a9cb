"""Newton's operational space controller, asked for what a fleet is asked for."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np

from opspace.robots.protocol import Robot
from opspace.tasks.rotation import quaternion_from_matrix


def newton_is_installed() -> bool:
    """Tell whether Newton can be timed."""
    return importlib.util.find_spec("newton") is not None


class NewtonSteps:
    """Newton's controller of a pose above a posture, for many arms of seven joints or more.

    It takes what it needs to know of an arm as arrays and computes no dynamics: they are written
    once, for all steps. Joint limits, singular directions and the Jacobians' rates are not its job.

    Args:
        robot: The robot.
        Q: (count, n) configurations, rad.
        V: (count, n) velocities, rad/s.
        reference: (n,) posture; the pose is the tool's there, rad.
        kp: Stiffness of both, 1/s².
        device: A device of Warp.
    """

    def __init__(
        self,
        robot: Robot,
        Q: np.ndarray,
        V: np.ndarray,
        reference: np.ndarray,
        kp: float,
        device: Any,
    ) -> None:
        import warp as wp  # noqa: PLC0415 - an optional peer  # pyright: ignore[reportMissingImports]
        from newton.controllers import (  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
            ControllerOperationalSpaceModelFree,
        )

        count, n = Q.shape
        kv = 2.0 * float(np.sqrt(kp))
        self._controller = ControllerOperationalSpaceModelFree(
            controlled_dofs_per_robot=wp.full(count, n, dtype=wp.int32, device=device),
            motion_stiffness=kp,
            motion_damping=kv,
            use_null_space_control=True,
            null_space_stiffness=kp,
            null_space_damping=kv,
            device=device,
        )
        self._given, self._found = self._controller.input(), self._controller.output()
        given = _known(robot, Q, V)
        given["desired_tool_pose_operational"] = np.tile(_pose(robot, reference), (count, 1))
        given["joint_q_des_null"] = np.tile(reference, count)
        for name, value in given.items():
            getattr(self._given, name).assign(value.astype(np.float32))
        self._shape = (count, n)

    def step(self) -> None:
        """Compute the torques of all arms."""
        self._controller.step(inputs=self._given, outputs=self._found, dt=1e-3)

    def torques(self) -> np.ndarray:
        """Return the torques of the last step, (count, n), N·m."""
        return self._found.joint_f.numpy().reshape(self._shape)


def _known(robot: Robot, Q: np.ndarray, V: np.ndarray) -> dict[str, np.ndarray]:
    """Collect what Newton's controller is told of each state; states that repeat are looked at once."""
    frame = robot.frame_id(robot.tool)
    at: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
        "mass_matrix": lambda q, v: robot.M,
        "gravity_force": lambda q, v: robot.gravity,
        "jacobian_tool_world": lambda q, v: robot.jacobian(frame),
        "tool_pose_world": lambda q, v: _pose(robot, q),
        "tool_twist_world": lambda q, v: robot.velocity(frame),
        "joint_q": lambda q, v: q,
        "joint_qd": lambda q, v: v,
    }
    states, which = np.unique(np.hstack([Q, V]), axis=0, return_inverse=True)
    found: dict[str, list[np.ndarray]] = {name: [] for name in at}
    for state in states:
        q, v = np.split(state, [Q.shape[1]])
        for name, value in at.items():
            robot.update(q, v)
            found[name].append(np.array(value(q, v)))
    whole = {name: np.array(rows)[which.reshape(-1)] for name, rows in found.items()}
    flat = ("gravity_force", "joint_q", "joint_qd")
    return {name: x.reshape(-1) if name in flat else x for name, x in whole.items()}


def _pose(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Position of the tool, then its quaternion xyzw."""
    robot.update(q, np.zeros(robot.nv))
    frame = robot.frame_id(robot.tool)
    w, *xyz = quaternion_from_matrix(robot.rotation(frame))
    return np.array([*robot.position(frame), *xyz, w])

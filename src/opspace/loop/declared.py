"""Whether what a driver declares goes with the controller, and whether the robot behaves like it."""

from __future__ import annotations

import math

import numpy as np

from opspace.controller import ReferenceController
from opspace.errors import InputError
from opspace.loop.driver import DriverFacts, RobotState
from opspace.robots.protocol import Robot

MOVING = 0.05
"""Speed at which a robot that is to hold still moves, rad/s or m/s."""
WRONG = 0.3
"""Part of the acceleration under the whole weight at which the declaration is wrong: friction hides
some of it, an error of the model is less."""


def check_declared(facts: DriverFacts, controller: ReferenceController) -> None:
    """Check that everything that a driver declares goes with a controller.

    Raises:
        InputError: Something would be added twice or by nobody, or rates differ.
    """
    if facts.gravity != controller.gravity:
        raise InputError(
            f"the driver declares gravity={facts.gravity!r}; the controller must be built with that, "
            f"not {controller.gravity!r}"
        )
    if facts.coriolis != "controller":
        raise InputError(
            "the driver declares coriolis='robot'; commands of this library contain Coriolis torque, "
            "and it would be added twice: take it off in the driver's write"
        )
    timing = controller.period
    if timing is None or not math.isclose(timing, facts.period, rel_tol=1e-3):
        raise InputError(
            f"the driver gives a state every {facts.period:g} s; the controller must be built with "
            f"period={facts.period:g}, not {timing}"
        )
    if controller.damping == 0.0:
        raise InputError("a loop brakes with the damping of the controller, which is 0")
    if controller.robot.floating_base:
        raise InputError(
            f"robot {controller.robot.name!r} has a floating base: nothing here holds or brakes it"
        )


class HoldCheck:
    r"""Compares a robot that is commanded to hold still with one that bears its weight the other way.

    Where the declaration is right, the commanded torque that holds leaves the robot at rest; where it
    is wrong, by the weight too much or too little, the joints begin to move with

        q̈_w = ± M⁻¹ g

    The part s = (Δv · q̈_w) / (Δt |q̈_w|²) of that motion is 0 in the first case and 1 in the second.

    Args:
        robot: The robot of the controller.
        facts: What the driver declares.
        duration: How long a robot that moves too little to tell is watched, s.
    """

    def __init__(self, robot: Robot, facts: DriverFacts, duration: float) -> None:
        self._robot, self._facts, self._duration = robot, facts, duration
        self._first: RobotState | None = None
        self._wrong = np.zeros(robot.nv)
        self.note = ""

    def holding(self, state: RobotState) -> np.ndarray:
        """Torque that holds in a state, (n,) N·m, as it is commanded."""
        self._robot.update(state.q, state.v)
        gravity = self._robot.gravity
        return np.zeros_like(gravity) if self._facts.gravity == "robot" else gravity.copy()

    def passed(self, state: RobotState) -> bool:
        """Look at the next state.

        Returns:
            Whether the robot has held for long enough.

        Raises:
            InputError: It moves, and how.
        """
        if self._first is None:
            self._begin(state)
            return self._duration <= 0.0
        assert self._first is not None
        passed = state.t - self._first.t
        moved = state.v - self._first.v
        quick = float(np.max(np.abs(moved))) > MOVING
        if not quick and passed < self._duration:
            return False
        self._judge(moved, passed, quick)
        return True

    def _begin(self, state: RobotState) -> None:
        fastest = float(np.max(np.abs(state.v)))
        if fastest > MOVING:
            raise InputError(
                f"the robot moves at {fastest:.2g} rad/s; a loop begins with one that stands still"
            )
        self._first = state
        self._robot.update(state.q, state.v)
        sign = 1.0 if self._facts.gravity == "controller" else -1.0
        self._wrong = sign * np.linalg.solve(self._robot.M, self._robot.gravity)

    def _judge(self, moved: np.ndarray, passed: float, quick: bool) -> None:
        weight = float(self._wrong @ self._wrong)
        seen = np.sqrt(weight) * passed > MOVING
        part = float(moved @ self._wrong) / (passed * weight) if seen and passed > 0.0 else 0.0
        if seen and part > WRONG:
            adds, other = ("adds", "robot") if self._facts.gravity == "controller" else (
                "does not add", "controller"
            )  # fmt: skip
            raise InputError(
                f"the driver declares gravity={self._facts.gravity!r}, but the robot moves as one "
                f"that {adds} the torque against gravity itself ({part:.0%} of the acceleration "
                f"under its weight): declare gravity={other!r}, for the controller, too"
            )
        if quick:
            worst = int(np.argmax(np.abs(moved)))
            raise InputError(
                f"the robot does not hold still where it should: joint "
                f"{self._robot.joint_names[worst]!r} came to {abs(moved[worst]):.2g} rad/s in "
                f"{passed:.3g} s; look at the model, the payload and what else pulls"
            )
        if not seen:
            self.note = "gravity pulls too little here to tell who holds the weight"

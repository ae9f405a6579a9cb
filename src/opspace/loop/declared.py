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

    What is commanded, τ, and what the declaration says of gravity predict a motion, and the opposite
    declaration another one, which differs by the whole weight:

        q̈ = M⁻¹ (τ + g_robot − g),     q̈_w − q̈ = ± M⁻¹ g

    The part s = (Δv − ∫q̈) · M⁻¹ g / (± Δt |M⁻¹ g|²) of that difference which is seen is 0 where the
    declaration is right and 1 where it is wrong. A command on its way up to what holds is no matter.

    Args:
        robot: The robot of the controller.
        facts: What the driver declares.
        duration: How long a robot that moves too little to tell is watched, s; 0 looks at nothing.
    """

    def __init__(self, robot: Robot, facts: DriverFacts, duration: float) -> None:
        self._robot, self._facts, self._duration = robot, facts, duration
        self._adds = facts.gravity == "robot"
        self._first: RobotState | None = None
        self._before = 0.0
        self._predicted = np.zeros(robot.nv)
        self._wrong = np.zeros(robot.nv)
        self.note = ""

    def holding(self, state: RobotState) -> np.ndarray:
        """Torque that holds in a state, (n,) N·m, as it is commanded."""
        self._robot.update(state.q, state.v)
        return np.zeros(self._robot.nv) if self._adds else self._robot.gravity.copy()

    def passed(self, state: RobotState, tau: np.ndarray | None) -> bool:
        """Look at the next state, after `holding`.

        Args:
            state: The state.
            tau: (n,) what has been commanded since the one before; None where nothing has.

        Returns:
            Whether the robot has held for long enough.

        Raises:
            InputError: It moves, and how.
        """
        if self._duration <= 0.0:
            return True
        if self._first is None:
            self._check_stands(state)
        if self._first is None or tau is None:
            self._first, self._before = state, state.t
            return False
        weight = np.linalg.solve(self._robot.M, self._robot.gravity)
        self._wrong = -weight if self._adds else weight
        held = np.linalg.solve(self._robot.M, tau)
        self._predicted += (state.t - self._before) * (held if self._adds else held - weight)
        self._before = state.t
        passed, moved = state.t - self._first.t, state.v - self._first.v - self._predicted
        quick = float(np.max(np.abs(moved))) > MOVING
        if not quick and passed < self._duration:
            return False
        self._judge(moved, passed, quick)
        return True

    def _check_stands(self, state: RobotState) -> None:
        fastest = float(np.max(np.abs(state.v)))
        if fastest > MOVING:
            raise InputError(
                f"the robot moves at {fastest:.2g} rad/s; a loop begins with one that stands still"
            )

    def _judge(self, moved: np.ndarray, passed: float, quick: bool) -> None:
        weight = float(self._wrong @ self._wrong)
        seen = passed > 0.0 and np.sqrt(weight) * passed > MOVING
        part = float(moved @ self._wrong) / (passed * weight) if seen else 0.0
        declared = self._facts.gravity
        if part > WRONG:
            does, other = ("does not add", "controller") if self._adds else ("adds", "robot")
            raise InputError(
                f"the driver declares gravity={declared!r}, but the robot moves as one that {does} the "
                f"torque against gravity itself ({part:.0%} of the acceleration under its weight): "
                f"declare gravity={other!r}, for the controller, too"
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

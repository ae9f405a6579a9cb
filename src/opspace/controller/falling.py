"""When a robot that stands is given up, and what its joints do then."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from opspace.command import Command, Status
from opspace.errors import InputError
from opspace.law import Profile
from opspace.robots.protocol import Robot
from opspace.tasks.rotation import matrix_from_quaternion

SLACKENING = 0.05
"""Time in which the torque of the last tick that stood goes away, s."""
SLOWER = 0.02
"""By how much its centre of mass has to slow down for a robot to be on its way back, m/s."""
LESS = 0.05
"""Or by how much less it has to give up, in weights."""


@dataclass(frozen=True)
class FallRule:
    """When a robot on contacts counts as falling.

    It falls when ``Status.NOT_BALANCED`` has held for ``after`` and nothing has got better: the
    centre of mass has not become slower, nor what is given up less. A robot that takes back a push is
    not balanced for much longer than the push, but first it slows down, then it comes back, and what its
    tasks want comes into reach. It falls as well when the base has turned away from upright, which is
    how it stands in the robot's reference posture, by more than ``tilt``: a law that believes in a
    contact which is not there sees no reason to give anything up. A body that swings to take back a
    push turns far as well, and comes back. From then on no task is followed: the joints are damped
    until `opspace.Controller.restart`.

    Attributes:
        after: How long the robot may be not balanced without getting better, s. A push is over
            sooner; a flight that is wanted is not.
        tilt: How far the vertical may be from where it is in the base when it stands, rad.

    Raises:
        InputError: A number that is not above 0.
    """

    after: float = 0.2
    tilt: float = 1.0

    def __post_init__(self) -> None:
        for what in ("after", "tilt"):
            value = getattr(self, what)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"falling: {what} must be above 0, got {value}")


class FallWatch:
    """Gives a robot up by a rule, and damps it.

    With Γ₀ the last torque of the robot that stood, s the quintic profile over `SLACKENING` and d the
    controller's damping,

        Γ(t) = (1 − s(t)) Γ₀ − d diag(M) v

    within the motors' limits: no step when it begins, nothing that pulls when it has.

    Attributes:
        numbers: How long it may be not balanced, s, cosine of the tilt, and the vertical in the base.

    Args:
        rule: The rule.
        robot: The robot.
        damping: d, 1/s.
    """

    def __init__(self, rule: FallRule, robot: Robot, damping: float) -> None:
        self._rule, self._robot, self._damping = rule, robot, damping
        x, y, z = _vertical(robot.q_reference)
        self.numbers = rule.after, math.cos(min(rule.tilt, math.pi)), x, y, z
        self._profile = Profile("quintic")
        self.forget()

    def forget(self) -> None:
        """Let the robot stand again."""
        self._hopeless: float | None = None
        self._fastest = self._most = 0.0
        self._fell: float | None = None
        self._last = np.zeros(self._robot.nv)

    def after(self, command: Command, given_up: float, M: np.ndarray) -> Command:
        """Look at a tick, and answer in its place once the robot falls.

        Args:
            command: The tick.
            given_up: What it gave up, in weights.
            M: (n, n) inertia of its state, kg·m².
        """
        if self._fell is None:
            if not self._falls(command, given_up, M):
                self._last = command.tau
                return command
            self._fell = command.t
        tau = self._damped(command.t - self._fell, M)
        return command._replace(tau=tau, status=command.status | Status.FALLING)

    def _falls(self, command: Command, given_up: float, M: np.ndarray) -> bool:
        if Status.NOT_BALANCED not in command.status:
            self._hopeless = None
        elif self._hopeless is None:
            self._hopeless = command.t
            self._fastest, self._most = self._speed(M), given_up
        elif self._gets_better(given_up, M):
            self._hopeless = command.t
        after, cosine, *upright = self.numbers
        lost = self._hopeless is not None and command.t - self._hopeless >= after
        (x, y, z), (a, b, c) = _vertical(self._robot.q), upright
        return lost or x * a + y * b + z * c < cosine

    def _gets_better(self, given_up: float, M: np.ndarray) -> bool:
        """Compare with the worst since it last got better; noise moves neither by that much."""
        speed = self._speed(M)
        slower, less = speed < self._fastest - SLOWER, given_up < self._most - LESS
        self._fastest = speed if slower else max(self._fastest, speed)
        self._most = given_up if less else max(self._most, given_up)
        return slower or less

    def _speed(self, M: np.ndarray) -> float:
        """Speed of the centre of mass, m/s: the momentum over the mass, the base's rows of M v."""
        square, v = 0.0, self._robot.v.tolist()
        for row in M[:3].tolist():  # summed in this order in C, too
            momentum = 0.0
            for m, x in zip(row, v, strict=True):
                momentum += m * x
            square += momentum * momentum
        return math.sqrt(square) / float(M[0, 0])

    def _damped(self, since: float, M: np.ndarray) -> np.ndarray:
        robot = self._robot
        limit = np.where(robot.actuated, robot.torque_limit, 0.0)
        left = 1.0 - self._profile(min(max(since, 0.0) / SLACKENING, 1.0)).value
        tau = left * self._last - self._damping * M.diagonal() * robot.v
        return np.clip(np.nan_to_num(tau, nan=0.0), -limit, limit)


def _vertical(q: np.ndarray) -> list[float]:
    """Give the vertical in the axes of the base, (3,)."""
    return matrix_from_quaternion(tuple(np.asarray(q, dtype=float)[3:7].tolist()))[2].tolist()

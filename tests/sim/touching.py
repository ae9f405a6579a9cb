"""An arm that comes down on a table, presses and wipes: a rough plant, and what is measured of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import opspace as osc
from opspace.law.press_columns import CONFIDENCE
from opspace.sim import Disturbances

DT = 1e-3
FORCE = 10.0
ROUGH = Disturbances(delay=1e-3, wrench_noise=0.3, wrench_delay=2e-3)
"""Torque one tick late, wrench two, noise of 0.3 N."""
AFTER = 3.0
"""When the circle begins, s."""


@dataclass
class Touched:
    """What one run gave, a row per tick.

    Attributes:
        tau: Torque, N·m.
        force: True force on the table, N.
        confidence: Of the contact.
        away: Distance from the circle along the table, m.
        turned: Angle from upright, rad.
    """

    tau: np.ndarray
    force: np.ndarray
    confidence: np.ndarray
    away: np.ndarray
    turned: np.ndarray

    @property
    def step(self) -> float:
        """Largest step of a joint torque around the first touch, N·m per tick."""
        first = int(np.argmax(self.force > 0.0))
        near = self.tau[max(first - 50, 0) : first + 300]
        return float(np.max(np.abs(np.diff(near, axis=0))))

    @property
    def losses(self) -> int:
        """How often the table was lost."""
        touching = self.force > 0.0
        return int(np.sum(touching[:-1] & ~touching[1:]))

    @property
    def crossings(self) -> int:
        """How often the confidence crossed a half."""
        sure = self.confidence > 0.5
        return int(np.sum(sure[1:] != sure[:-1]))

    @property
    def rms(self) -> float:
        """Error of the force on the circle once it goes at its speed, N."""
        return self.wiping["force"]

    @property
    def wiping(self) -> dict[str, float]:
        """Errors (RMS) on the circle once it goes at its speed: N, m and rad."""
        late = slice(round((AFTER + 0.5) / DT), None)
        errors = {"force": self.force - FORCE, "away": self.away, "turned": self.turned}
        return {name: float(np.sqrt(np.mean(x[late] ** 2))) for name, x in errors.items()}


class HardContact:
    """The switch that a transition replaces: on above 3 N, off below 1 N."""

    def __init__(self, press: osc.ForceTask) -> None:
        self.press, self.on = press, False

    def __call__(self, robot, t):
        pressed = float(np.linalg.norm(self.press.sense(robot, t).measured))
        self.on = pressed > (1.0 if self.on else 3.0)
        self.press.memory[CONFIDENCE] = float(self.on)
        return float(self.on)


class Height:
    """Activation by the height of the tool above a table."""

    def __init__(self, table: float) -> None:
        self.table = table

    def __call__(self, robot, t):
        height = float(robot.position(robot.frame_id(robot.tool))[2]) - self.table
        return osc.Buffer(0.04, 0.02)(height).value


def down_and_around(start, speed, travel=0.2):
    """Go down at a speed, past the table, then once around a circle of 0.2 m in 4 s."""

    def at(t):
        x, v, a = start.copy(), np.zeros(3), np.zeros(3)
        x[2] -= min(speed * t, travel)
        v[2] = -speed if speed * t < travel else 0.0
        if t > AFTER:
            # Ends as it begins: in half a second at the speed of the circle.
            w, s = 2.0 * math.pi / 4.0, t - AFTER
            ramp = min(s / 0.5, 1.0)
            turn = w * (0.5 * s * ramp if s < 0.5 else s - 0.25)
            rate, gain = w * ramp, (w / 0.5 if s < 0.5 else 0.0)
            c, d = math.cos(turn), math.sin(turn)
            x[:2] += 0.1 * np.array([c - 1.0, d])
            v[:2] = 0.1 * rate * np.array([-d, c])
            a[:2] = 0.1 * (gain * np.array([-d, c]) - rate * rate * np.array([c, d]))
        return osc.Sample(x, v, a)

    return at


def touch_and_wipe(
    way, *, stiffness=1e5, speed=0.1, seconds=AFTER, robot="puma560", approach=0.04, table=0.08,
    plant=ROUGH, size=math.inf, off=0.0,
) -> Touched:  # fmt: skip
    """Run one way of coming into contact.

    Args:
        way: "alone", "contact", "distance" (both) or "hard".
        stiffness: Of the table, N/m.
        speed: With which the position reference comes down, m/s.
        seconds: How long.
        robot: Name of the robot.
        approach: Speed of the force task in the air, m/s.
        table: How far below the start it is, m.
        plant: What is wrong with the plant.
        size: Radius of the table around the start, m; its rim falls away over 15 mm.
        off: How much higher the table is believed to be than it is, m.
    """
    arm = osc.load_robot(robot)
    arm.update(arm.q_reference, np.zeros(arm.nv))
    tool = arm.frame_id(arm.tool)
    start, upright = arm.position(tool).copy(), arm.rotation(tool).copy()
    height = float(start[2]) - table
    press = osc.ForceTask(
        force=-FORCE, axes_frame="world", approach_speed=approach, contact=(1.0, 4.0)
    )
    if way == "contact":
        press.activation = osc.Contact(press)
    elif way == "distance":
        press.activation = osc.ActivationUnion(osc.Contact(press), Height(height + off))
    elif way == "hard":
        press.activation = HardContact(press)
    hand = osc.PositionTask(target=osc.GiveWay(down_and_around(start, speed), press), kp=400.0)
    turn = osc.OrientationTask(target=upright, kp=400.0)
    stack = osc.Stack([press, turn, hand, osc.PostureTask(arm.q_reference, kp=20.0)])
    # What is measured is the touch, and nothing else that fades.
    controller = osc.Controller(arm, stack, period=DT, singularity=None)
    surface = osc.Surface([*start[:2], height], stiffness=stiffness, size=size, bevel=0.015)
    world = osc.Plant(arm, arm.q_reference, surfaces=[surface], disturbances=plant)
    rows = []
    for i in range(round(seconds / DT)):
        q, v = world.measure()
        command = controller.step(i * DT, q, v, wrenches=world.wrenches())
        where = np.linalg.norm(command.tasks[hand.name].error[:2])
        how = np.linalg.norm(command.tasks[turn.name].error)
        rows.append((command.tau, -world.exerted[2], press.touch.confidence, where, how))
        world.advance(command.tau)
    return Touched(*(np.array(column) for column in zip(*rows, strict=True)))

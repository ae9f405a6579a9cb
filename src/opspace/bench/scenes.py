"""What is timed: a robot, a stack of tasks, and the same wish put to other controllers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from opspace.contacts import SoleContact
from opspace.controller import Controller, ReferenceController
from opspace.controller.wrenches import Wrenches
from opspace.errors import missing_extra
from opspace.plan.scales import DEFAULT_SINGULARITY, Singularity
from opspace.robots import load_robot
from opspace.robots.catalogue import CATALOGUE, locate
from opspace.robots.loading import read_robot
from opspace.robots.protocol import Robot
from opspace.stack import Stack
from opspace.tasks import (
    ComTask,
    ForceTask,
    JointLimits,
    JointTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Task,
)

PANDA_HOME = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
UR_HOME = (0.0, -1.57, 1.57, -1.57, -1.57, 0.0)
STATES = 64
"""States on a closed path that a scene is timed at."""

Level = tuple[Task, ...]


@dataclass(frozen=True)
class Scene:
    """A robot and its tasks.

    Attributes:
        title: What is in it.
        robot: Gives the robot.
        home: Posture in the middle of the states; None is the robot's reference posture.
        levels: Gives the tasks, most important first.
        limits: Whether joint limits are kept.
        singularity: Buffer for singular directions, or None.
        transitions: How many tasks are on their way in all the time.
        blending: How they are blended.
        peers: Whether other controllers are asked for the same.
        contacts: Gives what a robot with a floating base stands on.
        torque_limits: Whether motors' limits are kept, see `opspace.Controller`.
        sway: How far every joint goes from home, rad.
        pressed: Force on the world at the tool that every tick is told, N; None is nothing.
    """

    title: str
    robot: Callable[[], Robot]
    levels: Callable[[], list[Level]]
    home: tuple[float, ...] | None = None
    limits: bool = True
    singularity: Singularity | None = DEFAULT_SINGULARITY
    transitions: int = 0
    blending: str = "auto"
    peers: bool = True
    contacts: Callable[[], list[SoleContact]] = list
    torque_limits: str = "report"
    sway: float = 0.05
    pressed: float | None = None

    def controller(self, kind: type[ReferenceController] = Controller) -> ReferenceController:
        """Build the library's controller, with its transitions begun."""
        robot = self.robot()
        levels = [list(level) for level in self.levels()]
        limits = JointLimits() if self.limits else None
        stack = Stack(levels, limits=limits, contacts=self.contacts())
        found = kind(
            robot,
            stack,
            singularity=self.singularity,
            blending=self.blending,
            torque_limits=self.torque_limits,
        )
        moving = [task for level in levels for task in level][: self.transitions]
        if moving:
            q, v = self.states(robot)
            found.step(0.0, q[0], v[0])
            for k, task in enumerate(moving):
                stack.remove(task, 2.0 * self.time * (1.0 + 0.1 * k), profile="linear")
            found.step(1e-3, q[0], v[0])
        return found

    @property
    def wrenches(self) -> Wrenches | None:
        """What every tick is told of the wrench at the tool."""
        if self.pressed is None:
            return None
        return {self.robot().tool: np.array([0.0, 0.0, self.pressed, 0.0, 0.0, 0.0])}

    @property
    def time(self) -> float:
        """Time of every tick, s: the transitions are then half-way, each elsewhere."""
        return 1e9 if self.transitions else 0.0

    def states(self, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
        """Give `STATES` configurations and velocities on a closed path around home."""
        home = robot.q_reference if self.home is None else np.array(self.home)
        rng = np.random.default_rng(0)
        phase = rng.uniform(0.0, 2.0 * np.pi, robot.nv)
        angle = 2.0 * np.pi * np.arange(STATES)[:, None] / STATES + phase
        way, speed = self.sway * np.sin(angle), 2.0 * self.sway * np.cos(angle)
        if robot.nq == robot.nv:
            return home + way, speed
        return np.array([robot.integrate(home, step, 1.0) for step in way]), speed


def _humanoid() -> Robot:
    path = locate(CATALOGUE["talos"])
    if path is None:
        raise missing_extra("example-robot-data", "robots")
    file = read_robot(path, "pinocchio", floating_base=False)
    return file.build(file.description)


def _humanoid_levels() -> list[Level]:
    right, left = "wrist_right_ft_tool_link", "wrist_left_ft_tool_link"
    return [
        (PoseTask(right, name="right hand"),),
        (PoseTask(left, name="left hand"),),
        (OrientationTask("head_2_link", name="head"),),
        (PositionTask("leg_left_6_link", name="left foot"),),
        (PostureTask(),),
    ]


HANDS = ("wrist_right_ft_tool_link", "wrist_left_ft_tool_link")
SOLE = (0.1, 0.06)
"""Half the sides of the soles of Talos, m."""


def _standing_levels() -> list[Level]:
    return [
        (ComTask(kp=50.0),),
        tuple(PositionTask(hand, name=hand) for hand in HANDS),
        (PostureTask(kp=25.0),),
    ]


def _standing(sway: float, what: str) -> Scene:
    return Scene(
        f"Talos on two soles (36 coordinates), centre of mass, two hands, posture, {what}",
        lambda: load_robot("talos"),
        _standing_levels,
        contacts=lambda: [
            SoleContact(f"{side}_sole_link", SOLE, name=side) for side in ("left", "right")
        ],
        torque_limits="priority",
        sway=sway,
    )


def _chain(k: int, blending: str) -> Scene:
    def levels() -> list[Level]:
        joints = load_robot("panda").joint_names
        moving: list[Level] = [
            (PositionTask(axes=axis, name=f"position {axis}"),) for axis in "xyz"
        ]
        moving += [(JointTask(joint),) for joint in joints[:5]]
        return [*moving, (PostureTask(),)]

    return Scene(
        f"Panda, eight tasks of one row above posture, {k} on their way, {blending}",
        lambda: load_robot("panda"),
        levels,
        PANDA_HOME,
        transitions=k,
        blending=blending,
        peers=False,
    )


def _panda(everything: bool) -> Scene:
    return Scene(
        f"Panda, pose above posture{'' if everything else ', no limits, no singular directions'}",
        lambda: load_robot("panda"),
        lambda: [(PoseTask(),), (PostureTask(),)],
        PANDA_HOME,
        limits=everything,
        singularity=DEFAULT_SINGULARITY if everything else None,
    )


def _down(press: bool) -> Scene:
    """One axis of the tool, controlled by its position or pressed with a force."""

    def down() -> Task:
        return ForceTask(name="down") if press else PositionTask(axes="z", name="down")

    return Scene(
        f"Panda, {'force' if press else 'position'} along one axis above orientation above posture",
        lambda: load_robot("panda"),
        lambda: [(down(),), (OrientationTask(),), (PostureTask(),)],
        PANDA_HOME,
        peers=False,
        pressed=10.0 if press else None,
    )


def _ur5(everything: bool) -> Scene:
    plain = "" if everything else ", no limits, no singular directions"
    return Scene(
        f"UR5, orientation above position{plain}",
        lambda: load_robot("ur5"),
        lambda: [(OrientationTask(),), (PositionTask(),)],
        UR_HOME,
        limits=everything,
        singularity=DEFAULT_SINGULARITY if everything else None,
    )


SCENES: Mapping[str, Scene] = MappingProxyType(
    {
        "panda": _panda(True),
        "panda-plain": _panda(False),
        "ur5": _ur5(True),
        "ur5-plain": _ur5(False),
        "axis": _down(False),
        "press": _down(True),
        "puma": Scene(
            "PUMA 560, orientation above position above posture",
            lambda: load_robot("puma560"),
            lambda: [(OrientationTask(),), (PositionTask(),), (PostureTask(),)],
        ),
        "puma-mujoco": Scene(
            "PUMA 560 by MuJoCo, orientation above position above posture",
            lambda: load_robot("puma560", backend="mujoco"),
            lambda: [(OrientationTask(),), (PositionTask(),), (PostureTask(),)],
            peers=False,
        ),
        "humanoid": Scene(
            "Talos fixed at the pelvis (30 joints), two hands, head, a foot, posture: 5 levels",
            _humanoid,
            _humanoid_levels,
        ),
        "standing": _standing(0.002, "no limit acts"),
        "pushed": _standing(0.2, "cones, joints and motors act"),
        **{f"chain-{k}": _chain(k, "chain") for k in (0, 1, 2, 4, 8)},
        **{f"idv-{k}": _chain(k, "idv") for k in (1, 2, 3)},
    }
)
"""Scenes by name."""

"""Motions towards and through singularities, run in the simulator and measured.

Everything goes through the public interface of the library; the other ``buffer_*`` scripts say
which motions and print the tables of docs/singularities.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import opspace as osc

DEFAULT = osc.Singularity(near=0.0)
"""The default buffers, also where a level is at rest: there those of the default lie lower."""
KP_TASK, KP_POSTURE = 100.0, 25.0
"""Stiffness of the tasks in Cartesian space and of the posture, 1/s²."""
MAX_SPEED = 20.0
"""A run is given up when a joint is faster, rad/s."""
STRENGTH = 10.0
"""A run is given up when it asks for so many times the torque of the strongest joint."""
START = 0.5
"""When the motions begin, s."""
REST = 0.5
"""How long before its return an arm is expected to stand still, s."""


class Watch:
    """Keeps what the measures need of every tick."""

    def __init__(self) -> None:
        """Start with nothing."""
        self.t: list[float] = []
        self.q: list[np.ndarray] = []
        self.v: list[np.ndarray] = []
        self.tau: list[np.ndarray] = []
        self.errors: dict[str, list[float]] = {}
        self.sigma: list[float] = []
        self.response: list[float] = []
        self.activation: list[float] = []

    def observe(self, q: np.ndarray, v: np.ndarray, command: osc.Command) -> None:
        """See one tick."""
        self.t.append(command.t)
        self.q.append(q)
        self.v.append(v)
        self.tau.append(command.tau)
        for name, task in command.tasks.items():
            self.errors.setdefault(name, []).append(task.error_norm)
        cartesian = [level for level in command.levels if "posture" not in level.tasks]
        self.sigma.append(min((s for level in cartesian for s in level.sigma), default=np.nan))
        self.response.append(min((r for level in cartesian for r in level.response), default=1.0))
        self.activation.append(
            min((h for level in cartesian for h in level.activation), default=1.0)
        )


@dataclass(frozen=True)
class Run:
    """What one run did.

    Attributes:
        outcome: How it ended.
        seen: Its ticks.
        back: When the return began, s.
    """

    outcome: osc.Outcome
    seen: Watch
    back: float

    @property
    def t(self) -> np.ndarray:
        """Times of the ticks, (T,), s."""
        return np.array(self.seen.t)

    @property
    def torque_step(self) -> float:
        """Largest change of any joint's torque from one tick to the next, N·m."""
        return float(np.abs(np.diff(np.array(self.seen.tau), axis=0)).max())

    @property
    def joint_speed(self) -> float:
        """Largest joint speed, rad/s."""
        return float(np.abs(np.array(self.seen.v)).max())

    @property
    def rest_speed(self) -> float:
        """Largest joint speed just before the return, rad/s; nan if it did not come to that."""
        t = self.t
        resting = (t >= self.back - REST) & (t < self.back)
        if t[-1] < self.back:
            return float("nan")
        return float(np.abs(np.array(self.seen.v)[resting]).max())

    @property
    def least_activation(self) -> float:
        """Smallest activation of any direction."""
        return float(np.min(self.seen.activation))

    def largest(self, task: str) -> float:
        """Largest error of a task, m or rad."""
        return float(np.max(self.seen.errors[task]))

    def final(self, task: str) -> float:
        """Error of a task at the end, m or rad."""
        return float(self.seen.errors[task][-1])


@dataclass(frozen=True)
class Reach:
    """How far an arm can lead its tool outwards while it keeps its orientation.

    Attributes:
        robot: The arm.
        start: (3,) tool position at the reference posture, m.
        outward: (3,) horizontal unit vector in which the arm stretches.
        way: Distance along it to the edge of the workspace, m.
    """

    robot: osc.Robot
    start: np.ndarray
    outward: np.ndarray
    way: float

    @classmethod
    def of(cls, name: str) -> Reach:
        """Find it for a robot by name."""
        robot = osc.load_robot(name)
        tool = robot.frame_id(robot.tool)
        robot.update(robot.q_reference, np.zeros(robot.nv))
        start, R = robot.position(tool).copy(), robot.rotation(tool).copy()
        # The reference postures of the arms used here all face along x.
        outward = np.array([1.0, 0.0, 0.0])
        return cls(robot, start, outward, _way(robot, start, R, outward))

    def out_and_back(self, way: float, duration: float, hold: float) -> tuple[osc.Chain, float]:
        """Lead the tool outwards and back.

        Args:
            way: How far, m.
            duration: Time of the way out and of the way back, s.
            hold: Waiting time between, s.

        Returns:
            The reference, and when the return begins, s.
        """
        return out_and_back(self.start, self.start + way * self.outward, duration, hold)


def out_and_back(
    start: np.ndarray, goal: np.ndarray, duration: float, hold: float
) -> tuple[osc.Chain, float]:
    """Go to a goal, wait and return, with the least jerk; also when the return begins, s."""
    back = START + duration + hold
    return (
        osc.Chain(
            (0.0, osc.MinimumJerk(start, goal, duration, start_time=START)),
            (back, osc.MinimumJerk(goal, start, duration, start_time=back)),
        ),
        back,
    )


def _way(robot: osc.Robot, start: np.ndarray, R: np.ndarray, outward: np.ndarray) -> float:
    """Follow the straight line outwards by Newton steps, to where none leads on."""
    tool = robot.frame_id(robot.tool)
    q, way, step = robot.q_reference.copy(), 0.0, 0.01
    while step > 1e-6:
        found = _pose(robot, tool, q, start + (way + step) * outward, R)
        if found is None:
            step /= 2.0
        else:
            q, way = found, way + step
    return way


def _pose(
    robot: osc.Robot, tool: int, q: np.ndarray, x: np.ndarray, R: np.ndarray
) -> np.ndarray | None:
    """Find a posture near ``q`` with this tool pose, None where there is none."""
    for _ in range(60):
        robot.update(q, np.zeros(robot.nv))
        twist = R @ robot.rotation(tool).T
        turn = 0.5 * np.array(
            [twist[2, 1] - twist[1, 2], twist[0, 2] - twist[2, 0], twist[1, 0] - twist[0, 1]]
        )
        error = np.concatenate([x - robot.position(tool), turn])
        if np.linalg.norm(error) < 1e-9:
            return q
        J = robot.jacobian(tool)
        change = np.linalg.lstsq(J, error, rcond=1e-12)[0]
        largest = np.abs(change).max()
        if largest > 1e3:
            return None
        q = robot.integrate(q, change * min(1.0, 0.2 / largest), 1.0)
    return None


def run(
    robot: osc.Robot,
    levels: Sequence[osc.Task],
    duration: float,
    *,
    singularity: osc.Singularity | None = DEFAULT,
    q: np.ndarray | None = None,
    back: float = 0.0,
) -> Run:
    """Simulate a stack from rest, without joint limits, and measure it.

    Args:
        robot: The robot.
        levels: Its tasks, most important first.
        duration: Simulated time, s.
        singularity: How singular directions are treated.
        q: Configuration at the start; None is the reference posture.
        back: When the return begins, s.

    Returns:
        The run.
    """
    controller = osc.Controller(robot, osc.Stack(levels), singularity=singularity)
    plant = osc.Plant(robot, robot.q_reference if q is None else q)
    known = robot.torque_limit[np.isfinite(robot.torque_limit)]
    stop = osc.StopRule(MAX_SPEED, STRENGTH * float(known.max()))
    watch = Watch()
    return Run(osc.simulate(plant, controller, duration, [watch], stop), watch, back)


def tasks(
    position: osc.Reference | np.ndarray | None,
    *,
    orientation: osc.Reference | None = None,
    posture: np.ndarray | None = None,
    with_posture: bool = True,
    max_speed: float | None = None,
) -> list[osc.Task]:
    """Orientation above position above posture, as in the shipped experiments."""
    stack: list[osc.Task] = [
        osc.OrientationTask(target=orientation, kp=KP_TASK),
        osc.PositionTask(target=position, kp=KP_TASK, max_speed=max_speed),
    ]
    if with_posture:
        stack.append(osc.PostureTask(target=posture, kp=KP_POSTURE))
    return stack

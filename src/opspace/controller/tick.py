"""One tick of operational space control: state in, torque and diagnostics out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from opspace.controller.calibration import calibrate
from opspace.controller.command import Command, LevelStatus, Status, TaskStatus
from opspace.controller.joint_limits import (
    Insertion,
    insertions,
    limit_task_sets,
    limit_terms,
)
from opspace.errors import InputError, unknown_name
from opspace.law import (
    BLENDINGS,
    LawInfo,
    SigmaBuffer,
    TaskSet,
    Weighted,
    blended_torque,
    combined,
    corners,
)
from opspace.robots.protocol import Robot
from opspace.stack import Stack
from opspace.tasks import JointTask, PostureTask, TaskTerms

BIASES = ("joint", "task")
"""``joint``: Γ = Γ_tasks + b + g, every joint compensated. ``task``: Eq. 3 as printed, the bias is
compensated only inside the range of the tasks and fades with them."""

LIMIT_PASSES = 4
"""How often joint limits are inserted with the accelerations just found; each pass can find the
joints that the ones before pushed against their own limits."""


@dataclass(frozen=True)
class Singularity:
    """How directions that the robot is about to lose are faded out (Section 4.1).

    With ``scale="relative"`` the eigenvalues σ of Eq. 25 are multiples of what is usual for the
    task on this robot: the median over the workspace of the smallest eigenvalue of its own Λ⁻¹,
    separately for rows in metres and in radians. One default then serves every robot. With
    ``scale="absolute"`` they are in 1/kg and 1/(kg·m²), as in the paper.

    Args:
        lower: σ at and below which a direction is absent.
        upper: σ at and above which a direction is fully active.
        scale: ``"relative"`` or ``"absolute"``.
        profile: Name of the activation profile.

    Raises:
        InputError: Not 0 < lower < upper.
        UnknownNameError: An unknown scale or profile.
    """

    lower: float = 0.1
    upper: float = 0.6
    scale: str = "relative"
    profile: str = "quintic"

    def __post_init__(self) -> None:
        SigmaBuffer(self.lower, self.upper, self.profile)
        if self.scale not in ("relative", "absolute"):
            raise unknown_name("scale", self.scale, ("relative", "absolute"))


class Controller:
    """Operational space control of a stack of tasks on a robot.

    Args:
        robot: The robot; the controller updates it at every tick.
        stack: The tasks.
        blending: ``"idv"`` or ``"chain"`` for the tasks, see `opspace.task_torque`; joint limits,
            of which many may act at once, are always blended by the chain.
        bias: ``"joint"`` (default) or ``"task"``, see `BIASES`.
        singularity: Buffer for singular directions; None switches their handling off.
        damping: Joint damping in the motions that no task uses, 1/s; also what a joint is braked
            with in case of a fault. Unused where a posture task covers every joint.

    Raises:
        InputError: The robot is not fully actuated, or an option cannot be used.
        UnknownNameError: A task names a frame or joint that the robot does not have.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        *,
        blending: str = "idv",
        bias: str = "joint",
        singularity: Singularity | None = Singularity(),
        damping: float = 10.0,
    ) -> None:
        if blending not in BLENDINGS:
            raise unknown_name("blending", blending, BLENDINGS)
        if bias not in BIASES:
            raise unknown_name("bias", bias, BIASES)
        if not (math.isfinite(damping) and damping >= 0.0):
            raise InputError(f"damping must be finite and >= 0 1/s, got {damping}")
        if not np.all(robot.actuated):
            free = [n for n, a in zip(robot.joint_names, robot.actuated, strict=True) if not a]
            raise InputError(
                f"robot {robot.name!r} is not fully actuated ({', '.join(free)}); this controller "
                "needs a motor at every joint"
            )
        if robot.nq != robot.nv:
            raise InputError(
                f"robot {robot.name!r} has joints with several coordinates (nq={robot.nq}, "
                f"n={robot.nv}); this controller takes hinges and slides only"
            )
        self.robot = robot
        self.stack = stack
        self.blending = blending
        self.bias = bias
        self.singularity = singularity
        self.damping = float(damping)
        for task in stack:
            task.bind(robot)
        self.calibration = calibrate(robot, stack)
        if stack.limits is not None:
            stack.limits.bind(robot, self.calibration.brake)
        self._buffer, self._references, self._joint_reference = self._scales()
        # Rows of Lᵀ have σ = 1 in whatever is left; this puts them above any buffer.
        self._unit_reference = 0.5 / self._buffer.upper if self._buffer is not None else 1.0
        self._posture_covers_all = any(
            isinstance(task, PostureTask) and task.rows == robot.nv for task in stack
        )

    def step(self, t: float, q: ArrayLike, v: ArrayLike) -> Command:
        """Compute the torque for one state.

        Args:
            t: Time, s.
            q: Configuration, (nq,).
            v: Velocity, (n,), rad/s.

        Returns:
            The command; its torque is finite.

        Raises:
            InputError: The state has a wrong size or is not finite, or a reference gave unusable
                numbers; no torque has been computed.
        """
        t = float(t)
        if not math.isfinite(t):
            raise InputError(f"time must be finite, got {t}")
        robot = self.robot
        robot.update(np.asarray(q, dtype=float), np.asarray(v, dtype=float))
        terms = [[task.evaluate(robot, t) for task in level] for level in self.stack.levels]
        task_sets = self._task_sets(terms)
        tau, info, limits = self._torque(task_sets)
        return self._command(t, tau, info, limits, terms)

    def _task_sets(self, terms: Sequence[Sequence[TaskTerms]]) -> list[TaskSet]:
        """J q̈ = f̃ for every task, f̃ = f* − J̇ q̇ (Eq. 3), and damping of what is left."""
        sets = [
            TaskSet(
                term.J,
                term.acceleration - term.drift,
                priority,
                1.0,
                task.name,
                self._references[task.name],
            )
            for priority, (level, found) in enumerate(zip(self.stack.levels, terms, strict=True))
            for task, term in zip(level, found, strict=True)
        ]
        if not self._posture_covers_all and self.damping > 0.0:
            # q̈ = −d v of what is left, weighed by the inertia: its momentum decays at the rate d.
            L = np.linalg.cholesky(self.robot.M)
            rest = -self.damping * (L.T @ self.robot.v)
            sets.append(
                TaskSet(L.T, rest, len(self.stack.levels), 1.0, "damping", self._unit_reference)
            )
        return sets

    def _torque(self, tasks: list[TaskSet]) -> tuple[np.ndarray, LawInfo, dict[str, float]]:
        """The law (Eq. 19-23), with the joint limits that its own answer calls for."""
        L = np.linalg.cholesky(self.robot.M)
        tau, info = self._law(L, [], tasks)
        limits = self.stack.limits
        if limits is None:
            return tau, info, {}
        robot = self.robot
        terms = limit_terms(limits, robot.q, robot.v)
        inserted: dict[str, Insertion] = {}
        for _ in range(LIMIT_PASSES):
            acceleration = self._acceleration(tau)
            again = insertions(terms, limits.profile, acceleration, inserted)
            if again == inserted:
                break
            inserted = again
            sets = limit_task_sets(terms, inserted, robot.nv, self._joint_reference)
            tau, info = self._law(L, sets, tasks)
        return tau, info, {name: limit.activation for name, limit in inserted.items()}

    def _law(
        self, L: np.ndarray, limits: list[TaskSet], tasks: list[TaskSet]
    ) -> tuple[np.ndarray, LawInfo]:
        """Joint torque of limits and tasks, bias included as the option says."""
        robot = self.robot
        sets = [*limits, *tasks]
        if self.bias == "task":
            # Eq. 3-4: f̃ = f* + η + ζ, the bias as an acceleration of each task.
            drop = np.linalg.solve(robot.M, robot.bias)
            sets = [task.replace(f=task.f + task.J @ drop) for task in sets]
        # Many joints can be near a limit at once: k + 1 corners for them, not 2^k.
        activations = [task.activation for task in sets]
        first = len(limits)
        blend = combined(
            corners(activations[:first], "chain"),
            [
                Weighted(w, frozenset(first + k for k in present))
                for w, present in corners(activations[first:], self.blending)
            ],
        )
        tau, info = blended_torque(L, sets, blend, self._buffer, want_spectra=True)
        return (tau if self.bias == "task" else tau + robot.bias), info

    def _acceleration(self, tau: np.ndarray) -> np.ndarray:
        """Joint accelerations that a torque causes, q̈ = A⁻¹ (Γ − b − g) (Eq. 1)."""
        return np.linalg.solve(self.robot.M, tau - self.robot.bias)

    def _command(
        self,
        t: float,
        tau: np.ndarray,
        info: LawInfo,
        limits: dict[str, float],
        terms: Sequence[Sequence[TaskTerms]],
    ) -> Command:
        robot = self.robot
        status = Status.OK
        if not np.all(np.isfinite(tau)):
            tau = robot.bias - self.damping * robot.M.diagonal() * robot.v
            status |= Status.FAULT
        if np.any(np.abs(tau) > robot.torque_limit):
            status |= Status.ABOVE_TORQUE_LIMIT
        if limits:
            status |= Status.JOINT_LIMIT
        levels = self._level_status(info)
        if any(np.any(level.activation < 1.0) for level in levels):
            status |= Status.DIRECTION_OFF
        tasks = {
            task.name: TaskStatus(1.0, term.error, math.sqrt(float(term.error @ term.error)))
            for level, found in zip(self.stack.levels, terms, strict=True)
            for task, term in zip(level, found, strict=True)
        }
        return Command(t, tau, status, tasks, levels, limits, info.hard_solves)

    def _level_status(self, info: LawInfo) -> tuple[LevelStatus, ...]:
        found = {report.priority: report.spectrum for report in info.levels}
        result: list[LevelStatus] = []
        for priority, level in enumerate(self.stack.levels):
            names = tuple(task.name for task in level)
            spectrum = found.get(priority)
            if spectrum is None:
                rows = sum(task.rows for task in level)
                empty = np.zeros(0)
                result.append(LevelStatus(names, empty, empty, np.zeros((rows, 0))))
            else:
                result.append(
                    LevelStatus(names, spectrum.sigma, spectrum.activation, spectrum.directions)
                )
        return tuple(result)

    def _scales(self) -> tuple[SigmaBuffer | None, dict[str, np.ndarray], float]:
        """The buffer, the reference of every task's rows, and that of joint rows."""
        option, found = self.singularity, self.calibration
        if option is None:
            ones = {task.name: np.ones(task.rows) for task in self.stack}
            return None, ones, 1.0
        buffer = SigmaBuffer(option.lower, option.upper, option.profile)
        # A⁻¹ has no eigenvalue below joint_sigma, so joint rows scaled like this are never singular.
        joint = 0.5 * found.joint_sigma / option.upper
        references = {}
        for task in self.stack:
            if isinstance(task, PostureTask | JointTask):
                references[task.name] = np.full(task.rows, joint)
            elif option.scale == "absolute":
                references[task.name] = np.ones(task.rows)
            else:
                references[task.name] = found.references[task.name]
        return buffer, references, joint

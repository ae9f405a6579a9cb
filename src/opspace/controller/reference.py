"""One tick of operational space control in readable form: state in, torque and diagnostics out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, Found, Status
from opspace.controller.bounds import keep_bounds
from opspace.controller.disturbance import DisturbanceObserver
from opspace.controller.drivable import check_drivable
from opspace.controller.handover import Handover
from opspace.controller.limit_task_sets import (
    Insertion,
    insertions,
    limit_task_sets,
    limit_terms,
)
from opspace.controller.reference_report import level_status, task_status
from opspace.controller.watchdog import Watchdog
from opspace.errors import InputError, unknown_name
from opspace.law import (
    LawInfo,
    Motors,
    Profile,
    TaskSet,
    Weighted,
    blended_torque,
    combined,
    corners,
)
from opspace.law.scalars import LIMIT_PASSES, SCALED
from opspace.plan.scales import DEFAULT_SINGULARITY, Scales, Singularity
from opspace.robots.protocol import Robot
from opspace.stack import Blending, Member, Mixture, Stack, mixture
from opspace.tasks import JointLimits, PostureTask, TaskTerms, TrackingTask
from opspace.tasks.activations import own_activation
from opspace.tasks.validation import finite, numbers

BIASES = ("joint", "task")
"""``joint``: Γ = Γ_tasks + b + g, every joint compensated. ``task``: Eq. 3 as printed, the bias is
compensated only inside the range of the tasks and fades with them."""

TORQUE_LIMITS = ("report", "priority")
"""``report``: a torque above the motors' limits is reported and left as it is. ``priority``: levels give
way until it is inside, the lowest first."""


class ReferenceController:
    """Operational space control of a stack of tasks on a robot, written to be read.

    `opspace.Controller` computes the same in compiled form; this is what it is tested against, and
    what other control laws are derived from.

    Args:
        robot: The robot; the controller updates it at every tick.
        stack: The tasks; they may come, go and change rank while the controller runs.
        blending: How tasks that move at once are blended. ``"auto"`` (default): intermediate
            desired values while at most 3 move, the chain for those that begin to move beyond;
            ``"idv"``: up to 16 exactly, 2^k hard torques; ``"chain"``: k + 1. See
            `opspace.stack.Blending`. Joint limits, of which many may act at once, are always
            blended by the chain.
        bias: ``"joint"`` (default) or ``"task"``, see `BIASES`.
        singularity: Buffer for singular directions; None switches their handling off.
        damping: Joint damping in the motions that no task uses, 1/s; also what a joint is braked
            with in case of a fault. Unused where a posture task covers every joint.
        torque_limits: What happens to a torque above the motors' limits, see `TORQUE_LIMITS`.
        period: Time between two ticks, s, if ticks and states shall be watched: late, jumping and stale
            ones are then reported in the status. None watches nothing.
        on_time_jump: What happens when time runs backwards or jumps, see
            `opspace.controller.watchdog.POLICIES`; it needs ``period``.

    Raises:
        InputError: The robot is not fully actuated, or an option cannot be used.
        UnknownNameError: A task names a frame or joint that the robot does not have.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        *,
        blending: str = "auto",
        bias: str = "joint",
        singularity: Singularity | None = DEFAULT_SINGULARITY,
        damping: float = 10.0,
        torque_limits: str = "report",
        period: float | None = None,
        on_time_jump: str = "report",
    ) -> None:
        self._blending = Blending(blending)
        if bias not in BIASES:
            raise unknown_name("bias", bias, BIASES)
        if torque_limits not in TORQUE_LIMITS:
            raise unknown_name("torque_limits", torque_limits, TORQUE_LIMITS)
        if not (math.isfinite(damping) and damping >= 0.0):
            raise InputError(f"damping must be finite and >= 0 1/s, got {damping}")
        if not isinstance(stack, Stack):
            raise InputError(
                f"a controller takes a Stack, not {type(stack).__name__}: Stack([task, ...])"
            )
        if not isinstance(robot, Robot):
            raise InputError(
                f"a controller takes a robot, not {type(robot).__name__}: load_robot(name)"
            )
        check_drivable(robot)
        if stack.limits is not None:
            Profile(stack.limits.profile)
        self._robot, self._stack = robot, stack
        self.bias = bias
        self.singularity = singularity
        self.damping = float(damping)
        self.torque_limits = torque_limits
        if period is None and on_time_jump != "report":
            raise InputError(f"on_time_jump={on_time_jump!r} needs the period of the ticks")
        self._timing = None if period is None else Watchdog(period, on_time_jump)
        self._motors: Motors | None = None
        self._scales = Scales(robot, singularity)
        stack.attach(self._scales.prepare)
        self.calibration = self._scales.calibration(list(stack))
        if stack.limits is not None:
            stack.limits.bind(robot, self.calibration.brake)
        self._handover: Handover | None = None
        self._observer = _observer(stack.limits, robot.nv, torque_limits)

    def __repr__(self) -> str:
        handled = "off" if self.singularity is None else repr(self.singularity)
        return (
            f"{type(self).__name__} of {self._robot!r}\n"
            f"  bias={self.bias!r}, torque_limits={self.torque_limits!r}, singularity={handled}\n"
            f"{self._stack!r}"
        )

    def take_over(self, tau: ArrayLike, duration: float = 0.5) -> None:
        """Begin at the torque that is on the robot, and move to the controller's own.

        The next tick answers ``tau``; see `opspace.controller.handover.Handover`. Called again, or
        after `hand_back`, it begins anew.

        Args:
            tau: (n,) torque that is on the robot now, N·m.
            duration: How long it takes, s.

        Raises:
            InputError: A torque of another size or not finite, or a duration that is none.
        """
        self._handover = Handover(self._joint_torque(tau), duration, back=False)

    def hand_back(self, tau: ArrayLike, duration: float = 0.5) -> None:
        """Move from the controller's torque to the one that takes over, and stay there.

        Args:
            tau: (n,) torque to end at, N·m: what the next controller begins with, or ``robot.gravity``
                where brakes are about to close.
            duration: How long it takes, s.

        Raises:
            InputError: A torque of another size or not finite, or a duration that is none.
        """
        self._handover = Handover(self._joint_torque(tau), duration, back=True)

    def _joint_torque(self, tau: ArrayLike) -> np.ndarray:
        found = numbers(tau, "the torque")
        if found.shape != (self.robot.nv,):
            raise InputError(
                f"a torque for {self.robot.name!r} has shape ({self.robot.nv},), not {found.shape}"
            )
        return found

    def _handed_over(self, command: Command) -> Command:
        """Mix the torque with another controller's while it takes over or hands back."""
        handover = self._handover
        assert handover is not None
        if self._observer is not None:
            self._observer.forget_last()
        tau = handover.torque(command.t, command.tau, self.robot.torque_limit)
        if handover.done:
            self._handover = None
        return command._replace(tau=tau, status=command.status | Status.HANDOVER)

    @property
    def robot(self) -> Robot:
        """The robot that it was built with."""
        return self._robot

    @property
    def stack(self) -> Stack:
        """The stack that it was built with; tasks come and go in it, it stays."""
        return self._stack

    @property
    def blending(self) -> str:
        """Name of the blending."""
        return self._blending.name

    def step(self, t: float, q: ArrayLike, v: ArrayLike) -> Command:
        """Compute the torque for one state.

        Args:
            t: Time, s.
            q: Configuration, (nq,).
            v: Velocity, (n,), rad/s.

        Returns:
            The command; its torque is finite.

        Raises:
            InputError: The state has a wrong size or is not finite, or a reference or activation
                gave unusable numbers; no torque has been computed.
        """
        t = finite(t, "time")
        robot = self.robot
        robot.update(numbers(q, "q"), numbers(v, "v"))
        timing = Status.OK if self._timing is None else self._timing.check(t, robot.q, robot.v)
        if timing & Status.TIME_JUMP and self._holds:
            return self._hold(t, timing)
        return self._answer(t, self.stack.begin_tick(t), timing)

    def _answer(self, t: float, members: Sequence[Member], timing: Status) -> Command:
        """Compute the torque of these tasks for the robot's present state."""
        robot = self.robot
        activations = [self._activation(member, t) for member in members]
        terms = [member.task.evaluate(robot, t) for member in members]
        mixed = mixture(members, activations, t, self._blending)
        if not self._usable(members, terms):
            return self._hold(t, timing | Status.FAULT)
        task_sets, blend = self._task_sets(members, activations, terms, mixed)
        try:
            tau, info, limits, kept = self._torque(t, task_sets, blend)
        except (InputError, np.linalg.LinAlgError):
            # Everything that went in is finite: these numbers are too large to compute with.
            return self._hold(t, timing | Status.FAULT)
        tau, status = self._checked(tau, limits)
        status |= timing | kept
        if any(level.scale < 1.0 - SCALED for level in info.levels):
            status |= Status.TORQUE_SCALED
        levels = level_status(members, mixed, info, len(limits))
        if any(np.any(level.activation < 1.0) for level in levels):
            status |= Status.DIRECTION_OFF
        tasks = task_status(members, activations, terms, mixed)
        command = Command(t, tau, status, info.hard_solves, Found(tasks, levels, limits))
        return command if self._handover is None else self._handed_over(command)

    def _usable(self, members: Sequence[Member], terms: Sequence[TaskTerms]) -> bool:
        """Whether the model and the library's own tasks are finite, and the inertia an inertia."""
        robot = self.robot
        numbers = [robot.M, robot.bias]
        for member, term in zip(members, terms, strict=True):
            if isinstance(member.task, TrackingTask):
                numbers += [term.J, term.drift, term.acceleration]
        if not all(np.isfinite(array).all() for array in numbers):
            return False
        return bool(np.linalg.eigvalsh(robot.M)[0] > 0.0)

    def _activation(self, member: Member, t: float) -> float:
        """Presence in the stack times the task's own activation."""
        presence = member.presence.value(t)
        return presence * own_activation(member.task, self.robot, t)

    def _task_sets(
        self,
        members: Sequence[Member],
        activations: Sequence[float],
        terms: Sequence[TaskTerms],
        mixed: Mixture,
    ) -> tuple[list[TaskSet], Sequence[Weighted]]:
        """J q̈ = f̃ for every task, f̃ = f* − J̇ q̇ (Eq. 3), and damping of what is left."""
        rank = {level: k for k, level in enumerate(mixed.levels)}
        sets = [
            TaskSet(
                terms[i].J,
                terms[i].acceleration - terms[i].drift,
                rank[level],
                1.0,
                members[i].task.name,
                self._scales.reference(members[i].task),
            )
            for i, level in mixed.slots
        ]
        covered = any(
            isinstance(member.task, PostureTask) and member.task.rows == self.robot.nv and h == 1.0
            for member, h in zip(members, activations, strict=True)
        )
        if covered or self.damping == 0.0:
            return sets, mixed.corners
        # q̈ = −d v of what is left, weighed by the inertia: its momentum decays at the rate d. A
        # posture on its way in takes everything away from it, so it need not fade.
        L = np.linalg.cholesky(self.robot.M)
        rest = -self.damping * (L.T @ self.robot.v)
        sets.append(TaskSet(L.T, rest, len(rank), 1.0, "damping", self._scales.unit))
        last = len(sets) - 1
        return sets, [Weighted(w, present | {last}) for w, present in mixed.corners]

    def _torque(
        self, t: float, tasks: list[TaskSet], blend: Sequence[Weighted]
    ) -> tuple[np.ndarray, LawInfo, dict[str, float], Status]:
        """The law (Eq. 19-23), with the joint limits that its own answer calls for."""
        L = np.linalg.cholesky(self.robot.M)
        tau, info = self._law(L, [], tasks, blend)
        limits = self.stack.limits
        if limits is None:
            return tau, info, {}, Status.OK
        robot = self.robot
        observer = self._observer
        if observer is not None:
            observer.observe(t, robot.v)
        terms = limit_terms(limits, robot.q, robot.v, observer and observer.acceleration)
        inserted: dict[str, Insertion] = {}
        for _ in range(LIMIT_PASSES):
            acceleration = self._acceleration(tau)
            again = insertions(limits, terms, acceleration, inserted)
            if again == inserted:
                break
            inserted = again
            sets = limit_task_sets(terms, inserted, robot.nv, self._scales.joint)
            tau, info = self._law(L, sets, tasks, blend)
        kept = Status.OK
        if limits.law.bound:
            motors = robot.torque_limit if self.torque_limits == "priority" else None
            tau, kept = keep_bounds(terms, robot.M, robot.bias, tau, motors)
        if observer is not None:
            observer.remember(t, robot.v, self._acceleration(tau))
        return tau, info, {name: limit.activation for name, limit in inserted.items()}, kept

    def _law(
        self,
        L: np.ndarray,
        limits: list[TaskSet],
        tasks: list[TaskSet],
        blend: Sequence[Weighted],
    ) -> tuple[np.ndarray, LawInfo]:
        """Joint torque of limits and tasks, bias included as the option says."""
        robot = self.robot
        sets = [*limits, *tasks]
        if self.bias == "task":
            # Eq. 3-4: f̃ = f* + η + ζ, the bias as an acceleration of each task.
            drop = np.linalg.solve(robot.M, robot.bias)
            sets = [task.replace(f=task.f + task.J @ drop) for task in sets]
        # Many joints can be near a limit at once: k + 1 corners for them, not 2^k.
        first = len(limits)
        everything = combined(
            corners([task.activation for task in limits], "chain"),
            [Weighted(w, frozenset(first + k for k in present)) for w, present in blend],
        )
        self._motors = self._limited_motors(L)
        tau, info = self._blend(L, sets, everything)
        if self._motors is not None:
            return self._motors.start + tau, info
        return (tau if self.bias == "task" else tau + robot.bias), info

    def _limited_motors(self, L: np.ndarray) -> Motors | None:
        """What the motors can give beside the bias, or None where they are not asked."""
        if self.torque_limits != "priority":
            return None
        limit = self.robot.torque_limit
        bias = np.zeros(limit.size) if self.bias == "task" else self.robot.bias
        return Motors(L, np.clip(bias, -limit, limit), limit)

    def _blend(
        self, L: np.ndarray, sets: Sequence[TaskSet], blend: Sequence[Weighted]
    ) -> tuple[np.ndarray, LawInfo]:
        """The sum of hard torques; another law may stand here to be compared with."""
        return blended_torque(
            L, sets, blend, self._scales.buffer, want_spectra=True, motors=self._motors
        )

    def _acceleration(self, tau: np.ndarray) -> np.ndarray:
        """Joint accelerations that a torque causes, q̈ = A⁻¹ (Γ − b − g) (Eq. 1)."""
        return np.linalg.solve(self.robot.M, tau - self.robot.bias)

    @property
    def _holds(self) -> bool:
        return self._timing is not None and self._timing.policy == "hold"

    def _hold(self, t: float, status: Status) -> Command:
        """Brake in a tick that cannot be trusted."""
        if self._observer is not None:
            self._observer.forget_last()
        return Command(t, self._braking(), status, 0, Found({}, (), {}))

    def _braking(self) -> np.ndarray:
        """Bias with joint damping, inside the motors' limits; finite whatever the model says."""
        robot = self.robot
        tau = robot.bias - self.damping * robot.M.diagonal() * robot.v
        limit = np.minimum(robot.torque_limit, np.finfo(float).max)
        return np.clip(np.nan_to_num(tau, nan=0.0), -limit, limit)

    def _checked(self, tau: np.ndarray, limits: dict[str, float]) -> tuple[np.ndarray, Status]:
        """A torque that is finite, and what there is to say about it."""
        robot = self.robot
        status = Status.OK
        if not np.all(np.isfinite(tau)):
            tau = self._braking()
            status |= Status.FAULT
        if np.any(np.abs(tau) > robot.torque_limit):
            status |= Status.ABOVE_TORQUE_LIMIT
        if limits:
            status |= Status.JOINT_LIMIT
        return tau, status


def _observer(limits: JointLimits | None, n: int, torque_limits: str) -> DisturbanceObserver | None:
    if limits is None or limits.observer_time is None or not limits.law.bound:
        return None
    if torque_limits != "priority":
        raise InputError(
            "joint limits with an observer_time need torque_limits='priority': "
            "what the motors clip would be taken for a disturbance"
        )
    return DisturbanceObserver(n, limits.observer_time)

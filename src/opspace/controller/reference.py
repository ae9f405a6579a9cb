"""Operational space control in readable form: a state in, torque and diagnostics out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, Found, Status
from opspace.contacts import GroundContact
from opspace.controller.changing_payload import Loading
from opspace.controller.disturbance import DisturbanceObserver
from opspace.controller.drivable import base_of, check_drivable
from opspace.controller.falling import FallRule, FallWatch
from opspace.controller.handover import Handover
from opspace.controller.integral import IntegralAction
from opspace.controller.rates import check_damping, check_limits, with_period
from opspace.controller.stages import Given, Law, Rules, sum_of_hard_torques, tick
from opspace.controller.watchdog import Watchdog
from opspace.controller.wrenches import Wrenches, WrenchInput
from opspace.errors import InputError, unknown_name
from opspace.law import Profile
from opspace.law.scalars import MAY_GIVE_UP
from opspace.plan.pack_integrals import PackedIntegrals
from opspace.plan.scales import DEFAULT_SINGULARITY, Scales, Singularity
from opspace.robots.adapter import AdapterBase
from opspace.robots.motor_range import motor_range
from opspace.robots.payload import Payload
from opspace.robots.protocol import Robot
from opspace.stack import Blending, Member, Stack
from opspace.tasks import CollisionAvoidance, ForceTask, JointLimits, Task, TrackingTask
from opspace.tasks.obstacles import NO_PLACINGS, Placing
from opspace.tasks.validation import finite, numbers

BIASES = ("joint", "task")
"""``joint``: Γ = Γ_tasks + b + g, every joint compensated. ``task``: Eq. 3 as printed, the bias is
compensated only inside the range of the tasks and fades with them."""

GRAVITIES = ("controller", "robot")
"""``controller``: the command holds the robot's weight. ``robot``: the robot adds the torque for that to
every command itself, as the drivers of Franka, KUKA and UR do, and the command leaves it out; limits
count what both give together."""

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
            ``"idv"``: up to 16 exactly, 2^k hard torques; ``"chain"``: k + 1;
            ``"smooth-chain"``: one more for each pair that is about to cross, and no kink where it
            does; or a `opspace.stack.Blending` of one's own. Joint limits, of which many may act
            at once, are always blended by the chain.
        bias: ``"joint"`` (default) or ``"task"``, see `BIASES`.
        gravity: Who adds the torque that holds the weight, ``"controller"`` (default) or ``"robot"``,
            see `GRAVITIES`.
        singularity: Buffer for singular directions; None switches their handling off, and so does a
            floating base where nothing else is given: what is usual in flight says nothing about a
            robot that stands.
        damping: Joint damping in the motions that no task uses, 1/s; also what a joint is braked
            with in case of a fault. Unused where a posture task covers every joint.
        torque_limits: What happens to a torque above the motors' limits, see `TORQUE_LIMITS`.
        period: Time between two ticks, s, if ticks and states shall be watched: late, jumping and stale
            ones are then reported in the status, joint limits and gains that need more frequent
            ticks refused, and joint limits count how accelerations change between two ticks. None
            does nothing of it.
        on_time_jump: What happens when time runs backwards or jumps, see
            `opspace.controller.watchdog.POLICIES`; it needs ``period``.
        collisions: What is kept apart: the robot's own links, and obstacles; None for nothing.
        falling: When a robot on contacts is given up and only damped; None is never, and tells by
            ``Status.NOT_BALANCED`` alone.
        law: Torque of task sets, to compare with the library's own; see
            `opspace.controller.stages.Question` for what it is asked.

    Raises:
        InputError: A joint behind the base has no motor, or an option cannot be used; the joint
            limits or the damping of a task need a shorter ``period``.
        UnknownNameError: A task names a frame or joint that the robot does not have.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        *,
        blending: str | Blending = "auto",
        bias: str = "joint",
        gravity: str = "controller",
        singularity: Singularity | None = DEFAULT_SINGULARITY,
        damping: float = 10.0,
        torque_limits: str = "report",
        period: float | None = None,
        on_time_jump: str = "report",
        collisions: CollisionAvoidance | None = None,
        falling: FallRule | None = None,
        law: Law = sum_of_hard_torques,
    ) -> None:
        self._blending = blending if isinstance(blending, Blending) else Blending(blending)
        if bias not in BIASES:
            raise unknown_name("bias", bias, BIASES)
        if gravity not in GRAVITIES:
            raise unknown_name("gravity", gravity, GRAVITIES)
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
        self._base = base_of(robot)
        if self._base:
            singularity = _singularity_of_base(robot, bias, gravity, singularity)
        if stack.limits is not None:
            Profile(stack.limits.profile)
        self._robot, self._stack = robot, stack
        self.bias = bias
        self.gravity = gravity
        self._robot_adds = gravity == "robot"
        self.singularity = singularity
        self.damping = float(damping)
        self.torque_limits = torque_limits
        if period is None and on_time_jump != "report":
            raise InputError(f"on_time_jump={on_time_jump!r} needs the period of the ticks")
        self._timing = (
            None if period is None else Watchdog(period, on_time_jump, robot.nq, robot.nv)
        )
        self._scales = Scales(robot, singularity)
        self._integral: IntegralAction | None = None
        self._forces: WrenchInput | None = None
        stack.attach(self._prepared if period is None else self._paced(period))
        self.calibration = self._scales.calibration(list(stack))
        if stack.limits is not None:
            stack.limits.bind(robot, self.calibration.brake)
        stack.attach_contacts(self._touching)
        _bind_collisions(collisions, robot)
        self._collisions = collisions
        self._placings: Mapping[str, Placing] = NO_PLACINGS
        self._handover: Handover | None = None
        self._last_torque: np.ndarray | None = None
        self._loading: Loading | None = None
        # What a quiet tick of compiled code needs; None as long as the last tick was none, or left
        # something to look at. No default of the class: that is read ten times as slowly.
        self._quiet: Any = None
        self._fall = self._watch_for(falling)
        self._plain = self._needs_no_more()
        self._observer = _observer(stack.limits, robot.nv, torque_limits)
        self._rules = Rules(
            law,
            self._blending,
            bias,
            self.damping,
            torque_limits == "priority",
            self._scales,
            stack.limits,
            self._observer,
            0.0 if period is None else float(period),
            collisions,
        )

    def _watch_for(self, falling: FallRule | None) -> FallWatch | None:
        """Watch whether the robot falls.

        Raises:
            InputError: No rule, or a robot that cannot fall.
        """
        if falling is None:
            return None
        if not isinstance(falling, FallRule):
            raise InputError(f"falling takes a FallRule, not {type(falling).__name__}")
        if not self._base:
            raise InputError(f"robot {self._robot.name!r} is bolted down and does not fall")
        return FallWatch(falling, self._robot, self.damping)

    def _touching(self, contact: GroundContact) -> None:
        """Get a contact ready.

        Raises:
            InputError: The robot stands on nothing.
        """
        if not self._base:
            raise InputError(
                f"contact {contact.name!r}: robot {self._robot.name!r} is bolted down; contacts are for "
                "robots with a floating base"
            )
        contact.bind(self._robot)

    def _paced(self, period: float) -> Callable[[Task], None]:
        """Check the rates of everything that is there now, and of every task that is prepared later."""
        if self._stack.limits is not None:
            check_limits(period, self._stack.limits)
        check_damping(period, self.damping, "damping =")
        return with_period(self._prepared, period)

    def _prepared(self, task: Task) -> None:
        """Get a task ready, and what it needs of the controller."""
        self._scales.prepare(task)
        if self._integral is None and isinstance(task, TrackingTask) and task.ki is not None:
            self._integral = IntegralAction(self._robot, self._scales)
            self._plain = False
        if isinstance(task, ForceTask):
            if self._forces is None:
                self._forces = WrenchInput(self._robot)
            self._forces.add(task)

    def __repr__(self) -> str:
        handled = "off" if self.singularity is None else repr(self.singularity)
        return (
            f"{type(self).__name__} of {self._robot!r}\n"
            f"  bias={self.bias!r}, gravity={self.gravity!r}, torque_limits={self.torque_limits!r}, "
            f"singularity={handled}\n"
            f"{self._stack!r}"
        )

    def take_over(self, tau: ArrayLike, duration: float = 0.5) -> None:
        """Begin at the torque that is on the robot, and move to the controller's own.

        The next tick answers ``tau``; see `opspace.controller.handover.Handover`. Called again, or
        after `hand_back`, it begins anew. It is a `restart`: somebody else may have moved the robot
        meanwhile, and the controller holds it where it finds it.

        Args:
            tau: (n,) torque that is on the robot now, N·m; without gravity where the robot adds it.
            duration: How long it takes, s.

        Raises:
            InputError: A torque of another size or not finite, or a duration that is none.
        """
        self._begin(Handover(self._joint_torque(tau), duration, back=False))
        self.restart()

    def carry(self, payload: Payload | None, duration: float = 0.5) -> None:
        """Take a payload into the model, or out of it, without a step in the torque.

        Inertia, Coriolis and gravity torque and the centre of mass move with it, from the next tick
        on; called again before that has ended, they go on from where they are. ``robot.payload``
        is the payload from the first tick on. From any thread, between two ticks.

        Args:
            payload: What the robot carries in the end; None is nothing.
            duration: How long it takes, s; 0 is at once.

        Raises:
            InputError: The robot cannot carry it, or is not one of ``load_robot``.
            UnknownNameError: The robot has no frame of the payload's.
        """
        robot = self.robot
        if not isinstance(robot, AdapterBase):
            raise InputError(
                f"robot {robot.name!r} is not one of load_robot: what it carries is in its own model"
            )
        self._loading = Loading(robot, payload, duration)
        self.stack.transitions.look()

    def _load(self, t: float) -> None:
        """Let a payload come or go on."""
        loading = self._loading
        if loading is not None and loading.tick(t) and self._loading is loading:
            self._loading = None

    def restart(self) -> None:
        """Go on at the next tick as if no time had passed since the last, wherever the robot is now.

        After a stop, with a clock that went on or began anew: tasks without a target hold what they
        find, references and transitions go on from where they were, what waits for its time waits on,
        angles take the short way, no task has been at rest, and the tick is neither late nor a jump in
        time. A target that is a value stays what it is; give another one where the robot should not go
        there. Times that are given from now on are those of the clock after the pause. From any thread,
        between two ticks.
        """
        if self._timing is not None:
            self._timing.forget()
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Let the next tick depend on nothing that the robot did before it."""
        if self._observer is not None:
            self._observer.forget_last()
        if self._loading is not None:
            self._loading.resume()
        if self._fall is not None:
            self._fall.forget()
        self._rules.unrest.forget()
        self.stack.resume()

    def hand_back(self, tau: ArrayLike, duration: float = 0.5) -> None:
        """Move from the controller's torque to the one that takes over, and stay there.

        Args:
            tau: (n,) torque to end at, N·m: what the next controller begins with, or where brakes are
                about to close ``robot.gravity``, or zero where the robot adds it.
            duration: How long it takes, s.

        Raises:
            InputError: A torque of another size or not finite, or a duration that is none.
        """
        self._begin(Handover(self._joint_torque(tau), duration, back=True))

    def _begin(self, handover: Handover) -> None:
        self._handover, self._plain = handover, False
        self.stack.transitions.look()

    def _joint_torque(self, tau: ArrayLike) -> np.ndarray:
        found = numbers(tau, "the torque")
        if found.shape != (self.robot.nv,):
            raise InputError(
                f"a torque for {self.robot.name!r} has shape ({self.robot.nv},), not {found.shape}"
            )
        return found

    def _needs_no_more(self) -> bool:
        """Tell whether a command leaves as the tick has made it."""
        return not self._robot_adds and self._integral is None and self._fall is None

    def _sensed(self, t: float, wrenches: Wrenches | None, members: Sequence[Member]) -> int:
        """Hand the wrenches of a tick to the tasks that need them."""
        if self._forces is None:
            self._forces = WrenchInput(self._robot)
        return self._forces.take(t, wrenches, members)

    def _finished(self, command: Command, members: Sequence[Member]) -> Command:
        """Learn from a tick, leave out what the robot adds, mix with another's torque in a handover."""
        if self._handover is None and self._integral is not None:
            self._integral.after(command, members, self._compiled_integrals)
        if self._fall is not None:
            command = self._fall.after(command, self.stack.hindrance * MAY_GIVE_UP, self._inertia)
            self._last_torque = command.tau
        added, handover = self._added_by_robot(), self._handover
        if handover is None:
            return command._replace(tau=command.tau - added) if self._robot_adds else command
        if self._observer is not None:
            self._observer.forget_last()
        limit, middle = motor_range(self.robot)
        tau = handover.torque(command.t, command.tau - added, limit, added - middle)
        if handover.done:
            self._handover = None
            self._plain, self._quiet = self._needs_no_more(), None
        return command._replace(tau=tau, status=command.status | Status.HANDOVER)

    @property
    def _compiled_integrals(self) -> PackedIntegrals | None:
        """What learns from errors where compiled code has ticked."""
        return None

    @property
    def _inertia(self) -> np.ndarray:
        """Inertia (n, n) that the last tick was computed with, kg·m²."""
        return self.robot.M

    def _added_by_robot(self) -> np.ndarray:
        """Torque that the robot adds to a command, (n,) N·m, finite whatever the model says."""
        if not self._robot_adds:
            return np.zeros(self.robot.nv)
        return np.nan_to_num(self.robot.gravity, nan=0.0, posinf=0.0, neginf=0.0)

    @property
    def robot(self) -> Robot:
        """The robot that it was built with."""
        return self._robot

    @property
    def stack(self) -> Stack:
        """The stack that it was built with; tasks come and go in it, it stays."""
        return self._stack

    @property
    def collisions(self) -> CollisionAvoidance | None:
        """What it keeps apart; obstacles come, go and move in it, it stays."""
        return self._collisions

    @property
    def period(self) -> float | None:
        """Time between two ticks that was announced, s; None if none was."""
        return self._rules.period or None

    @property
    def on_time_jump(self) -> str:
        """What happens when time runs backwards or jumps; see `opspace.controller.watchdog.POLICIES`."""
        return "report" if self._timing is None else self._timing.policy

    @property
    def blending(self) -> str:
        """Name of the blending."""
        return self._blending.name

    @property
    def wrenches(self) -> Mapping[str, np.ndarray | None]:
        """Wrenches that the last tick was given, (6,) N and N·m; None where nothing was new."""
        return MappingProxyType({} if self._forces is None else self._forces.given)

    @property
    def placings(self) -> Mapping[str, Placing]:
        """Where the last tick found the obstacles of `collisions`, and how they moved, by name."""
        return self._placings

    def step(
        self, t: float, q: ArrayLike, v: ArrayLike, *, wrenches: Wrenches | None = None
    ) -> Command:
        """Compute the torque for one state.

        Args:
            t: Time, s.
            q: Configuration, (nq,).
            v: Velocity, (n,), rad/s.
            wrenches: Wrench that the robot exerts on the environment, (6,) N and N·m in world axes at
                the point of the task, by name of the frame; None in place of one where nothing new
                has been measured. Only force tasks need them.

        Returns:
            The command; its torque is finite.

        Raises:
            InputError: The state has a wrong size or is not finite, or a reference or activation
                gave unusable numbers; a force task lacks its wrench; no torque has been computed.
            UnknownNameError: A wrench of a frame that the robot does not have.
        """
        t = finite(t, "time")
        robot = self.robot
        if self._loading is not None:
            self._load(t)
        robot.update(numbers(q, "q"), numbers(v, "v"))
        timing = Status(0 if self._timing is None else self._timing.check(t, robot.q, robot.v))
        if timing & Status.TIME_JUMP and self._holds:
            self._begin_anew()
            return self._hold(t, timing)
        members = self.stack.begin_tick(t)
        if wrenches is not None or self._forces is not None:
            timing |= self._sensed(t, wrenches, members)
        return self._answer(t, members, timing)

    def _answer(self, t: float, members: Sequence[Member], timing: Status) -> Command:
        """Compute the torque of these tasks for the robot's present state."""
        r = self.robot
        touching = self.stack.begin_contacts(t) if self._base else ()
        motors = motor_range(r)
        given = Given(
            self._rules,
            t,
            members,
            r,
            r.q,
            r.v,
            r.M,
            r.bias - motors.middle,
            motors.limit,
            motors.middle,
            base=self._base,
            contacts=touching,
        )
        answer = tick(given)
        if answer is None:
            return self._hold(t, timing | Status.FAULT)
        tau, status, hard_solves, found, hindrance, self._placings = answer
        self.stack.hinder(hindrance)
        if Status.FAULT in status:
            tau = self._braking()
        elif self._base:
            self._last_torque = tau
        command = Command(t, tau, status | timing, hard_solves, found)
        if self._forces is not None:
            self._forces.after(command.status)
        return command if self._plain else self._finished(command, members)

    def braking(self, q: ArrayLike, v: ArrayLike) -> np.ndarray:
        """Compute the torque that brakes every joint in a state, as a tick with a fault does.

        Nothing else changes: what the tasks remember is from the last tick.

        Args:
            q: Configuration, (nq,).
            v: Velocity, (n,), rad/s.

        Returns:
            (n,) bias with joint damping, N·m, inside the motors' limits and without what the robot adds.

        Raises:
            InputError: The state has a wrong size or is not finite.
        """
        self.robot.update(numbers(q, "q"), numbers(v, "v"))
        return self._braking() - self._added_by_robot()

    @property
    def _holds(self) -> bool:
        return self._timing is not None and self._timing.policy == "hold"

    def _hold(
        self,
        t: float,
        status: Status,
        inertia: np.ndarray | None = None,
        bias: np.ndarray | None = None,
    ) -> Command:
        """Brake in a tick that cannot be trusted, with the robot's own inertia and bias or these."""
        if self._observer is not None:
            self._observer.forget_last()
        tau = self._braking(inertia, bias) - self._added_by_robot()
        return Command(t, tau, status, 0, Found({}, (), {}))

    def _braking(
        self, inertia: np.ndarray | None = None, bias: np.ndarray | None = None
    ) -> np.ndarray:
        """Bias with joint damping, inside the motors' limits; finite whatever the model says.

        On a floating base it is the last torque with joint damping: the bias alone carries nothing.
        """
        robot = self.robot
        inertia = robot.M if inertia is None else inertia
        held = self._last_torque
        if held is None:
            held = robot.bias if bias is None else bias
        tau = held - self.damping * inertia.diagonal() * robot.v
        limit, middle = motor_range(robot)
        limit = np.minimum(limit, np.finfo(float).max)
        limit[: self._base] = 0.0
        return np.clip(np.nan_to_num(tau, nan=0.0) - middle, -limit, limit) + middle


def _singularity_of_base(
    robot: Robot,
    bias: str,
    gravity: str,
    singularity: Singularity | None,
) -> Singularity | None:
    """Refuse what does not go with a floating base, and tell what stands for the default buffer."""
    if bias != "joint" or gravity != "controller":
        raise InputError(
            f"robot {robot.name!r} has a floating base: nothing holds its weight but contacts, "
            "so it takes bias='joint' and gravity='controller'"
        )
    return None if singularity is DEFAULT_SINGULARITY else singularity


def _bind_collisions(collisions: CollisionAvoidance | None, robot: Robot) -> None:
    if collisions is None:
        return
    if not isinstance(collisions, CollisionAvoidance):
        raise InputError(f"collisions takes a CollisionAvoidance, not {type(collisions).__name__}")
    collisions.bind(robot)


def _observer(limits: JointLimits | None, n: int, torque_limits: str) -> DisturbanceObserver | None:
    if limits is None or limits.observer_time is None or not limits.law.bound:
        return None
    if torque_limits != "priority":
        raise InputError(
            "joint limits with an observer_time need torque_limits='priority': "
            "what the motors clip would be taken for a disturbance"
        )
    return DisturbanceObserver(n, limits.observer_time)

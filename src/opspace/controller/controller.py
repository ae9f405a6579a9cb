"""The controller: the tick of the readable form, compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import isfinite
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, Status
from opspace.controller.batch import (
    Batch,
    axes_of,
    check_contacts,
    check_count,
    check_members,
    checked_states,
    cores,
    refresh_apart,
)
from opspace.controller.disturbance import DisturbanceObserver
from opspace.controller.reference import ReferenceController
from opspace.controller.stages import sum_of_hard_torques
from opspace.controller.watchdog import Watchdog
from opspace.controller.wrenches import Wrenches
from opspace.errors import InputError
from opspace.kernels.columns import (
    BASE,
    DAMPING,
    KEEP_TORQUE,
    OPTION_SIZE,
    PERIOD,
    REACH,
    RELEASE_UPPER,
    REST_LOWER,
    REST_RELEASE,
    REST_UPPER,
    ROOM,
    SIGMA_DAMPING,
    SIGMA_LOWER,
    SIGMA_PROFILE,
    SIGMA_UPPER,
    SINGULAR,
    SOLVE,
    STATE_NOT_FINITE,
    TASK_BIAS,
)
from opspace.law import PROFILES
from opspace.machine.answer_call import layout_is_known
from opspace.machine.record import Handle
from opspace.plan.entries import KERNELS
from opspace.plan.pack_contacts import ContactTick, PackedContacts, fits
from opspace.plan.pack_integrals import PackedIntegrals
from opspace.plan.plan import Heritage, Plan, structure
from opspace.plan.quiet_call import QuietCall
from opspace.plan.quiet_records import QUIET
from opspace.plan.read_report import CompiledReport
from opspace.robots.adapter import AdapterBase
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.motor_range import motor_range
from opspace.robots.rigid_model import RigidModel
from opspace.stack import Blending, Member, Outlook, variables_of
from opspace.stack.transitions import Transitions
from opspace.tasks.obstacles import Placing
from opspace.tasks.task import CHANGES
from opspace.tasks.validation import finite, numbers


class _Statuses(dict[int, Status]):
    """Flags by their number; making one costs more than a tick, making all of them a second."""

    def __missing__(self, bits: int) -> Status:
        found = self[bits] = Status(bits)
        return found


STATUSES = _Statuses()
NEW = tuple.__new__
KEPT = 32
"""Plans that are kept for stacks to come again."""
ROOM_FOR = 6
"""Contacts that there is room for from the start; more make room once."""
TIME_JUMP, FAULT = int(Status.TIME_JUMP), int(Status.FAULT)
CONTACT_WAITS = int(Status.CONTACT_WAITS)

_Fixed: TypeAlias = tuple[
    AdapterBase,
    Callable[[ArrayLike, ArrayLike], None],
    Callable[[], None] | None,
    Watchdog | None,
    Callable[[float], tuple[Member, ...]],
    bool,
    DisturbanceObserver | None,
    Callable[[float, int], int],
]
_LaidOut: TypeAlias = tuple[
    tuple[Member, ...],
    Plan,
    int,
    Callable[[], np.ndarray],
    Callable[[], bytes],
    QuietCall | None,
]
_Quiet: TypeAlias = tuple[Callable[..., Any], int, object, Transitions, tuple[Member, ...], bool]


class Controller(ReferenceController):
    """Operational space control of a stack of tasks on a robot.

    Every tick is one call of compiled code, which computes what `ReferenceController` computes; the
    arguments, errors and results are the same. A wheel brings it compiled; elsewhere the first
    controller compiles it, which takes about half a minute, and later ones read it from the disk.

    Options are fixed when it is built. Stacks of more than some thirty tasks, and contacts of one's own
    class, take the readable form.
    """

    _axes: MotionAxes | None = None
    _plan: Plan | None = None
    _bodies: RigidModel | None = None
    _batch: Batch | None = None
    _standing: PackedContacts | None = None  # what a robot with a floating base touches
    # What every tick needs, in one piece: reading an attribute takes as long as a line of local names.
    _fixed: _Fixed | None = None
    _laid_out: _LaidOut | None = None
    _quiet: _Quiet | None  # earned by every tick that leaves nothing to look at
    _told: Handle | None = None  # what decides that, as kernels see it; None where no tick is quiet
    _readable = False  # whether the tick before was the readable form's
    # What is laid out before it is needed, replaced as a whole and never changed: plans by structure,
    # and by the tasks (their identity, for which they are kept) how to take one up.
    _ready: Mapping[tuple[object, ...], Plan] = MappingProxyType({})
    _ahead: Mapping[int, tuple[Heritage, _LaidOut]] = MappingProxyType({})

    def step(
        self, t: float, q: ArrayLike, v: ArrayLike, *, wrenches: Wrenches | None = None
    ) -> Command:
        """Compute the torque for one state; see `ReferenceController.step`."""
        quiet = self._quiet
        if quiet is not None and wrenches is None:
            tick, address, seen, transitions, members, plain = quiet
            if CHANGES.last is seen and transitions.ticked is members:
                command = tick(t, q, v, address)
                if command is not None:
                    return command if plain else self._finished(command, members)
        return self._look(t, q, v, wrenches)

    def _look(  # noqa: PLR0912, PLR0915 - one piece is fast
        self, t: float, q: ArrayLike, v: ArrayLike, wrenches: Wrenches | None
    ) -> Command:
        """Tick with a look at everything that may have happened since the last one."""
        self._quiet = None
        fixed = self._fixed
        if fixed is None:
            self.warm_up()
            fixed = self._fixed
            if fixed is None:
                return super().step(t, q, v, wrenches=wrenches)
        robot, place, catch_up, watch, begin_tick, stands, observer, tick = fixed
        if type(t) is not float or not isfinite(t):
            t = finite(t, "time")
        if self._loading is not None:
            self._load(t)
        try:
            place(q, v)
        except (TypeError, ValueError):
            q, v = numbers(q, "q"), numbers(v, "v")
            robot.check_state(q, v)
            place(q, v)
        if catch_up is not None:
            catch_up()
        timing = 0  # a number: the operators of flags cost as much as all of Python here
        if watch is not None:
            q, v = robot.q, robot.v
            if not isfinite(sum(q.tolist()) + sum(v.tolist())):  # which never warns
                robot.check_state(q, v)
            timing = watch.check(t, q, v)
            if timing & TIME_JUMP and self._holds:
                self._begin_anew()
                return self._hold(t, STATUSES[timing])
        members = begin_tick(t)
        forces = self._forces
        if forces is not None:
            timing |= forces.take(t, wrenches, members)
        elif wrenches is not None:
            timing |= self._sensed(t, wrenches, members)
        footing = ()
        if stands:
            timing |= self._touch(t)
        laid_out = self._laid_out
        if laid_out is None or members is not laid_out[0]:
            laid_out = self._lay_out(members)
            if laid_out is None:
                robot.update(robot.q, robot.v)
                self._leave(members)
                return self._answer(t, members, STATUSES[timing])
            if forces is not None:
                forces.moved = True
        _, plan, address, torque, memory, quiet = laid_out
        if forces is not None and forces.moved:
            plan.remember()
            forces.moved = False
        if plan.moving or CHANGES.last is not plan.seen:
            if plan.distances is not None and not self._watches_all(plan):
                laid_out = self._lay_out_anew(members)
                _, plan, address, torque, memory, quiet = laid_out
            plan.refresh(robot, t)
        answer = tick(t, address) if observer is None else self._learn(t, observer)
        if plan.asks:
            plan.note_ways()
        if answer < 0:
            if answer == STATE_NOT_FINITE:
                robot.check_state(robot.q, robot.v)
            inertia, bias = plan.tick.M, plan.tick.bias  # what C brakes with, too
            return self._hold(t, STATUSES[timing | FAULT], inertia, bias)
        tau = torque()
        if stands:
            footing = self._stood(tau)
        if quiet is not None and not plan.moving and forces is None and self._loading is None:
            transitions, plain = self.stack.transitions, self._plain
            self._quiet = quiet.tick, quiet.address, plan.seen, transitions, members, plain
        status = STATUSES[answer % SOLVE | timing]
        if timing and forces is not None:  # the tick knows what happened in it
            forces.after(status)
        # Bytes are copied in half the time of an array; the tuple's own constructor takes twice this.
        command = NEW(
            Command,
            (t, tau, status, answer // SOLVE, NEW(CompiledReport, (plan, memory(), footing))),
        )
        return command if self._plain else self._finished(command, members)

    @property
    def placings(self) -> Mapping[str, Placing]:
        """Where the last tick found the obstacles of `collisions`, and how they moved, by name."""
        plan = self._plan
        if plan is None or plan.distances is None:
            return super().placings
        return plan.distances.layout.by_name(plan.distances.placings)

    @property
    def _compiled_integrals(self) -> PackedIntegrals | None:
        return None if self._laid_out is None else self._laid_out[1].integrals

    @property
    def _inertia(self) -> np.ndarray:
        return super()._inertia if self._laid_out is None else self._laid_out[1].tick.M

    def _added_by_robot(self) -> np.ndarray:
        if not self._robot_adds or self._bodies is None or self._laid_out is None:
            return super()._added_by_robot()
        _, plan, address, *_ = self._laid_out
        KERNELS["gravity"](address)
        return np.nan_to_num(plan.tick.gravity, nan=0.0, posinf=0.0, neginf=0.0)

    def _begin_anew(self) -> None:
        super()._begin_anew()
        if self._plan is not None:
            self._plan.forget()

    def _learn(self, t: float, observer: DisturbanceObserver) -> int:
        """Tick with joint limits that learn what the model does not explain."""
        assert self._fixed is not None
        assert self._plan is not None
        plan, v = self._plan, self.robot.v
        observer.observe(t, v)
        plan.disturb(observer.acceleration)
        answer = self._fixed[-1](t, plan.handle.address)
        if answer >= 0:
            observer.remember(t, v, plan.tick.joint_acceleration)
        return answer

    def torque_batch(
        self,
        Q: ArrayLike,
        V: ArrayLike,
        t: float | None = None,
        *,
        threads: int | None = None,
    ) -> np.ndarray:
        """Compute the torque of the present stack at many states at once.

        Row k is what `step` would answer as the next tick, at time ``t``, in the state
        (Q[k], V[k]), if no request began or ended with it: activations, targets and gains are
        those of the moment. The call changes nothing: neither the controller nor its robot nor
        its tasks. It computes the dynamics itself and uses every core.

        Activations of the user's own (`Task.activation`) are called in Python, once per state;
        references in time once per call. Contacts of a floating base have come as far as at the last
        tick. Call it from the thread that ticks.

        Args:
            Q: (states, nq) configurations.
            V: (states, n) velocities, rad/s.
            t: Time, s; None is the time of the last tick, 0 before the first.
            threads: Number of threads; None is one for each core that the process may use.

        Returns:
            (states, n) torques, N·m, bias included as far as `step` includes it; always finite. In a
            state where the model gives nothing usable it is the braking torque that `step` gives with
            ``Status.FAULT`` where no tick was before.

        Raises:
            InputError: A wrong shape or a number that is not finite, with its row; a task or contact
                that is evaluated in Python, or a task that holds, or begins its way with, what it will
                find at its first tick; a robot of the user's own.
        """
        if t is None:
            t = self.stack.time or 0.0
        if not isfinite(t):
            raise InputError(f"time must be finite, got {t}")
        if threads is not None and threads < 1:
            raise InputError(f"a batch needs at least one thread, got {threads}")
        members = self.stack.members
        check_members(members)
        batch = self._batch
        threads = threads or cores()
        touching = self.stack.touching
        check_contacts(touching)
        same = batch is not None and batch.members is members and batch.threads == threads
        if (
            batch is None
            or not (same and self._sees_all(batch.plan))
            or not batch.touch(touching, t)
        ):
            batch = self._batch = self._batched(members, threads)
            batch.touch(touching, t)
        if self._observer is not None:
            batch.disturb(self._observer.acceleration)
        states = checked_states(batch.robot, Q, V)
        tau = batch.torque(*states, float(t), self._plan)
        return tau - batch.gravity(*states) if self._robot_adds else tau

    def warm_up(self) -> float:
        """Compile the tick, or read what was compiled before; the first tick does it otherwise.

        What is compiled depends neither on the robot nor on the stack, so nothing is compiled later,
        whatever transitions come.

        Returns:
            How long it took, s.
        """
        if self._axes is None:
            self._axes = self._compiled_robot()
        robot = self.robot
        if self._axes is None or not isinstance(robot, AdapterBase):
            return 0.0
        seconds = KERNELS.load()
        if self._base and self._standing is None:
            self._standing = self._contacts_of(self._axes, len(self.stack.contacts))
        self._fixed = (
            robot,
            robot.place_turned if self._base else robot.place,
            robot.catch_up if self._bodies is None else None,
            self._timing,
            self.stack.begin_tick,
            self._base > 0,
            self._observer,
            KERNELS["tick"],
        )
        if layout_is_known() and not (self._base or self._bodies is None or self._observer):
            self._told = self._tell(robot)
        self.stack.foresee(self._lay_out_ahead)
        return seconds

    def _tell(self, robot: AdapterBase) -> Handle:
        """Let kernels see what else a tick must look at."""
        watch, nothing = self._timing, np.zeros(0)
        arrays = {"times": self.stack.transitions.times, "behind": robot.behind}
        if watch is None:
            arrays |= dict.fromkeys(("watch", "last_q", "last_v"), nothing)
        else:
            arrays |= {"watch": watch.watch, "last_q": watch.last_q, "last_v": watch.last_v}
        return QUIET.make({}, arrays).handle()

    def _compiled_robot(self) -> MotionAxes | None:
        """Give the robot's arrays: computed by compiled code where it can, else by its library."""
        robot = self.robot
        if self._not_compiled():
            return None
        if not isinstance(robot, AdapterBase):
            return None
        model = self._bodies = robot.rigid_model()
        if model is None:
            axes = robot.motion_axes()
            apart = self._collisions is not None
            return None if apart and axes is not None and axes.followers else axes
        return model.motion_axes(*robot.state)

    def _not_compiled(self) -> str:
        """Name what somebody wrote that compiled code cannot call, empty where there is nothing."""
        limits = self.stack.limits
        if limits is not None and limits.overridden:
            return f"the law of {type(limits).__name__}"
        if self._rules.law is not sum_of_hard_torques:
            return "a law of one's own"
        blending = type(self._blending)
        return "" if blending is Blending else f"the blending {blending.__name__}"

    def plan_apart(self, members: tuple[Member, ...]) -> Plan:
        """Lay tasks out for whoever computes many robots, apart from what the ticks here use.

        Gains and targets are those of the moment; a task that holds what it finds is laid out with
        what it would find now, and begins nothing.

        Args:
            members: The tasks, prepared by the stack.

        Returns:
            A plan with dynamics of its own.

        Raises:
            InputError: The robot is one of the user's own, something is Python, or there are too many
                tasks.
        """
        robot, model = self._bodies_for("a fleet")
        check_count(members, "a fleet")
        plan = self._planned_apart(members, axes_of(model, robot.nq))
        refresh_apart([plan], robot, 0.0)
        return plan

    def _bodies_for(self, who: str) -> tuple[AdapterBase, RigidModel]:
        """Return the robot and its bodies, for somebody who computes them.

        Raises:
            InputError: There is something that nobody else can compute.
        """
        robot = self.robot
        if own := self._not_compiled():
            raise InputError(f"{who} cannot call {own}; step() can")
        if self._bodies is None and isinstance(robot, AdapterBase):
            self._bodies = robot.rigid_model()
        if self._bodies is None or not isinstance(robot, AdapterBase):
            raise InputError(
                f"robot {robot.name!r} is not one of load_robot with hinges and slides that each move "
                f"alone; {who} needs its bodies"
            )
        return robot, self._bodies

    def _batched(self, members: tuple[Member, ...], threads: int) -> Batch:
        robot, model = self._bodies_for("a batch")
        return Batch(robot, model, members, self._planned_apart, threads)

    def _lay_out_ahead(self, to_come: Iterator[Outlook]) -> None:
        """Make the plans that will be needed, so that a tick has only to take one up."""
        axes, known, now = self._axes, self._ready, self._plan
        assert axes is not None
        ready: dict[tuple[object, ...], Plan] = {} if now is None else {now.structure: now}
        ahead: dict[int, tuple[Heritage, _LaidOut]] = {}
        before: Plan | None = None
        last: Outlook | None = None
        for outlook in to_come:
            if last is not None and outlook.members is last.members:
                continue
            copies, plan = outlook.copies, None
            if Plan.fits(copies, axes):
                key = structure(copies)
                plan = ready.get(key) or known.get(key)
                if plan is None or not self._watches_all(plan):
                    plan = self._planned(copies, axes)
                ready[key] = plan
                if before is not None and last is not None:
                    ramps = tuple(variable.ramp for variable in variables_of(copies))
                    heritage = plan.heritage(before, last.variables, outlook.variables, ramps)
                    ahead[id(outlook.members)] = heritage, self._collected(outlook.members, plan)
            before, last = plan, outlook
        for key, plan in known.items():
            if len(ready) < KEPT:
                ready.setdefault(key, plan)
        self._ready, self._ahead = ready, ahead

    def _lay_out(self, members: tuple[Member, ...]) -> _LaidOut | None:
        """Take up the plan for these tasks, or None where compiled code cannot tick with them."""
        if self._base and not fits(self.stack.touching):
            return None
        found = self._ahead.get(id(members))
        if found is None or not found[0].holds(self._plan) or not self._watches_all(found[1][1]):
            found = self._laid_out_now(members)
            if found is None:
                return None
        heritage, laid_out = found
        plan = laid_out[1]
        plan.go_on(heritage, members)
        if self._readable:
            plan.come_back(self._blending, self._rules.unrest)
            self._readable = False
        self._plan, self._laid_out = plan, laid_out
        return laid_out

    def _laid_out_now(self, members: tuple[Member, ...]) -> tuple[Heritage, _LaidOut] | None:
        """Lay out what was not foreseen, or what something else has come before."""
        assert self._axes is not None
        before, key = self._plan, structure(members)
        plan = before if before is not None and before.structure == key else self._ready.get(key)
        if plan is None or not self._watches_all(plan):
            if not Plan.fits(members, self._axes):
                return None
            plan = self._planned(members, self._axes)
        variables = variables_of(members)
        known = () if before is None else before.variables
        heritage = plan.heritage(before, known, variables, tuple(v.ramp for v in variables))
        return heritage, self._collected(members, plan)

    def _collected(self, members: tuple[Member, ...], plan: Plan) -> _LaidOut:
        """Collect what every tick of these tasks needs."""
        quiet = None if self._told is None else QuietCall(plan, self._told, STATUSES)
        tick = plan.tick
        return members, plan, plan.handle.address, tick.tau.copy, plan.memory.tobytes, quiet

    def _leave(self, members: tuple[Member, ...]) -> None:
        """Let the readable form go on from the compiled one."""
        if self._plan is not None:
            self._plan.leave(members, self._blending, self._rules.unrest)
        self._plan, self._laid_out, self._readable = None, None, True

    def _touch(self, t: float) -> int:
        """Move contacts on to time ``t`` [s] and pack them; tell whether one waits.

        Contacts that compiled code cannot evaluate, and more than there is room for, take the plan.
        """
        members, standing = self.stack.begin_contacts(t), self._standing
        assert standing is not None
        assert self._axes is not None
        if not fits(members):
            self._laid_out = None
            return 0
        if len(members) > standing.most or self._distances > standing.distances:
            standing = self._standing = self._contacts_of(self._axes, len(members))
            self._laid_out = None
        waits = standing.begin(members, self.robot, t)
        return CONTACT_WAITS if waits else 0

    def _stood(self, tau: np.ndarray) -> tuple[ContactTick, ...]:
        """Learn what a tick gave up, and tell which contacts it had."""
        standing = self._standing
        assert standing is not None
        self._last_torque = tau
        self.stack.hinder(standing.hindrance)
        return standing.footing

    def _contacts_of(self, axes: MotionAxes, known: int) -> PackedContacts:
        asked = self.torque_limits == "priority"
        room = np.array(self.robot.torque_limit) if asked else np.full(axes.v.size, np.inf)
        room[: self._base] = np.inf
        return PackedContacts(axes, max(known, ROOM_FOR), room, self._distances)

    @property
    def _distances(self) -> int:
        """How many distances there are to keep now."""
        return 0 if self._collisions is None else len(self._collisions.layout().rows)

    def _planned(self, members: tuple[Member, ...], axes: MotionAxes) -> Plan:
        return self._plan_of(members, axes, self._standing, leads=True)

    def _planned_apart(
        self, members: tuple[Member, ...], axes: MotionAxes, *, leads: bool = False
    ) -> Plan:
        """Make a plan with contacts of its own, as every thread of a batch needs one."""
        own = self._contacts_of(axes, len(self.stack.contacts)) if self._base else None
        return self._plan_of(members, axes, own, leads=leads)

    def _plan_of(
        self,
        members: tuple[Member, ...],
        axes: MotionAxes,
        contacts: PackedContacts | None,
        *,
        leads: bool,
    ) -> Plan:
        return Plan(
            members,
            axes,
            self._scales,
            self.stack.limits,
            motor_range(self.robot),
            self._options(),
            self._blending,
            self._collisions,
            contacts,
            leads=leads,
        )

    def _watches_all(self, plan: Plan) -> bool:
        """Tell whether a plan knows of all obstacles that there are now, and has room for contacts."""
        return plan.contacts is self._standing and self._sees_all(plan)

    def _sees_all(self, plan: Plan) -> bool:
        """Tell whether a plan knows of all obstacles that there are now."""
        if self._collisions is None or plan.distances is None:
            return True
        return plan.distances.layout is self._collisions.layout()

    def _lay_out_anew(self, members: tuple[Member, ...]) -> _LaidOut:
        """Go on with the same tasks and other obstacles."""
        laid_out = self._lay_out(members)
        assert laid_out is not None
        laid_out[1].remember()
        return laid_out

    def _options(self) -> np.ndarray:
        option = np.zeros(OPTION_SIZE)
        buffer = self._scales.buffer
        if buffer is not None:
            option[SINGULAR] = 1.0
            option[SIGMA_LOWER], option[SIGMA_UPPER] = buffer.lower, buffer.upper
            option[SIGMA_PROFILE] = PROFILES.index(buffer.profile)
            option[RELEASE_UPPER], option[SIGMA_DAMPING] = buffer.release_upper, buffer.damping
            option[REST_LOWER], option[REST_RELEASE], option[REST_UPPER] = buffer.at_rest
        option[DAMPING] = self.damping
        option[TASK_BIAS] = float(self.bias == "task")
        option[ROOM], option[REACH] = self._blending.room, self._blending.reach
        option[PERIOD] = self._rules.period
        # On the ground the motors' limits act behind the law, together with those of the forces.
        option[KEEP_TORQUE] = float(self.torque_limits == "priority" and not self._base)
        option[BASE] = float(self._base)
        return option

"""Many robots of one kind, each with its own state, targets, gains and transitions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from opspace.controller import Controller
from opspace.errors import InputError
from opspace.fleet.check_fleet import check_dynamics, check_robot, check_task
from opspace.fleet.force_arrays import ForceArrays
from opspace.fleet.precision import dtype_name
from opspace.fleet.program import FleetProgram
from opspace.fleet.roster import Roster
from opspace.fleet.task_arrays import TaskArrays
from opspace.fleet.told_arrays import ToldArrays, write_rows
from opspace.fleet.warp_library import as_warp, device_of, robots_of, warp
from opspace.plan.plan import Plan
from opspace.plan.scales import DEFAULT_SINGULARITY, Singularity
from opspace.robots.protocol import Robot
from opspace.stack import Blending, Stack
from opspace.stack.changes import Timing, checked_level, checked_task
from opspace.tasks import ForceTask, Task
from opspace.tasks.validation import finite

BLOCK = 32
"""Threads of a block: with more, a few thousand robots would leave most of a graphics card idle."""


class Fleet:
    r"""Operational space control of many robots of one kind at once, in Warp.

    Every step is one launch of one kernel, which computes for each robot what `Controller` computes:
    the dynamics, the tasks, Σ_T w_T H(T; f̃) with its singular directions, joint limits and torque
    limits. The kernel is made from the sources of the compiled tick, for the sizes of this robot and
    this stack, and compiled at the first step, which takes some ten seconds, or read from Warp's
    cache.

    The stack says which tasks there are and where they begin. From then on each robot has a stack of
    its own: `insert`, `remove`, `move` and `swap` are for all robots or for some, and
    ``fleet["hand"]`` has the targets, gains and activations of the task ``"hand"``, one row per robot.

    Args:
        robot: The robot, of ``load_robot``, bolted down.
        stack: The tasks and joint limits.
        count: Number of robots.
        device: A device of Warp, ``"cpu"``, ``"cuda:0"``; None is Warp's own choice.
        dtype: ``"float64"`` or ``"float32"``, or the type of NumPy, Warp or torch.
        blending: See `Controller`.
        bias: See `Controller`.
        singularity: See `Controller`.
        damping: See `Controller`.
        torque_limits: See `Controller`.
        period: Time between two steps, s, if joint limits shall count how accelerations change
            between two steps; no step is checked for being late.
        dynamics: ``"own"``: the kernel computes them from the robot's file. ``"given"``: every step
            takes them from arrays, which a simulator writes: ``M`` and ``bias`` of the fleet, and
            ``pose``, ``jacobian`` and ``drift`` of each task of motion.

    Attributes:
        robot: The robot.
        count: Number of robots.
        device: The device of Warp.
        dtype: Name of the type of the numbers.
        tau: (count, n) torque of the last step that was given none to write to, N·m.
        status: (count,) what happened in it, in the numbers of `Status`.
        hard_solves: (count,) hard torques that were computed.
        given: Whether dynamics are given.
        M: (count, n, n) inertia if dynamics are given, kg·m²; zero, a fault, until it is written.
        bias: (count, n) torque that holds the joints at zero acceleration then, N·m.
        limits: (count, sides) how much each joint limit acts, in the order of ``limit_names``.

    Raises:
        InputError: The robot, a task or an option that a fleet cannot compute, by its name.
        MissingExtraError: Warp is not installed.
    """

    def __init__(
        self,
        robot: Robot,
        stack: Stack,
        count: int,
        *,
        device: object = None,
        dtype: object = "float64",
        blending: str | Blending = "auto",
        bias: str = "joint",
        singularity: Singularity | None = DEFAULT_SINGULARITY,
        damping: float = 10.0,
        torque_limits: str = "report",
        period: float | None = None,
        dynamics: str = "own",
    ) -> None:
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InputError(f"a fleet has at least one robot, got {count!r}")
        wp = warp()
        self.count = count
        self.device = device_of(device)
        self.dtype = dtype_name(dtype)
        self._real = getattr(wp, self.dtype)
        self._controller = Controller(
            robot,
            stack,
            blending=blending,
            bias=bias,
            singularity=singularity,
            damping=damping,
            torque_limits=torque_limits,
            period=period,
        )
        check_robot(self._controller)
        self.given = check_dynamics(dynamics, period)
        self.robot = robot
        self._roster = Roster(count)
        self._arrays: dict[str, ToldArrays] = {}
        for level, tasks in stack.levels_by_number.items():
            for task in tasks:
                self._roster.start_with(check_task(task, given=self.given), level)
        n, sides = robot.nv, stack.limits.sides if stack.limits else ()
        self.limit_names = tuple(side.name for side in sides)
        self.tau = self._zeros((count, n))
        self.limits = self._zeros((count, len(sides)))
        if self.given:
            self.M, self.bias = self._zeros((count, n, n)), self._zeros((count, n))
        self.status = wp.zeros(count, dtype=wp.int32, device=self.device)
        self.hard_solves = wp.zeros(count, dtype=wp.int32, device=self.device)
        self._ended = wp.full(count, np.nan, dtype=wp.float64, device=self.device)
        self._time = wp.zeros(1, dtype=wp.float64, device=self.device)
        self._plan: Plan | None = None
        self._lay_out()

    def __repr__(self) -> str:
        names = ", ".join(self._arrays)
        where = f"on {self.device}, {self.dtype}"
        return f"Fleet of {self.count} {self.robot.name!r} {where}; tasks: {names}"

    def __getitem__(self, name: str) -> Any:
        """Return what a task of this name is told and tells: `TaskArrays` or `ForceArrays`.

        Raises:
            UnknownNameError: There is none.
            InputError: It has been asked for since the last step, and comes with the next one.
        """
        found = self._roster.find(str(name)).name
        if found not in self._arrays:
            raise InputError(f"task {found!r} has its arrays from the next step on")
        return self._arrays[found]

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the tasks, also those that no robot has in its stack at the moment."""
        return iter(self._arrays.values())

    def __len__(self) -> int:
        """Count the robots."""
        return self.count

    # --- Steps -----------------------------------------------------------------------------------

    def step(self, t: Any, q: Any, v: Any, tau: Any = None) -> Any:
        """Compute the torque of every robot.

        Nothing is copied and nothing allocated, unless a request has been made since the last step;
        without one, and with ``t`` on the device, the step can be captured in a graph.

        Args:
            t: Time, s: a number, or an array of Warp of float64 on the device, one for all robots or
                one each.
            q: (count, nq) configurations, rad, m: an array of Warp, a tensor of torch, or on a
                processor an array of NumPy.
            v: (count, n) velocities, rad/s.
            tau: (count, n) where to write the torques, N·m; None is ``self.tau``.

        Returns:
            ``tau``, or ``self.tau``; always finite. A robot whose state or target is not finite, or
            one of whose gains is negative, gets
            the braking torque that `Controller.step` gives with ``Status.FAULT``.

        Raises:
            InputError: An array of another shape, type or device.
        """
        wp = warp()
        times = self._times(t)
        if self._roster.asked:
            self._happen(t)
        real, device = self._real, self.device
        robot = self.robot
        q_ = as_warp(q, "q", (self.count, robot.nq), real, device)
        v_ = as_warp(v, "v", (self.count, robot.nv), real, device)
        into = self.tau if tau is None else tau
        tau_ = as_warp(into, "tau", (self.count, robot.nv), real, device)
        program = self._program
        inputs = [
            times, q_, v_, tau_, program.fixed, program.whole, self._ramps, self._groups,
            self.status, self.hard_solves, self.limits,
        ]  # fmt: skip
        wp.launch(program.kernel, dim=self.count, inputs=inputs, device=device, block_dim=BLOCK)
        return into

    def _times(self, t: Any) -> Any:
        wp = warp()
        if isinstance(t, wp.array):
            shape = (1,) if t.shape == (1,) else (self.count,)
            return as_warp(t, "t", shape, wp.float64, self.device)
        self._time.fill_(finite(t, "time"))
        return self._time

    def _happen(self, t: Any) -> None:
        """Let the requests begin that have been made since the last step."""
        now = float(np.max(t.numpy())) if hasattr(t, "numpy") else float(t)
        if self._roster.happen(now) or self._plan is None:
            self._lay_out()
        else:
            self._ramps.assign(self._roster.ramps(self._plan.variables))
        for arrays in self._arrays.values():
            arrays.begin_again(self._roster.members[arrays.name].epoch)

    # --- Requests --------------------------------------------------------------------------------

    def insert(
        self,
        task: Task | str,
        level: float,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        robots: Any = None,
    ) -> None:
        """Insert a task into the stacks of some robots, from the next step on; see `Stack.insert`.

        A task or a level that the fleet has not had makes another kernel, which is compiled at the
        next step unless Warp has it already. To have it beforehand, ask for no robots,
        ``robots=[]``; so do `move` and `swap`.

        Args:
            task: The task, or the name of one that the fleet has.
            level: Number of its level; lower is more important.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            robots: None for all, a mask (count,), or their numbers.

        Raises:
            InputError: A task that a fleet cannot evaluate, a name that another task has, some of
                the robots have it at another level, or a number that cannot be used.
            UnknownNameError: A frame or joint that the robot does not have, or an unknown profile.
        """
        timing, mask = Timing(duration, profile), robots_of(robots, self.count)
        number, roster = checked_level(level), self._roster
        if not isinstance(task, str) and checked_task(task).name not in roster.members:
            self._controller.stack.prepare(check_task(task, given=self.given))
            roster.take_in(task, number)
        roster.insert(task, number, mask, timing)

    def remove(
        self,
        task: Task | str,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        robots: Any = None,
    ) -> None:
        """Remove a task from the stacks of some robots, from the next step on; see `Stack.remove`.

        Its arrays stay, and it can come back at any time without a kernel of another kind.

        Args:
            task: The task or its name.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            robots: None for all, a mask (count,), or their numbers.

        Raises:
            InputError: A number that cannot be used.
            UnknownNameError: No such task, or an unknown profile.
        """
        self._roster.remove(task, robots_of(robots, self.count), Timing(duration, profile))

    def move(
        self,
        task: Task | str,
        level: float,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        robots: Any = None,
    ) -> None:
        """Move a task to another level at some robots, from the next step on; see `Stack.move`.

        Args:
            task: The task or its name.
            level: Number of its level; one that the task has not had makes another kernel.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            robots: None for all, a mask (count,), or their numbers.

        Raises:
            InputError: Some of the robots do not have it, or a number that cannot be used.
            UnknownNameError: No such task, or an unknown profile.
        """
        timing, mask = Timing(duration, profile), robots_of(robots, self.count)
        self._roster.move(task, checked_level(level), mask, timing)

    def swap(
        self,
        first: Task | str,
        second: Task | str,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        robots: Any = None,
    ) -> None:
        """Exchange the levels of two tasks at some robots, from the next step on; see `Stack.swap`.

        Args:
            first: One task or its name.
            second: The other.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            robots: None for all, a mask (count,), or their numbers.

        Raises:
            InputError: The same task twice, some of the robots do not have both, or a number that
                cannot be used.
            UnknownNameError: No such task, or an unknown profile.
        """
        timing, mask = Timing(duration, profile), robots_of(robots, self.count)
        self._roster.swap(first, second, mask, timing)

    def reset(self, robots: Any = None) -> None:
        """Let some robots begin anew at the next step, as at the first one.

        Their stacks are those of the start again, without a transition; tasks without a target hold
        what they find, and angles take the short way. Targets, gains and activations that have been
        written stay.

        Args:
            robots: None for all, a mask (count,), or their numbers.
        """
        mask = robots_of(robots, self.count)
        self._roster.reset(mask)
        write_rows(self._ended, np.nan, mask)  # no time has passed since a tick before

    # --- Layout ----------------------------------------------------------------------------------

    def program_for(self, kind: str) -> FleetProgram:
        """Make the program of the tasks and levels of the last step for another kind of device.

        Args:
            kind: ``"cpu"`` or ``"cuda"``.
        """
        assert self._plan is not None
        given = (self.M, self.bias) if self.given else None
        arrays = list(self._arrays.values())
        return FleetProgram(
            self._plan, arrays, self.dtype, self.device, kind, ended=self._ended, given=given
        )

    def _lay_out(self) -> None:
        """Make the plan, the kernel and the arrays for the tasks and levels that there are."""
        roster, before = self._roster, self._plan
        plan = self._controller.plan_apart(roster.present)
        for name, member in roster.members.items():
            if name not in self._arrays:
                kind: Any = ForceArrays if isinstance(member.task, ForceTask) else TaskArrays
                self._arrays[name] = kind(member.task, self.count, self._real, self.device)
        arrays = list(self._arrays.values())
        for one, packed in zip(arrays, plan.packed, strict=True):
            one.begin(plan.tick, packed.index, packed.rows, given=self.given)
        groups = np.zeros((self.count, len(plan.variables)), np.int64)
        if before is not None:
            old = self._groups.numpy()
            for k, variable in enumerate(plan.variables):
                if variable in before.variables:
                    groups[:, k] = old[:, before.variables.index(variable)]
        wp = warp()
        self._groups = wp.array(groups, dtype=wp.int64, device=self.device)
        self._ramps = wp.array(roster.ramps(plan.variables), dtype=wp.float64, device=self.device)
        self._plan = plan
        self._program = self.program_for("cpu" if self.device.is_cpu else "cuda")

    def _zeros(self, shape: tuple[int, ...]) -> Any:
        return warp().zeros(shape, dtype=self._real, device=self.device)

"""The loop of a real robot: it is read, answered, and braked whatever happens."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from opspace.command import Status
from opspace.controller import ReferenceController
from opspace.controller.handover import Handover
from opspace.controller.watchdog import JUMP, MISSED
from opspace.errors import InputError, OpspaceError, RobotStoppedError
from opspace.kernels.cycle_columns import FROZEN, JUMPED, OVER, SILENT
from opspace.kernels.cycle_columns import STOPPED as STOPPED_BY_STATUS
from opspace.loop.declared import HoldCheck, check_declared
from opspace.loop.driver import Driver, RobotState
from opspace.loop.free_cycles import FreeCycles
from opspace.loop.history import Cycles, History, width_of
from opspace.loop.loop import Observer, Stepping, StopRule, answered
from opspace.loop.loop_report import Counts, LoopReport, answer_times
from opspace.loop.real_time import RealTime
from opspace.loop.requests import Changes, RequestDesk, RunRequest
from opspace.loop.torque_rate import TorqueRate
from opspace.robots.motor_range import motor_range
from opspace.tasks import Task
from opspace.tasks.validation import positive

log = logging.getLogger("opspace")

STOPS = Status.FAULT | Status.TIME_JUMP | Status.LIMIT_LOST | Status.COLLISION_LOST
"""Statuses that end a loop; not ``TIME_JUMP`` where the controller was built to hold then."""
NO_RULE = StopRule()
"""Stops for numbers that are not finite only."""
CONNECTING = 5.0
"""How long the first state may take, s."""
FADE = 0.05
"""Time in which the torque of the tasks becomes that of the brakes, s."""
LONGEST_BRAKING = 2.0
"""A robot that does not stand after so long is left to its driver, s."""
STANDING = 0.01
"""Speed below which a joint stands, rad/s or m/s."""
STANDS = 20
"""For so many states in a row."""
TENDING = 5e-3
"""How often what users change is looked for while cycles are compiled, s."""

STOPPED = "stopped"
"""Why a loop ends that is asked to."""


class _NoStateError(OpspaceError):
    """The robot has been silent for longer than the loop waits."""


class Loop:
    """Runs a controller on a robot, in a thread of its own, from standstill to standstill.

    First the robot is commanded to hold still, and one that does not, because its driver declares
    the wrong thing, is refused. Then every cycle reads, checks age and clock, ticks, keeps the
    command within what the robot takes after the last one it accepted, writes, and remembers. A
    robot that is silent keeps its last command for ``patience`` periods; then the loop ends. Every
    end, also by Ctrl-C and by an error, brakes the robot until it stands and stops the driver.

    While it runs, tasks come and go and targets change from any thread, on the stack and the tasks
    themselves; `ask` changes a stiffness smoothly. Use it as a context, or `run` it::

        with osc.Loop(controller, driver) as loop:
            hand.target = [0.4, 0.1, 0.5]
            loop.wait(3.0)

    Args:
        controller: The controller, built for the gravity and the period that the driver declares.
        driver: The robot.
        observers: Told about every tick after its command has been written; they take of the time
            until the next state.
        tasks: Tasks that requests may name and that are inserted later.
        black_box: A `opspace.BlackBox` around the controller, which then steps in its place.
        stop: When to give up, beside ``stop_on``.
        stop_on: Statuses that end it; None for `STOPS`.
        hold_check: How long the robot is watched before it moves, s; 0 does without.
        handover: How long it takes from holding still to the controller's torque, s.
        patience: How many periods without a new state are waited for.
        history: How many cycles are remembered, or a `opspace.SharedHistory`, which other processes see.
        real_time: What to ask of the operating system; None for nothing.
        compiled: Have compiled code go through the cycles, with a robot behind shared memory: no other
            thread of Python, whatever it does, is waited for. Targets and gains change as before. While
            tasks come or go, and to begin and to brake, cycles are Python's.

    Raises:
        InputError: What the driver declares does not go with the controller, or an option cannot be.
    """

    def __init__(
        self,
        controller: ReferenceController,
        driver: Driver,
        *,
        observers: Sequence[Observer] = (),
        tasks: Sequence[Task] = (),
        black_box: Stepping | None = None,
        stop: StopRule = NO_RULE,
        stop_on: Status | None = None,
        hold_check: float = 0.2,
        handover: float = 0.5,
        patience: int = 5,
        history: int | History = 10_000,
        real_time: RealTime | None = None,
        compiled: bool = False,
    ) -> None:
        facts = self._facts = driver.facts
        check_declared(facts, controller)
        if black_box is not None and black_box.robot is not controller.robot:
            raise InputError("the black box is around another controller")
        if patience < 1:
            raise InputError(f"patience is at least 1 period, not {patience}")
        if not 0.0 <= hold_check < np.inf:
            raise InputError(f"hold_check must be finite and >= 0 s, got {hold_check}")
        robot = controller.robot
        self._controller, self._driver = controller, driver
        self._stepping = controller if black_box is None else black_box
        self._observers = tuple(observers)
        self._rule = stop
        if stop_on is None:
            stop_on = STOPS
            if controller.on_time_jump == "hold":
                stop_on &= ~Status.TIME_JUMP
        self._stop_on = stop_on
        self._hold = HoldCheck(robot, facts, hold_check)
        self._handover = positive(handover, "the duration of the handover")
        self._patience = patience * facts.period
        self._rate = TorqueRate(facts.torque_rate, facts.period, robot.nv)
        self._real_time = real_time
        if isinstance(history, int):
            history = History(history, robot.nq, robot.nv)
        if history.rows.shape[1] != width_of(robot.nq, robot.nv) or history.seen:
            raise InputError("the history is that of another robot, or of a loop before this one")
        self._history = history
        self._desk = RequestDesk(Changes(controller, tasks), answer=_answered)
        self._free: FreeCycles | None = None
        if compiled:
            if observers or black_box is not None or stop != NO_RULE:
                raise InputError(
                    "compiled cycles tell no observers, black box or stop rule: the history has them all"
                )
            step = np.full(robot.nv, np.inf) if self._rate.step is None else self._rate.step
            self._free = FreeCycles(
                controller, driver, self._history, facts, self._patience, int(stop_on), step
            )
        self._counts, self._seen = Counts(), Status.OK
        self._notes: list[str] = []
        self._last: RobotState | None = None
        self._woke = 0.0  # when the last state came
        self._frozen = 0
        self._sent = np.zeros(robot.nv) if facts.gravity == "robot" else None
        self._limited = True  # nothing has been commanded yet
        self._wanted = self._reason = ""
        self._duration: float | None = None
        self._completed = self._standstill = False
        self._error: Exception | None = None
        self._moves = threading.Event()
        self._thread: threading.Thread | None = None

    # --- Any thread -----------------------------------------------------------------------------

    def start(self) -> None:
        """Connect, check, and hand the robot over to the controller; return when it has it.

        Raises:
            InputError: It was started before, or the robot does not do what the driver declares.
            Exception: What the driver raises.
        """
        if self._thread is not None:
            raise InputError("a loop runs once; make another one")
        # What is compiled or allocated at a first tick takes longer than a robot waits.
        warm_up = getattr(self._controller, "warm_up", None)
        if warm_up is not None:
            warm_up()
        self._thread = threading.Thread(target=self._live, name="opspace loop")
        self._thread.start()
        if self._free is not None:
            threading.Thread(target=self._tend, args=(self._free,), daemon=True).start()
        try:
            self._moves.wait()
        except BaseException:
            self.stop("interrupted")
            self._join()
            raise
        if self._error is not None:
            self._join()
            raise self._error

    def stop(self, reason: str = STOPPED) -> None:
        """Have the robot brake and the loop end; `wait` waits for that."""
        self._wanted = self._wanted or reason or STOPPED
        if self._free is not None:
            self._free.ask()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait while the robot moves.

        Args:
            seconds: The longest, s of this computer; None until the loop has ended.

        Returns:
            Whether the loop goes on.
        """
        if self._thread is None:
            return False
        self._thread.join(seconds)
        return self._thread.is_alive()

    def run(self, duration: float | None = None) -> LoopReport:
        """Start, wait for the end, and tell how it went.

        Args:
            duration: For how long, s by the clock of the states; None until somebody stops it.

        Returns:
            The report.

        Raises:
            InputError: See `start`.
            Exception: What the controller or the driver raised, when the robot has been stopped.
            KeyboardInterrupt: Ctrl-C, when the robot stands.
        """
        self._duration = None if duration is None else positive(duration, "the duration of a loop")
        with self:
            self.wait()
        return self.report

    def __enter__(self) -> Loop:
        self.start()
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.stop(STOPPED if kind is None else f"{getattr(kind, '__name__', kind)}: {error}")
        self._join()
        if self._error is not None and kind is None:
            raise self._error

    def ask(self, request: RunRequest) -> None:
        """Ask for a change of the tasks; it is done between two cycles, and logged where refused."""
        self._desk.ask(request)
        if self._free is not None:
            self._free.ask()

    @property
    def running(self) -> bool:
        """Whether the loop goes on."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def history(self) -> Cycles:
        """The last cycles."""
        return self._history.cycles()

    @property
    def _last_time(self) -> float:
        """Time of the last state, s; NaN before the first."""
        freely = None if self._free is None else self._free.last
        if freely is not None:
            return freely
        return np.nan if self._last is None else self._last.t

    @property
    def report(self) -> LoopReport:
        """How it went so far."""
        return LoopReport(
            completed=self._completed,
            reason=self._reason,
            t=self._last_time,
            counts=self._counts + (Counts() if self._free is None else self._free.counts),
            seen=self._seen,
            standstill=self._standstill,
            answered=answer_times(self._history.cycles()),
            notes=tuple(self._notes),
        )

    def _join(self) -> None:
        """Wait for the end; nobody who presses Ctrl-C again leaves a robot that moves."""
        while self._thread is not None and self._thread.is_alive():
            try:
                self._thread.join()
            except KeyboardInterrupt:
                log.warning("the robot is being braked")

    # --- The thread of the loop -----------------------------------------------------------------

    def _live(self) -> None:
        give_back = self._prepare()
        try:
            self._driver.start()
            if self._hold_still():
                self._moves.set()
                self._move()
        except _NoStateError as error:
            self._end(str(error))
        # Whatever it is, the robot stops, and the thread that asked hears of it.
        except Exception as error:
            self._fail(error)
        finally:
            self._stop_driver()
            self._say_the_end()
            self._desk.close()
            give_back()
            self._moves.set()

    def _prepare(self) -> Callable[[], None]:
        if self._real_time is None:
            return lambda: None
        refused, give_back = self._real_time.take()
        self._notes += refused
        return give_back

    def _say_the_end(self) -> None:
        how = "stopped" if self._error is None else "crashed"
        self._history.end("completed" if self._completed else how, self._reason)

    def _end(self, reason: str) -> None:
        if not self._reason:
            self._reason = reason
            log.warning("the loop ends: %s", reason)

    def _fail(self, error: Exception) -> None:
        if self._error is None:
            self._error = error
        self._end(f"{type(error).__name__}: {error}")

    def _stop_driver(self) -> None:
        try:
            self._driver.stop()
        except Exception as error:
            log.exception("the driver could not be stopped")
            self._fail(error)

    def _hold_still(self) -> bool:
        """Have the robot hold still, and look at whether it does; False where it is stopped before."""
        while not self._wanted:
            state = self._next()
            tau = self._hold.holding(state)
            held = self._hold.passed(state, self._sent if state.tau is None else state.tau)
            # The first commands may be on their way up to what holds.
            held = held and not self._limited
            self._give(state, tau, Status.OK)
            if held:
                self._notes += [self._hold.note] if self._hold.note else []
                self._controller.take_over(tau, self._handover)
                return True
        self._stopped()
        return False

    def _move(self) -> None:
        """Let the controller have the robot, and brake it."""
        try:
            self._control()
        except (_NoStateError, RobotStoppedError):
            # Without a state nothing brakes that does not know it itself; who has stopped is not asked.
            raise
        except Exception as error:
            self._fail(error)
        self._brake()

    def _tend(self, free: FreeCycles) -> None:
        """Do for compiled cycles what is no matter of microseconds, in a thread of its own."""
        main = threading.main_thread()
        while self.running:
            if self._moves.is_set():
                try:
                    free.tend()
                except Exception as error:
                    log.exception("compiled cycles cannot go on")
                    self.stop(f"{type(error).__name__}: {error}")
                    return
                if not main.is_alive():
                    self.stop("the program has ended")
            time.sleep(TENDING)

    def _run_freely(self, free: FreeCycles, ends: float) -> bool:
        """Go through cycles without Python; tell whether the loop has ended."""
        assert self._last is not None
        assert self._sent is not None
        code = free.run(self._last, self._woke, self._sent, ends)
        self._last, self._woke, self._sent, statuses = free.gather(self._counts)
        self._seen |= Status(statuses)
        if code == OVER:
            self._completed = True
        elif code == STOPPED_BY_STATUS:
            self._end(f"status {Status(statuses) & self._stop_on!r}")
        elif code == JUMPED:
            self._seen |= Status.TIME_JUMP
            if Status.TIME_JUMP in self._stop_on:
                self._end(f"status {Status.TIME_JUMP!r}")
            else:
                self._controller.restart()
                return False
        elif code == SILENT:
            raise _NoStateError(f"no new state came from the robot for {self._patience:.3g} s")
        elif code == FROZEN:
            raise _NoStateError("the robot told the same state while it moved")
        else:
            return False
        return True

    def _control(self) -> None:
        begun: float | None = None
        main = threading.main_thread()
        while True:
            free = self._free
            if begun is not None and free is not None and not self._wanted and self._desk.idle:
                ends = np.inf if self._duration is None else begun + self._duration
                if free.ready() and self._run_freely(free, ends):
                    return None
            state = self._next()
            begun = state.t if begun is None else begun
            command = answered(self._stepping, state.t, state.q, state.v, state.wrenches)
            tau = self._give(state, command.tau, command.status)
            command = command._replace(tau=tau)
            for observer in self._observers:
                observer.observe(state.q, state.v, command)
            self._desk.observe(state.q, state.v, command)
            if command.status & self._stop_on:
                return self._end(f"status {command.status & self._stop_on!r}")
            if reason := self._rule.reason(self._controller.robot, state.v, tau):
                return self._end(reason)
            if self._wanted:
                return self._stopped()
            if self._duration is not None and state.t - begun >= self._duration:
                self._completed = True
                return None
            if not main.is_alive():
                return self._end("the program has ended")

    def _stopped(self) -> None:
        self._completed, self._reason = self._wanted == STOPPED, self._wanted

    def _brake(self) -> None:
        """Damp every joint until all stand; the torque gets there from what was commanded last."""
        assert self._sent is not None
        robot, period = self._controller.robot, self._facts.period
        handover = Handover(self._sent, FADE, back=False)
        added, still, motors = np.zeros(robot.nv), 0, motor_range(robot)
        for k in range(round(LONGEST_BRAKING / period)):
            state = self._next()
            tau = self._controller.braking(state.q, state.v)
            if self._facts.gravity == "robot":
                added = robot.gravity
            mixed = handover.torque(k * period, tau, motors.limit, added - motors.middle)
            self._give(state, mixed, Status.OK)
            still = still + 1 if np.max(np.abs(state.v)) < STANDING else 0
            if still >= STANDS and handover.done:
                self._standstill = True
                return
        self._notes.append(f"the robot did not stand {LONGEST_BRAKING:g} s after it was braked")

    def _give(self, state: RobotState, tau: np.ndarray, status: Status) -> np.ndarray:
        """Write a command as far as the robot takes it, and remember the cycle."""
        command = self._rate.within(tau, self._sent if state.tau is None else state.tau)
        self._driver.write(command)
        passed = time.perf_counter() - self._woke
        self._limited, self._sent = command is not tau, command
        counts = self._counts
        counts.cycles += 1
        counts.limited += self._limited
        counts.overruns += passed > self._facts.period
        if status:
            self._seen |= status
            counts.late += Status.LATE in status
            counts.jumps += Status.TIME_JUMP in status
        self._history.add(state.t, state.q, state.v, command, int(status), passed)
        return command

    def _next(self) -> RobotState:
        """Wait for a state that is newer than the last one.

        Raises:
            _NoStateError: There is none for longer than the loop waits.
            InputError: It is not a state.
        """
        last, period, counts = self._last, self._facts.period, self._counts
        most = CONNECTING if last is None else self._patience
        begun = time.perf_counter() if last is None else self._woke
        while True:
            state = self._driver.read(MISSED * period)
            now = time.perf_counter()
            if state is None:
                counts.missed += 1
            elif last is not None and 0.0 <= last.t - state.t <= JUMP * period:
                counts.old += 1
            else:
                break
            if now - begun > most:
                raise _NoStateError(f"no new state came from the robot for {now - begun:.3g} s")
        self._check(state)
        self._last, self._woke = state, now
        return state

    def _check(self, state: RobotState) -> None:
        """Refuse what is no state, and one that does not change any more while the robot moves."""
        robot = self._controller.robot
        _, q, v, tau, _ = state
        if q.shape != (robot.nq,) or v.shape != (robot.nv,):
            raise InputError(
                f"the driver told q of {q.shape} and v of {v.shape}; robot {robot.name!r} has "
                f"({robot.nq},) and ({robot.nv},)"
            )
        if not (np.all(np.isfinite(q)) and np.all(np.isfinite(v)) and np.isfinite(state.t)):
            raise InputError("the driver told a state that is not finite")
        if tau is not None and not (tau.shape == v.shape and np.all(np.isfinite(tau))):
            raise InputError("the driver told an accepted torque that is none of this robot")
        last = self._last
        if last is None or not (
            np.any(v) and np.array_equal(v, last.v) and np.array_equal(q, last.q)
        ):
            self._frozen = 0
            return
        self._counts.stale += 1
        self._frozen += 1
        if self._frozen * self._facts.period > self._patience:
            raise _NoStateError(
                f"the robot told the same state {self._frozen} times while it moved"
            )


def _answered(request: RunRequest, reason: str) -> None:
    if reason:
        log.warning("request %s of %s was refused: %s", request.kind, request.about, reason)

"""A robot in a process of its own, to try drivers and loops with: ``python -m`` this module."""

from __future__ import annotations

import argparse
import json
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np

from opspace.drivers.shared_memory import SharedRobotSide
from opspace.drivers.udp import UdpRobotSide
from opspace.drivers.unitree import UnitreeRobotSide
from opspace.errors import InputError, OpspaceError
from opspace.loop.any_plant import AnyPlant
from opspace.loop.driver import WHO, RobotState
from opspace.robots import Robot, load_robot
from opspace.sim import Plant

DAMPING = 10.0
"""With which it brakes by itself, 1/s."""
WAIT = 2.0
"""How long a robot that waits for answers does so, s."""


class RobotSide(Protocol):
    """What a robot uses to be driven."""

    @property
    def braked(self) -> bool:
        """Whether nobody drives, or the driver has asked for brakes."""
        ...

    def commands(self) -> np.ndarray | None:
        """Return the newest command that has come, None where none has."""
        ...

    def tell(self, state: RobotState) -> None:
        """Send a state."""
        ...

    def give_up(self) -> None:
        """Say that the robot has braked by itself, until the next driver comes."""
        ...

    def close(self) -> None:
        """Be driven no more."""
        ...


@dataclass(frozen=True)
class Trouble:
    """What happens on the way, in both directions and each by chance.

    Attributes:
        loss: Part of what is sent that never arrives.
        delay: How many periods everything takes.
        reorder: Part of what is sent that arrives a period late, behind what was sent after it.
        seed: Seed of the chance.

    Raises:
        InputError: A part is not from 0 to 1, or a delay below 0.
    """

    loss: float = 0.0
    delay: int = 0
    reorder: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for what, part in (("loss", self.loss), ("reorder", self.reorder)):
            if not 0.0 <= part <= 1.0:
                raise InputError(f"{what} is a part from 0 to 1, not {part}")
        if self.delay < 0:
            raise InputError(f"a delay is at least 0 periods, not {self.delay}")


class _Way:
    """One direction of a wire with trouble."""

    def __init__(self, trouble: Trouble, seed: int) -> None:
        self._trouble = trouble
        self._chance = np.random.default_rng([trouble.seed, seed])
        self._under_way: list[tuple[int, RobotState | np.ndarray]] = []
        self._cycle = 0

    def send(self, what: RobotState | np.ndarray) -> None:
        """Send something in this period."""
        lost, late = self._chance.random(2) < (self._trouble.loss, self._trouble.reorder)
        if not lost:
            self._under_way.append((self._cycle + self._trouble.delay + int(late), what))

    def arrivals(self) -> list[RobotState | np.ndarray]:
        """End a period; return what has arrived in it, in the order of arrival."""
        there = [what for due, what in self._under_way if due <= self._cycle]
        self._under_way = [one for one in self._under_way if one[0] > self._cycle]
        self._cycle += 1
        return there


@dataclass
class Account:
    """What has happened to a robot.

    Attributes:
        cycles: Periods that it lived.
        accepted: Commands that it took.
        reflexes: Times that a command differed from the one before by more than it takes.
        silences: Times that it braked because commands stayed away.
        fastest: Speed of the fastest joint at the end, rad/s.
        steepest: The most by which a command differed from the one before, N·m/s.
    """

    cycles: int = 0
    accepted: int = 0
    reflexes: int = 0
    silences: int = 0
    fastest: float = 0.0
    steepest: float = 0.0


class SimulatedRobot:
    """Does what real robots do between their joints and a driver.

    It holds itself until the first command comes, keeps each until the next one, and brakes by itself
    when none comes for ``patience`` periods, when one differs too much from the one before, and when
    it is asked to; the driver starts anew after that.

    Args:
        plant: The joints.
        robot: Their model.
        side: How it is driven.
        gravity: Who adds the torque that holds the weight.
        torque_rate: The most by which commands may differ, N·m/s; None for any.
        patience: After how many periods without a command it brakes.
        trouble: What happens on the way.
        lockstep: Wait for the answer to every state that arrives, so that a slow computer does not
            matter; else time passes as it does.
    """

    def __init__(
        self,
        plant: AnyPlant,
        robot: Robot,
        side: RobotSide,
        *,
        gravity: str,
        torque_rate: float | None = None,
        patience: int = 20,
        trouble: Trouble = Trouble(),
        lockstep: bool = False,
    ) -> None:
        self._plant, self._robot, self._side = plant, robot, side
        self._adds = gravity == "robot"
        self._most = np.inf if torque_rate is None else torque_rate * plant.dt
        self._patience = patience
        self._lockstep = lockstep
        self._there, self._back = _Way(trouble, 0), _Way(trouble, 1)
        self._accepted = np.zeros(robot.nv)
        self._driven = self._answers = False
        self._silent = 0
        self.account = Account()

    def run(self, over: Callable[[], bool]) -> None:
        """Live until it is over."""
        due = time.perf_counter()
        while not over():
            told = self._tell()
            command = self._heard(told)
            self._take(command)
            self._plant.advance(self._accepted if self._driven else self._brake())
            self.account.cycles += 1
            due = max(due + self._plant.dt, time.perf_counter() - self._plant.dt)
            if not self._lockstep or not self._answers:
                time.sleep(max(due - time.perf_counter(), 0.0))
        self.account.fastest = float(np.max(np.abs(self._plant.v)))

    def _tell(self) -> bool:
        """Send a state; tell whether one arrives."""
        q, v = self._plant.measure()
        accepted = self._accepted.copy() if self._driven else np.full(v.size, np.nan)
        self._there.send(RobotState(self._plant.t, q, v, accepted))
        arrived = self._there.arrivals()
        for state in arrived:
            assert isinstance(state, RobotState)
            self._side.tell(state)
        return bool(arrived)

    def _heard(self, told: bool) -> np.ndarray | None:
        """Wait for an answer where there will be one, and let it come through."""
        found = self._side.commands()
        if self._lockstep and told and self._answers and not self._side.braked:
            end = time.perf_counter() + WAIT
            while found is None and not self._side.braked and time.perf_counter() < end:
                time.sleep(2e-5)
                found = self._side.commands()
        if told or found is not None:
            self._answers = found is not None
        if found is not None:
            self._back.send(found)
        arrived = self._back.arrivals()
        return arrived[-1] if arrived else None  # pyright: ignore[reportReturnType]

    def _take(self, command: np.ndarray | None) -> None:
        """Accept a command, or brake."""
        account = self.account
        if self._side.braked:
            self._rest()
            return
        if command is None:
            self._silent += 1
            if self._driven and self._silent > self._patience:
                account.silences += 1
                self._side.give_up()
                self._rest()
            return
        self._silent = 0
        step = float(np.max(np.abs(command - self._accepted)))
        # What a robot that holds itself does about its weight, nobody is told.
        step = step if self._driven or self._adds else 0.0
        account.steepest = max(account.steepest, step / self._plant.dt)
        if step > self._most * (1.0 + 1e-9) or not np.all(np.isfinite(command)):
            account.reflexes += 1
            self._side.give_up()
            self._rest()
            return
        self._driven, self._accepted = True, command
        account.accepted += 1

    def _rest(self) -> None:
        self._driven = False
        self._silent = 0
        self._accepted = np.zeros(self._robot.nv)

    def _brake(self) -> np.ndarray:
        robot = self._robot
        robot.update(self._plant.q, self._plant.v)
        tau = robot.bias - DAMPING * robot.M.diagonal() * robot.v
        return tau - robot.gravity if self._adds else tau


def parser() -> argparse.ArgumentParser:
    """What the command line may say."""
    parser = argparse.ArgumentParser(
        prog="python -m opspace.drivers.simulated_robot",
        description="A simulated robot behind UDP, shared memory or DDS.",
    )
    parser.add_argument("robot", help="name or file of a robot")
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument("--udp", type=int, metavar="PORT", help="be driven over UDP; 0 is any port")
    how.add_argument("--memory", metavar="FILE", help="be driven through shared memory")
    how.add_argument("--unitree", type=int, metavar="DOMAIN", help="be driven as one of Unitree's")
    parser.add_argument("--interface", help="network interface for DDS")
    parser.add_argument("--period", type=float, default=1e-3, help="between two states, s")
    parser.add_argument("--gravity", choices=WHO, default="controller", help="who adds its torque")
    parser.add_argument("--torque-rate", type=float, help="the most that it takes, N·m/s")
    parser.add_argument("--patience", type=int, default=20, help="periods without a command")
    parser.add_argument("--loss", type=float, default=0.0, help="part that never arrives")
    parser.add_argument("--delay", type=int, default=0, help="periods that everything takes")
    parser.add_argument("--reorder", type=float, default=0.0, help="part that arrives late")
    parser.add_argument("--seed", type=int, default=0, help="of chance")
    parser.add_argument("--lockstep", action="store_true", help="wait for every answer")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a robot until it is told to end, then print what has happened as JSON.

    Args:
        arguments: The words of the command line; None takes those of the process.
    """
    words = parser()
    given = words.parse_args(arguments)
    try:
        robot = load_robot(given.robot)
        adds = given.gravity == "robot"
        plant = Plant(robot, robot.q_reference, dt=given.period, adds_gravity=adds)
        trouble = Trouble(given.loss, given.delay, given.reorder, given.seed)
        side = _side_of(given, robot)
    except (OpspaceError, OSError) as error:
        words.error(str(error))
    one = SimulatedRobot(
        plant,
        robot,
        side,
        gravity=given.gravity,
        torque_rate=given.torque_rate,
        patience=given.patience,
        trouble=trouble,
        lockstep=given.lockstep,
    )
    ended: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda got, _: ended.append(got))
    try:
        one.run(lambda: bool(ended))
    finally:
        side.close()
    print(json.dumps(asdict(one.account)), flush=True)


def _side_of(given: argparse.Namespace, robot: Robot) -> RobotSide:
    """Make what it is driven by, and say where."""
    if given.unitree is not None:
        side = UnitreeRobotSide(robot.nv, given.interface, given.unitree)
        print(f"in domain {given.unitree}", flush=True)
        return side
    if given.memory is not None:
        side = SharedRobotSide(given.memory, robot.nq, robot.nv)
        print(f"sharing {given.memory}", flush=True)
        return side
    side = UdpRobotSide(given.udp, robot.nv)
    print(f"listening at port {side.port}", flush=True)
    return side


if __name__ == "__main__":
    main()

"""The search for what drives a joint beyond a limit that it could respect.

``python -m tests.controller.limit_search panda --evaluations 10000`` climbs from random runs to worse
ones and keeps the worst in ``worst_runs.json``, which `tests.controller.test_guarantee` runs again.
"""

import argparse
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.special import ndtri

import opspace as osc
from opspace import Status
from opspace.law.scalars import LOST
from opspace.sim import Plant

KEPT = Path(__file__).with_name("worst_runs.json")
DT = 0.001
TICKS, CHANGE = 120, 30
"""Ticks of a run, and after how many the targets change."""
PASSED = LOST / (osc.JointLimits.k1 * osc.JointLimits.k2)
"""What an acceleration that is wrong by LOST, too little for a word, makes of a position, rad."""
TOO_FAST = LOST / osc.JointLimits.k2
OFF_THE_MEAN = 2e-3
"""The same, rad/s, where several joints are at their speed limits at once: the acceleration in the
middle of a tick, which the bounds count, is then not its mean."""
AIMS = ("edge", "speed")
"""What is to be made large: how much faster a joint is than what it can stop from before its limit, or
than its limit of speed. A joint that goes beyond a limit has been beyond that edge before."""
SLOW = 0.05
"""What may be no faster than this before a limit is not asked how near its edge it is, rad/s."""
PARENTS = 12
"""Runs that are changed to find worse ones."""


@dataclass(frozen=True)
class Run:
    """What a run came to after its first tick, below 0 where it stayed inside.

    Attributes:
        position: How far a joint went beyond a limit, rad.
        edge: How much faster a joint was than what it can stop from before its limit, in parts of that.
        speed: How much faster a joint was than its limit of speed, rad/s.
        lost: Whether a tick said that a limit cannot be kept; nothing counts from there on.
    """

    position: float
    edge: float
    speed: float
    lost: bool


class Genes:
    """Numbers in [0, 1) that are drawn in the same order every time, and can be changed one by one.

    Args:
        values: (k,) the numbers.
    """

    def __init__(self, values):
        self.values, self._used = np.asarray(values, dtype=float), 0

    def random(self, size=None):
        """Draw what comes next."""
        count = 1 if size is None else size
        drawn = self.values[self._used : self._used + count]
        self._used += count
        return float(drawn[0]) if size is None else drawn


def pick(values, u):
    """Choose among values by numbers in [0, 1)."""
    return np.asarray(values)[(np.asarray(u) * len(values)).astype(int)]


def normal(u):
    """Normal numbers from such in [0, 1), none beyond 4 standard deviations."""
    return ndtri(np.clip(u, 3e-5, 1.0 - 3e-5))


class Adversary:
    """An arm with tasks that care for no limit, and a simulation with the controller's own model.

    The simulation makes one step in a tick, or many, between which inertia and Coriolis forces change.

    Args:
        name: The arm.
        motors: What the motors' limits do, ``torque_limits`` of `opspace.Controller`.
        steps: Steps of the simulation in a tick.
    """

    def __init__(self, name, motors, steps):
        self.robot, self.motors, self.steps = osc.load_robot(name), motors, steps
        self.limits = osc.JointLimits()
        self.plant = Plant(
            self.robot,
            self.robot.q_reference,
            dt=DT,
            substeps=steps,
            torque_limits=motors == "priority",
        )
        self.start()
        self.side = np.ones(self.robot.nv)

    def start(self):
        """Make a stack and a controller that know of no run before."""
        self.tool = osc.PositionTask(target=np.zeros(3), kp=1e5)
        self.turn = osc.OrientationTask(target=np.eye(3), kp=1e5)
        self.posture = osc.PostureTask(self.robot.q_reference, kp=1e5)
        self.stack = osc.Stack([self.tool, self.turn, self.posture], limits=self.limits)
        # What one step is worth is the acceleration at its beginning: then nothing else counts.
        period = None if self.steps == 1 else DT
        self.controller = osc.Controller(
            self.robot, self.stack, torque_limits=self.motors, period=period
        )

    def begin(self, draw):
        """A state from which every joint can stop at its limits: many near them, many at the edge.

        Most joints begin on their way to the limit that they are near, and are driven there.
        """
        robot, n = self.robot, self.robot.nv
        lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -3.0)
        upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, 3.0)
        away = np.minimum(-0.1 * np.log1p(-draw.random(n)), upper - lower)
        self.side = pick([-1.0, 1.0], draw.random(n))
        near = np.where(self.side < 0.0, lower + away, upper - away)
        anywhere = lower + (upper - lower) * draw.random(n)
        q = np.where(draw.random(n) < 0.7, near, anywhere)
        slowest, fastest = self.can_stop(q)
        there = self.side * pick([-1.0, 1.0, 1.0, 1.0], draw.random(n))
        v = np.where(there < 0.0, -slowest, fastest) * pick([0.0, 0.5, 1.0, 1.0], draw.random(n))
        self.plant.data.qpos[:], self.plant.data.qvel[:] = q, v
        for task in (self.tool, self.turn, self.posture):
            task.kp = 10.0 ** (2.0 + 6.0 * draw.random())

    def can_stop(self, q):
        """How fast each joint may be on its way down and up, (n,) each, 5 rad/s at most."""
        allowed = np.full((2, self.robot.nv), 5.0)
        for side, edge in zip(self.limits.sides, self.edges(q), strict=True):
            row = allowed[int(side.sign > 0.0)]
            row[side.index] = min(edge, side.speed, row[side.index])
        return allowed

    def edges(self, q):
        """Speed from which each side of a joint can just be kept, one for each side."""
        gaps = [side.sign * (side.limit - q[side.index]) for side in self.limits.sides]
        return np.array(
            [
                self.limits.allowed_speed(side, max(gap, 0.0)) if np.isfinite(gap) else np.inf
                for side, gap in zip(self.limits.sides, gaps, strict=True)
            ]
        )

    def change(self, draw):
        """Other targets, and the stack on its way to another order."""
        n = self.robot.nv
        self.tool.target = 3.0 * normal(draw.random(3))
        quaternion = normal(draw.random(4)) + 1e-9
        self.turn.target = quaternion / np.linalg.norm(quaternion)
        beyond = self.plant.q + self.side * 8.0 * draw.random(n)
        anywhere = -8.0 + 16.0 * draw.random(n)
        self.posture.target = np.where(draw.random(n) < 0.8, beyond, anywhere)
        swapped, order = draw.random() < 0.5, np.argsort(draw.random(3))
        duration = float(pick([0.0, 0.03, 0.2], draw.random()))
        if swapped:
            tasks = [self.tool, self.turn, self.posture]
            self.stack.swap(tasks[order[0]], tasks[order[1]], duration=duration)

    @property
    def genes(self):
        """Numbers that a run draws."""
        n = self.robot.nv
        return 7 * n + 3 + -(-TICKS // CHANGE) * (3 * n + 12)

    def run(self, draw):
        """Let it run until a tick says LOST, or to its end.

        Args:
            draw: What gives the numbers of the run: `Genes`, or a generator of NumPy.

        Returns:
            The `Run`.
        """
        self.start()
        self.begin(draw)
        limit, speed, sign, index = self.ends()
        most = np.full(3, -np.inf)
        for tick in range(TICKS):
            if tick % CHANGE == 0:
                self.change(draw)
            q, v = self.plant.q, self.plant.v
            towards = sign * v[index]
            edge = self.edges(q)
            too_fast = np.where(edge > SLOW, towards / edge - 1.0, -1.0)
            now = sign * q[index] - limit, too_fast, towards - speed
            if tick > 0:
                most = np.maximum(most, [np.max(each) for each in now])
            command = self.controller.step(DT * tick, q, v)
            assert Status.FAULT not in command.status
            if Status.LIMIT_LOST in command.status:
                return Run(*most.tolist(), lost=True)
            self.plant.advance(command.tau)
        return Run(*most.tolist(), lost=False)

    def ends(self):
        """Of every side of every joint: its limit and speed, its sign, and the joint."""
        sides = self.limits.sides
        sign = np.array([side.sign for side in sides])
        limit = sign * np.array([side.limit for side in sides])
        speed = np.array([side.speed for side in sides])
        return limit, speed, sign, np.array([side.index for side in sides])


adversary = cache(Adversary)


def changed(genes, rng):
    """Draw some of the numbers again, or move them a little."""
    these = rng.random(genes.size) < rng.choice([0.01, 0.03, 0.1, 0.3])
    little = (genes + rng.normal(0.0, 0.05, genes.size)) % 1.0
    return np.where(
        these, np.where(rng.random(genes.size) < 0.5, rng.random(genes.size), little), genes
    )


def climb(arm, aim, evaluations, rng):
    """Search for the run that makes most of an aim.

    Args:
        arm: The `Adversary`.
        aim: One of `AIMS`.
        evaluations: Runs to try; the first tenth are drawn, later ones mostly changed.
        rng: Generator.

    Returns:
        The worst runs, ``(what was made of the aim, genes)``, worst first, and the largest position
        of any run.
    """
    found, farthest = [], -np.inf
    for count in range(evaluations):
        if count < evaluations // 10 or rng.random() < 0.1:
            genes = rng.random(arm.genes)
        else:
            genes = changed(found[int(len(found) * rng.random() ** 2)][1], rng)
        genes = genes.round(6)
        run = arm.run(Genes(genes))
        farthest = max(farthest, run.position)
        # Beyond a limit is worse than anything before it.
        value = getattr(run, aim) + 1e6 * max(run.position - PASSED, 0.0)
        found = sorted([*found, (value, genes)], key=lambda one: -one[0])[:PARENTS]
    return found, farthest


def main():
    """Search, say what was found, and keep the worst."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("arm")
    arguments.add_argument("--evaluations", type=int, default=10_000, help="for each aim")
    arguments.add_argument("--motors", default="priority", choices=("priority", "report"))
    arguments.add_argument("--seed", type=int, default=0)
    wanted = arguments.parse_args()
    arm = Adversary(wanted.arm, wanted.motors, 20)
    for aim in AIMS:
        rng = np.random.default_rng([wanted.seed, AIMS.index(aim)])
        found, farthest = climb(arm, aim, wanted.evaluations, rng)
        value, genes = found[0]
        print(
            f"{wanted.arm} {wanted.motors} {aim}: at most {value:.3g}, {farthest:.3g} rad",
            flush=True,
        )
        kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
        kept[f"{wanted.arm} {wanted.motors} {aim}"] = genes.tolist()
        KEPT.write_text(json.dumps(kept, sort_keys=True).replace("], ", "],\n ") + "\n")


if __name__ == "__main__":
    main()

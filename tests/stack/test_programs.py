"""Random programs at one state: continuity, and every task exactly where it should be."""

import numpy as np
import pytest
from hypothesis import given, settings

from opspace.law import TaskSet, Weighted, blended_torque
from opspace.stack import Blending, Stack, mixture
from tests.budget import examples
from tests.stack.arm import arm, state, tasks_for
from tests.stack.programs import Program, programs, running_of, variables_of

DT = 0.004


class Bench:
    """Hard torques of stacks of the arm's tasks at one state."""

    def __init__(self):
        robot = arm()
        self.tasks = tasks_for(robot)
        for task in self.tasks:
            task.bind(robot)
        robot.update(*state(robot))
        self.L = np.linalg.cholesky(robot.M)
        self.terms = {task.name: task.evaluate(robot, 0.0) for task in self.tasks}
        self._known = {}

    def hard(self, where):
        """Torque of the stack that has task ``name`` at ``level`` for every pair in ``where``."""
        ranks = {level: k for k, level in enumerate(sorted({level for _, level in where}))}
        key = frozenset((name, ranks[level]) for name, level in where)
        if key not in self._known:
            sets = [
                TaskSet(self.terms[name].J, self.terms[name].acceleration, rank)
                for name, rank in sorted(key)
            ]
            everything = [Weighted(1.0, frozenset(range(len(sets))))]
            self._known[key], _ = blended_torque(self.L, sets, everything)
        return self._known[key]


@pytest.fixture(scope="module")
def bench():
    return Bench()


def run(bench, steps, blending, ticks_per_wait=1, check=lambda *_: None):
    """Play a program; returns the torques, the final stack and the model's idea of it."""
    tasks = bench.tasks
    stack = Stack([tasks[0], [tasks[2], tasks[3]], tasks[6]])
    initial = {t.name: n for n, level in stack.levels_by_number.items() for t in level}
    program = Program(stack, tasks, steps, initial)
    dt = DT / ticks_per_wait
    blending = Blending(blending)
    taus, members, tick = [], stack.begin_tick(0.0), 0
    while tick < 20 * ticks_per_wait or not (program.done and stack.settled):
        t = tick * dt
        if tick % ticks_per_wait == 0:
            here = {member.task.name for member in members}
            program.play(tick // ticks_per_wait, here, running_of(members, t))
        members = stack.begin_tick(t)
        mixed = mixture(members, [m.presence.value(t) for m in members], t, blending)
        where = [
            frozenset((members[i].task.name, level) for i, level in map(mixed.slots.__getitem__, c))
            for _, c in mixed.corners
        ]
        weights = [w for w, _ in mixed.corners]
        hards = [bench.hard(corner) for corner in where]
        taus.append(sum(w * u for w, u in zip(weights, hards, strict=True)))
        check(t, members, mixed, where, weights, hards, taus)
        tick += 1
        assert tick < 4000 * ticks_per_wait
    return np.array(taus), stack, program


class StepBound:
    """|Δτ| <= Σ |Δ activation| · widest gap between hard torques, at every tick."""

    def __init__(self):
        self.values, self.hards, self.most = {}, [], 0

    def __call__(self, t, members, mixed, where, weights, hards, taus):
        values = {variable: variable.value(t) for variable in variables_of(members)}
        moved = sum(
            abs(v.value(t) - self.values.get(v, 0.0))
            for v in [*values, *(v for v in self.values if v not in values)]
        )
        if self.values:
            gap = np.ptp([*hards, *self.hards], axis=0).max()
            step = np.abs(taus[-1] - taus[-2]).max()
            assert step <= moved * gap + 1e-9 * (1.0 + np.abs(taus[-1]).max())
        self.values, self.hards = values, hards
        self.most = max(self.most, sum(0.0 < v < 1.0 for v in values.values()))


def no_task_lost_or_twice(t, members, mixed, where, weights, hards, taus):
    assert sum(weights) == pytest.approx(1.0, abs=1e-12)
    assert min(weights) > 0.0
    for corner in where:
        names = [name for name, _ in corner]
        assert len(set(names)) == len(names)
    for member, shares in zip(members, mixed.shares, strict=True):
        h = member.presence.value(t)
        there = sum(
            w
            for w, corner in zip(weights, where, strict=True)
            if member.task.name in {name for name, _ in corner}
        )
        assert there == pytest.approx(h, abs=1e-12)
        assert sum(share for _, share in shares) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("blending", ["auto", "idv", "chain"])
@settings(max_examples=30)
@given(steps=programs(0.002, 0.4))
def test_a_step_is_at_most_what_the_activations_allow(bench, blending, steps):
    bound = StepBound()

    def check(*tick):
        bound(*tick)
        no_task_lost_or_twice(*tick)

    _, stack, program = run(bench, steps, blending, check=check)
    found = {t.name: n for n, level in stack.levels_by_number.items() for t in level}
    assert found == program.levels


@pytest.mark.parametrize("blending", ["idv", "chain"])
@examples(3)
@given(steps=programs(0.15, 0.5))
def test_halving_the_tick_halves_the_largest_step(bench, blending, steps):
    # At half a millisecond: where several ramps are steep at once, longer ticks step over the
    # steepest moment, and the next halving finds it.
    coarse, fine = (
        np.abs(np.diff(run(bench, steps, blending, n)[0], axis=0)).max() for n in (8, 16)
    )
    assert fine <= 0.6 * coarse + 1e-9


def test_the_programs_do_overlap(bench):
    """What the two tests above draw from is not tame."""
    most = []

    @settings(max_examples=20, database=None)
    @given(steps=programs(0.002, 0.4))
    def play(steps):
        bound = StepBound()
        run(bench, steps, "chain", check=bound)
        most.append(bound.most)

    play()
    assert max(most) >= 4


EVENTS = {
    "insert": lambda stack, tasks: stack.insert(tasks[2], 0.5, 0.2),
    "remove": lambda stack, tasks: stack.remove("height", 0.2),
    "move": lambda stack, tasks: stack.move("posture", -1, 0.2),
    "swap": lambda stack, tasks: stack.swap("height", "posture", 0.2),
}
TURNS = {
    "insert": lambda stack, tasks: stack.remove(tasks[2], 0.1),
    "remove": lambda stack, tasks: stack.insert(tasks[0], 2.0, 0.1),
    "move": lambda stack, tasks: stack.move("posture", 0.5, 0.1),
    "swap": lambda stack, tasks: stack.swap("height", "posture", 0.1),
}


@pytest.mark.parametrize("event", EVENTS)
@pytest.mark.parametrize("turned", [False, True])
def test_nothing_steps_at_the_edges(bench, event, turned):
    """At start, turn and arrival the torque and its first two derivatives are continuous."""
    stack = Stack([bench.tasks[0], bench.tasks[6]])
    dt, taus, blending = 0.0005, [], Blending("idv")
    for tick in range(900):
        t = tick * dt
        if tick == 100:
            EVENTS[event](stack, bench.tasks)
        if turned and tick == 270:
            TURNS[event](stack, bench.tasks)
        members = stack.begin_tick(t)
        mixed = mixture(members, [m.presence.value(t) for m in members], t, blending)
        taus.append(
            sum(
                w
                * bench.hard({(members[mixed.slots[k][0]].task.name, mixed.slots[k][1]) for k in c})
                for w, c in mixed.corners
            )
        )
    assert stack.settled
    first = np.abs(np.diff(taus, axis=0)).max(axis=1)
    second = np.abs(np.diff(taus, 2, axis=0)).max(axis=1)
    third = np.abs(np.diff(taus, 3, axis=0)).max(axis=1)
    # Of a C² function sampled finely, every difference is small beside the one before.
    assert second.max() < 0.1 * first.max()
    assert third.max() < 0.25 * second.max()
    assert first.max() > 1e-3

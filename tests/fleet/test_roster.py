"""Each robot of a fleet goes through the transitions of a stack of its own; Warp has no part in this."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.fleet.roster import Roster
from opspace.plan.entries import KERNELS
from opspace.stack.changes import Timing

COUNT, DT = 4, 0.01
NAMES = ("position", "orientation", "elbow")
PROFILES = ("quintic", "cubic", "half-sine", "linear")


def tasks(robot):
    target = osc.PositionTask(target=[0.4, 0.1, 0.3])
    turn = osc.OrientationTask(target=np.eye(3), max_speed=2.0)
    posture = osc.PostureTask(target=robot.q_reference)
    elbow = osc.JointTask(robot.joint_names[2], 0.3, name="elbow")
    return [target, turn, posture], elbow


class Rows:
    """A roster whose robots are computed one by one with the compiled tick."""

    def __init__(self, options):
        robot = osc.load_robot("puma560")
        levels, self.later = tasks(robot)
        stack = osc.Stack(levels)
        self.controller = osc.Controller(robot, stack, **options)
        stack.prepare(self.later)
        self.roster = Roster(COUNT)
        for level, found in stack.levels_by_number.items():
            for task in found:
                self.roster.start_with(task, level)
        self.roster.take_in(self.later, 2)
        self.groups = {}
        KERNELS.load()

    def step(self, t, Q, V):
        if self.roster.asked and self.roster.happen(t):
            self.plan = self.controller.plan_apart(self.roster.present)
        plan, tick = self.plan, self.plan.tick
        ramps = self.roster.ramps(plan.variables)
        tau = np.empty(Q.shape)
        for i in range(COUNT):
            tick.q[:], tick.v[:], tick.variable[:] = Q[i], V[i], ramps[i]
            tick.group[:] = [self.groups.get((i, v), 0) for v in plan.variables]
            plan.forget()
            assert KERNELS["tick"](t, plan.handle.address) >= 0
            self.groups.update(
                {(i, v): g for v, g in zip(plan.variables, tick.group.tolist(), strict=True)}
            )
            tau[i] = tick.tau
        return tau


class Ones:
    """As many controllers."""

    def __init__(self, options):
        self.controllers, self.stacks, self.tasks = [], [], []
        for _ in range(COUNT):
            robot = osc.load_robot("puma560")
            levels, later = tasks(robot)
            self.stacks.append(osc.Stack(levels))
            self.tasks.append(later)
            self.controllers.append(osc.Controller(robot, self.stacks[-1], **options))
            self.stacks[-1].prepare(later)

    def step(self, t, Q, V):
        return np.array(
            [c.step(t, q, v).tau for c, q, v in zip(self.controllers, Q, V, strict=True)]
        )


def ask(rows, ones, rng):
    """Ask both for something, of the robots that can do it; the fleet must find the others itself."""
    kind, name = rng.choice(["insert", "remove", "move", "move", "swap"]), str(rng.choice(NAMES))
    level, mask = float(rng.choice([0, 1, 2])), rng.random(COUNT) < 0.6
    timing = {
        "duration": float(rng.choice([0.0, 0.02, 0.05, 0.15])),
        "profile": str(rng.choice(PROFILES)),
    }
    other = str(rng.choice([n for n in NAMES if n != name]))
    able = np.zeros(COUNT, bool)
    for i in np.flatnonzero(mask):
        stack = ones.stacks[i]
        try:
            if kind == "insert":
                task = ones.tasks[i] if name == "elbow" else stack[name]
                stack.insert(task, level, **timing)
            elif kind == "swap":
                stack.swap(name, other, **timing)
            else:
                getattr(stack, kind)(name, *([level] if kind == "move" else []), **timing)
        except osc.OpspaceError:
            continue
        able[i] = True
    if not able.any():
        return
    timing, roster = Timing(**timing), rows.roster
    if kind == "insert":
        roster.insert(name, level, able, timing)
    elif kind == "remove":
        roster.remove(name, able, timing)
    elif kind == "move":
        roster.move(name, level, able, timing)
    else:
        roster.swap(name, other, able, timing)


@settings(max_examples=5)
@given(seed=st.integers(0, 2**32 - 1))
def test_random_requests_for_some_robots(seed):
    rng = np.random.default_rng(seed)
    options = {"blending": "idv"}  # any other asks who began to move first
    rows, ones = Rows(options), Ones(options)
    q = rows.controller.robot.q_reference
    Q, V = q + rng.uniform(-0.5, 0.5, (COUNT, q.size)), rng.uniform(-1, 1, (COUNT, q.size))
    for k in range(60):
        if rng.random() < 0.2:
            ask(rows, ones, rng)
        tau, want = rows.step(k * DT, Q, V), ones.step(k * DT, Q, V)
        np.testing.assert_allclose(tau, want, rtol=0, atol=1e-9 * np.abs(want).max())

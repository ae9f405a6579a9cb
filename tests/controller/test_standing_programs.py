"""Random programs of requests on a standing G1: forces and torques that exist, and nothing lost."""

import threading
import time
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import UnknownNameError
from tests.budget import examples
from tests.stack.programs import Program, programs

HALF, OFFSET = (0.085, 0.025), (0.035, 0.0, -0.035)
GRID = 0.01
"""Requests come at multiples of this, whatever the tick is, s."""
SHORTEST, LONGEST = 0.1, 0.3
CLOSE = 1e-6 * 33.34114202 * 9.81
"""Planned and felt forces of a rigid robot differ by less, N."""
SOFT = 0.05 * 33.34114202 * 9.81
"""Where a falling robot's limits contradict each other, a force leaves its cone by less, N."""
CONTACT_KINDS = ("touch", "leave", "leave anyway")


def with_contacts(seed, steps):
    """Make some requests of a program requests for contacts; a foot is seldom torn away."""
    rng = np.random.default_rng(seed)
    kinds = [None, None, *CONTACT_KINDS[:2], *CONTACT_KINDS[:2], CONTACT_KINDS[2]]
    return [replace(step, kind=rng.choice(kinds) or step.kind) for step in steps]


standing_programs = st.builds(
    with_contacts, st.integers(0, 2**32 - 1), programs(SHORTEST, LONGEST, sizes=(5, 10))
)


def without_force(steps):
    """The same, but no foot is torn away: a robot that falls amplifies whatever differs."""
    kind = {CONTACT_KINDS[2]: CONTACT_KINDS[1]}
    return [replace(step, kind=kind.get(step.kind, step.kind)) for step in steps]


class StandingProgram(Program):
    """A program that also lets contacts come and go; ``wanted`` says which are to be there."""

    def __init__(self, stack, tasks, contacts, steps, initial):
        super().__init__(stack, tasks, steps, initial)
        self.contacts = contacts
        self.wanted = set(stack.contacts)

    def _ask(self, step, here):
        if step.kind not in CONTACT_KINDS:
            return super()._ask(step, here)
        contact = self.contacts[step.first % len(self.contacts)]
        if step.kind == "touch":
            self.stack.insert(contact, step.duration, profile=step.profile)
            self.wanted.add(contact.name)
        elif contact.name in self.stack.contacts:
            wait = step.kind == "leave"
            self.stack.remove(contact, step.duration, profile=step.profile, wait=wait)
            self.wanted.discard(contact.name)
        else:
            with pytest.raises(UnknownNameError):
                self.stack.remove(contact, step.duration)
        return set()


class Show:
    """G1 as a rigid robot whose closed contacts cannot move, and what a program made of it."""

    def __init__(self, steps, dt, kind=osc.Controller):
        self.robot, self.plant = osc.load_robot("g1"), osc.load_robot("g1")
        self.q, self.v, self.dt = self.robot.q_reference.copy(), np.zeros(self.robot.nv), dt
        feet = [
            osc.SoleContact(f"{side}_ankle_roll_link", HALF, offset=OFFSET, name=side)
            for side in ("left", "right")
        ]
        palm = osc.PointContact(
            "right_rubber_hand", normal=(-1.0, 0.0, 0.0), force=20.0, name="palm"
        )
        self.contacts = [*feet, palm]
        hand = self._placed("left_rubber_hand") + (0.04, 0.03, 0.05)
        tasks = [
            osc.ComTask(),
            osc.OrientationTask("torso_link", name="torso"),
            osc.PositionTask("left_rubber_hand", hand, name="hand"),
            osc.PositionTask("right_rubber_hand", name="other"),
            osc.PoseTask("right_ankle_roll_link", name="foot"),
            osc.AngularMomentumTask(name="calm"),
            osc.PostureTask(kp=25.0),
        ]
        stay = [tasks[0], tasks[1], tasks[6]]
        stack = osc.Stack([osc.JointLimits(), *stay], contacts=feet)
        self.controller = kind(
            self.robot,
            stack,
            torque_limits="priority",
            singularity=osc.Singularity(),
            falling=osc.FallRule(),
        )
        initial = {t.name: n for n, level in stack.levels_by_number.items() for t in level}
        self.program = StandingProgram(stack, tasks, self.contacts, steps, initial)
        self.taus, self.overlap, self.limited, self.ends = [], 0, 0, []
        self._play()

    def _placed(self, frame):
        self.plant.update(self.q, self.v)
        return self.plant.position(self.plant.frame_id(frame)).copy()

    def _play(self):
        per, tick = round(GRID / self.dt), 0
        self.command = self.controller.step(0.0, self.q, self.v)
        quiet = 0
        while quiet < 2.5 * LONGEST / self.dt and not self.fell:
            self._advance()
            tick += 1
            if tick % per == 0:
                self._request(tick // per)
            self.command = self.controller.step(tick * self.dt, self.q, self.v)
            quiet = quiet + 1 if self.program.done else 0
            self._check()

    def _request(self, tick):
        """Hand the program on; at most six changes run at a time."""
        now = tick * GRID
        self.ends = [end for end in self.ends if end > now]
        due = [step for at, step in self.program.schedule if at <= tick]
        moved = len(self.ends)
        self.program.play(tick, set(self.command.tasks), moved)
        self.ends += [now + step.duration for step in due][: self.program.overlap - moved]
        self.overlap = max(self.overlap, len(self.ends))

    def _check(self):
        command = self.command
        if self.fell:  # what is told of contacts is what was planned, and is not done
            return
        self.taus.append(command.tau)
        assert np.all(np.abs(command.tau) <= self.robot.torque_limit)
        assert np.all(command.tau[:6] == 0.0)
        lost = osc.Status.LIMIT_LOST in command.status
        for told in command.contacts.values():
            outside = told.cone_use - 1.0
            assert outside <= 1e-6 or (lost and outside * np.linalg.norm(told.force) <= SOFT)
            assert told.activation > 0.0 or not np.any(told.force)
        self.limited += osc.Status.FILTERED in command.status

    def _advance(self):
        """Move as a rigid robot does, and compare what its contacts feel."""
        plant = self.plant
        plant.update(self.q, self.v)
        closed = [c for c in self.contacts if self._holds(c.name)]
        terms = [contact.evaluate(plant) for contact in closed]
        J = np.concatenate([np.zeros((0, plant.nv)), *(t.J for t in terms)])
        gamma = np.concatenate([np.zeros(0), *(t.acceleration for t in terms)])
        m = gamma.size
        K = np.block([[plant.M, -J.T], [J, np.zeros((m, m))]])
        x = np.linalg.solve(K, np.concatenate([self.command.tau - plant.bias, gamma]))
        felt = np.split(x[plant.nv :], np.cumsum([t.acceleration.size for t in terms])[:-1])
        for contact, one, force in zip(closed, terms, felt, strict=False):
            gap = one.axes @ force[:3] - self.command.contacts[contact.name].force
            assert osc.Status.LIMIT_LOST in self.command.status or np.max(np.abs(gap)) < CLOSE
        self.v = self.v + self.dt * x[: plant.nv]
        self.q = plant.integrate(self.q, self.v, self.dt)

    @property
    def fell(self):
        """Whether the robot was given up: what it is asked for from then on is not done."""
        return osc.Status.FALLING in self.command.status

    def _holds(self, name):
        told = self.command.contacts.get(name)
        return told is not None and told.motion == 1.0

    def largest_step(self):
        return max(float(np.max(np.abs(b - a))) for a, b in pairwise(self.taus))


def assert_nothing_is_lost(show):
    if show.fell:
        return
    stack, command = show.controller.stack, show.command
    found = {t.name: n for n, level in stack.levels_by_number.items() for t in level}
    assert found == show.program.levels
    for name, told in command.contacts.items():
        if name in show.program.wanted:
            assert told.progress == 1.0
        else:
            assert told.waiting
            assert osc.Status.CONTACT_WAITS in command.status
    assert show.program.wanted <= set(command.contacts)
    assert stack.settled or any(told.waiting for told in command.contacts.values())


@examples(4)
@given(steps=standing_programs)
def test_whatever_is_asked_forces_and_torques_exist_and_nothing_is_lost(steps):
    assert_nothing_is_lost(Show(steps, 0.005))


def test_the_programs_do_overlap_and_reach_the_limits():
    """What the tests of this file draw from is not tame."""
    shows = []

    @settings(max_examples=3, database=None)
    @given(steps=standing_programs)
    def play(steps):
        shows.append(Show(steps, 0.01))

    play()
    assert max(show.overlap for show in shows) >= 5
    assert max(show.limited for show in shows) > 5


def test_contacts_and_tasks_are_asked_for_from_any_thread():
    """Each thread has one member of the stack, knows what is possible, and has it there in the end."""
    show = Show([], 0.01)
    stack, hand = show.controller.stack, show.program.tasks[2]
    wrong = []

    def ask(insert, remove):
        try:
            for _ in range(15):
                remove()
                time.sleep(1e-3)
                insert()
        except BaseException as error:
            wrong.append(error)

    for contact in show.contacts:
        stack.insert(contact, 0.0)
    stack.insert(hand, 0.5, 0.0)
    members = [(one,) for one in show.contacts] + [(hand, 0.5)]
    threads = [
        threading.Thread(
            target=ask,
            args=(partial(stack.insert, *one, 0.03), partial(stack.remove, one[0], 0.03)),
        )
        for one in members
    ]
    for thread in threads:
        thread.start()
    for tick in range(1, 100000):
        alive = any(thread.is_alive() for thread in threads)
        show.command = show.controller.step(10.0 + tick * show.dt, show.q, show.v)
        show._check()
        if not alive and stack.settled:
            break
    assert not wrong
    assert stack.settled
    assert all(told.progress == 1.0 for told in show.command.contacts.values())
    assert len(show.command.contacts) == len(show.contacts)
    assert show.command.tasks["hand"].activation == 1.0


@pytest.mark.slow
@settings(max_examples=30)
@given(steps=standing_programs)
def test_at_a_kilohertz_forces_and_torques_exist_and_nothing_is_lost(steps):
    assert_nothing_is_lost(Show(steps, 0.001))


@pytest.mark.slow
@settings(max_examples=6)
@given(steps=standing_programs)
def test_a_quarter_of_the_tick_makes_less_than_half_of_the_step(steps):
    """Nothing jumps: contacts, tasks and active limits come and go in as small steps as one likes."""
    shows = [Show(without_force(steps), dt) for dt in (0.001, 0.00025)]
    assume(not any(show.fell for show in shows))
    coarse, fine = (show.largest_step() for show in shows)
    print(coarse, fine)
    assert fine <= 0.5 * coarse + 1e-9

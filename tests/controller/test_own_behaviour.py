"""A subclass that overrides anything a tick asks for is honoured by either form of the controller."""

import numpy as np
import pytest

import opspace as osc
from opspace.kernels.columns import JOINTS, MOTION, OWN
from opspace.plan.pack_task import kind_of
from opspace.tasks.gains import Gains
from opspace.tasks.motion_task import MotionTask
from opspace.tasks.motions import WorldFrame
from opspace.tasks.quantities import Position
from tests.controller.test_compiled import Twins

ROBOT = ("puma560", "pinocchio")
GOAL = np.array([0.5, 0.1, 0.6])


class Terms(osc.PositionTask):
    def _terms(self, basis, **parts):
        terms = super()._terms(basis, **parts)
        return osc.TaskTerms(terms.J, terms.drift, 2.0 * terms.acceleration, terms.error)


class Desired(osc.PositionTask):
    def desired(self, robot, t):
        x, v, a = super().desired(robot, t)
        return osc.Sample(x + [0.0, 0.0, 0.1 * t], v, a)


class PrivateDesired(osc.PositionTask):
    def _desired(self, t, current):
        x, v, a = super()._desired(t, current)
        return osc.Sample(x + [0.1 * t, 0.0, 0.0], v, a)


class Between(MotionTask):
    """Comes after the built-in class in the order of resolution, and before its base."""

    def _terms(self, basis, **parts):
        terms = super()._terms(basis, **parts)
        return osc.TaskTerms(terms.J, terms.drift, 0.5 * terms.acceleration, terms.error)


class Mixed(osc.PositionTask, Between):
    pass


class MovingSource(osc.PositionTask):
    """A point that wanders along the tool."""

    @property
    def source(self):
        found = WorldFrame(self._frame, np.array([0.0, 0.0, 0.1 * self.shift]))
        if self._robot is not None:
            found.bind(self._robot)
        return found

    @source.setter
    def source(self, value):
        self._frame, self.shift = value.frame, 0.0

    def bind(self, robot):
        super().bind(robot)
        self.source.bind(robot)


class Doubled(Position):
    def error(self, motion, desired):
        return 2.0 * super().error(motion, desired)


class Shifted(WorldFrame):
    def measure(self, robot):
        found = super().measure(robot)
        return type(found)(
            found.position + 0.1, found.rotation, found.velocity, found.J, found.drift
        )


class Careful(Gains):
    def acceleration(self, error, velocity_error, feedforward):
        return 0.1 * super().acceleration(error, velocity_error, feedforward)


class SoftGains(osc.PositionTask):
    def _set_gains(self, kp, kv, max_speed):
        super()._set_gains(kp, kv, max_speed)
        found = self._gains
        self._gains = Careful(found.kp, found.kv, found.critical, found.max_speed, found.groups)


class LazyPosture(osc.PostureTask):
    def desired(self, robot, t):
        x, v, a = super().desired(robot, t)
        return osc.Sample(0.5 * x, v, a)


class SoftJoint(osc.JointTask):
    def evaluate(self, robot, t):
        terms = super().evaluate(robot, t)
        return osc.TaskTerms(terms.J, terms.drift, 0.5 * terms.acceleration, terms.error)


def own_parts(source=None, quantity=None):
    def make():
        return MotionTask(
            "own",
            source=source or WorldFrame(None),
            quantity=quantity or Position(),
            target=GOAL,
            selection=np.eye(3),
            axes_frame="world",
            kp=100.0,
            kv=None,
            max_speed=None,
        )

    return make


def within(kind):
    """A method of the instance, which only its own methods may set."""

    class Inside(kind):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            plain = super().evaluate
            self.evaluate = lambda robot, t: plain(robot, t + 0.1)

    return Inside


def moved(t):
    return osc.Sample(GOAL + [0.0, 0.1 * t, 0.0], np.array([0.0, 0.1, 0.0]), np.zeros(3))


OVERRIDING = {
    "_terms": lambda: Terms(target=GOAL),
    "desired": lambda: Desired(target=GOAL),
    "desired, holding": Desired,
    "_desired": lambda: PrivateDesired(target=GOAL),
    "a base between": lambda: Mixed(target=GOAL),
    "source as a property": lambda: MovingSource(target=GOAL),
    "a source of one's own": own_parts(source=Shifted(None)),
    "a quantity of one's own": own_parts(quantity=Doubled()),
    "gains of one's own": lambda: SoftGains(target=GOAL),
    "desired of a posture": lambda: LazyPosture(name="low"),
    "evaluate of a joint": lambda: SoftJoint("joint2", 0.3),
    "evaluate of the instance": lambda: within(osc.PositionTask)(target=moved),
}


def commands(make):
    twins = Twins(ROBOT, lambda: [make(), osc.PostureTask()])
    q = twins.robot.q_reference + 0.1
    return twins, [twins.step(t, q, np.full(6, 0.1)).tau for t in (0.0, 0.5, 1.0)]


@pytest.mark.parametrize("what", OVERRIDING)
def test_what_is_overridden_is_honoured_by_both_forms(what):
    twins, taus = commands(OVERRIDING[what])
    task = next(iter(twins.stacks[0]))
    assert kind_of(task) == OWN
    built_in = osc.PostureTask(name="low") if isinstance(task, LazyPosture) else None
    if isinstance(task, SoftJoint):
        built_in = osc.JointTask("joint2", 0.3)
    plain = commands(lambda: built_in or osc.PositionTask(target=task.target))[1]
    if what != "source as a property":  # its shift is still 0
        assert any(np.abs(a - b).max() > 1e-3 for a, b in zip(taus, plain, strict=True))


def test_a_source_that_is_computed_anew_is_followed():
    twins = Twins(ROBOT, lambda: [MovingSource(target=GOAL), osc.PostureTask()])
    q, found = twins.robot.q_reference + 0.1, []
    for k in range(3):
        for stack in twins.stacks:
            next(iter(stack)).shift = float(k)
        found.append(twins.step(0.001 * k, q, np.zeros(6)).tau)
    assert np.abs(found[2] - found[0]).max() > 1e-3


class Plain(osc.PositionTask):
    """Overrides nothing that a tick asks for."""

    def __init__(self):
        super().__init__(target=GOAL, name="plain")
        self.note = "mine"

    def bind(self, robot):
        super().bind(robot)

    def __repr__(self):
        return "plain"

    def more(self):
        return self.note


@pytest.mark.parametrize(
    ("task", "kind"),
    [
        (osc.PositionTask(), MOTION),
        (Plain(), MOTION),
        (own_parts()(), MOTION),
        (osc.PostureTask(), JOINTS),
        (osc.JointTask("joint1"), JOINTS),
    ],
)
def test_what_overrides_nothing_stays_compiled(task, kind):
    assert kind_of(task) == kind

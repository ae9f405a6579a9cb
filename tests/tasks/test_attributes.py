"""Names that nothing would read are refused; tasks of one's own keep what they like."""

import pytest

import opspace as osc


class Mine(osc.PositionTask):
    """A task with an attribute of every sort."""

    declared: float
    constant = 1.0

    def __init__(self):
        self.before = 1
        super().__init__(name="mine")
        self.made = self._hidden = 2

    def bind(self, robot):
        super().bind(robot)
        self.found = robot.tool

    @property
    def wish(self):
        return self.made

    @wish.setter
    def wish(self, value):
        self.made = value

    def later(self):
        def callback():
            self.learnt = 3

        callback()


class Loud(Mine):
    def __setattr__(self, name, value):
        super().__setattr__(name, value)


@pytest.mark.parametrize(
    ("thing", "wrong", "right"),
    [
        (osc.PositionTask(), "taget", "target"),
        (osc.PostureTask(), "max_sped", "max_speed"),
        (osc.JointLimits(), "clearence", "clearance"),
        (osc.JointLimits(), "bufer", "buffer"),
        (Mine(), "foundd", "wish"),
        (Mine(), "wihs", "wish"),
        (Loud(), "declard", "declared"),
        (Loud(), "mad", "made"),
    ],
)
def test_an_unknown_attribute_is_refused(thing, wrong, right):
    with pytest.raises(
        osc.UnknownNameError, match=f"attribute of {type(thing).__name__} '{wrong}'"
    ) as e:
        setattr(thing, wrong, 1.0)
    assert e.value.name == wrong
    assert right in e.value.choices
    assert not hasattr(thing, wrong)


def test_the_near_match_is_named_and_no_method_is_offered():
    with pytest.raises(osc.UnknownNameError, match="did you mean 'target' or") as e:
        osc.PositionTask().taget = [0.0, 0.0, 0.0]
    assert not {"evaluate", "bind", "holds_nothing_yet"} & set(e.value.choices)


@pytest.mark.parametrize("kind", [Mine, Loud])
def test_a_task_of_ones_own_has_what_its_methods_make_and_its_class_declares(kind):
    task = kind()
    task.bind(osc.load_robot("puma560"))
    task.later()
    for name in ("declared", "constant", "before", "made", "_hidden", "found", "wish", "learnt"):
        setattr(task, name, 5.0)
        assert getattr(task, name) == 5.0


def test_a_method_is_overridden_and_not_assigned_to():
    task = osc.PositionTask()
    with pytest.raises(osc.InputError, match="desired is a method of PositionTask: override it"):
        task.desired = lambda robot, t: None
    task.activation = lambda robot, t: 1.0


def test_a_method_that_happens_to_hold_a_task_may_not_name_anything_new():
    class Elsewhere:
        def tune(self, task):
            task.taget = 1.0

    with pytest.raises(osc.UnknownNameError):
        Elsewhere().tune(osc.PositionTask())

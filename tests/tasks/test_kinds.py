"""One table of task kinds: what a scenario can say follows from the constructor."""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import opspace
from opspace.scenario.task_entries import make_entry
from opspace.tasks import TASK_KINDS, PositionTask
from opspace.tasks.kinds import TaskKind


class HeightTask(PositionTask):
    """Keeps the tool at a height.

    Args:
        frame: Name of the frame; None is the robot's tool.
        weight: How much it counts, 1.
        slow: Whether it takes its time.
        name: Name of the task.
    """

    def __init__(
        self,
        frame: str | None = None,
        *,
        weight: float,
        slow: bool = False,
        max_speed: float | None = None,
        name: str = "height",
    ) -> None:
        super().__init__(frame, axes="z", name=name, max_speed=max_speed)
        self.weight, self.slow = weight, slow


ENTRY = make_entry("height", TaskKind(HeightTask, "position"))


def test_a_new_kind_has_the_keys_defaults_and_units_of_its_constructor():
    fields = ENTRY.model_fields
    own = {"type", "level", "present", "activation", "kp", "kv"}
    assert set(fields) - own == set(inspect.signature(HeightTask).parameters) - {"name"}
    assert fields["weight"].is_required()
    assert fields["weight"].description == "How much it counts, 1"
    assert fields["slow"].default is False
    with pytest.raises(ValueError, match=re.escape("must be a number above 0 [m/s], not -1")):
        ENTRY(type="height", level=0, weight=1.0, max_speed=-1)
    with pytest.raises(ValueError, match="did you mean 'weight'"):
        ENTRY(type="height", level=0, wieght=1.0)


@pytest.mark.parametrize(
    "name", ["com", "relative_position", "relative_orientation", "relative_pose"]
)
def test_a_kind_that_nothing_else_is_made_of_is_named_in_three_files(name):
    source = Path(opspace.__file__).parent
    word = re.compile(rf"\b{TASK_KINDS[name].task.__name__}\b")
    told = {
        file.relative_to(source).as_posix()
        for file in source.rglob("*.py")
        if file.parent.name != "bench" and word.search(file.read_text(encoding="utf-8"))
    }
    own = f"tasks/{name.split('_')[0]}.py"
    assert told == {own, "tasks/__init__.py", "__init__.py"}


@pytest.mark.parametrize(("name", "kind"), TASK_KINDS.items())
def test_what_a_kind_controls_is_what_its_task_measures(name, kind):
    needed = [
        "joint1" if key == "joint" else "base"
        for key, argument in inspect.signature(kind.task).parameters.items()
        if argument.default is argument.empty
    ]
    task = kind.task(*needed)
    motion = {"position": "Position", "orientation": "Orientation", "pose": "Pose"}
    found = getattr(task, "quantity", None)
    assert type(found).__name__ == motion.get(kind.controls, "NoneType"), name
    stiffness = 0.0 if kind.controls == "momentum" or kind.sprung else 100.0
    assert np.all(np.asarray(task.kp) == stiffness)

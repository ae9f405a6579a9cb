"""What a fleet cannot do is refused by name."""

from __future__ import annotations

from opspace.controller import Controller
from opspace.errors import InputError
from opspace.kernels.columns import OWN
from opspace.plan.pack_task import kind_of
from opspace.tasks import ForceTask, ImpedanceTask, Task, TrackingTask


def check_robot(controller: Controller) -> None:
    """Check that robots of this kind can be computed in a fleet.

    Raises:
        InputError: They cannot.
    """
    robot, limits = controller.robot, controller.stack.limits
    if getattr(robot, "floating_base", False):
        raise InputError(
            f"robot {robot.name!r} has a floating base; a fleet takes robots that are bolted down"
        )
    if controller.stack.contacts:
        raise InputError("a fleet takes no contacts; its robots are bolted down")
    if limits is not None and limits.observer_time is not None:
        raise InputError(
            "joint limits with an observer_time learn from tick to tick, which a fleet does not; "
            "give JointLimits none"
        )


def check_task(task: Task) -> TrackingTask:
    """Return a task that a fleet can evaluate.

    Raises:
        InputError: It cannot.
    """
    what = f"task {task.name!r} ({type(task).__name__})"
    if isinstance(task, ForceTask | ImpedanceTask):
        raise InputError(f"{what} needs a wrench; a fleet takes tasks of motion and of joints")
    if kind_of(task) == OWN or not isinstance(task, TrackingTask):
        raise InputError(f"{what} is evaluated in Python; a fleet takes the library's own tasks")
    if task.activation is not None:
        raise InputError(
            f"{what} has an activation of its own, which is Python; write what it would give into "
            f"fleet[{task.name!r}].activation"
        )
    if task.ki is not None:
        raise InputError(f"{what} has integral action (ki), which a fleet has not")
    if task.max_acceleration is not None:
        raise InputError(
            f"{what} goes to new targets on a way (max_acceleration), which a fleet does not; move "
            f"fleet[{task.name!r}].target along one"
        )
    if callable(task.target):
        raise InputError(
            f"{what} follows a reference in time, which is Python; write its values into "
            f"fleet[{task.name!r}].target, velocity and acceleration"
        )
    return task

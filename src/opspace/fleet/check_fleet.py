"""What a fleet cannot do is refused by name."""

from __future__ import annotations

from opspace.controller import Controller
from opspace.errors import InputError, unknown_name
from opspace.kernels.columns import MOMENTUM, OWN
from opspace.plan.pack_task import kind_of
from opspace.tasks import ForceTask, Task, TrackingTask


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


DYNAMICS = ("own", "given")


def check_dynamics(dynamics: str, period: float | None) -> bool:
    """Tell whether dynamics are given.

    Raises:
        UnknownNameError: They come from elsewhere.
        InputError: They are needed between two steps, too.
    """
    if dynamics not in DYNAMICS:
        raise unknown_name("dynamics", dynamics, DYNAMICS)
    if dynamics == "given" and period is not None:
        raise InputError(
            "with a period, joint limits need the dynamics between two steps as well; a fleet with "
            "dynamics='given' takes none"
        )
    return dynamics == "given"


def check_task(task: Task, *, given: bool) -> TrackingTask | ForceTask:
    """Return a task that a fleet can evaluate.

    Args:
        task: The task.
        given: Whether dynamics are given.

    Raises:
        InputError: It cannot.
    """
    what = f"task {task.name!r} ({type(task).__name__})"
    if kind_of(task) == OWN or not isinstance(task, TrackingTask | ForceTask):
        raise InputError(f"{what} is evaluated in Python; a fleet takes the library's own tasks")
    if given and kind_of(task) == MOMENTUM:
        raise InputError(f"{what} needs the robot's own dynamics; they are given")
    if task.activation is not None:
        raise InputError(
            f"{what} has an activation of its own, which is Python; write what it would give into "
            f"fleet[{task.name!r}].activation"
        )
    if isinstance(task, TrackingTask) and callable(task.target):
        raise InputError(
            f"{what} follows a reference in time, which is Python; write its values into "
            f"fleet[{task.name!r}].target, velocity and acceleration"
        )
    return task

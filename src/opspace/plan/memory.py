"""Make the arrays of a tick; those that a report reads later lie in one block."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from opspace.kernels.columns import (
    KIND_SIZE,
    NUMBERS_SIZE,
    VARIABLE_SIZE,
    Tick,
)
from opspace.kernels.inertia import inertia_handle, make_inertia
from opspace.kernels.projection import bounds_handle, make_bounds
from opspace.machine.record import Handle
from opspace.plan.space import Space, make_space, space_handle
from opspace.robots.motion_axes import MotionAxes


class Sizes(NamedTuple):
    """Sizes of a plan.

    Attributes:
        n: Joints.
        tasks: Tasks.
        rows: Rows of all tasks.
        slot_rows: Rows of all places of tasks.
        slots: Places of tasks.
        levels: Levels of the stack.
        variables: Activations in time.
        limits: Joint limits, sides counted.
        corners: Corners that the blend can have.
    """

    n: int
    tasks: int
    rows: int
    slot_rows: int
    slots: int
    levels: int
    variables: int
    limits: int
    corners: int


class Block:
    """One piece of memory that arrays are cut from, so that one copy keeps all of them."""

    def __init__(self, size: int) -> None:
        self.memory = np.zeros(size)
        self._used = 0

    def take(self, *shape: int) -> np.ndarray:
        """Cut an array of numbers."""
        size = math.prod(shape)
        part = self.memory[self._used : self._used + size].reshape(shape)
        self._used += size
        return part

    def take_integers(self, count: int) -> np.ndarray:
        """Cut an array of whole numbers."""
        return self.take(count).view(np.int64)


def reported(size: Sizes, block: Block) -> dict[str, np.ndarray]:
    """Cut what a tick writes and a report reads, in the same order from every block."""
    return {
        "tau": block.take(size.n),
        "h": block.take(size.tasks),
        "share": block.take(size.slots),
        "error": block.take(size.rows),
        "limit_h": block.take(size.limits),
        "scale": block.take(size.levels + 2),
        "top": block.take(size.levels + 2),
        "chosen": block.take_integers(size.levels + 2),
        "width": block.take_integers(size.levels + 2),
        "kept": block.take(size.slot_rows, size.n),
    }


def reported_size(size: Sizes) -> int:
    """Numbers that `reported` takes."""
    beside = size.n + size.tasks + size.slots + size.rows + size.limits
    return beside + 4 * (size.levels + 2) + size.slot_rows * size.n


def make_tick(
    size: Sizes, axes: MotionAxes, torque_limit: np.ndarray, option: np.ndarray
) -> tuple[Tick, Space, np.ndarray]:
    """Make the arrays of a tick.

    Args:
        size: Sizes of the plan.
        axes: The robot's arrays.
        torque_limit: (n,) what the motors give, N·m.
        option: (OPTION_SIZE,) options of the controller.

    Returns:
        The arrays, the memory of the walk, and the block that holds what is reported.
    """
    block = Block(reported_size(size))
    kept = reported(size, block)
    limit = np.array(torque_limit)  # one that may be written, like all the others
    inertia = inertia_handle(make_inertia(_before(axes)))
    space = make_space(size.n, size.levels + 1, size.rows + size.limits, inertia)._replace(
        top=kept.pop("top"),
        chosen=kept.pop("chosen"),
        width=kept.pop("width"),
        kept=kept.pop("kept"),
        limit=limit,
    )
    integers = np.int64
    tick = Tick(
        q=axes.q,
        v=axes.v,
        M=axes.M,
        bias=axes.bias,
        axes=axes.axes,
        placement=axes.placement,
        parent=np.array(axes.parent, integers),
        mass_place=np.array([[m.body, m.joint] for m in axes.masses], integers).reshape(-1, 2),
        mass=np.array([[m.mass, *m.centre] for m in axes.masses]).reshape(-1, 4),
        kind=np.zeros((size.tasks, KIND_SIZE), integers),
        numbers=np.zeros((size.tasks, NUMBERS_SIZE)),
        coordinate=np.zeros(size.rows, integers),
        select=np.zeros((size.rows, 6)),
        goal=np.zeros((size.rows, 3)),
        kp=np.zeros(size.rows),
        kv=np.zeros(size.rows),
        row_weight=np.ones(size.rows),
        variable=np.zeros((size.variables, VARIABLE_SIZE)),
        group=np.zeros(size.variables, integers),
        slots=np.zeros((size.slots, 3), integers),
        slot_on=np.zeros(size.slots, integers),
        slot_off=np.zeros(size.slots, integers),
        slot_place=np.zeros(size.slots, integers),
        own=np.ones(size.tasks),
        limit_joint=np.zeros(size.limits, integers),
        limit=np.zeros((size.limits, 7)),
        torque_limit=limit,
        option=option,
        **kept,
        **_scratch(size),
    )
    return tick, space, block.memory


def _before(axes: MotionAxes) -> np.ndarray:
    """Return the coordinate before each one; an inertia that is not ours may couple any two."""
    n = axes.v.size
    return axes.parent if axes.bodies.kind.size else np.arange(n) - 1


def _scratch(size: Sizes) -> dict[str, np.ndarray]:
    """Make what no one reads after the tick."""
    n, integers = size.n, np.int64
    rows, limits = size.rows, size.limits
    return {
        "wanted": np.zeros(rows),
        "limit_wanted": np.zeros(limits),
        "J": np.zeros((rows, n)),
        "Jw": np.zeros((rows + limits, n)),
        "drift": np.zeros(rows),
        "fw": np.zeros(rows + limits),
        "velocity": np.zeros((n, 6)),
        "acceleration": np.zeros((n, 6)),
        "motion": np.zeros((3, 24)),
        "motion_J": np.zeros((3, 6, n)),
        "motion_error": np.zeros(6),
        "value": np.zeros(size.variables),
        "chained": np.zeros(size.variables, integers),
        "order": np.zeros(size.variables + 1, integers),
        "corner_on": np.zeros(2 * size.corners, integers),
        "corner_weight": np.zeros(2 * size.corners),
        "limit_on": np.zeros((limits + 1, limits), integers),
        "limit_weight": np.zeros(limits + 1),
        "limit_order": np.zeros(limits + 1, integers),
        "rest": np.zeros(n + 1),
        "u": np.zeros(n),
        "drop": np.zeros(n),
        "joint_acceleration": np.zeros(n),
    }


def tick_handle(t: Tick, space: Space, axes: MotionAxes) -> Handle:
    """Make the handle with which compiled functions reach a `Tick`, its walk, and the robot."""
    bodies = Handle("RigidBodies", axes.bodies._asdict())
    dynamics = Handle("Dynamics", axes.dynamics._asdict())
    bounds = bounds_handle(make_bounds(t.v.size))
    return Handle(
        "Tick",
        {
            **t._asdict(),
            "inertia": space.inertia,
            "space": space_handle(space),
            "bodies": bodies,
            "dynamics": dynamics,
            "bounds": bounds,
        },
    )

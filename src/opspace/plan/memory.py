"""Make the arrays of a tick; those that a report reads later lie in one block."""

from __future__ import annotations

from functools import lru_cache
from struct import unpack_from
from typing import NamedTuple

import numpy as np

from opspace.kernels.stance_columns import SOLE_ROWS
from opspace.machine.field_table import Block, Record
from opspace.machine.lanes import whole
from opspace.plan.bound_records import BOUNDS
from opspace.plan.contact_records import no_stance
from opspace.plan.distance_records import DISTANCES
from opspace.plan.led_records import LED
from opspace.plan.records import INERTIA, SPACE, TICK
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.motor_range import MotorRange


class Sizes(NamedTuple):
    """Sizes of a plan; `opspace.plan.records.SIZES` says of what."""

    n: int
    tasks: int
    rows: int
    slot_rows: int
    slots: int
    levels: int
    variables: int
    limits: int
    corners: int
    balls: int = 0
    sets: int = 0
    faces: int = 0
    distances: int = 0
    contacts: int = 0
    presses: int = 0
    led: int = 0
    led_rows: int = 0

    def by_name(self) -> dict[str, int]:
        """Return them as the tables of `opspace.plan.records` take them."""
        widest = max(self.rows + self.limits, self.n, SOLE_ROWS * self.contacts, 1)
        return {**self._asdict(), "widest": widest}


class Reported:
    """What a tick wrote and a report reads, in a copy of its block.

    Args:
        size: Sizes of the plan.
        memory: The copy.
    """

    def __init__(self, size: Sizes, memory: bytes) -> None:
        self._places = _places(size)
        self._memory = memory

    def __getitem__(self, name: str) -> np.ndarray:
        """Cut one array out; a person rarely asks for all of them."""
        start, count, dtype, shape = self._places[name]
        found = np.frombuffer(self._memory, dtype, count, start) if count else np.empty(0, dtype)
        return found if len(shape) == 1 else found.reshape(shape)

    def numbers(self, name: str) -> tuple[float, ...]:
        """Read one array as plain numbers, which for a few is faster."""
        start, count, dtype, _ = self._places[name]
        kind = "q" if dtype is np.int64 else "d"
        return unpack_from(f"={count}{kind}", self._memory, start)


@lru_cache(maxsize=64)
def _places(size: Sizes) -> dict[str, tuple[int, int, type, tuple[int, ...]]]:
    """Tell where each array begins in the block, how many numbers it has, of what type and shape."""
    sizes = size.by_name()
    block = Block(np.zeros(TICK.reported_size(sizes) + SPACE.reported_size(sizes)))
    found: dict[str, tuple[int, int, type, tuple[int, ...]]] = {}
    start = 0
    for name, part in {**TICK.reported(sizes, block), **SPACE.reported(sizes, block)}.items():
        found[name] = (start, part.size, part.dtype.type, part.shape)
        start += part.nbytes
    return found


def make_tick(
    size: Sizes,
    axes: MotionAxes,
    motors: MotorRange,
    option: np.ndarray,
    stance: Record | None = None,
) -> tuple[Record, np.ndarray]:
    """Make the arrays of a tick.

    Args:
        size: Sizes of the plan.
        axes: The robot's arrays.
        motors: What the motors give.
        option: (OPTION_SIZE,) options of the controller.
        stance: What the robot touches, a `STANCE`; None where it is bolted down.

    Returns:
        The arrays, a `TICK`, and the block that holds what is reported.
    """
    sizes = size.by_name()
    block = Block(np.zeros(TICK.reported_size(sizes) + SPACE.reported_size(sizes)))
    kept = TICK.reported(sizes, block)
    limit = np.array(motors.limit)  # one that may be written, like all the others
    inertia = make_inertia(_before(axes))
    space = {"inertia": inertia, "limit": limit, **SPACE.reported(sizes, block)}
    given = {
        **{name: getattr(axes, name) for name in ("q", "v", "M", "bias", "axes", "placement")},
        "later_q": np.zeros(axes.q.size),
        "parent": np.array(axes.parent, np.int64),
        "carried_by": _carried_by(axes.parent),
        "mass_place": axes.masses.place,
        "mass": axes.masses.points,
        "torque_limit": limit,
        "torque_middle": np.array(motors.middle),
        "option": option,
        "inertia": inertia,
        "space": SPACE.make(sizes, space),
        "bodies": axes.bodies,
        "dynamics": axes.dynamics,
        "later": axes.later,
        "later_inertia": make_inertia(_before(axes)),
        "bounds": BOUNDS.make(sizes),
        "distances": DISTANCES.make(sizes),
        "led": LED.make(sizes),
        "stance": no_stance() if stance is None else stance,
    }
    return TICK.make(sizes, {**kept, **given}), block.memory


def _carried_by(parent: np.ndarray) -> np.ndarray:
    """Return for every joint, by rows, which joints carry it, itself included."""
    n = parent.size
    found = np.zeros((n, whole(n)))
    for a in range(n):
        if parent[a] >= 0:
            found[a] = found[parent[a]]
        found[a, a] = 1.0
    return found


def _before(axes: MotionAxes) -> np.ndarray:
    """Return the coordinate before each one; an inertia that is not ours may couple any two."""
    n = axes.v.size
    return axes.parent if axes.bodies.kind.size else np.arange(n) - 1


def make_inertia(before: np.ndarray) -> Record:
    """Make the memory for the factor of a tree, or of a chain where its branches are not in order."""
    n = before.size
    end, carried = np.arange(1, n + 1), np.ones(n, np.int64)
    for a in range(n - 1, -1, -1):
        if before[a] >= 0:
            end[before[a]] = max(end[before[a]], end[a])
            carried[before[a]] += carried[a]
    if not np.array_equal(end - np.arange(n), carried):
        return make_inertia(np.arange(n) - 1)
    start = list(range(n))
    for a, b in enumerate(before.tolist()):
        if 0 <= b == a - 1:
            start[a] = start[b]
    given = {"before": np.array(before, np.int64), "start": np.array(start, np.int64), "end": end}
    return INERTIA.make({"n": n}, given)

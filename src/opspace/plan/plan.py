"""A stack between two changes, laid out for the compiled tick."""

from __future__ import annotations

from collections.abc import Sequence
from struct import pack_into

import numpy as np

from opspace.kernels.columns import (
    LIMIT_BOUND,
    LIMIT_BUFFER,
    LIMIT_K1,
    LIMIT_K2,
    LIMIT_KP,
    LIMIT_LAW,
    LIMIT_PROFILE,
    LIMIT_WEIGHT,
)
from opspace.kernels.limit_columns import DISTURBANCE, SIGN, SPEED
from opspace.law import PROFILES
from opspace.law.scalars import NO_GROUP
from opspace.machine.field_table import Record
from opspace.plan.memory import Sizes, make_tick
from opspace.plan.pack_task import Packed
from opspace.plan.scales import Scales
from opspace.robots.adapter import AdapterBase
from opspace.robots.motion_axes import MotionAxes
from opspace.stack import Blending, Member, Variable
from opspace.tasks import JointLimits
from opspace.tasks.task import CHANGES

MOST = 62
"""Bits of a corner: more tasks, places or activations than this take the readable tick."""


class Plan:
    """The arrays of one set of tasks and transitions; any change makes another plan.

    Args:
        members: The tasks.
        axes: The robot's arrays.
        scales: What σ is measured in.
        limits: Joint limits, or None.
        torque_limit: (n,) what the motors give, N·m.
        options: Numbers of the controller's options, (OPTION_SIZE,).
        blending: How activations are blended.
    """

    def __init__(
        self,
        members: tuple[Member, ...],
        axes: MotionAxes,
        scales: Scales,
        limits: JointLimits | None,
        torque_limit: np.ndarray,
        options: np.ndarray,
        blending: Blending,
    ) -> None:
        self.members = members
        self.structure = structure(members)
        self.axes = axes
        self.limits = limits
        self.n = axes.v.size
        self.variables: list[Member | Variable] = [*members, *_arrivals(members)]
        self.levels = sorted({place.level for m in members for place in m.places})
        self.places = sorted(
            ((p.level, i, k) for i, m in enumerate(members) for k, p in enumerate(m.places)),
            key=lambda place: place[:2],
        )
        self.size = Sizes(
            n=axes.v.size,
            tasks=len(members),
            rows=sum(member.task.rows for member in members),
            slot_rows=sum(members[i].task.rows for _, i, _ in self.places),
            slots=len(self.places),
            levels=len(self.levels),
            variables=len(self.variables),
            limits=0 if limits is None else len(limits.sides),
            corners=blending.most_corners(len(self.variables)),
        )
        self.tick, self.memory = make_tick(self.size, axes, torque_limit, options)
        self.seen: object = None
        self.moving = False
        self.packed = self._pack(scales)
        self._ramps = self.tick.variable.reshape(-1).view(np.uint8).data
        self._pack_variables()
        self._pack_slots()
        self.first_kept = self.tick.space.first_kept
        depth, rows = self.tick.slots[:, 0], self.tick.slots[:, 2]
        self.first_kept[:] = [rows[depth < d].sum() for d in range(self.first_kept.size)]
        if limits is not None:
            _pack_limits(limits, scales, self.tick)
        self.handle = self.tick.handle()

    @staticmethod
    def fits(members: Sequence[Member]) -> bool:
        """Tell whether the bit sets are wide enough."""
        places = sum(len(member.places) for member in members)
        return len(members) + places <= MOST

    def refresh(self, robot: AdapterBase, t: float) -> None:
        """Bring targets, gains, and what users compute themselves up to date.

        Nothing is to be done while ``seen`` is the last change there was and nothing is ``moving``.

        Args:
            robot: The robot at the present state.
            t: Time, s.

        Raises:
            InputError: A reference, activation or task gave unusable numbers.
        """
        last = CHANGES.last  # before the look at the tasks: what changes meanwhile is seen next
        for packed in self.packed:
            packed.refresh(robot, t)
        self.moving = any(packed.moving for packed in self.packed)
        self.seen = last

    def disturb(self, acceleration: np.ndarray) -> None:
        """Tell the joint limits what comes on top of the commanded accelerations, (n,) rad/s²."""
        tick = self.tick
        tick.limit[:, DISTURBANCE] = tick.limit[:, SIGN] * acceleration[tick.limit_joint]

    def groups(self) -> dict[object, int]:
        """Return the group of the blend that each activation is in."""
        return dict(zip(self.variables, self.tick.group.tolist(), strict=True))

    def go_on_from(self, before: Plan | None, members: tuple[Member, ...]) -> None:
        """Take these tasks, of the same structure, and keep what the plan before remembers of them.

        Args:
            before: The plan before, which may be this one: groups of the blend, turns of rotations.
            members: The tasks with their ramps.
        """
        variables = [*members, *_arrivals(members)]
        if before is not self or variables != self.variables:
            self._take_over(before, members, variables)
        self._pack_variables()

    def _take_over(
        self, before: Plan | None, members: tuple[Member, ...], variables: list[Member | Variable]
    ) -> None:
        groups = {} if before is None else before.groups()
        known = {} if before is None else {p.member: p for p in before.packed}
        self.members, self.variables = members, variables
        self.tick.group[:] = [groups.get(v, NO_GROUP) for v in variables]
        for packed, member in zip(self.packed, members, strict=True):
            packed.member = member
            packed.remember(known.get(member))
        self.seen = None  # a target may have gone on meanwhile

    def forget_ways(self) -> None:
        """Let all angles take the short way at the next tick."""
        for packed in self.packed:
            packed.forget()

    def leave(self, members: Sequence[Member], blending: Blending) -> None:
        """Let the readable form go on with these tasks where this plan was at the tick before."""
        blending.remember(self.groups())
        for packed in self.packed:
            if packed.member in members:
                packed.leave()

    def come_back(self, blending: Blending) -> None:
        """Go on where the readable form was at the tick before."""
        groups = blending.remembered()
        self.tick.group[:] = [groups.get(v, NO_GROUP) for v in self.variables]
        for packed in self.packed:
            packed.come_back()
        self.seen = None

    def _pack(self, scales: Scales) -> list[Packed]:
        packed: list[Packed] = []
        first = 0
        for i, member in enumerate(self.members):
            entry = Packed(member, i, first, self.axes, self.tick)
            self.tick.row_weight[entry.rows] = 1.0 / np.sqrt(scales.reference(member.task))
            first = entry.rows.stop
            packed.append(entry)
        return packed

    def _pack_variables(self) -> None:
        rows: list[float] = []
        for variable in self.variables:
            ramp = (variable.presence if isinstance(variable, Member) else variable).ramp
            rows += (PROFILES.index(ramp.profile), *ramp.numbers)
        # As bytes: an array takes twice as long to read a list.
        pack_into(f"{len(rows)}d", self._ramps, 0, *rows)

    def _pack_slots(self) -> None:
        tick = self.tick
        index = {id(v): i for i, v in enumerate(self.variables)}
        rank = {level: k for k, level in enumerate(self.levels)}
        for s, (level, i, k) in enumerate(self.places):
            member, packed = self.members[i], self.packed[i]
            place = member.places[k]
            chosen = 0 if place.arrival is None else 1 << index[id(place.arrival)]
            later = [p.arrival for p in member.places[k + 1 :]]
            tick.slots[s] = rank[level] + 1, packed.rows.start, member.task.rows
            tick.slot_place[s] = chosen
            tick.slot_on[s] = chosen | 1 << i
            tick.slot_off[s] = sum({1 << index[id(arrival)] for arrival in later})


def structure(members: Sequence[Member]) -> tuple[object, ...]:
    """Tell what a plan is laid out for: which tasks are at which levels, moved by how many ramps."""
    found: list[object] = []
    seen: dict[Variable | None, int] = {}
    for member in members:
        found += (id(member.task), len(member.places))
        for place in member.places:
            found += (place.level, seen.setdefault(place.arrival, len(seen)))
    return tuple(found)


def _arrivals(members: Sequence[Member]) -> list[Variable]:
    """List the activations that move tasks between places, each once."""
    found: dict[int, Variable] = {}
    for member in members:
        for place in member.places[1:]:  # the first place has none
            assert place.arrival is not None
            found.setdefault(id(place.arrival), place.arrival)
    return list(found.values())


def _pack_limits(limits: JointLimits, scales: Scales, tick: Record) -> None:
    for i, side in enumerate(limits.sides):
        tick.limit_joint[i] = side.index
        tick.limit[i, : SPEED + 1] = (
            side.sign,
            side.limit,
            side.brake,
            limits.margin(side),
            0.0,
            side.speed,
        )
    option = tick.option
    option[LIMIT_LAW], option[LIMIT_BOUND] = limits.law.code, limits.law.bound
    option[LIMIT_PROFILE] = PROFILES.index(limits.profile)
    option[LIMIT_WEIGHT] = 1.0 / np.sqrt(scales.joint)
    option[[LIMIT_K1, LIMIT_K2, LIMIT_KP]] = limits.k1, limits.k2, limits.kp
    option[LIMIT_BUFFER] = limits.buffer

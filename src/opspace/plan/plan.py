"""A stack between two changes, laid out for the compiled tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from struct import Struct
from typing import NamedTuple

import numpy as np

from opspace.kernels.columns import (
    FORCE,
    LIMIT_BOUND,
    LIMIT_BUFFER,
    LIMIT_K1,
    LIMIT_K2,
    LIMIT_KP,
    LIMIT_LAW,
    LIMIT_PROFILE,
    LIMIT_WEIGHT,
    VARIABLE_SIZE,
)
from opspace.kernels.limit_columns import DISTURBANCE, SIGN, SPEED
from opspace.law import PROFILES, Ramp
from opspace.law.scalars import MOST_UNREST, NO_GROUP
from opspace.machine.field_table import Record
from opspace.machine.record import WORD
from opspace.plan.memory import Sizes, make_tick
from opspace.plan.pack_contacts import PackedContacts
from opspace.plan.pack_distances import PackedDistances
from opspace.plan.pack_force import PackedForce, pack, presses_of
from opspace.plan.pack_integrals import PackedIntegrals
from opspace.plan.pack_task import Packed, hides, kind_of
from opspace.plan.scales import Scales
from opspace.plan.spectra import Spectra
from opspace.robots.adapter import AdapterBase
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.motor_range import MotorRange
from opspace.stack import Blending, Member, UnrestMemory, Variable, variables_of
from opspace.stack.unrest_memory import NEVER
from opspace.tasks import CollisionAvoidance, JointLimits
from opspace.tasks.task import CHANGES

MOST = 62
"""Bits of a corner: more tasks, places or activations than this take the readable tick."""
CODES = {name: float(code) for code, name in enumerate(PROFILES)}
PACK = Struct(f"{VARIABLE_SIZE}d").pack
ROW = VARIABLE_SIZE * WORD
NOWHERE = np.array([NO_GROUP], np.int64).tobytes()
"""The group of an activation that was not there."""


class Heritage(NamedTuple):
    """What a plan takes over from the one before it.

    Attributes:
        before: The plan before, which may be the same one; None if there was none.
        known: The activations that it has then.
        variables: Those after it.
        groups: Where the group of each of them is remembered; None if all stay where they are.
        turns: The tasks with angles, each with the same task in the plan before.
        unrests: The rows of the tasks that may be at rest, each with those in the plan before.
        ramps: The ramps that the activations are expected to have.
        packed: These as the plan's memory has them.
    """

    before: Plan | None
    known: tuple[Variable, ...]
    variables: tuple[Variable, ...]
    groups: tuple[memoryview | bytes, ...] | None
    turns: tuple[tuple[Packed, Packed | None], ...]
    unrests: tuple[tuple[slice, slice | None], ...]
    ramps: tuple[Ramp, ...]
    packed: bytes

    def holds(self, before: Plan | None) -> bool:
        """Tell whether this plan is the one before, with the activations that were foreseen."""
        return before is self.before and (before is None or before.variables == self.known)


class Plan:
    """The arrays of one set of tasks and transitions; any change makes another plan.

    Args:
        members: The tasks.
        axes: The robot's arrays.
        scales: What σ is measured in.
        limits: Joint limits, or None.
        motors: What the motors give.
        options: Numbers of the controller's options, (OPTION_SIZE,).
        blending: How activations are blended.
        guard: What is kept apart, or None.
        contacts: What the robot touches, or None where it is bolted down.
        leads: Whether the tick itself leads tasks to their targets on ways; otherwise that is done by
            whoever refreshes the plan.
    """

    def __init__(
        self,
        members: tuple[Member, ...],
        axes: MotionAxes,
        scales: Scales,
        limits: JointLimits | None,
        motors: MotorRange,
        options: np.ndarray,
        blending: Blending,
        guard: CollisionAvoidance | None = None,
        contacts: PackedContacts | None = None,
        *,
        leads: bool = False,
    ) -> None:
        self.members = members
        self.structure = structure(members)
        self.axes = axes
        self.limits = limits
        self.n = axes.v.size
        self.variables = variables_of(members)
        self.levels = sorted({place.level for m in members for place in m.places})
        self.places = sorted(
            ((p.level, i, k) for i, m in enumerate(members) for k, p in enumerate(m.places)),
            key=lambda place: place[:2],
        )
        last = CHANGES.last
        layout = None if guard is None else guard.layout()
        presses = presses_of(members)
        rows = sum(member.task.rows for member in members)
        self.size = Sizes(
            n=axes.v.size,
            tasks=len(members),
            rows=rows,
            slot_rows=sum(members[i].task.rows for _, i, _ in self.places),
            slots=len(self.places),
            levels=len(self.levels),
            variables=len(self.variables),
            limits=0 if limits is None else len(limits.sides),
            corners=blending.most_corners(len(self.variables)),
            balls=0 if layout is None else layout.ball_frame.size,
            sets=0 if layout is None else layout.set_frame.size,
            faces=0 if layout is None else layout.face.shape[0],
            distances=0 if layout is None else len(layout.rows),
            contacts=0 if contacts is None else contacts.most,
            presses=len(presses),
            led=len(members) if leads else 0,
            led_rows=rows if leads else 0,
        )
        self.contacts = contacts
        stance = None if contacts is None else contacts.record
        self.tick, self.memory = make_tick(self.size, axes, motors, options, stance)
        self.packed = self._pack(scales, presses)
        self.forces = [packed for packed in self.packed if isinstance(packed, PackedForce)]
        self.distances: PackedDistances | None = None
        if guard is not None and layout is not None:
            self.distances = PackedDistances(guard, layout, axes, self.tick)
        # Where everything is known ahead, the first tick need not look.
        self.moving = False
        self.asks = False  # for ways, of the next tick
        self.seen: object = None
        if guard is None and all(packed.settled for packed in self.packed):
            self.seen = last
        # As bytes: arrays take several times as long to read and write them.
        self._ramps = self.tick.variable.reshape(-1).view(np.uint8).data
        self._groups = self.tick.group.view(np.uint8).data
        self._ramps[:] = b"".join([_packed(variable.ramp) for variable in self.variables])
        self._pack_slots()
        self.first_kept = self.tick.space.first_kept
        depth, counts = self.tick.slots[:, 0], self.tick.slots[:, 2]
        self.first_kept[:] = [counts[depth < d].sum() for d in range(self.first_kept.size)]
        if limits is not None:
            _pack_limits(limits, scales, self.tick)
        self.handle = self.tick.handle()
        self.integrals = PackedIntegrals.of(self.packed, self.handle)
        self.spectra = Spectra(self.tick.option)
        self._rests = bool(self.tick.row_near.any())

    @staticmethod
    def fits(members: Sequence[Member], axes: MotionAxes | None = None) -> bool:
        """Tell whether the bit sets are wide enough, and no hidden frame of a robot presses."""
        places = sum(len(member.places) for member in members)
        if len(members) + places > MOST:
            return False
        if axes is None or not axes.followers:
            return True
        return not any(kind_of(m.task) == FORCE and hides(axes, m.task) for m in members)

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
        if self.distances is not None:
            self.distances.refresh(t)
        self.moving = any(packed.moving for packed in self.packed)
        self.moving |= self.distances is not None and self.distances.moving
        self.asks = self._asks()
        self.seen = last

    def note_ways(self) -> None:
        """Let tasks know the ways that the tick has begun."""
        for packed in self.packed:
            if packed.led is not None:
                packed.led.note()
        self.asks = self._asks()

    def disturb(self, acceleration: np.ndarray) -> None:
        """Tell the joint limits what comes on top of the commanded accelerations, (n,) rad/s²."""
        tick = self.tick
        tick.limit[:, DISTURBANCE] = tick.limit[:, SIGN] * acceleration[tick.limit_joint]

    def heritage(
        self,
        before: Plan | None,
        known: tuple[Variable, ...],
        variables: tuple[Variable, ...],
        ramps: tuple[Ramp, ...],
    ) -> Heritage:
        """Find what this plan is to take over, for these activations instead of the known ones.

        Args:
            before: The plan before, which may be this one.
            known: The activations that it has then.
            variables: The activations that this one will have.
            ramps: The ramps that they are expected to have.
        """
        packed = b"".join([_packed(ramp) for ramp in ramps])
        if before is self and known == variables:
            return Heritage(before, known, variables, None, (), (), ramps, packed)
        place = {} if before is None else {variable: i for i, variable in enumerate(known)}
        turns: list[tuple[Packed, Packed | None]] = []
        unrests: list[tuple[slice, slice | None]] = []
        for one, presence in zip(self.packed, variables, strict=False):
            i = place.get(presence)
            earlier = None if before is None or i is None else before.packed[i]
            if one.way_round is not None:
                turns.append((one, earlier))
            if self._rests:
                unrests.append((one.rows, None if earlier is None else earlier.rows))
        groups = [
            NOWHERE if before is None or (i := place.get(variable)) is None else before.group(i)
            for variable in variables
        ]
        return Heritage(
            before, known, variables, tuple(groups), tuple(turns), tuple(unrests), ramps, packed
        )

    def group(self, i: int) -> memoryview:
        """Return the memory of the group that an activation is in."""
        return self._groups[i * WORD : (i + 1) * WORD]

    def go_on(self, heritage: Heritage, members: tuple[Member, ...]) -> None:
        """Take these tasks, of the same structure, and keep what is remembered of them.

        Args:
            heritage: What that is: groups of the blend, turns of rotations.
            members: The tasks with their ramps.
        """
        self.members, self.variables = members, heritage.variables
        if heritage.groups is not None:
            self._groups[:] = b"".join(heritage.groups)
            for packed, earlier in heritage.turns:
                packed.remember(earlier)
                if packed.target is None:
                    self.seen = None
            if heritage.unrests:
                self._take_unrest(heritage)
        for force in self.forces:
            force.take_up()
        rows = self._ramps
        rows[:] = heritage.packed
        i = 0
        for variable, ramp in zip(heritage.variables, heritage.ramps, strict=True):
            if variable.ramp is not ramp:  # it started at another time than was expected
                rows[i : i + ROW] = _packed(variable.ramp)
            i += ROW

    def remember(self) -> None:
        """Be where force tasks remember their contacts from now on, wherever they did before."""
        for force in self.forces:
            if force.task.memory.row is not force.memory:
                force.keep()

    def forget(self) -> None:
        """Let all angles take the short way at the next tick, and no task have been at rest."""
        for packed in self.packed:
            packed.forget()
        self.tick.row_unrest[:], self.tick.unrest_at[0] = MOST_UNREST, NEVER

    def _take_unrest(self, heritage: Heritage) -> None:
        """Go on from how far the tasks were from rest in the plan before."""
        found, before = np.full(self.size.rows, MOST_UNREST), heritage.before
        for rows, earlier in heritage.unrests:
            if before is not None and earlier is not None:
                found[rows] = before.tick.row_unrest[earlier]
        self.tick.row_unrest[:] = found
        self.tick.unrest_at[0] = NEVER if before is None else before.tick.unrest_at[0]

    def leave(self, members: Sequence[Member], blending: Blending, unrest: UnrestMemory) -> None:
        """Let the readable form go on with these tasks where this plan was at the tick before."""
        blending.remember(dict(zip(self.variables, self.tick.group.tolist(), strict=True)))
        rows = zip(self.variables, self.packed, strict=False)
        kept = {presence: self.tick.row_unrest[one.rows].copy() for presence, one in rows}
        unrest.remember(float(self.tick.unrest_at[0]), kept)
        for packed, member in zip(self.packed, self.members, strict=True):
            if member in members:
                packed.leave()

    def come_back(self, blending: Blending, unrest: UnrestMemory) -> None:
        """Go on where the readable form was at the tick before."""
        groups = blending.remembered()
        self.tick.group[:] = [groups.get(v, NO_GROUP) for v in self.variables]
        self.tick.unrest_at[0] = unrest.at
        for packed, presence in zip(self.packed, self.variables, strict=False):
            packed.come_back()
            rows = packed.rows
            self.tick.row_unrest[rows] = unrest.of(presence, rows.stop - rows.start)
        self.seen = None

    def _asks(self) -> bool:
        return any(packed.led is not None and packed.led.asked for packed in self.packed)

    def _pack(self, scales: Scales, presses: Mapping[int, int]) -> list[Packed]:
        packed: list[Packed] = []
        first = 0
        for i, member in enumerate(self.members):
            entry = pack(member, i, first, self.axes, self.tick, presses)
            reference = scales.reference(member.task)
            self.tick.row_reference[entry.rows] = reference
            self.tick.row_weight[entry.rows] = 1.0 / np.sqrt(reference)
            self.tick.row_near[entry.rows] = scales.near(member.task)
            first = entry.rows.stop
            packed.append(entry)
        return packed

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


def _packed(ramp: Ramp) -> bytes:
    profile, *numbers = ramp
    return PACK(CODES[profile], *numbers)


def structure(members: Sequence[Member]) -> tuple[object, ...]:
    """Tell what a plan is laid out for: which tasks are at which levels, moved by how many ramps."""
    found: list[object] = []
    seen: dict[Variable | None, int] = {}
    for member in members:
        found += (id(member.task), len(member.places))
        for place in member.places:
            found += (place.level, seen.setdefault(place.arrival, len(seen)))
    return tuple(found)


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

"""What a scenario can ask a task to follow: a value, or a reference in time.

A reference begins where the task finds the robot at the start of the run, so that no scenario can
begin with a step. ``goal`` is where it leads, ``offset`` says the same relative to that start.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, TypeVar

from pydantic import Discriminator, Field, Tag, model_validator

from opspace.scenario.fields import Checked, Entry, Number, problem, shown

if TYPE_CHECKING:
    from typing_extensions import Self

GoalT = TypeVar("GoalT")
OffsetT = TypeVar("OffsetT")

_OR_REFERENCE = ", or a mapping with a type"

Seconds = Annotated[float, Number("s", at_least=0.0)]
Duration = Annotated[float, Number("s", above=0.0)]
Point = Annotated[tuple[float, ...], Number("m", size=3)]
RotationVector = Annotated[tuple[float, ...], Number("rad", size=3)]
Joints = Annotated[tuple[float, ...], Number("rad or m", size="any")]
Joint = Annotated[float, Number("rad or m")]

PointValue = Annotated[tuple[float, ...], Number("m", size=3, otherwise=_OR_REFERENCE)]
JointValue = Annotated[float, Number("rad or m", otherwise=_OR_REFERENCE)]
PoseValue = Annotated[
    tuple[float, ...],
    Number(
        "x y z, quaternion w x y z", size=7, otherwise=", or a mapping of position and orientation"
    ),
]


def _check_quaternion(value: Any) -> tuple[float, ...]:
    numbers = Number("quaternion w x y z", size=4, otherwise=_OR_REFERENCE).check(value)
    assert isinstance(numbers, tuple)
    norm = math.hypot(*numbers)
    if abs(norm - 1.0) > QUATERNION_TOLERANCE:
        raise problem(f"must be a quaternion w x y z of norm 1, not {norm:.6g}: {shown(value)}")
    return numbers


QUATERNION_TOLERANCE = 1e-3
"""Quaternions typed with three decimals pass; the task makes them exact."""

Quaternion = Annotated[tuple[float, ...], Checked(_check_quaternion)]


def _check_configuration(value: Any) -> str | tuple[float, ...]:
    if isinstance(value, str) and value.strip():
        return value
    names = ", or the name of one of the robot's configurations such as reference"
    numbers = Number("rad or m", size="any", otherwise=names).check(value)
    assert isinstance(numbers, tuple)
    return numbers


Configuration = Annotated[str | tuple[float, ...], Checked(_check_configuration)]
"""Joint values, or the name of a configuration of the robot."""


ROUNDING = 1e-9
"""By how much a sum of two times may be off, s."""


class HoldEntry(Entry):
    """Stay where the task finds the robot."""

    type: Literal["hold"] = Field(description="hold")


class _Aimed(Entry, Generic[GoalT, OffsetT]):
    """A reference that leads to a goal or an offset."""

    goal: GoalT | None = Field(default=None, description="where it leads, written as a value")
    offset: OffsetT | None = Field(
        default=None, description="where it leads, relative to the start"
    )
    start_time: Seconds = Field(default=0.0, description="time at which it begins [s]")

    @model_validator(mode="after")
    def _one_aim(self) -> Self:
        if (self.goal is None) == (self.offset is None):
            raise problem("needs either the key 'goal' or the key 'offset'")
        return self


class MinimumJerkEntry(_Aimed[GoalT, OffsetT], Generic[GoalT, OffsetT]):
    """Straight from rest to rest with the least jerk."""

    type: Literal["minimum_jerk"] = Field(description="minimum_jerk")
    duration: Duration = Field(description="time of the motion [s]")


class JerkLimitedEntry(_Aimed[GoalT, OffsetT], Generic[GoalT, OffsetT]):
    """As fast as limits of velocity, acceleration and jerk allow."""

    type: Literal["jerk_limited"] = Field(description="jerk_limited")
    max_velocity: Annotated[float, Number("m/s or rad/s", above=0.0)] = Field(
        description="limit of each coordinate [m/s or rad/s]"
    )
    max_acceleration: Annotated[float, Number("m/s² or rad/s²", above=0.0)] = Field(
        description="limit of each coordinate [m/s² or rad/s²]"
    )
    max_jerk: Annotated[float, Number("m/s³ or rad/s³", above=0.0)] = Field(
        description="limit of each coordinate [m/s³ or rad/s³]"
    )


class OutAndBackEntry(Entry, Generic[OffsetT]):
    """Out by an offset, wait, and back to the start, each way with the least jerk."""

    type: Literal["out_and_back"] = Field(description="out_and_back")
    offset: OffsetT = Field(description="the far end, relative to the start")
    out_duration: Duration = Field(description="time of the way out [s]")
    hold_duration: Seconds = Field(default=0.0, description="time at the far end [s]")
    back_duration: Duration = Field(description="time of the way back [s]")
    start_time: Seconds = Field(default=0.0, description="time at which it begins [s]")


class SwingEntry(Entry):
    """Out on an arc about an axis, wait, and back to the start, each way with the least jerk."""

    type: Literal["swing"] = Field(description="swing")
    angle: Annotated[float, Number("rad")] = Field(
        description="angle of the arc [rad], counter-clockwise about the axis"
    )
    center: Point = Field(description="a point on the axis [m]")
    axis: Annotated[tuple[float, ...], Number("1", size=3)] = Field(
        default=(0.0, 0.0, 1.0), description="direction of the axis"
    )
    out_duration: Duration = Field(description="time of the way out [s]")
    hold_duration: Seconds = Field(default=0.0, description="time at the far end [s]")
    back_duration: Duration = Field(description="time of the way back [s]")
    start_time: Seconds = Field(default=0.0, description="time at which it begins [s]")

    @model_validator(mode="after")
    def _check_axis(self) -> Self:
        if not any(self.axis):
            raise problem("must not be zero", "axis")
        return self


class ViaPointsEntry(Entry, Generic[GoalT, OffsetT]):
    """From the start through points at given times, at rest at both ends."""

    type: Literal["via_points"] = Field(description="via_points")
    times: Annotated[tuple[float, ...], Number("s", above=0.0, size="any")] = Field(
        description="rising times of the points [s]"
    )
    points: Annotated[list[GoalT] | None, Field(min_length=1)] = Field(
        default=None, description="a target value for each time"
    )
    offsets: Annotated[list[OffsetT] | None, Field(min_length=1)] = Field(
        default=None, description="an offset from the start for each time"
    )
    start_time: Seconds = Field(default=0.0, description="time at which it begins [s]")

    @model_validator(mode="after")
    def _check_points(self) -> Self:
        if (self.points is None) == (self.offsets is None):
            raise problem("needs either the key 'points' or the key 'offsets'")
        times = (self.start_time, *self.times)
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise problem(f"must rise from start_time {self.start_time:g} s on", "times")
        key, places = ("points", self.points) if self.points else ("offsets", self.offsets)
        if len(places or ()) != len(self.times):
            raise problem(f"must be as many as times, {len(self.times)}", key)
        return self


class MoveEntry(Entry, Generic[GoalT, OffsetT]):
    """One way of several, from rest to rest."""

    at: Seconds = Field(description="time at which it begins [s]")
    duration: Duration = Field(description="time that it takes [s]")
    goal: GoalT | None = Field(default=None, description="where it leads, written as a value")
    offset: OffsetT | None = Field(
        default=None, description="where it leads, relative to the start of the run"
    )

    @model_validator(mode="after")
    def _one_aim(self) -> Self:
        if (self.goal is None) == (self.offset is None):
            raise problem("needs either the key 'goal' or the key 'offset'")
        return self


class StopsEntry(Entry, Generic[GoalT, OffsetT]):
    """From stop to stop, each way straight with the least jerk, and still between them."""

    type: Literal["stops"] = Field(description="stops")
    moves: Annotated[list[MoveEntry[GoalT, OffsetT]], Field(min_length=1)] = Field(
        description="the ways in order of time; none begins before the one before it is over"
    )

    @model_validator(mode="after")
    def _in_turn(self) -> Self:
        for i, (one, following) in enumerate(pairwise(self.moves), start=1):
            end = one.at + one.duration
            if following.at < end - ROUNDING:
                raise problem(f"moves[{i}]: must not begin before {end:g} s", "moves")
        return self


class CircleEntry(Entry):
    """On a circle that passes through the start, from rest up to one turn per period."""

    type: Literal["circle"] = Field(description="circle")
    radius: Annotated[float, Number("m", above=0.0)] = Field(description="radius [m]")
    period: Duration = Field(description="time of one turn at full speed [s]")
    normal: Annotated[tuple[float, ...], Number("1", size=3)] = Field(
        default=(0.0, 0.0, 1.0), description="axis of the circle, counter-clockwise"
    )
    start_time: Seconds = Field(default=0.0, description="time at which it begins [s]")
    ramp: Duration | None = Field(
        default=None, description="time to full speed [s]; null is one period"
    )

    @model_validator(mode="after")
    def _check_normal(self) -> Self:
        if not any(self.normal):
            raise problem("must not be zero", "normal")
        return self


def tag_of(value: Any) -> str:
    """Name the kind of a target or task entry: ``<type>`` of a mapping, ``<value>`` of the rest.

    The angle brackets tell these names from keys where an error says where it happened.
    """
    if isinstance(value, dict):
        return f"<{value.get('type', '')}>"
    return f"<{getattr(value, 'type', '')}>" if isinstance(value, Entry) else "<value>"


_BY_TYPE = Discriminator(tag_of)

PointTarget = Annotated[
    Annotated[PointValue, Tag("<value>")]
    | Annotated[HoldEntry, Tag("<hold>")]
    | Annotated[MinimumJerkEntry[Point, Point], Tag("<minimum_jerk>")]
    | Annotated[JerkLimitedEntry[Point, Point], Tag("<jerk_limited>")]
    | Annotated[OutAndBackEntry[Point], Tag("<out_and_back>")]
    | Annotated[ViaPointsEntry[Point, Point], Tag("<via_points>")]
    | Annotated[StopsEntry[Point, Point], Tag("<stops>")]
    | Annotated[CircleEntry, Tag("<circle>")]
    | Annotated[SwingEntry, Tag("<swing>")],
    _BY_TYPE,
]

OrientationTarget = Annotated[
    Annotated[Quaternion, Tag("<value>")]
    | Annotated[HoldEntry, Tag("<hold>")]
    | Annotated[MinimumJerkEntry[Quaternion, RotationVector], Tag("<minimum_jerk>")]
    | Annotated[OutAndBackEntry[RotationVector], Tag("<out_and_back>")]
    | Annotated[StopsEntry[Quaternion, RotationVector], Tag("<stops>")],
    _BY_TYPE,
]

PostureTarget = Annotated[
    Annotated[Configuration, Tag("<value>")]
    | Annotated[HoldEntry, Tag("<hold>")]
    | Annotated[MinimumJerkEntry[Configuration, Joints], Tag("<minimum_jerk>")]
    | Annotated[JerkLimitedEntry[Configuration, Joints], Tag("<jerk_limited>")]
    | Annotated[OutAndBackEntry[Joints], Tag("<out_and_back>")]
    | Annotated[StopsEntry[Configuration, Joints], Tag("<stops>")]
    | Annotated[ViaPointsEntry[Configuration, Joints], Tag("<via_points>")],
    _BY_TYPE,
]

JointTarget = Annotated[
    Annotated[JointValue, Tag("<value>")]
    | Annotated[HoldEntry, Tag("<hold>")]
    | Annotated[MinimumJerkEntry[Joint, Joint], Tag("<minimum_jerk>")]
    | Annotated[JerkLimitedEntry[Joint, Joint], Tag("<jerk_limited>")]
    | Annotated[OutAndBackEntry[Joint], Tag("<out_and_back>")]
    | Annotated[StopsEntry[Joint, Joint], Tag("<stops>")]
    | Annotated[ViaPointsEntry[Joint, Joint], Tag("<via_points>")],
    _BY_TYPE,
]


class PoseParts(Entry):
    """A pose whose position and orientation are given on their own; what is left out is held."""

    position: PointTarget | None = Field(default=None, description="target of the position [m]")
    orientation: OrientationTarget | None = Field(
        default=None, description="target of the orientation"
    )


PoseTarget = Annotated[
    Annotated[PoseValue, Tag("<value>")] | Annotated[PoseParts, Tag("<parts>")],
    Discriminator(lambda value: "<parts>" if isinstance(value, dict | Entry) else "<value>"),
]

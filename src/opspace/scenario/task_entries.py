"""What a scenario can say about a task; keys and defaults are those of the task's constructor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from opspace.scenario.fields import Checked, Entry, Quantity, problem, shown, whole
from opspace.scenario.targets import (
    JointTarget,
    OrientationTarget,
    Point,
    PointTarget,
    PoseTarget,
    PostureTarget,
    tag_of,
)

if TYPE_CHECKING:
    from typing_extensions import Self

Gain = float | tuple[float, ...]
Stiffness = Annotated[Gain, Quantity("1/s²", at_least=0.0, size="rows")]
Damping = Annotated[Gain, Quantity("1/s", at_least=0.0, size="rows")]
LinearSpeed = Annotated[float, Quantity("m/s", above=0.0)]
AngularSpeed = Annotated[float, Quantity("rad/s", above=0.0)]
JointSpeed = Annotated[float, Quantity("rad/s or m/s", above=0.0)]
PoseSpeeds = Annotated[tuple[float, ...], Quantity("linear m/s, angular rad/s", above=0.0, size=2)]
AxesFrame = Literal["world", "tool"]

_TARGET = "value or reference to follow; null holds the value at the start"
_FRAME = "name of the frame; null is the robot's tool"


class TaskEntry(Entry):
    """What every task has."""

    level: Annotated[int, Checked(whole)] = Field(description="priority, 0 is the highest")
    present: bool = Field(
        default=True,
        description="whether it is in the stack at the start; one that an event inserts first is not",
    )
    kp: Stiffness = Field(default=100.0, description="stiffness [1/s²], a number or one per row")
    kv: Damping | None = Field(
        default=None, description="damping [1/s]; null is critical, 2 sqrt(kp)"
    )

    def rows(self) -> int | None:
        """Number of task rows, None where only the robot knows it."""
        return None

    @model_validator(mode="after")
    def _check_rows(self) -> Self:
        rows = self.rows()
        for key, gain in (("kp", self.kp), ("kv", self.kv)):
            if rows is not None and isinstance(gain, tuple) and len(gain) != rows:
                raise problem(f"must be a number or a list of {rows} numbers, not {len(gain)}", key)
        return self


class _AxesEntry(TaskEntry):
    """A task on some of three axes."""

    axes: str = Field(default="xyz", description="axes to control, some of the letters xyz")

    @field_validator("axes")
    @classmethod
    def _check_axes(cls, axes: str) -> str:
        if not axes or set(axes) - set("xyz") or len(set(axes)) < len(axes):
            raise problem(f"must be some of the letters xyz, each once, not {shown(axes)}")
        return axes

    def rows(self) -> int:
        """Number of task rows."""
        return len(self.axes)


class _SixRowEntry(TaskEntry):
    """A task on position and orientation together."""

    target: PoseTarget | None = Field(default=None, description=_TARGET)
    kp_linear: Annotated[float, Quantity("1/s²", at_least=0.0)] | None = Field(
        default=None, description="stiffness of the linear rows in place of kp [1/s²]"
    )
    kp_angular: Annotated[float, Quantity("1/s²", at_least=0.0)] | None = Field(
        default=None, description="stiffness of the angular rows in place of kp [1/s²]"
    )
    max_speed: PoseSpeeds | None = Field(
        default=None, description="speeds that the error may ask for [m/s, rad/s]; null is no limit"
    )
    frame: str | None = Field(default=None, description=_FRAME)

    def rows(self) -> int:
        """Number of task rows."""
        return 6


class Position(_AxesEntry):
    """Position of a point of a frame."""

    type: Literal["position"] = Field(description="position")
    frame: str | None = Field(default=None, description=_FRAME)
    target: PointTarget | None = Field(default=None, description=_TARGET)
    axes_frame: AxesFrame = Field(default="world", description="whose axes: world or tool")
    max_speed: LinearSpeed | None = Field(
        default=None, description="speed that the error may ask for [m/s]; null is no limit"
    )
    offset: Point | None = Field(
        default=None, description="point to control, in the frame's axes [m]"
    )


class Orientation(_AxesEntry):
    """Orientation of a frame."""

    type: Literal["orientation"] = Field(description="orientation")
    frame: str | None = Field(default=None, description=_FRAME)
    target: OrientationTarget | None = Field(default=None, description=_TARGET)
    axes_frame: AxesFrame = Field(default="world", description="whose axes: world or tool")
    max_speed: AngularSpeed | None = Field(
        default=None, description="speed that the error may ask for [rad/s]; null is no limit"
    )


class Pose(_SixRowEntry):
    """Position and orientation of a frame."""

    type: Literal["pose"] = Field(description="pose")
    axes_frame: AxesFrame = Field(default="world", description="whose axes: world or tool")
    offset: Point | None = Field(
        default=None, description="point to control, in the frame's axes [m]"
    )


class Posture(TaskEntry):
    """Several joints."""

    type: Literal["posture"] = Field(description="posture")
    target: PostureTarget | None = Field(default=None, description=_TARGET)
    joints: Annotated[list[str] | None, Field(min_length=1)] = Field(
        default=None, description="names of the joints; null is every actuated joint"
    )
    max_speed: JointSpeed | None = Field(
        default=None,
        description="norm of the speed that the error may ask for [rad/s]; null is no limit",
    )

    def rows(self) -> int | None:
        """Number of task rows, None for every actuated joint."""
        return len(self.joints) if self.joints is not None else None


class Joint(TaskEntry):
    """One joint."""

    type: Literal["joint"] = Field(description="joint")
    joint: str = Field(description="name of the joint")
    target: JointTarget | None = Field(default=None, description=_TARGET)
    max_speed: JointSpeed | None = Field(
        default=None,
        description="speed that the error may ask for [rad/s or m/s]; null is no limit",
    )

    def rows(self) -> int:
        """Number of task rows."""
        return 1


class Com(_AxesEntry):
    """Position of the centre of mass."""

    type: Literal["com"] = Field(description="com")
    target: PointTarget | None = Field(default=None, description=_TARGET)
    max_speed: LinearSpeed | None = Field(
        default=None, description="speed that the error may ask for [m/s]; null is no limit"
    )


class RelativePosition(_AxesEntry):
    """Position of a frame as another frame sees it."""

    type: Literal["relative_position"] = Field(description="relative_position")
    frame: str | None = Field(default=None, description=_FRAME)
    reference_frame: str = Field(description="name of the frame it is seen from")
    target: PointTarget | None = Field(default=None, description=_TARGET)
    max_speed: LinearSpeed | None = Field(
        default=None, description="speed that the error may ask for [m/s]; null is no limit"
    )


class RelativeOrientation(_AxesEntry):
    """Orientation of a frame as another frame sees it."""

    type: Literal["relative_orientation"] = Field(description="relative_orientation")
    frame: str | None = Field(default=None, description=_FRAME)
    reference_frame: str = Field(description="name of the frame it is seen from")
    target: OrientationTarget | None = Field(default=None, description=_TARGET)
    max_speed: AngularSpeed | None = Field(
        default=None, description="speed that the error may ask for [rad/s]; null is no limit"
    )


class RelativePose(_SixRowEntry):
    """Pose of a frame as another frame sees it."""

    type: Literal["relative_pose"] = Field(description="relative_pose")
    reference_frame: str = Field(description="name of the frame it is seen from")


AnyTask = Annotated[
    Annotated[Position, Tag("<position>")]
    | Annotated[Orientation, Tag("<orientation>")]
    | Annotated[Pose, Tag("<pose>")]
    | Annotated[Posture, Tag("<posture>")]
    | Annotated[Joint, Tag("<joint>")]
    | Annotated[Com, Tag("<com>")]
    | Annotated[RelativePosition, Tag("<relative_position>")]
    | Annotated[RelativeOrientation, Tag("<relative_orientation>")]
    | Annotated[RelativePose, Tag("<relative_pose>")],
    Discriminator(tag_of),
]

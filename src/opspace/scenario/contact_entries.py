"""What a scenario file can say about what a robot stands on and holds on to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator

from opspace.contacts import EdgeContact, GroundContact, PointContact, SoleContact
from opspace.robots.protocol import Robot
from opspace.scenario.fields import Entry, Number, problem
from opspace.scenario.targets import Point, tag_of
from opspace.sim.ground import RADIUS, Board, Ground, Wall, corners

Force = Annotated[float, Number("N", at_least=0.0)]
Positive = Annotated[float, Number("1", above=0.0)]
Direction = Annotated[tuple[float, ...], Number("1", size=3)]


def _check_direction(value: tuple[float, ...]) -> tuple[float, ...]:
    if not any(value):
        raise problem("must not be zero")
    return value


class ContactEntry(Entry):
    """What every contact has; the controller trusts these numbers, the ground has its own."""

    present: bool = Field(
        default=True,
        description="whether it is in the stack at the start; one that an event inserts first is not",
    )
    frame: str = Field(description="name of the frame that touches")
    offset: Point = Field(default=(0.0, 0.0, 0.0), description="its point, in the frame's axes [m]")
    friction: Positive = Field(
        default=0.5, description="coefficient that forces keep to; at most the real one over √2"
    )
    force: Force | None = Field(
        default=None, description="normal force that is wanted [N]; null is whatever serves"
    )
    max_force: Annotated[float, Number("N", above=0.0)] | None = Field(
        default=None, description="largest normal force [N]; null is three weights of the robot"
    )

    def options(self) -> dict[str, Any]:
        """Collect what a constructor takes."""
        own = type(self).model_fields
        return {key: getattr(self, key) for key in own if key not in ("type", "present")}


class SoleEntry(ContactEntry):
    """A rectangle that stays flat on a surface."""

    type: Literal["sole"] = Field(description="sole")
    half: Annotated[tuple[float, ...], Number("m", above=0.0, size=2)] = Field(
        description="half the sides along the frame's x and y [m]"
    )

    def build(self, name: str) -> GroundContact:
        """Make the contact."""
        return SoleContact(**self.options(), name=name)


class TurningEntry(ContactEntry):
    """What touches a surface on which its frame may turn."""

    normal: Direction = Field(
        default=(0.0, 0.0, 1.0), description="direction out of the surface, in the world"
    )

    @field_validator("normal")
    @classmethod
    def _check_normal(cls, normal: tuple[float, ...]) -> tuple[float, ...]:
        return _check_direction(normal)


class PointEntry(TurningEntry):
    """A point on a surface whose frame may turn."""

    type: Literal["point"] = Field(description="point")

    def build(self, name: str) -> GroundContact:
        """Make the contact."""
        return PointContact(**self.options(), name=name)


class EdgeEntry(TurningEntry):
    """A line on a surface about which its frame may turn."""

    type: Literal["edge"] = Field(description="edge")
    half: Annotated[float, Number("m", above=0.0)] = Field(description="half its length [m]")
    along: Direction = Field(
        default=(0.0, 1.0, 0.0), description="its direction, in the frame's axes"
    )

    @field_validator("along")
    @classmethod
    def _check_along(cls, along: tuple[float, ...]) -> tuple[float, ...]:
        return _check_direction(along)

    def build(self, name: str) -> GroundContact:
        """Make the contact."""
        return EdgeContact(**self.options(), name=name)


AnyContact = Annotated[
    Annotated[SoleEntry, Tag("<sole>")]
    | Annotated[EdgeEntry, Tag("<edge>")]
    | Annotated[PointEntry, Tag("<point>")],
    Discriminator(tag_of),
]


class WallEntry(Entry):
    """A plane that the robot may touch."""

    point: Point = Field(description="a point of it [m]")
    normal: Direction = Field(description="direction out of it, where the robot is")

    @field_validator("normal")
    @classmethod
    def _check_normal(cls, normal: tuple[float, ...]) -> tuple[float, ...]:
        return _check_direction(normal)


class BoardEntry(Entry):
    """A part of the floor that has another height from some time on."""

    contact: str = Field(description="name of the contact below which it lies")
    height: Annotated[float, Number("m")] = Field(
        description="how much higher than the floor [m]; below 0 is a hole"
    )
    at: Annotated[float, Number("s", at_least=0.0)] = Field(
        default=0.0, description="when it comes [s]"
    )


class GroundEntry(Entry):
    """What is really there to touch, whatever the controller believes."""

    friction: Positive = Field(default=0.8, description="real coefficient of friction")
    time_constant: Annotated[float, Number("s", above=0.0)] = Field(
        default=0.01, description="of the surfaces' give [s]"
    )
    walls: list[WallEntry] = Field(default_factory=list, description="planes beside the floor")
    boards: list[BoardEntry] = Field(
        default_factory=list, description="where the floor has not the height that was expected"
    )

    def build(self, contacts: Mapping[str, GroundContact]) -> Ground:
        """Make the ground for the contacts of a scenario."""
        return Ground(
            list(contacts.values()),
            friction=self.friction,
            time_constant=self.time_constant,
            walls=[Wall(_triple(wall.point), _triple(wall.normal)) for wall in self.walls],
            boards=[Board(board.contact, board.height, board.at) for board in self.boards],
        )


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def height_of(contacts: Iterable[GroundContact], robot: Robot) -> float:
    """Find how high the lowest point of what stands on the floor is, m; 0 where nothing does.

    Args:
        contacts: What stands on the floor.
        robot: The robot, updated.
    """
    heights = [
        float((robot.position(frame) + robot.rotation(frame) @ middle)[2]) - RADIUS
        for contact in contacts
        for frame in [robot.frame_id(contact.frame)]
        for middle in corners(contact)
    ]
    return min(heights, default=0.0)

"""What a scenario file can say about what is touched, and about tasks that come in by touch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, model_validator

from opspace.scenario.fields import Entry, Number, problem
from opspace.scenario.targets import Point
from opspace.sim.hole import Hole
from opspace.sim.surfaces import Surface
from opspace.tasks import DistanceBuffer

if TYPE_CHECKING:
    from typing_extensions import Self

Metres = Annotated[float, Number("m", at_least=0.0)]
Stiffness = Annotated[float, Number("N/m", above=0.0)]


class SurfaceEntry(Entry):
    """A flat piece that the tool may press."""

    point: Point = Field(description="a point of it; its middle where it has a size [m]")
    normal: Annotated[tuple[float, ...], Number("1", size=3)] = Field(
        default=(0.0, 0.0, 1.0), description="direction out of it"
    )
    stiffness: Stiffness = Field(default=1e5, description="with which it pushes back [N/m]")
    friction: Annotated[float, Number("1", at_least=0.0)] = Field(
        default=0.3, description="part of the normal force that rubs along it"
    )
    damping: Annotated[float, Number("N·s/m", at_least=0.0)] = Field(
        default=0.0, description="of the motion into it [N·s/m]"
    )
    size: Annotated[float, Number("m", above=0.0)] | None = Field(
        default=None, description="radius in which it is flat [m]; null is everywhere"
    )
    bevel: Metres = Field(default=0.0, description="width of the rim that falls away beyond [m]")
    give: Metres = Field(default=0.0, description="how far it is soft, as a button is [m]")
    soft_stiffness: Stiffness = Field(
        default=1000.0, description="stiffness as far as it is soft [N/m]"
    )

    def build(self) -> Surface:
        """Make the surface.

        Raises:
            InputError: A normal that points nowhere.
        """
        given = {key: getattr(self, key) for key in type(self).model_fields}
        if given["size"] is None:
            del given["size"]
        return Surface(**given)


class HoleEntry(Entry):
    """A round hole in a plate, and the round peg on the tool that it is for."""

    point: Point = Field(description="middle of its mouth [m]")
    normal: Annotated[tuple[float, ...], Number("1", size=3)] = Field(
        default=(0.0, 0.0, 1.0), description="direction out of it"
    )
    diameter: Annotated[float, Number("m", above=0.0)] = Field(
        default=0.02, description="of the peg, which ends at the tool [m]"
    )
    clearance: Annotated[float, Number("m", above=0.0)] = Field(
        default=1e-4, description="what the hole is wider by, in diameter [m]"
    )
    depth: Annotated[float, Number("m", above=0.0)] = Field(
        default=0.02, description="from the mouth to the bottom [m]"
    )
    chamfer: Metres = Field(default=1e-3, description="width of the chamfer at the mouth [m]")
    stiffness: Stiffness = Field(default=1e5, description="with which it pushes back [N/m]")
    friction: Annotated[float, Number("1", at_least=0.0)] = Field(
        default=0.1, description="part of the normal force that rubs"
    )
    damping: Annotated[float, Number("N·s/m", at_least=0.0)] = Field(
        default=50.0, description="of the motion into what is touched [N·s/m]"
    )

    def build(self) -> Hole:
        """Make the hole.

        Raises:
            InputError: A normal that points nowhere, or a chamfer as deep as the hole.
        """
        return Hole(**{key: getattr(self, key) for key in type(self).model_fields})


class NearEntry(Entry):
    """How near to a point a task is there."""

    point: Point = Field(description="the point [m]")
    off: Metres = Field(description="distance at and beyond which the task is absent [m]")
    on: Metres = Field(description="distance at and beyond which it is fully there [m]")
    frame: str | None = Field(
        default=None,
        description="name of the frame whose distance counts; null is the robot's tool",
    )

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.on == self.off:
            raise problem(f"must differ from off, {self.off:g}", "on")
        return self

    def build(self) -> DistanceBuffer:
        """Make the activation."""
        return DistanceBuffer(self.point, self.off, self.on, frame=self.frame)


class ActivationEntry(Entry):
    """What brings a task in: a touch, being near, or either of both."""

    contact: str | None = Field(
        default=None, description="name of the force task whose touch brings it in"
    )
    near: NearEntry | None = Field(default=None, description="distance that brings it in")

    @model_validator(mode="after")
    def _check_any(self) -> Self:
        if self.contact is None and self.near is None:
            raise problem("needs the key 'contact', the key 'near', or both")
        return self

"""What a scenario file can say about what a robot must not touch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from opspace.robots import load_robot
from opspace.robots.shapes import LinkCapsule
from opspace.scenario.fields import Checked, Entry, Number, listed, problem, shown
from opspace.scenario.references import as_reference, build_target, vectors
from opspace.scenario.targets import Point, PostureTarget, Quaternion
from opspace.tasks import Ball, Box, Capsule, CollisionAvoidance, ConvexMesh, HalfSpace, OtherRobot
from opspace.tasks.obstacles import Obstacle
from opspace.tasks.references.sample import Sample

if TYPE_CHECKING:
    from typing_extensions import Self

Positive = Annotated[float, Number("m", above=0.0)]
NEEDED = {
    "ball": ("radius",),
    "capsule": ("radius", "length"),
    "box": ("size",),
    "mesh": ("vertices",),
    "half-space": ("normal",),
}
"""What each shape has beside its place."""


def _pairs(value: Any) -> str | list[tuple[str, str]]:
    """Read which links are kept apart."""
    if isinstance(value, str):
        if value not in ("auto", "none"):
            raise problem(f"must be {listed(('auto', 'none'))} or pairs of links", None)
        return value
    if not isinstance(value, list) or not all(
        isinstance(pair, list | tuple) and len(pair) == 2 for pair in value
    ):
        raise problem(f"must be a list of pairs of links, not {shown(value)}")
    return [(str(one), str(two)) for one, two in value]


class Straight:
    """A straight line in time.

    Args:
        start: (3,) where it is at time 0, m.
        velocity: (3,) m/s.
    """

    def __init__(self, start: tuple[float, ...], velocity: tuple[float, ...]) -> None:
        self.start, self.velocity = np.array(start), np.array(velocity)

    def __call__(self, t: float) -> Sample:
        """Return where it is at time t, s."""
        return Sample(self.start + self.velocity * t, self.velocity, np.zeros(3))


class ObstacleEntry(Entry):
    """Something that the robot must not touch."""

    shape: Literal["ball", "capsule", "box", "mesh", "half-space"] = Field(description="what it is")
    radius: Positive | None = Field(default=None, description="of a ball or a capsule [m]")
    length: Positive | None = Field(
        default=None, description="of a capsule along its z axis, without its ends [m]"
    )
    size: Annotated[tuple[float, ...], Number("m", size=3, above=0.0)] | None = Field(
        default=None, description="sides of a box [m]"
    )
    vertices: list[Point] | None = Field(
        default=None, description="points of which a mesh is the convex hull [m]"
    )
    normal: Annotated[tuple[float, ...], Number("1", size=3)] | None = Field(
        default=None, description="out of a half-space, towards where the robot may be"
    )
    position: Point = Field(description="of its middle; of a half-space a point of its plane [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="its axes, quaternion wxyz"
    )
    velocity: Annotated[tuple[float, ...], Number("m/s", size=3)] = Field(
        default=(0.0, 0.0, 0.0), description="with which it moves from its position on [m/s]"
    )
    ignore: list[str] = Field(default_factory=list, description="links that may touch it")

    @model_validator(mode="after")
    def _check_shape(self) -> Self:
        for key in ("radius", "length", "size", "vertices", "normal"):
            needed = key in NEEDED[self.shape]
            if needed and getattr(self, key) is None:
                raise problem(f"is needed for a {self.shape}", key)
            if not needed and getattr(self, key) is not None:
                raise problem(f"is not something that a {self.shape} has", key)
        return self

    def build(self, name: str) -> Obstacle:
        """Make the obstacle."""
        place: Any = Straight(self.position, self.velocity) if any(self.velocity) else self.position
        given = {"name": name, "ignore": self.ignore}
        if self.shape == "ball":
            return Ball(self.radius or 0.0, place, **given)
        if self.shape == "capsule":
            size = self.radius or 0.0, self.length or 0.0
            return Capsule(*size, place, self.orientation, **given)
        if self.shape == "box":
            return Box(self.size or (), place, self.orientation, **given)
        if self.shape == "mesh":
            return ConvexMesh(self.vertices or (), place, self.orientation, **given)
        return HalfSpace(place, self.normal or (), **given)


class OtherRobotEntry(Entry):
    """Another robot in the workspace, which does not look out for this one."""

    robot: str = Field(
        description="name of a robot, or path of a .urdf or .xml file from the working directory"
    )
    position: Point = Field(description="where its base is [m]")
    orientation: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="axes of its base, quaternion wxyz"
    )
    target: PostureTarget | None = Field(
        default=None,
        description="how its joints move, beginning in its reference posture; null is not at all",
    )
    ignore: list[str] = Field(default_factory=list, description="links that may touch it")

    def build(self, name: str) -> OtherRobot:
        """Make its links.

        Args:
            name: What the names of its links begin with.

        Raises:
            OpspaceError: A robot or numbers that cannot be used.
        """
        robot = load_robot(self.robot)
        place = self.position, self.orientation
        other = OtherRobot(robot, *place, name=name, ignore=self.ignore)
        space = vectors(np.array(robot.q_reference))
        course = as_reference(build_target(self.target, space), space)
        start = course(0.0)
        other.follow(start.x, start.v)  # which refuses numbers that do not fit
        other.play(course)
        return other


class LinkCapsuleEntry(Entry):
    """A capsule around a link, or a part of it."""

    frame: str = Field(description="frame of the robot that it is fixed to")
    start: Point = Field(description="centre of one end in the axes of the frame [m]")
    end: Point = Field(description="centre of the other end; the same makes a ball [m]")
    radius: Positive = Field(description="radius [m]")

    def build(self) -> LinkCapsule:
        """Make it."""
        x, y, z = self.start
        u, v, w = self.end
        return LinkCapsule(self.frame, (x, y, z), (u, v, w), self.radius)


class CollisionsEntry(Entry):
    """What the robot is kept away from."""

    margin: Annotated[float, Number("m", at_least=0.0)] = Field(
        default=0.01, description="distance that is kept [m]"
    )
    brake: Annotated[float, Number("m/s²", above=0.0)] = Field(
        default=4.0, description="with which distances can be counted on to stop shrinking [m/s²]"
    )
    pairs: Annotated[Any, Checked(_pairs)] = Field(
        default="auto", description="links that are kept apart: auto, none, or pairs of frames"
    )
    shapes: list[LinkCapsuleEntry] | None = Field(
        default=None, description="capsules of links; null fits them to the robot's own geometry"
    )
    obstacles: dict[str, ObstacleEntry] = Field(
        default_factory=dict, description="name: what is in the workspace"
    )
    others: dict[str, OtherRobotEntry] = Field(
        default_factory=dict, description="name: another robot in the workspace"
    )

    def build(self) -> CollisionAvoidance:
        """Make the guard.

        Raises:
            OpspaceError: A robot or a number that cannot be used.
        """
        obstacles = [entry.build(name) for name, entry in self.obstacles.items()]
        for name, other in self.others.items():
            obstacles.extend(other.build(name).obstacles)
        return CollisionAvoidance(
            *obstacles,
            margin=self.margin,
            shapes="model" if self.shapes is None else [shape.build() for shape in self.shapes],
            brake=self.brake,
            pairs=self.pairs,
        )

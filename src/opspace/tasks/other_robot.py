"""Another robot in the same workspace: its links are obstacles that move as it does."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.robots.protocol import Robot
from opspace.robots.shapes import LinkCapsule, shapes_of
from opspace.tasks.collision_avoidance import wanted_shapes
from opspace.tasks.distance_layout import along
from opspace.tasks.obstacles import Ball, Capsule, Obstacle, Placing
from opspace.tasks.references.sample import Reference
from opspace.tasks.rotation import as_rotation
from opspace.tasks.validation import finite, finite_array


class OtherRobot:
    """The links of a robot as obstacles for another one, with their velocities.

    Hand `obstacles` to the other's `opspace.CollisionAvoidance`, and call `follow` with what this robot
    does, from any thread.

    Two robots that keep away from each other share the speed at which they may close: each moves
    towards the other at ``share`` of it at most, whatever the other does, and one that stands is never
    made to give way. Each gets an `OtherRobot` of the other, with shares whose sum is 1, and guards with
    the same margin and brake. Without a share this robot is something that goes on as it moves.

    Args:
        robot: The robot; it is not changed.
        position: (3,) where its base is in the world of the robot that avoids it, m.
        rotation: Axes of its base there, (3, 3) or quaternion wxyz.
        shapes: Its shapes, as for `opspace.CollisionAvoidance`.
        name: What the names of the obstacles begin with.
        ignore: Links of the robot that avoids it which may touch it.
        share: The part, above 0 and below 1, of the speed at which the two may close that is for the
            robot that avoids it, where this one avoids that one with the rest; None where it does not.

    Raises:
        InputError: Numbers that cannot be used.
        ModelError: The robot's file has no shapes, or the file of shapes cannot be used.
    """

    def __init__(
        self,
        robot: Robot,
        position: ArrayLike = (0.0, 0.0, 0.0),
        rotation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        *,
        shapes: str | Path | Sequence[LinkCapsule] = "model",
        name: str = "other",
        ignore: Iterable[str] = (),
        share: float | None = None,
    ) -> None:
        part = 0.0 if share is None else finite(share, f"the share of {name!r}")
        if share is not None and not 0.0 < part < 1.0:
            raise InputError(f"the share of {name!r} must be above 0 and below 1, not {share!r}")
        self._position = finite_array(position, (3,), f"the position of {name!r}")
        self._rotation = as_rotation(rotation, f"the rotation of {name!r}")
        given, _ = wanted_shapes(shapes)
        found = shapes_of(robot) if isinstance(given, str) else given
        if not found:
            raise InputError(f"{name!r} has no shapes")
        self._robot = robot.fresh()
        self._frames = [self._robot.frame_id(shape.frame) for shape in found]
        places = [along(shape) for shape in found]
        self._axes = np.array([axes for axes, _, _ in places])
        self._middles = np.array([middle for _, middle, _ in places])
        ignored = tuple(ignore)
        self.obstacles: tuple[Obstacle, ...] = tuple(
            _obstacle(shape, 2.0 * half, word, ignored)
            for shape, (*_, half), word in zip(found, places, _words(name, found), strict=True)
        )
        for obstacle in self.obstacles:
            obstacle.share = part
        self.follow(robot.q_reference, np.zeros(robot.nv))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._robot.name!r}, {len(self.obstacles)} links)"

    def follow(self, q: ArrayLike, v: ArrayLike) -> None:
        """Put the links where they are now; the next tick of the other robot sees it.

        Args:
            q: (nq,) configuration, rad.
            v: (n,) velocity, rad/s.

        Raises:
            InputError: A wrong size or a number that is not finite.
        """
        robot = self._robot
        placings = self._placings(
            finite_array(q, (robot.nq,), "q"), finite_array(v, (robot.nv,), "v")
        )
        for obstacle, placing in zip(self.obstacles, placings, strict=True):
            obstacle.put_back(placing)

    def play(self, course: Reference) -> None:
        """Let the links go as the robot does that follows a reference of its joints exactly.

        Args:
            course: Gives positions (n,) [rad] and velocities of its joints at a time.

        Raises:
            InputError: At a tick, what it gives is not (n,) or not finite; here, joints whose positions
                have other coordinates than their velocities.
        """
        robot = self._robot
        if robot.nq != robot.nv:
            raise InputError(f"robot {robot.name!r} has joints that no reference of numbers moves")
        last: tuple[float, list[Placing]] | None = None

        def placings(t: float) -> list[Placing]:
            nonlocal last
            found = last
            if found is None or found[0] != t:
                sample = course(t)
                q = finite_array(sample.x, (robot.nq,), "q of the course")
                v = finite_array(sample.v, (robot.nv,), "v of the course")
                found = last = t, self._placings(q, v)
            return found[1]

        for i, obstacle in enumerate(self.obstacles):
            obstacle.follow(lambda t, i=i: placings(t)[i])

    def _placings(self, q: np.ndarray, v: np.ndarray) -> list[Placing]:
        """Where the capsules of the links are, and how they move."""
        robot, base = self._robot, self._rotation
        robot.update(q, v)
        R = np.array([robot.rotation(frame) for frame in self._frames])
        twist = np.array([robot.velocity(frame) for frame in self._frames])
        arm = (R @ self._middles[:, :, None])[:, :, 0]
        linear = twist[:, :3] + np.cross(twist[:, 3:], arm)
        origin = np.array([robot.position(frame) for frame in self._frames])
        velocity = np.concatenate([linear @ base.T, twist[:, 3:] @ base.T], axis=1)
        position = self._position + (origin + arm) @ base.T
        return list(map(Placing, base @ R @ self._axes, position, velocity))


def _obstacle(shape: LinkCapsule, length: float, name: str, ignore: tuple[str, ...]) -> Obstacle:
    if length == 0.0:
        return Ball(shape.radius, name=name, ignore=ignore)
    return Capsule(shape.radius, length, name=name, ignore=ignore)


def _words(name: str, shapes: Sequence[LinkCapsule]) -> list[str]:
    """Name an obstacle after each shape; those of one frame are numbered."""
    frames = [shape.frame for shape in shapes]
    return [
        f"{name}:{frame}" + (f":{frames[:i].count(frame) + 1}" if frames.count(frame) > 1 else "")
        for i, frame in enumerate(frames)
    ]

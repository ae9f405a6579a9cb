"""What a robot is kept away from: itself, and what stands or moves in its workspace."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from opspace.errors import InputError, unknown_name
from opspace.law.scalars import RETURN_SPEED, TICK_ROOM
from opspace.robots.protocol import Robot
from opspace.robots.shape_file import SUFFIXES, read_shapes
from opspace.robots.shapes import LinkCapsule, joints_that_move, shapes_of
from opspace.robots.srdf import SUFFIX as SRDF
from opspace.robots.srdf import disabled_pairs
from opspace.robots.touching import Pairs, carried_pairs, pairs_of
from opspace.tasks.distance_layout import DistanceLayout, lay_out
from opspace.tasks.obstacles import Obstacle
from opspace.tasks.task import CHANGES
from opspace.tasks.validation import finite, positive

SHAPES = ("model",)
PAIRS = ("auto", "none")


class Carried(NamedTuple):
    """What the robot carries on one frame.

    Attributes:
        shapes: Its capsules.
        pairs: Links that it is kept from, each with the frame.
        touches: Obstacles that it may touch.
    """

    shapes: tuple[LinkCapsule, ...]
    pairs: tuple[tuple[str, str], ...]
    touches: frozenset[str]


class CollisionAvoidance:
    """Keeps a robot from touching itself and obstacles, in every tick, whatever the tasks ask for.

    Every link is a capsule, covered with balls; every ball keeps its distance ρ to every convex set, a
    link or an obstacle, that its link can touch. As for a joint limit (`opspace.JointLimits`) the
    distance D = ρ − margin may shrink only so fast that the arm still stops:

        −ρ̈ ≤ −v v_adm'(D) + k₂ (v_adm(D) − v),   v = −ρ̇

    and the controller answers the acceleration nearest to what the stack wants among those that no
    pair forbids, in the projection that keeps joints and motors, too.

    Args:
        obstacles: What is there from the start.
        margin: Distance that is kept, m.
        shapes: ``"model"``, the collision geometry of the robot's file; a file of ``opspace shapes``,
            ending in .yaml; or capsules of one's own.
        pairs: Links that are kept from each other: ``"auto"`` takes those of the file of shapes, or
            chooses, see `opspace.robots.touching.pairs_of`; an SRDF file leaves out what it disables;
            ``"none"`` is none; or pairs of frames.
        brake: Acceleration with which distances can be counted on to stop shrinking, m/s².

    Raises:
        InputError: A number that cannot be used, or two obstacles of one name.
        ModelError: A file that cannot be used.
        UnknownNameError: An unknown choice; at binding a frame that the robot does not have.
    """

    k1 = 8.0
    k2 = 12.0

    def __init__(
        self,
        *obstacles: Obstacle,
        margin: float = 0.01,
        shapes: str | Path | Sequence[LinkCapsule] = "model",
        pairs: str | Path | Iterable[tuple[str, str]] = "auto",
        brake: float = 4.0,
    ) -> None:
        self.margin = finite(margin, "the margin of collisions")
        if self.margin < 0.0:
            raise InputError(f"the margin of collisions must be at least 0, not {margin}")
        self.brake = positive(brake, "the brake of collisions")
        self._wanted_shapes, chosen = wanted_shapes(shapes)
        self._wanted_pairs = _wanted_pairs(pairs)
        if chosen is not None and self._wanted_pairs == "auto":
            self._wanted_pairs = chosen
        self._robot: Robot | None = None
        self._moved: Mapping[str, frozenset[int]] = {}
        self.shapes: tuple[LinkCapsule, ...] = ()
        self.pairs: tuple[tuple[str, str], ...] = ()
        self.left_out: Mapping[tuple[str, str], str] = {}
        self._obstacles: tuple[Obstacle, ...] = ()
        self._carried: Mapping[str, Carried] = {}
        self._layout: tuple[object, object, DistanceLayout] | None = None
        self.add(*obstacles)

    def __repr__(self) -> str:
        names = ", ".join(obstacle.name for obstacle in self._obstacles) or "none"
        return (
            f"{type(self).__name__}(margin={self.margin:g}, {len(self.shapes)} shapes, "
            f"{len(self.pairs)} pairs of links, obstacles: {names})"
        )

    @property
    def kept(self) -> float:
        """The distance that bounds keep, m: the margin, and what a tick may add to it."""
        return self.margin + TICK_ROOM

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles."""
        return self._obstacles

    def __getitem__(self, name: str) -> Obstacle:
        """Return an obstacle by its name.

        Raises:
            UnknownNameError: There is none.
        """
        for obstacle in self._obstacles:
            if obstacle.name == name:
                return obstacle
        raise unknown_name("obstacle", name, [obstacle.name for obstacle in self._obstacles])

    @property
    def chosen(self) -> Pairs:
        """Pairs of links that are kept apart, and why the others are left out."""
        return Pairs(self.pairs, dict(self.left_out))

    def add(self, *obstacles: Obstacle) -> None:
        """Let there be more obstacles from the next tick on; from any thread.

        Nothing steps if they are not near: one that the arm is about to touch is a bound at once.

        Raises:
            InputError: No obstacle, or one of a name that is taken.
            UnknownNameError: It ignores a link that the robot does not have.
        """
        names = {obstacle.name for obstacle in self._obstacles}
        for obstacle in obstacles:
            if not isinstance(obstacle, Obstacle):
                raise InputError(
                    "a guard takes Ball, Box, Capsule, ConvexMesh and HalfSpace, not "
                    f"{type(obstacle).__name__}"
                )
            if obstacle.name in names:
                raise InputError(f"there is an obstacle {obstacle.name!r} already")
            names.add(obstacle.name)
            self._check_ignored(obstacle)
        self._change((*self._obstacles, *obstacles))

    def remove(self, *names: str) -> None:
        """Forget obstacles from the next tick on; from any thread.

        Raises:
            UnknownNameError: There is none of that name.
        """
        gone = [self[name] for name in names]
        self._change(tuple(o for o in self._obstacles if o not in gone))

    @property
    def carried(self) -> Mapping[str, Carried]:
        """What is carried, by frame."""
        return self._carried

    def carry(self, *shapes: LinkCapsule, ignore: Iterable[str] = ()) -> None:
        """Let the robot hold something from the next tick on, which is kept from touching, too.

        It is kept from every obstacle and from every link that has more than one joint between; not from
        those that are nearer to it than the margin at the robot's present state, such as the hand that
        holds it. What it weighs is for `opspace.Payload`. Call it from the thread that ticks.

        Args:
            shapes: Its capsules, all on one frame that no shape of the robot is on; see
                `opspace.Robot.add_frame`.
            ignore: Names of obstacles and of links that it may touch: the table that it stands on.

        Raises:
            InputError: No shape, shapes on several frames or on one that is taken, or no robot yet.
            UnknownNameError: A frame, a link or an obstacle that there is not.
        """
        robot = self._robot
        if robot is None:
            raise InputError("nothing can be carried before a controller has this guard")
        frames = {shape.frame for shape in shapes}
        if len(frames) != 1:
            raise InputError(f"what is carried is on one frame, not on {sorted(frames) or 'none'}")
        (frame,) = frames
        if frame not in robot.frame_names:
            raise unknown_name("frame", frame, robot.frame_names)
        if frame in self._carried or any(shape.frame == frame for shape in self.shapes):
            raise InputError(f"frame {frame!r} has shapes already: carry it on a frame of its own")
        touched = [ignore] if isinstance(ignore, str) else list(ignore)
        links = list(dict.fromkeys(shape.frame for shape in self.shapes))
        names = [obstacle.name for obstacle in self._obstacles]
        for name in touched:
            if name not in links and name not in names:
                raise unknown_name("link or obstacle", name, [*links, *names])
        apart = carried_pairs(robot, self.shapes, shapes, self.margin)
        pairs = tuple(pair for pair in apart if pair[0] not in touched)
        found = Carried(shapes, pairs, frozenset(touched))
        self._moved = {**self._moved, frame: joints_that_move(robot, [frame])[0]}
        self._carried = {**self._carried, frame: found}
        CHANGES.last = object()

    def release(self, *frames: str) -> None:
        """Forget what is carried on frames from the next tick on.

        Raises:
            UnknownNameError: Nothing is carried there.
        """
        for frame in frames:
            if frame not in self._carried:
                raise unknown_name("frame that carries something", frame, self._carried)
        self._carried = {f: c for f, c in self._carried.items() if f not in frames}
        CHANGES.last = object()

    def clearance_lost(self, speed: float) -> float:
        """How much nearer than the margin an obstacle comes that hides its speed, m.

        The arm stays where it retreats as fast as the obstacle follows, u: at D < 0 with
        −v_adm(D) = u (1 + v_adm'(D)/k₂), v_adm and its slope those of joints beyond their limits.

        Args:
            speed: u, m/s.

        Returns:
            −D; inf from the speed on with which it retreats at most, `opspace.law.scalars.RETURN_SPEED`.
        """
        share = abs(finite(speed, "the speed of an obstacle")) / RETURN_SPEED
        if share >= 1.0:
            return math.inf
        slope = share * self.k1 / self.k2
        if slope == 0.0:
            return 0.0
        y = (math.sqrt(1.0 + 4.0 * slope * (share + slope)) - 1.0) / (2.0 * slope)
        return RETURN_SPEED / self.k1 * math.atanh(y)

    def bind(self, robot: Robot) -> None:
        """Find the links of a robot, their shapes and the pairs that are to be watched.

        Raises:
            InputError: It is bound to another robot.
            ModelError: The robot's file has no shapes.
            UnknownNameError: A frame that the robot does not have.
        """
        if self._robot is robot:
            return
        if self._robot is not None:
            raise InputError(f"this guard is for {self._robot.name!r} already: make another one")
        given = self._wanted_shapes
        shapes = shapes_of(robot) if isinstance(given, str) else given
        frames = list(dict.fromkeys(shape.frame for shape in shapes))
        for frame in frames:
            if frame not in robot.frame_names:
                raise unknown_name("frame", frame, robot.frame_names)
        self.pairs, self.left_out = self._chosen(robot, shapes, frames)
        self._moved = dict(zip(frames, joints_that_move(robot, frames), strict=True))
        self.shapes, self._robot = tuple(shapes), robot
        for obstacle in self._obstacles:
            self._check_ignored(obstacle)

    def _chosen(self, robot: Robot, shapes: Sequence[LinkCapsule], frames: Sequence[str]) -> Pairs:
        wanted = self._wanted_pairs
        if wanted == "auto":
            return pairs_of(robot, shapes, self.margin)
        if isinstance(wanted, str):
            return Pairs((), {})
        if isinstance(wanted, Pairs):
            return wanted
        if isinstance(wanted, dict):
            return pairs_of(robot, shapes, self.margin, wanted)
        for name in {name for pair in wanted for name in pair}:
            if name not in frames:
                raise unknown_name("link with a shape", name, frames)
        return Pairs(wanted, {})

    def layout(self) -> DistanceLayout:
        """Lay out the present obstacles; the same object as long as none comes or goes."""
        found, obstacles, carried = self._layout, self._obstacles, self._carried
        if found is None or found[0] is not obstacles or found[1] is not carried:
            assert self._robot is not None
            held = carried.values()
            laid_out = lay_out(
                self._robot,
                (*self.shapes, *chain.from_iterable(c.shapes for c in held)),
                self._moved,
                (*self.pairs, *chain.from_iterable(c.pairs for c in held)),
                obstacles,
                {frame: c.touches for frame, c in carried.items()},
            )
            found = self._layout = obstacles, carried, laid_out
        return found[2]

    def _change(self, obstacles: tuple[Obstacle, ...]) -> None:
        self._obstacles = obstacles
        CHANGES.last = object()

    def _check_ignored(self, obstacle: Obstacle) -> None:
        if self._robot is None:
            return
        for name in obstacle.ignore:
            if name not in self._moved:
                raise unknown_name(f"link that {obstacle.name!r} ignores", name, self._moved)


def wanted_shapes(
    shapes: str | Path | Sequence[LinkCapsule],
) -> tuple[str | tuple[LinkCapsule, ...], Pairs | None]:
    """Read what shapes are given as, and the pairs that come with them."""
    if isinstance(shapes, Path) or (isinstance(shapes, str) and shapes.endswith(SUFFIXES)):
        return read_shapes(shapes)
    if isinstance(shapes, str):
        if shapes not in SHAPES:
            raise unknown_name("shapes", shapes, (*SHAPES, *(f"a {end} file" for end in SUFFIXES)))
        return shapes, None
    return tuple(shapes), None


def _wanted_pairs(
    pairs: str | Path | Iterable[tuple[str, str]],
) -> str | Pairs | dict[frozenset[str], str] | tuple[tuple[str, str], ...]:
    """Read what pairs are given as: a choice, what an SRDF file disables, or pairs of frames."""
    if isinstance(pairs, Path) or (isinstance(pairs, str) and pairs.endswith(SRDF)):
        return disabled_pairs(pairs)
    if isinstance(pairs, str):
        if pairs not in PAIRS:
            raise unknown_name("pairs", pairs, (*PAIRS, f"a {SRDF} file"))
        return pairs
    return tuple(pairs)

"""Things in the world that a robot is to stay away from; they may move."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.law.polyhedra import FACE_ROWS
from opspace.tasks.hulls import hull_faces
from opspace.tasks.references.sample import Reference, Sample
from opspace.tasks.rotation import as_rotation
from opspace.tasks.task import CHANGES
from opspace.tasks.validation import Array, finite, finite_array, numbers, positive
from opspace.tasks.ways import Pace, VectorWay

_NONE = np.zeros(3)
_STILL = np.zeros(6)
_UPRIGHT = np.eye(3)

LED = Pace(0.3, 1.0)
"""Limits of an obstacle that is led, m/s, m/s². An acceleration a costs a/(k₁k₂) of the margin."""


class Placing(NamedTuple):
    """Where an obstacle is and how it moves, in world axes.

    Attributes:
        rotation: (3, 3).
        position: (3,) m.
        velocity: (6,) of its origin, then angular, m/s and rad/s.
    """

    rotation: Array
    position: Array
    velocity: Array


NO_PLACINGS: Mapping[str, Placing] = MappingProxyType({})


class Obstacle:
    """A convex set that may move: a box of any size, grown by a radius.

    Attributes:
        name: Its name, unique within a guard.
        ignore: Frames of links that need not stay away from it: a hand that is to touch it, a base
            that stands on it.
        lower: (3,) where the box begins in its own axes, m.
        upper: (3,) where it ends, m.
        radius: By how much it is grown, m.
        faces: (f, 4, 3) of a mesh, three corners and the outward normal of each in its own axes, m; the
            box is then around it. None of a box.
        share: Where it keeps away itself, the part of the speed at which the two may close that is left
            to the robot, below 1; 0 where it goes on as it moves, whatever comes.
    """

    def __init__(
        self,
        name: str,
        extent: tuple[ArrayLike, ArrayLike],
        radius: float,
        position: ArrayLike | Reference,
        rotation: ArrayLike,
        velocity: ArrayLike,
        ignore: Iterable[str],
    ) -> None:
        if not name:
            raise InputError("an obstacle needs a name that is not empty")
        if isinstance(ignore, str):
            raise InputError(f"ignore of {name!r} takes names of links, not one text")
        self.name = name
        self.ignore = tuple(ignore)
        self.lower, self.upper = np.array(extent[0], float), np.array(extent[1], float)
        self.radius = radius
        self.faces = np.zeros((0, FACE_ROWS, 3))
        self.share = 0.0
        # One record, assigned once: a tick in another thread sees the old place or the new one.
        self._state = self._told(position, rotation, velocity, _NONE)

    def __repr__(self) -> str:
        x, y, z = self.position.tolist()
        return f"{type(self).__name__}({self.name!r}, at {x:.3g}, {y:.3g}, {z:.3g})"

    @property
    def position(self) -> Array:
        """Where its origin is, or was at the last tick where it follows a reference, (3,) m."""
        return self._state[0].position

    @property
    def rotation(self) -> Array:
        """Its axes, (3, 3)."""
        return self._state[0].rotation

    @property
    def velocity(self) -> Array:
        """How it moves, (6,) linear then angular, m/s and rad/s."""
        return self._state[0].velocity

    @property
    def moving(self) -> bool:
        """Whether it follows a reference in time."""
        return self._state[1] is not None

    def placing(self, t: float) -> Placing:
        """Tell where it is and how it moves at one moment.

        Args:
            t: Time, s.

        Raises:
            InputError: Its reference gave something else than a position (3,).
        """
        found = self._state
        here, path = found
        if path is None:
            return here
        begin = getattr(path, "begin_at", None)
        path = path if begin is None else begin(t)
        sample: Any = path(t)
        if isinstance(sample, Placing):
            here = sample
            if self._state is found:
                self._state = here, path
            return here
        speed = sample.v if np.size(sample.v) else _NONE
        here, _ = self._told(sample.x, here.rotation, speed, _NONE)
        if self._state is found:  # nobody has placed it meanwhile
            self._state = here, path
        return here

    def place(
        self,
        position: ArrayLike | Reference | None = None,
        rotation: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
    ) -> None:
        """Tell where it is now; from any thread, seen at the next tick.

        A velocity that is not told is taken for zero, and what moves all the same comes nearer than the
        margin. Between two calls it stays where it was told to be. A jump in place is a jump in what
        the arm may do.

        Args:
            position: (3,) of its origin, m, or a reference in time that it follows, with its velocity;
                None is where it was.
            rotation: (3, 3) or quaternion wxyz; None is as it was.
            velocity: (3,) linear or (6,) linear and angular, m/s and rad/s; None is none.

        Raises:
            InputError: A wrong shape or a number that is not finite.
        """
        here, _ = self._state
        self._state = self._told(
            here.position if position is None else position,
            here.rotation if rotation is None else rotation,
            _STILL if velocity is None else velocity,
            here.position,
        )
        CHANGES.last = object()

    def follow(self, course: Callable[[float], Placing]) -> None:
        """Let it go where something says that it is, turn and all, from the next tick on.

        Args:
            course: Gives the placing at a time, s.
        """
        self._state = self._state[0], course
        CHANGES.last = object()

    def lead(self, goal: ArrayLike, t: float) -> None:
        """Let it go from where it is to another place, within `LED`, so that what follows it can stop.

        The way begins as it moves at time ``t``, so it may be asked for again and again, as a hand that
        drags an obstacle does.

        Args:
            goal: (3,) where its origin goes, m.
            t: Time of the present tick, s.

        Raises:
            InputError: A wrong shape or a number that is not finite.
        """
        end = finite_array(goal, (3,), f"the goal of {self.name!r}")
        here, path = self._state
        now = Sample(here.position, here.velocity[:3], _NONE)
        if isinstance(path, VectorWay):
            now = path(t)
        self.place(VectorWay.to(now, end, t, LED))

    def put_back(self, placing: Placing) -> None:
        """Let it be exactly so, to the last bit, whatever it follows.

        Args:
            placing: What `placing` of it or of another one gave; it is not checked.
        """
        self._state = placing, None
        CHANGES.last = object()

    def _told(
        self,
        position: ArrayLike | Reference,
        rotation: ArrayLike,
        velocity: ArrayLike,
        before: ArrayLike,
    ) -> tuple[Placing, Reference | None]:
        given = numbers(velocity, f"the velocity of {self.name!r}")
        if given.shape == (3,):
            given = np.concatenate([given, _NONE])
        path: Any = position if callable(position) else None
        return Placing(
            as_rotation(rotation, f"the rotation of {self.name!r}"),
            finite_array(
                before if path is not None else cast("ArrayLike", position),
                (3,),
                f"the position of {self.name!r}",
            ),
            finite_array(given, (6,), f"the velocity of {self.name!r}"),
        ), path


class Ball(Obstacle):
    """A ball.

    Args:
        radius: m.
        position: (3,) of its centre, m, or a reference in time.
        velocity: (3,) m/s.
        name: Its name.
        ignore: Links that need not stay away from it.

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        radius: float,
        position: ArrayLike | Reference = _NONE,
        *,
        velocity: ArrayLike = _STILL,
        name: str = "ball",
        ignore: Iterable[str] = (),
    ) -> None:
        grown = positive(radius, f"the radius of {name!r}")
        super().__init__(name, (_NONE, _NONE), grown, position, _UPRIGHT, velocity, ignore)


class Capsule(Obstacle):
    """A cylinder with round ends along its own z axis.

    Args:
        radius: m.
        length: Of the part between the ends, m.
        position: (3,) of its middle, m, or a reference in time.
        rotation: Its axes, (3, 3) or quaternion wxyz.
        velocity: (3,) or (6,), m/s and rad/s.
        name: Its name.
        ignore: Links that need not stay away from it.

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        radius: float,
        length: float,
        position: ArrayLike | Reference = _NONE,
        rotation: ArrayLike = _UPRIGHT,
        *,
        velocity: ArrayLike = _STILL,
        name: str = "capsule",
        ignore: Iterable[str] = (),
    ) -> None:
        grown = positive(radius, f"the radius of {name!r}")
        end = np.array([0.0, 0.0, 0.5 * positive(length, f"the length of {name!r}")])
        super().__init__(name, (-end, end), grown, position, rotation, velocity, ignore)


class Box(Obstacle):
    """A box.

    Args:
        size: (3,) length of its sides, m.
        position: (3,) of its middle, m, or a reference in time.
        rotation: Its axes, (3, 3) or quaternion wxyz.
        velocity: (3,) or (6,), m/s and rad/s.
        name: Its name.
        ignore: Links that need not stay away from it.

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        size: ArrayLike,
        position: ArrayLike | Reference = _NONE,
        rotation: ArrayLike = _UPRIGHT,
        *,
        velocity: ArrayLike = _STILL,
        name: str = "box",
        ignore: Iterable[str] = (),
    ) -> None:
        half = 0.5 * finite_array(size, (3,), f"the size of {name!r}")
        if not np.all(half > 0.0):
            raise InputError(f"the size of {name!r} must be above zero, not {size!r}")
        super().__init__(name, (-half, half), 0.0, position, rotation, velocity, ignore)


class ConvexMesh(Obstacle):
    """The convex hull of points, grown by a radius.

    A row costs more the more faces there are, so give a coarse hull.

    Args:
        vertices: (k, 3) in its own axes, m; at least four, not in one plane.
        position: (3,) of the origin of these axes, m, or a reference in time.
        rotation: Its axes, (3, 3) or quaternion wxyz.
        radius: By how much it is grown, m.
        velocity: (3,) or (6,), m/s and rad/s.
        name: Its name.
        ignore: Links that need not stay away from it.

    Raises:
        InputError: A number that cannot be used, or points without a volume.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        position: ArrayLike | Reference = _NONE,
        rotation: ArrayLike = _UPRIGHT,
        *,
        radius: float = 0.0,
        velocity: ArrayLike = _STILL,
        name: str = "mesh",
        ignore: Iterable[str] = (),
    ) -> None:
        points = numbers(vertices, f"the vertices of {name!r}")
        faces = hull_faces(points, f"the vertices of {name!r}")
        grown = finite(radius, f"the radius of {name!r}")
        if grown < 0.0:
            raise InputError(f"the radius of {name!r} must be at least 0, not {radius!r}")
        corners = faces[:, :3].reshape(-1, 3)
        extent = corners.min(axis=0), corners.max(axis=0)
        super().__init__(name, extent, grown, position, rotation, velocity, ignore)
        self.faces = faces


class HalfSpace(Obstacle):
    """All that is on one side of a plane: a floor, a wall.

    Args:
        point: (3,) a point of the plane, m.
        normal: (3,) out of it, towards where the robot may be; of any length.
        velocity: (3,) m/s.
        name: Its name.
        ignore: Links that need not stay away from it.

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        point: ArrayLike = _NONE,
        normal: ArrayLike = (0.0, 0.0, 1.0),
        *,
        velocity: ArrayLike = _STILL,
        name: str = "floor",
        ignore: Iterable[str] = (),
    ) -> None:
        way = finite_array(normal, (3,), f"the normal of {name!r}")
        if not np.any(way):
            raise InputError(f"the normal of {name!r} must not be zero")
        without = np.array([math.inf, math.inf, 0.0])
        extent = np.full(3, -math.inf), without
        super().__init__(name, extent, 0.0, point, _axes_about(way), velocity, ignore)


def _axes_about(normal: Array) -> Array:
    """Axes with z along a direction, (3, 3)."""
    z = normal / np.linalg.norm(normal)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])

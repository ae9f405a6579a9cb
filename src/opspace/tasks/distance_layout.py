"""Balls of a robot and the convex sets that they keep away from, as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

import numpy as np

from opspace.command import Distance
from opspace.errors import ByName
from opspace.law.polyhedra import FACE_ROWS, Meshes
from opspace.robots.protocol import Robot
from opspace.robots.shapes import LinkCapsule
from opspace.tasks.obstacles import Obstacle, Placing

NOTHING_TOUCHES: Mapping[str, frozenset[str]] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class DistanceLayout:
    """Which balls of a robot keep their distance to which convex sets.

    Attributes:
        obstacles: The obstacles; their sets are the last ones.
        ball_frame: (balls,) frame of the robot that carries each ball.
        ball_centre: (balls, 3) in the axes of the frame, m.
        ball_radius: (balls,) m.
        set_frame: (sets,) frame that carries each set, −1 for an obstacle.
        set_rotation: (sets, 3, 3) its axes on the frame; those of an obstacle are to be asked of it.
        set_position: (sets, 3) its origin there, m.
        lower: (sets, 3) where each set begins in its own axes, m.
        upper: (sets, 3) where it ends, m.
        set_radius: (sets,) by how much it is grown, m.
        mesh: (sets, 2) its first face and how many it has; none where it is a box.
        face: (faces, 4, 3) corners and normal of each in the axes of its set, m.
        share: (sets,) see `Obstacle.share`; 0 for links.
        rows: (rows, 2) a ball and a set each.
        pairs: Names of the pairs of bodies, "body/body".
        pair: (rows,) the pair that each row belongs to.
    """

    obstacles: tuple[Obstacle, ...]
    ball_frame: np.ndarray
    ball_centre: np.ndarray
    ball_radius: np.ndarray
    set_frame: np.ndarray
    set_rotation: np.ndarray
    set_position: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    set_radius: np.ndarray
    mesh: np.ndarray
    face: np.ndarray
    share: np.ndarray
    rows: np.ndarray
    pairs: tuple[str, ...]
    pair: np.ndarray

    def meshes_of(self, sets: np.ndarray) -> Meshes | None:
        """Say which of some sets are meshes; None where there is no mesh at all."""
        return Meshes(self.mesh[sets], self.face) if self.face.size else None

    def placings(self, t: float) -> tuple[Placing, ...]:
        """Ask every obstacle where it is at time t, s."""
        return tuple(obstacle.placing(t) for obstacle in self.obstacles)

    def by_name(self, placings: Sequence[Placing]) -> dict[str, Placing]:
        """Give what `placings` tells the names of the obstacles."""
        return {o.name: placing for o, placing in zip(self.obstacles, placings, strict=True)}

    def status(self, distance: np.ndarray, taken: np.ndarray) -> dict[str, Distance]:
        """Tell of every pair of bodies how near it is and how much it acts, the nearest first.

        Args:
            distance: (rows,) between the shapes, m.
            taken: (rows,) what each bound takes from how fast its distance shrinks, m/s².
        """
        near, most = np.full(len(self.pairs), np.inf), np.zeros(len(self.pairs))
        np.minimum.at(near, self.pair, distance)
        np.maximum.at(most, self.pair, taken)
        order = np.argsort(near, kind="stable")
        names = [self.pairs[k] for k in order.tolist()]
        told = map(Distance, near[order].tolist(), most[order].tolist())
        return ByName(zip(names, told, strict=True))


def lay_out(
    robot: Robot,
    shapes: Sequence[LinkCapsule],
    moved: Mapping[str, frozenset[int]],
    pairs: Sequence[tuple[str, str]],
    obstacles: tuple[Obstacle, ...],
    touches: Mapping[str, frozenset[str]] = NOTHING_TOUCHES,
) -> DistanceLayout:
    """Cover the links with balls, and pair these with the sets that they are to keep away from.

    Args:
        robot: The robot.
        shapes: Its capsules.
        moved: Joints that move each link, by frame.
        pairs: Links that are kept apart.
        obstacles: The obstacles.
        touches: Names of the obstacles that a link may touch, by frame, beside what these say.
    """
    covers = [shape.balls() for shape in shapes]
    of_shape = np.repeat(np.arange(len(covers)), [len(balls) for balls, _ in covers])
    places = [along(shape) for shape in shapes]
    frames = np.array([robot.frame_id(shape.frame) for shape in shapes], np.int64)
    halves = np.array([(0.0, 0.0, half) for *_, half in places]).reshape(-1, 3)
    lower, upper = ([getattr(o, side) for o in obstacles] for side in ("lower", "upper"))
    names, rows = _rows(shapes, of_shape, moved, pairs, obstacles, touches)
    extra = len(obstacles)
    return DistanceLayout(
        obstacles,
        frames[of_shape],
        np.concatenate([balls for balls, _ in covers]) if covers else np.zeros((0, 3)),
        np.array([covers[i][1] for i in of_shape]),
        np.concatenate([frames, np.full(extra, -1)]),
        np.array([*[R for R, _, _ in places], *[np.eye(3)] * extra]).reshape(-1, 3, 3),
        np.array([*[p for _, p, _ in places], *[np.zeros(3)] * extra]).reshape(-1, 3),
        np.concatenate([-halves, np.array(lower).reshape(-1, 3)]),
        np.concatenate([halves, np.array(upper).reshape(-1, 3)]),
        np.array([*[s.radius for s in shapes], *[o.radius for o in obstacles]]),
        *_meshes(len(shapes), obstacles),
        np.array([*[0.0] * len(shapes), *[o.share for o in obstacles]]),
        rows[:, :2],
        names,
        rows[:, 2],
    )


def _meshes(links: int, obstacles: Sequence[Obstacle]) -> tuple[np.ndarray, np.ndarray]:
    """Say where the faces of every set are in the list of all, and list them."""
    count = np.array([0] * links + [o.faces.shape[0] for o in obstacles], np.int64)
    first = np.cumsum(count) - count
    faces = [np.zeros((0, FACE_ROWS, 3)), *(o.faces for o in obstacles)]
    return np.column_stack([first, count]), np.concatenate(faces)


def _rows(
    shapes: Sequence[LinkCapsule],
    of_shape: np.ndarray,
    moved: Mapping[str, frozenset[int]],
    pairs: Sequence[tuple[str, str]],
    obstacles: Sequence[Obstacle],
    touches: Mapping[str, frozenset[str]],
) -> tuple[tuple[str, ...], np.ndarray]:
    """Name the pairs of bodies, and give the ball, set and pair of every row."""
    parts: dict[str, list[int]] = {}
    for i, shape in enumerate(shapes):
        parts.setdefault(shape.frame, []).append(i)
    count = np.bincount(of_shape, minlength=len(shapes))
    names: list[str] = []
    rows: list[tuple[int, int, int]] = []

    def keep(shape: int, to: int) -> None:
        rows.extend((int(ball), to, len(names)) for ball in np.flatnonzero(of_shape == shape))

    for one, two in pairs:
        for i, j in product(parts[one], parts[two]):
            if count[i] <= count[j]:
                keep(i, j)
            else:
                keep(j, i)
        names.append(f"{one}/{two}")
    for k, obstacle in enumerate(obstacles, len(shapes)):
        for frame, joints in moved.items():
            if frame not in parts or not joints:
                continue
            if frame not in obstacle.ignore and obstacle.name not in touches.get(frame, ()):
                for i in parts[frame]:
                    keep(i, k)
                names.append(f"{frame}/{obstacle.name}")
    return tuple(names), np.array(rows, np.int64).reshape(-1, 3)


def along(shape: LinkCapsule) -> tuple[np.ndarray, np.ndarray, float]:
    """Axes with z along a capsule, its middle and half its length, m."""
    start, end = np.array(shape.start), np.array(shape.end)
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        return np.eye(3), start, 0.0
    z = (end - start) / length
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= math.sqrt(float(x @ x))
    return np.column_stack([x, np.cross(z, x), z]), 0.5 * (start + end), 0.5 * length

"""What a robot is kept away from, in the header and the rows of a recording."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import chain
from typing import Any

import numpy as np

from opspace.command import Distance
from opspace.controller import ReferenceController
from opspace.errors import OpspaceError, RecordingError
from opspace.law.polyhedra import FACE_ROWS
from opspace.record.format import Column
from opspace.record.reader import Recording
from opspace.robots.shapes import LinkCapsule
from opspace.tasks import CollisionAvoidance
from opspace.tasks.obstacles import Obstacle, Placing

HEADER_KEY = "collisions"
GROUP = "obstacles"
PARTS = {
    **{f"position/{a}": ("m", f"where its origin is, {a}") for a in "xyz"},
    **{f"axes/{i}{j}": ("1", f"part {i} of its axis {j}") for i in "xyz" for j in "xyz"},
    **{f"velocity/{a}": ("m/s", f"velocity of its origin, {a}") for a in "xyz"},
    **{f"velocity/r{a}": ("rad/s", f"how it turns about {a}") for a in "xyz"},
}
"""What is recorded of an obstacle in every tick, to the last bit: unit and meaning."""

_NOWHERE = np.full(len(PARTS), np.nan)


def about_collisions(guard: CollisionAvoidance) -> dict[str, Any]:
    """Describe a guard in JSON's own types.

    Returns:
        ``margin``, m; ``shapes`` and ``pairs`` of links; ``obstacles`` by name: where the set begins and
        ends in its own axes, null where it does not, by how much it is grown, m, its faces where it is a
        mesh, and its share.
    """
    return {
        "margin": guard.margin,
        "shapes": [asdict(shape) for shape in guard.shapes],
        "pairs": [list(pair) for pair in guard.pairs],
        "obstacles": {
            o.name: {
                "kind": type(o).__name__,
                "lower": _finite(o.lower),
                "upper": _finite(o.upper),
                "radius": o.radius,
                "faces": o.faces.tolist(),
                "share": o.share,
                "ignore": list(o.ignore),
            }
            for o in guard.obstacles
        },
    }


def recorded_shapes(about: Mapping[str, Any]) -> tuple[LinkCapsule, ...]:
    """Read the capsules of links back from what `about_collisions` says."""
    return tuple(
        LinkCapsule(s["frame"], tuple(s["start"]), tuple(s["end"]), float(s["radius"]))
        for s in about["shapes"]
    )


def recorded_obstacle(name: str, about: Mapping[str, Any]) -> Obstacle:
    """Make the obstacle that an entry of ``obstacles`` describes, at the origin of the world."""
    ends = (
        [sign * math.inf if x is None else float(x) for x in about[side]]
        for side, sign in (("lower", -1.0), ("upper", 1.0))
    )
    lower, upper = ends
    here = np.zeros(3)
    found = Obstacle(
        name, (lower, upper), about["radius"], here, np.eye(3), np.zeros(6), about["ignore"]
    )
    found.share = float(about.get("share", 0.0))
    found.faces = np.array(about.get("faces", ()), float).reshape(-1, FACE_ROWS, 3)
    return found


def columns_of_collisions(guard: CollisionAvoidance) -> list[Column]:
    """List the columns of a guard: the nearest pair, every pair, and where every obstacle is."""
    return [
        Column("distances/least", "m", "distance of the nearest pair that is kept apart"),
        Column("distances/taken", "m/s²", "the most that a pair slows down its approach"),
        *(Column(f"distances/{pair}", "m", f"distance of {pair}") for pair in pairs_of(guard)),
        *columns_of_obstacles([obstacle.name for obstacle in guard.obstacles]),
    ]


def pairs_of(guard: CollisionAvoidance) -> tuple[str, ...]:
    """List the pairs of bodies that a guard keeps apart now, each once."""
    return tuple(dict.fromkeys(guard.layout().pairs))


def columns_of_obstacles(names: Sequence[str]) -> list[Column]:
    """List the columns of obstacles; rows hold NaN while there is none of that name."""
    return [
        Column(f"{GROUP}/{name}/{part}", unit, f"{name}: {what}")
        for name in names
        for part, (unit, what) in PARTS.items()
    ]


class CollisionRows:
    """Writes the rows of a guard, for the pairs and obstacles that it has at the start.

    Args:
        controller: The controller that is recorded.
        guard: Its guard.
    """

    def __init__(self, controller: ReferenceController, guard: CollisionAvoidance) -> None:
        self._controller, self._guard = controller, guard
        self._pairs = pairs_of(guard)
        self._names = tuple(obstacle.name for obstacle in guard.obstacles)
        self._known = {*self._names, *guard.carried}

    def row(self, distances: Mapping[str, Distance]) -> list[np.ndarray]:
        """Give the numbers of one tick for `columns_of_collisions`."""
        placings = self._controller.placings
        self._tell("the obstacle", placings.keys() - self._known)
        self._tell("what is carried on", self._guard.carried.keys() - self._known)
        apart = distances.values()
        least = min((pair.distance for pair in apart), default=math.inf)
        taken = max((pair.taken for pair in apart), default=0.0)
        each = [
            math.nan if (pair := distances.get(name)) is None else pair.distance
            for name in self._pairs
        ]
        return [np.array([least, taken, *each]), *row_of_placings(placings, self._names)]

    def _tell(self, what: str, late: set[str]) -> None:
        """Say once what a recording has no columns for."""
        if not late:
            return
        self._known |= late
        names = ", ".join(map(repr, sorted(late)))
        warnings.warn(
            f"{what} {names} came after the recording began: it is not recorded, and a replay does not "
            "know of it",
            stacklevel=3,
        )


def row_of_placings(placings: Mapping[str, Placing], names: Sequence[str]) -> list[np.ndarray]:
    """Give the numbers of one tick for `columns_of_obstacles`."""
    found = [placings.get(name) for name in names]
    return [
        _NOWHERE if p is None else np.concatenate([p.position, p.rotation.reshape(9), p.velocity])
        for p in found
    ]


def recorded_placings(recording: Recording) -> list[Mapping[str, Placing]] | None:
    """Read back where the obstacles were in every tick; None where no guard was recorded."""
    if HEADER_KEY not in recording.header:
        return None
    last = f"/{next(iter(PARTS))}"
    names = [
        column.name.removeprefix(f"{GROUP}/").removesuffix(last)
        for column in recording.columns
        if column.name.startswith(f"{GROUP}/") and column.name.endswith(last)
    ]
    by_name = {name: row_columns(recording, name) for name in names}
    return [
        {
            name: placing_of(x[i])
            for name, x in by_name.items()
            if x is not None and not np.isnan(x[i, 0])
        }
        for i in range(len(recording))
    ]


def row_columns(recording: Recording, name: str) -> np.ndarray | None:
    """Read the columns of an obstacle, (T, parts); None where none of that name was recorded."""
    columns = [f"{GROUP}/{name}/{part}" for part in PARTS]
    if columns[0] not in recording:
        return None
    return np.column_stack([recording[column] for column in columns])


def placing_of(numbers: np.ndarray) -> Placing:
    """Read the numbers of an obstacle in one tick, in the order of `PARTS`."""
    return Placing(numbers[3:12].reshape(3, 3), numbers[:3], numbers[12:])


class ObstaclePlayer:
    """Puts the obstacles of a controller where those of a recording were.

    Args:
        recording: The recording.
        controller: A controller like the one that was recorded.

    Raises:
        RecordingError: The recording has a guard and the controller has none, or it has an obstacle
            that neither the controller nor the header knows.
    """

    def __init__(self, recording: Recording, controller: ReferenceController) -> None:
        self._rows = recorded_placings(recording)
        self._guard = controller.collisions
        self._known: dict[str, Obstacle] = {}
        if self._rows is None:
            return
        where = recording.directory
        if self._guard is None:
            raise RecordingError(f"{where} was recorded with collisions, the controller has none")
        about = recording.header[HEADER_KEY]["obstacles"]
        self._known = {obstacle.name: obstacle for obstacle in self._guard.obstacles}
        for name in dict.fromkeys(chain.from_iterable(self._rows)):
            if name in self._known:
                continue
            try:
                self._known[name] = recorded_obstacle(name, about[name])
            except (KeyError, TypeError, ValueError, OpspaceError):
                raise RecordingError(f"{where} does not tell what obstacle {name!r} is") from None

    def put(self, row: int) -> None:
        """Put them where they were in one tick, after the tick before it.

        Who comes again is the last, as it was then: sums over obstacles have the order of these.
        """
        if self._rows is None or self._guard is None:
            return
        placings, guard = self._rows[row], self._guard
        present = {obstacle.name for obstacle in guard.obstacles}
        if gone := present - placings.keys():
            guard.remove(*gone)
        if new := [name for name in placings if name not in present]:
            guard.add(*(self._known[name] for name in new))
        for name, placing in placings.items():
            self._known[name].put_back(placing)


def _finite(values: np.ndarray) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in values]

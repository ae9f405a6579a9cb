"""What a robot carries beside its own links, and the numbers that compiled code has of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.robots.placement import as_numbers, skew

if TYPE_CHECKING:
    from opspace.machine.field_table import Record
    from opspace.robots.motion_axes import FramePlace, MassPoint

UPPER = ([0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2])
"""Entries xx, xy, yy, xz, yz, zz of a symmetric matrix."""


@dataclass(frozen=True)
class Payload:
    """A rigid body that is fixed to a frame of the robot.

    Attributes:
        mass: kg.
        centre: (3,) centre of mass in the frame's axes, m.
        inertia: (3, 3) inertia about it in the frame's axes, or (3,) its diagonal, kg·m²; None is a
            point of mass.
        frame: Name of the frame; None is the robot's tool.

    Raises:
        InputError: A mass below zero, an inertia that no body has, or numbers that are none.
    """

    mass: float
    centre: ArrayLike = (0.0, 0.0, 0.0)
    inertia: ArrayLike | None = None
    frame: str | None = None

    def __post_init__(self) -> None:
        mass = float(as_numbers(self.mass, "the mass of a payload", ()))
        if mass < 0.0:
            raise InputError(f"the mass of a payload must be >= 0 kg, got {mass:g}")
        object.__setattr__(self, "mass", mass)
        centre = as_numbers(self.centre, "the centre of a payload", (3,))
        # As plain numbers: two payloads can be compared.
        object.__setattr__(self, "centre", tuple(centre.tolist()))
        tensor = np.zeros(3) if self.inertia is None else self.inertia
        tensor = as_numbers(tensor, "the inertia of a payload", (3, 3), (3,))
        tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
        moments = np.linalg.eigvalsh(tensor)
        slack = 1e-9 * max(float(moments[-1]), 1e-9)
        if not np.allclose(tensor, tensor.T, atol=slack) or moments[0] < -slack:
            raise InputError("the inertia of a payload must be symmetric and positive")
        if moments[2] > moments[0] + moments[1] + slack:
            raise InputError(
                "the inertia of a payload must be one that a body can have: each moment at most "
                f"the sum of the others, not {', '.join(f'{m:g}' for m in moments)} kg·m²"
            )
        object.__setattr__(self, "inertia", tuple(map(tuple, tensor.tolist())))

    @property
    def load(self) -> np.ndarray:
        """Return it as a `load`, about the origin and in the axes of its frame."""
        return load(self.mass, np.asarray(self.centre), np.asarray(self.inertia))


def load(mass: float, centre: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Write a body as ten numbers that simply add up: m, m c, and the inertia about the origin.

    Args:
        mass: m, kg.
        centre: (3,) c, m.
        inertia: (3, 3) about the centre, kg·m².
    """
    tensor = inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.concatenate(([mass], mass * centre, tensor[UPPER]))


def tensor_of(numbers: np.ndarray) -> np.ndarray:
    """Return the inertia (3, 3) about the origin of a `load`."""
    tensor = np.empty((3, 3))
    tensor[UPPER] = numbers[4:]
    tensor[UPPER[::-1]] = numbers[4:]
    return tensor


def moved(numbers: np.ndarray, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """See a `load` from another frame.

    Args:
        numbers: (10,) the load.
        rotation: (3, 3) of its axes there.
        position: (3,) of its origin there, m.
    """
    mass, moment = numbers[0], rotation @ numbers[1:4]
    P, H = skew(position), skew(moment)
    tensor = rotation @ tensor_of(numbers) @ rotation.T - P @ H - H @ P - mass * P @ P
    return np.concatenate(([mass], moment + mass * position, tensor[UPPER]))


class Masses:
    """Masses of the links as compiled code reads them; what the robot carries is added in place.

    Attributes:
        place: (links, 2) body and last joint of each.
        points: (links, 4) its mass, kg, and centre on the body, m.

    Args:
        links: The moving links.
        frames: Where the robot's own frames are fixed.
        bodies: `RIGID_BODIES`, where compiled code computes the dynamics.
    """

    def __init__(
        self,
        links: Sequence[MassPoint],
        frames: Mapping[int, FramePlace],
        bodies: Record | None = None,
    ) -> None:
        self.place = np.array([[m.body, m.joint] for m in links], np.int64).reshape(-1, 2)
        self.points = np.array([[m.mass, *m.centre] for m in links], float).reshape(-1, 4)
        self._frames = dict(frames)
        self._bodies = bodies
        self._row = {link.body: i for i, link in enumerate(links)}
        self._own = self.points.copy()
        count = 0 if bodies is None else bodies.mass.size
        self._inertia = [self._inertia_of(b) for b in range(count)]
        self._loaded: set[int] = set()

    def _inertia_of(self, body: int) -> tuple[float, np.ndarray, np.ndarray]:
        bodies = self._bodies
        assert bodies is not None
        return float(bodies.mass[body]), bodies.centre[body].copy(), bodies.tensor[body].copy()

    def carry(self, loads: Mapping[int, np.ndarray]) -> None:
        """Add loads, (10,) each by the frame that carries it, to what the links weigh by themselves."""
        on_body: dict[int, np.ndarray] = {}
        for frame, numbers in loads.items():
            place = self._frames[frame]
            there = moved(numbers, place.local[:9].reshape(3, 3).T, place.local[9:])
            on_body[place.body] = on_body.get(place.body, 0.0) + there
        for body in self._loaded | set(on_body):
            self._set(body, on_body.get(body))
        self._loaded = set(on_body)

    def _set(self, body: int, added: np.ndarray | None) -> None:
        row = self._row[body]
        self.points[row] = self._own[row] if added is None else _joined(self._own[row], added)
        bodies = self._bodies
        if bodies is None:
            return
        mass, centre, tensor = self._inertia[body]
        if added is not None:
            own = np.zeros(10)
            own[4:] = tensor
            total = load(mass, centre, tensor_of(own)) + added
            mass, *centre = _joined(np.array([mass, *centre]), added)
            centre = np.array(centre)
            about = tensor_of(total) - mass * (
                centre @ centre * np.eye(3) - np.outer(centre, centre)
            )
            tensor = about[UPPER]
        bodies.mass[body], bodies.centre[body], bodies.tensor[body] = mass, centre, tensor


def _joined(point: np.ndarray, added: np.ndarray) -> np.ndarray:
    """Return mass and centre (4,) of a point of mass and a load together."""
    mass = point[0] + added[0]
    if mass == 0.0:
        return point
    return np.array([mass, *((point[0] * point[1:] + added[1:4]) / mass)])


def mixed(
    before: Mapping[int, np.ndarray], after: Mapping[int, np.ndarray], share: float
) -> dict[int, np.ndarray]:
    """Return (1 − share) of some loads and the share of others; what is left of nothing is not there."""
    if share >= 1.0:
        return dict(after)
    none = np.zeros(10)
    return {
        frame: (1.0 - share) * before.get(frame, none) + share * after.get(frame, none)
        for frame in _ordered(before, after)
    }


def _ordered(*those: Iterable[int]) -> Iterable[int]:
    return sorted({frame for some in those for frame in some})

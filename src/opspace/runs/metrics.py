"""What a run achieved, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from opspace.record import Recording

REST = 0.5
"""How long before its return a robot is expected to stand still [s]."""

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "completed": "1",
        "stopped_at": "s",
        "max_torque_step": "N·m",
        "max_joint_speed": "rad/s",
        "max_orientation_error": "rad",
        "rest_speed": "rad/s",
        "final_position_error": "m",
        "min_sigma": "1",
        "max_joint_position": "rad",
        "min_joint_position": "rad",
    }
)
"""The unit of each of the metrics where every joint turns, see `units_of`."""

_JOINT_METRICS = {"max_torque_step": "tau", "max_joint_speed": "v", "rest_speed": "v"}
"""Those that are the largest of any joint, and the columns that they are taken from."""

_ANGULAR = "rad"
_TASKS = {"m": "position", _ANGULAR: "orientation"}


@dataclass(frozen=True)
class Metrics:
    """Numbers of one run; None where the run does not tell.

    Attributes:
        completed: Whether it ran to its end.
        stopped_at: Time at which it was given up.
        max_torque_step: Largest |Δtau| of any joint from one tick to the next.
        max_joint_speed: Largest speed of any joint.
        max_orientation_error: Largest norm of the orientation error.
        rest_speed: Largest joint speed in the last 0.5 s before the return.
        final_position_error: Norm of the position error at the last tick.
        min_sigma: Smallest eigenvalue of any level's projected inverse inertia.
        max_joint_position: Largest position of the limited joint.
        min_joint_position: Smallest position of the limited joint.
    """

    completed: bool
    stopped_at: float | None
    max_torque_step: float | None
    max_joint_speed: float | None
    max_orientation_error: float | None
    rest_speed: float | None
    final_position_error: float | None
    min_sigma: float | None
    max_joint_position: float | None
    min_joint_position: float | None

    def to_json(self) -> dict[str, bool | float | None]:
        """Return the numbers by name, all finite, None where there is none."""
        return asdict(self)


def units_of(recording: Recording) -> dict[str, str]:
    """Return the unit of each of the metrics of a run: joints that slide are in N and m/s.

    A number that may come from joints of both kinds has both units, those of the first joint first.
    """
    of_joints = {name: recording.unit_of(group) for name, group in _JOINT_METRICS.items()}
    return {**UNITS, **of_joints}


def measure(
    recording: Recording, *, limited_joint: str | None = None, return_time: float | None = None
) -> Metrics:
    """Measure a run. Numbers that are not finite are left out.

    Args:
        recording: The run, whichever way it ended.
        limited_joint: Joint whose range is reported.
        return_time: Time at which the robot is led back [s]; None when it is not.

    Returns:
        The metrics.

    Raises:
        UnknownNameError: The recording has no such joint, or no velocities or torques.
    """
    completed = recording.ended.how == "completed"
    position, orientation = _error(recording, "m"), _error(recording, _ANGULAR)
    sigma = [name for name in recording.names if _is_sigma(name)]
    joint = [] if limited_joint is None else recording[f"q/{limited_joint}"]
    return Metrics(
        completed=completed,
        stopped_at=None if completed or not len(recording) else _last(recording.t),
        max_torque_step=_largest(_torque_steps(recording)),
        max_joint_speed=_largest(np.abs(recording.group("v"))),
        max_orientation_error=_largest(orientation),
        rest_speed=_rest_speed(recording, return_time),
        final_position_error=_last(position),
        min_sigma=_smallest(np.concatenate([recording[name] for name in sigma] or [[]])),
        max_joint_position=_largest(joint),
        min_joint_position=_smallest(joint),
    )


def largest_torque_step(recording: Recording, start: float, end: float) -> float | None:
    """Find the largest |Δtau| of any joint between two ticks while something happens.

    Args:
        recording: The run.
        start: When it begins, s; the step into the first tick from then on counts.
        end: When it is over, s; the step into the first tick from then on counts as well.

    Returns:
        N·m; None where the run was over before.
    """
    t = recording.t
    first, last = np.searchsorted(t, [start, end], side="left")
    # The tick times are sums of floats: one tick more on either side misses nothing.
    return _largest(_torque_steps(recording)[max(first - 2, 0) : last + 1])


def _torque_steps(recording: Recording) -> np.ndarray:
    """Return |Δtau| of each joint from tick to tick, (T - 1, n)."""
    # A diverged run ends with torques whose difference is not a number.
    with np.errstate(invalid="ignore"):
        return np.abs(np.diff(recording.group("tau"), axis=0))


def _error(recording: Recording, unit: str) -> np.ndarray:
    """Return the norm of the position or orientation error, (T,), empty where there is none.

    It is that of the task of this name, else the rows of this unit of the first pose.
    """
    name = f"tasks/{_TASKS[unit]}/error"
    if f"{name}/0" in recording:
        return np.linalg.norm(recording.group(name), axis=1)
    for first in (name for name in recording.names if name.endswith("/error/0")):
        rows = recording.members(first.removesuffix("/0"))
        units = [recording.units[row] for row in rows]
        if units == ["m"] * 3 + [_ANGULAR] * 3:
            found = [recording[row] for row, u in zip(rows, units, strict=True) if u == unit]
            return np.linalg.norm(np.column_stack(found), axis=1)
    return np.empty(0)


def _rest_speed(recording: Recording, return_time: float | None) -> float | None:
    t = recording.t
    if return_time is None or not len(t) or t[-1] < return_time:
        return None
    resting = (t >= return_time - REST) & (t < return_time)
    return _largest(np.abs(recording.group("v")[resting]))


def _is_sigma(name: str) -> bool:
    parts = name.split("/")
    return len(parts) == 4 and parts[0] == "levels" and parts[2] == "sigma"


def _finite(values: ArrayLike) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    return array[np.isfinite(array)]


def _largest(values: ArrayLike) -> float | None:
    finite = _finite(values)
    return float(finite.max()) if finite.size else None


def _smallest(values: ArrayLike) -> float | None:
    finite = _finite(values)
    return float(finite.min()) if finite.size else None


def _last(values: np.ndarray) -> float | None:
    return float(values[-1]) if values.size and np.isfinite(values[-1]) else None

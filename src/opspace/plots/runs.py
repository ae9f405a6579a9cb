"""What the figures need of recordings, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.plots.labels import Line
from opspace.plots.style import VARIANT_TITLES, line_color
from opspace.record import Recording

AXES = ("x", "y", "z")

OWN_SCALE = 3.0
"""A run gets a vertical scale of its own when it reaches this many times as far as the calmest."""


class Direction(NamedTuple):
    """The direction of a level that comes closest to being lost.

    Attributes:
        level: Column prefix of its level, such as ``levels/1``.
        sigma: (T, k) eigenvalues of that level, strongest first, NaN where there is none.
        activation: (T, k) activation of each.
    """

    level: str
    sigma: np.ndarray
    activation: np.ndarray

    def weakest(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest eigenvalue at each tick and its activation, each (T,)."""
        filled = np.where(np.isfinite(self.sigma), self.sigma, np.inf)
        index = filled.argmin(axis=1)[:, None]
        sigma = np.take_along_axis(self.sigma, index, axis=1)[:, 0]
        return sigma, np.take_along_axis(self.activation, index, axis=1)[:, 0]


class SigmaEdges(NamedTuple):
    """The buffer on the eigenvalues of Λ⁻¹.

    Attributes:
        lower: Eigenvalue at and below which a direction is absent.
        upper: Eigenvalue at and above which a direction is fully active.
        profile: Name of the activation profile.
        unit: Unit of the edges; 1 where they are relative to the eigenvalues at the start.
    """

    lower: float
    upper: float
    profile: str
    unit: str


class Limit(NamedTuple):
    """A joint that is kept within its range.

    Attributes:
        joint: Its name.
        unit: Unit of its position.
        lower: Lower limit, None where the recording does not tell it.
        upper: Upper limit, None where the recording does not tell it.
        buffer: Width of the buffer inside each limit, 0 where there is none.
    """

    joint: str
    unit: str
    lower: float | None
    upper: float | None
    buffer: float


def check_variants(runs: Mapping[str, Recording]) -> dict[str, Recording]:
    """Return runs in the order in which they are drawn.

    Args:
        runs: Recording by variant: ``without``, ``switch`` or ``transition``.

    Returns:
        The same, in that order.

    Raises:
        InputError: There is no run, or one of them has no ticks.
        UnknownNameError: There is no such variant.
    """
    for name, run in runs.items():
        if name not in VARIANT_TITLES:
            raise unknown_name("variant", name, VARIANT_TITLES)
        if len(run) < 2:
            raise InputError(f"{run.directory} holds {len(run)} ticks; a figure needs two")
    if not runs:
        raise InputError("there is no run to draw")
    return {name: runs[name] for name in VARIANT_TITLES if name in runs}


def title(variant: str, run: Recording, separator: str = ", ") -> str:
    """Return what a variant is called, and when it was stopped."""
    name = VARIANT_TITLES[variant]
    return f"{name}{separator}stopped at {run.t[-1]:.2f} s" if stopped(run) else name


def scales(runs: Mapping[str, Recording], group: str) -> dict[str, tuple[float, float]]:
    """Choose a vertical range for each run: the same where all stay readable with it.

    Args:
        runs: Recording by variant.
        group: Column group that is drawn.

    Returns:
        Range by variant. Runs that reach much further than the calmest one have their own.
    """
    reach = {name: _reach(run.group(group)) for name, run in runs.items()}
    calmest = min(high - low for low, high in reach.values())
    calm = [(low, high) for low, high in reach.values() if high - low <= OWN_SCALE * calmest]
    common = min(low for low, _ in calm), max(high for _, high in calm)
    chosen = {n: common if r in calm else r for n, r in reach.items()}
    return {
        n: (1.05 * low - 0.05 * high, 1.05 * high - 0.05 * low) for n, (low, high) in chosen.items()
    }


def _reach(values: np.ndarray) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if not finite.size or finite.min() == finite.max():
        return (-1.0, 1.0)
    return float(finite.min()), float(finite.max())


def _largest(values: np.ndarray) -> np.ndarray:
    """Return the largest finite value of each row, NaN where there is none."""
    return np.fmax.reduce(np.where(np.isfinite(values), values, np.nan), axis=1)


def joint_lines(run: Recording, group: str) -> list[Line]:
    """Return a line for each joint.

    Args:
        run: The recording.
        group: Column group with a column for each joint, such as ``v``.
    """
    names = run.members(group)
    return [
        Line(name.removeprefix(f"{group}/"), line_color(i), run.t, run[name])
        for i, name in enumerate(names)
    ]


def tool_lines(run: Recording) -> list[Line]:
    """Return a line for each coordinate of the tool."""
    return [Line(a, line_color(i), run.t, run[f"tool/{a}"]) for i, a in enumerate(AXES)]


def direction_lines(t: np.ndarray, values: np.ndarray) -> list[Line]:
    """Return a line for each direction of a level.

    Args:
        t: (T,) time.
        values: (T, k) strongest direction first.
    """
    count = values.shape[1]
    between = ["second"] if count == 3 else [f"no. {i + 1}" for i in range(1, count - 1)]
    names = ["strongest", *between, "weakest"] if count > 1 else ["direction"]
    return [Line(names[i], line_color(i), t, values[:, i]) for i in range(count)]


def largest_step(run: Recording) -> np.ndarray:
    """Return the largest |Δtau| of any joint from each tick to the next, (T - 1,)."""
    # A diverged run ends with torques whose difference is not a number.
    with np.errstate(invalid="ignore"):
        return _largest(np.abs(np.diff(run.group("tau"), axis=0)))


def positive(values: np.ndarray) -> np.ndarray:
    """Return values with NaN where a logarithm has none."""
    return np.where(values > 0.0, values, np.nan)


def fastest(run: Recording) -> np.ndarray:
    """Return the largest joint speed at each tick, (T,)."""
    return _largest(np.abs(run.group("v")))


def end_time(runs: Mapping[str, Recording]) -> float:
    """Return the time at which the longest run ends [s]."""
    return max(float(run.t[-1]) for run in runs.values())


def stopped(run: Recording) -> bool:
    """Tell whether a run was given up."""
    return run.ended.how != "completed"


def tool(run: Recording) -> np.ndarray:
    """Return the position of the tool, (T, 3)."""
    return np.column_stack([run[f"tool/{axis}"] for axis in AXES])


def desired(run: Recording, task: str) -> np.ndarray:
    """Return the desired position of the tool x + (x_d − x), (T, 3).

    Args:
        run: The recording.
        task: Name of the task whose first three rows are that position.
    """
    return tool(run) + run.group(f"tasks/{task}/error")[:, :3]


def weakest(run: Recording) -> Direction | None:
    """Find the level with the smallest eigenvalue of the run, None where none is recorded."""
    names = [name for name in run.names if name.startswith("levels/") and "/sigma/" in name]
    prefixes = dict.fromkeys(name.split("/sigma/")[0] for name in names)
    found = []
    for prefix in prefixes:
        sigma = run.group(f"{prefix}/sigma")
        if np.isfinite(sigma).any():
            found.append((float(np.nanmin(sigma)), prefix))
    if not found:
        return None
    prefix = min(found)[1]
    return Direction(prefix, run.group(f"{prefix}/sigma"), run.group(f"{prefix}/activation"))


def sigma_edges(run: Recording) -> SigmaEdges | None:
    """Return the singularity buffer of a run, None without one."""
    settings = _scenario(run).get("singularity")
    if not settings:
        return None
    unit = "1/kg" if settings.get("scale") == "absolute" else "1"
    profile = settings.get("profile", "quintic")
    return SigmaEdges(settings["lower"], settings["upper"], profile, unit)


def limit_activation(run: Recording, joint: str) -> np.ndarray | None:
    """Return the larger activation of a joint's two limit tasks, (T,), None without them."""
    names = [f"limits/{joint}/{side}" for side in ("lower", "upper")]
    found = [run[name] for name in names if name in run]
    return np.max(found, axis=0) if found else None


def limited_joint(runs: Mapping[str, Recording]) -> Limit:
    """Find the joint whose limit matters most in a set of runs.

    Args:
        runs: The variants; the last one that has limit tasks decides.

    Returns:
        The joint and its limits.

    Raises:
        InputError: No run has a limit task.
    """
    for run in reversed(list(runs.values())):
        names = [name for name in run.names if name.startswith("limits/")]
        if not names:
            continue
        strongest = max(names, key=lambda name: float(run[name].max()))
        joint = strongest.removeprefix("limits/").rpartition("/")[0]
        settings = _scenario(run).get("joint_limits") or {}
        lower, upper = settings.get("joints", {}).get(joint, (None, None))
        buffer = settings.get("buffer", 0.0) if settings.get("mode") == "buffer" else 0.0
        return Limit(joint, run.units[f"q/{joint}"], lower, upper, buffer)
    raise InputError("no run has a column limits/<joint>/lower or limits/<joint>/upper")


def _scenario(run: Recording) -> Mapping[str, Any]:
    return run.header.get("scenario") or {}

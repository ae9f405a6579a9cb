"""Five scenes in which an arm would touch something, under several ways to keep it away."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from opspace.command import Status
from opspace.compare.projections import (
    BarrierProgram,
    NearestInInertia,
    SwitchedDistances,
    Unkept,
)
from opspace.controller import Controller, ReferenceController
from opspace.errors import InputError
from opspace.record import Recording
from opspace.record.format import write_json
from opspace.robots import load_robot
from opspace.runs.progress import ProgressBar
from opspace.runs.run import METRICS, run_scenario
from opspace.scenario.load import load_scenario

SCENES = ("table", "self-fold", "moving-ball", "gap", "clutter")

WAYS: Mapping[str, Callable[..., ReferenceController]] = MappingProxyType(
    {
        "without": Unkept,
        "switch": SwitchedDistances,
        "cbf-qp": BarrierProgram,
        "inertia": NearestInInertia,
        "opspace": Controller,
    }
)
"""Controllers by name: nothing kept apart, a hard switch 5 cm ahead, a quadratic program with barriers,
the nearest acceleration in the inertia, and the library."""

PICTURES = 4
"""Pictures of a strip."""

FILM_FPS = 8.0
"""Pictures per second of a film."""

STOP_SPEED = 50.0
"""A run is given up when a joint is faster, rad/s."""


@dataclass(frozen=True)
class KeptApart:
    """What one way made of one scene.

    Attributes:
        least: Least distance between shapes, mm.
        step: Largest |Δτ| of any joint from tick to tick, N·m per ms.
        step_99: The same, that of 99 of 100 ticks.
        error: Mean distance of the tool from where it is wanted, mm.
        turned: Mean angle by which it is turned from how it is wanted, mrad.
        lost: Ticks that said that no torque keeps everything apart; of another way what the library
            would say of its state.
        completed: Whether it ran to its end.
    """

    least: float
    step: float
    step_99: float
    error: float
    turned: float
    lost: int
    completed: bool


@dataclass(frozen=True)
class GuardedScene:
    """One scene under several ways.

    Attributes:
        name: Its name among the shipped scenarios.
        margin: Distance that is to be kept, m.
        recordings: By way.
        found: What each made of it.
    """

    name: str
    margin: float
    recordings: Mapping[str, Recording]
    found: Mapping[str, KeptApart]


def reproduce_collisions(
    out: Path,
    scenes: Sequence[str] = SCENES,
    ways: Sequence[str] = tuple(WAYS),
    progress: ProgressBar | None = None,
) -> list[GuardedScene]:
    """Run scenes in every way and write ``metrics.json``.

    Args:
        out: Directory to write to; each scene gets one below it, each way one below that.
        scenes: Names of shipped scenarios with collisions.
        ways: Some of `WAYS`.
        progress: Bar that gets a line for each run.

    Returns:
        The scenes.

    Raises:
        InputError: A scenario without collisions.
    """
    done = [_run(name, ways, out / name, progress) for name in scenes]
    numbers = {s.name: {way: asdict(kept) for way, kept in s.found.items()} for s in done}
    write_json(out / METRICS, numbers)
    return done


def _run(name: str, ways: Sequence[str], out: Path, progress: ProgressBar | None) -> GuardedScene:
    scenario = load_scenario(name)
    guard = scenario.collisions
    if guard is None:
        raise InputError(f"scenario {name!r} keeps nothing apart")
    stop = scenario.stop.model_copy(update={"max_joint_speed": STOP_SPEED})
    scenario = scenario.model_copy(update={"stop": stop})
    recordings = {
        way: run_scenario(
            scenario,
            out / way,
            title=f"{name} {way}",
            progress=progress,
            overwrite=True,
            controller=WAYS[way],
        ).recording
        for way in ways
    }
    found = {way: _measure(recording) for way, recording in recordings.items()}
    return GuardedScene(name, guard.margin, recordings, found)


def torque_steps(recording: Recording) -> np.ndarray:
    """Return the largest |Δτ| of any joint from each tick to the next, per ms, (T − 1,)."""
    steps = np.max(np.abs(np.diff(recording.group("tau"), axis=0)), axis=1)
    return steps / (1e3 * np.diff(recording.t))


def _measure(recording: Recording) -> KeptApart:
    steps = torque_steps(recording)
    error, turned = (
        1e3 * float(np.mean(np.linalg.norm(recording.group(f"tasks/{task}/error"), axis=1)))
        for task in ("position", "orientation")
    )
    lost = recording["status"].astype(np.int64) & int(Status.COLLISION_LOST)
    return KeptApart(
        least=1e3 * float(np.min(recording["distances/least"])),
        step=float(np.max(steps)),
        step_99=float(np.quantile(steps, 0.99)),
        error=error,
        turned=turned,
        lost=int(np.count_nonzero(lost)),
        completed=recording.ended.how == "completed",
    )


def collisions_table(scenes: Sequence[GuardedScene]) -> tuple[list[str], list[list[str]]]:
    """Write what was found, a row for each scene and way."""
    heads = ["scene", "way", "least distance [mm]", "torque step [N·m/ms]", "99 % of them"]
    heads += ["mean tool error [mm]", "turned [mrad]", "ticks lost", "run"]
    rows: list[list[str]] = []
    for scene in scenes:
        for i, (way, kept) in enumerate(scene.found.items()):
            numbers = [f"{kept.least:.1f}", f"{kept.step:.2f}", f"{kept.step_99:.2f}"]
            ended = "completed" if kept.completed else "stopped"
            start = scene.name if i == 0 else ""
            numbers += [f"{kept.error:.1f}", f"{kept.turned:.1f}", str(kept.lost)]
            rows.append([start, way, *numbers, ended])
    return heads, rows


def draw_collisions(scenes: Sequence[GuardedScene], out: Path) -> list[str]:
    """Draw the figure, and a strip of pictures and a film of every scene with the library.

    Returns:
        What could not be drawn, one line each.

    Raises:
        MissingExtraError: matplotlib or MuJoCo is not installed.
    """
    from opspace.pictures.film import film  # noqa: PLC0415 - an extra, and slow to import
    from opspace.pictures.snapshots import (  # noqa: PLC0415
        SnapshotUnavailableError,
        snapshot_strip,
    )
    from opspace.plots import save  # noqa: PLC0415
    from opspace.plots.collisions_plot import collisions_figure  # noqa: PLC0415

    margins = {scene.name: scene.margin for scene in scenes}
    recordings = {scene.name: scene.recordings for scene in scenes}
    save(collisions_figure(recordings, margins), out / "collisions.png")
    for scene in scenes:
        recording = scene.recordings.get("opspace")
        if recording is None:
            continue
        robot = load_robot("panda")
        times = np.linspace(0.0, float(recording.t[-1]), PICTURES).tolist()
        try:
            snapshot_strip(recording, robot, times, out / f"{scene.name}.png")
            film(recording, robot, out / f"{scene.name}.gif", fps=FILM_FPS)
        except SnapshotUnavailableError as error:
            return [str(error)]
    return []

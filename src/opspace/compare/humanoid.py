"""A humanoid that stands, lifts, reaches, lands and leans, with and without continuous transitions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from opspace.compare.laws import (
    REGULARISATION,
    presences,
    ten_to_one_weight,
    weighted_least_squares,
)
from opspace.compare.strict_program import StrictProgramController, daqp_installed
from opspace.compare.tsid_controller import TsidController
from opspace.compare.tsid_model import INSTALLS_TSID, tsid_installed
from opspace.controller import Controller, ReferenceController
from opspace.controller.stages import Question
from opspace.law import LawInfo
from opspace.record import Recording
from opspace.record.contact_columns import GROUP
from opspace.record.format import write_json
from opspace.runs.event_times import began
from opspace.runs.metrics import largest_torque_step
from opspace.runs.progress import ProgressBar
from opspace.runs.run import METRICS, RunResult, run_scenario
from opspace.scenario import Scenario, load_scenario
from opspace.scenario.build import build_robot
from opspace.scenario.events import Event, in_order

SCENARIO = "humanoid"
TAIL = 0.05
"""Time after a change that still belongs to it, s."""
LANDING = "foot lands"
UNNOTICED = 0.01
"""Time for which a foot may have touched before its contact comes, s."""
SETTLED = 0.05
"""Time after a touchdown in which planned and measured forces are not compared, s."""
FIRMEST = 1e8
"""Weight of contacts in the weighted program."""

CHANGES: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        "foot lets go": ("remove right", 0),
        "hand in": ("insert hand", 0),
        "shoulder and lean in": ("insert lean", 0),
        "torso and lean swap": ("swap torso, lean", 0),
        "they swap back": ("swap torso, lean", 1),
        "lean out": ("remove lean", 0),
        "hand out": ("remove hand", 0),
        LANDING: ("insert right", 0),
        "hand presses": ("insert palm", 0),
        "hand lets go": ("remove palm", 0),
    }
)
"""Name of every change: what its event says, and the how many-th of those it is."""


def ten_to_one(asked: Question) -> tuple[np.ndarray, LawInfo]:
    """Weights in place of priorities: 10^(−number) for a level, ramped as tasks come and go."""
    sets = asked.task_sets

    def weight(rank: int) -> float:
        if rank >= len(asked.levels):
            return REGULARISATION
        return FIRMEST if rank < 0 else ten_to_one_weight(asked.levels[rank])

    weights = [
        h * weight(task.priority)
        for h, task in zip(presences(asked.corners, len(sets)), sets, strict=True)
    ]
    return weighted_least_squares(asked.L, sets, weights), LawInfo(1, 1, ())


INSTALLS_DAQP = "pip install 'opspace[compare]'"


@dataclass(frozen=True)
class Variant:
    """One way to change contacts and tasks.

    Attributes:
        title: What it does.
        changes: What it changes in the scenario.
        controller: Makes the controller.
        needs: What installs what it needs beside the library; empty for nothing.
        installed: Whether that is there.
    """

    title: str
    changes: Mapping[str, Any]
    controller: Callable[..., ReferenceController] = Controller
    needs: str = ""
    installed: Callable[[], bool] = lambda: True


VARIANTS: Mapping[str, Variant] = MappingProxyType(
    {
        "transition": Variant("continuous transitions", {}),
        "switch": Variant("the same law, hard switch", {"method": "switch"}),
        "weighted": Variant(
            "one quadratic program, weights 10 to 1 from level to level, ramped",
            {},
            partial(ReferenceController, law=ten_to_one),
        ),
        "weighted-switch": Variant(
            "the same program, weights that switch",
            {"method": "switch"},
            partial(ReferenceController, law=ten_to_one),
        ),
        "hierarchy": Variant(
            "strict priorities by one quadratic program per level; the forces of contacts are ramped",
            {},
            StrictProgramController,
            INSTALLS_DAQP,
            daqp_installed,
        ),
        "hierarchy-switch": Variant(
            "the same programs, hard switch",
            {"method": "switch"},
            StrictProgramController,
            INSTALLS_DAQP,
            daqp_installed,
        ),
        "tsid": Variant(
            "TSID: one quadratic program, weights 10 to 1 from level to level, changed as it offers",
            {},
            TsidController,
            INSTALLS_TSID,
            tsid_installed,
        ),
    }
)


def usable_variants() -> dict[str, Variant]:
    """Give the variants whose packages are installed."""
    return {name: variant for name, variant in VARIANTS.items() if variant.installed()}


def reproduce_humanoid(
    out: Path,
    variants: Mapping[str, Variant] | None = None,
    *,
    scenario: Scenario | None = None,
    progress: ProgressBar | None = None,
) -> dict[str, RunResult]:
    """Run the humanoid under every variant and write the numbers.

    Args:
        out: Directory to write to; each variant gets one below it.
        variants: The variants; None is all whose packages are installed.
        scenario: Another scenario with the same events; None is the shipped one.
        progress: Bar that gets a line for each run.

    Returns:
        Result by variant.
    """
    base = load_scenario(SCENARIO) if scenario is None else scenario
    runs = {
        name: run_scenario(
            base.model_copy(update=dict(variant.changes)),
            out / name,
            title=f"{SCENARIO} {name}",
            progress=progress,
            overwrite=True,
            controller=variant.controller,
        )
        for name, variant in (usable_variants() if variants is None else variants).items()
    }
    write_json(out / METRICS, {name: measures(run.recording, base) for name, run in runs.items()})
    return runs


def measures(recording: Recording, scenario: Scenario) -> dict[str, float | None]:
    """Measure a run of the humanoid.

    Args:
        recording: The run.
        scenario: Its scenario, with the durations of the continuous variant.

    Returns:
        Largest torque step of every change, N·m per tick, of one during which the foot lands until then;
        then the numbers of the whole run, which
        `UNITS` names. None where the run was over before.
    """
    spans = _spans(scenario, recording)
    found: dict[str, float | None] = {
        name: None if span is None else largest_torque_step(recording, *span)
        for name, span in spans.items()
    }
    found["anywhere"] = largest_torque_step(recording, 0.0, float(recording.t[-1]))
    lift = spans["foot lets go"]
    found["force of the foot that lets go"] = _force_step(recording, "right", lift)
    error = np.linalg.norm(recording.group("tasks/com/error"), axis=1)
    found["centre of mass, largest error"] = 1e3 * float(np.nanmax(error))
    found["centre of mass, rms error"] = 1e3 * float(np.sqrt(np.nanmean(error**2)))
    found["force, measured less planned, rms"] = _apart(recording, spans[LANDING])
    found["friction and sole, largest use"] = float(np.nanmax(_columns(recording, "cone_use")))
    return found


UNITS: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys([*CHANGES, "anywhere"], "N·m per ms"),
        "force of the foot that lets go": "N per ms",
        "centre of mass, largest error": "mm",
        "centre of mass, rms error": "mm",
        "force, measured less planned, rms": "N",
        "friction and sole, largest use": "1",
    }
)


def table(runs: Mapping[str, Mapping[str, float | None]]) -> tuple[list[str], list[list[str]]]:
    """Write the measures, one column per variant."""
    rows = [
        [
            name,
            *("-" if (x := found[name]) is None else f"{x:.2g}" for found in runs.values()),
            unit,
        ]
        for name, unit in UNITS.items()
    ]
    return ["largest torque step, then the whole run", *runs, "unit"], rows


def draw(runs: Mapping[str, RunResult], out: Path, *, progress: Any = None) -> list[str]:
    """Draw the figure, snapshots and a film of the runs.

    Args:
        runs: Result by variant.
        out: Directory to write to.
        progress: Is told how many pictures of the film are done, and of how many.

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
    from opspace.plots.contact_figure import humanoid_figure  # noqa: PLC0415
    from opspace.plots.style import save  # noqa: PLC0415

    scenario = load_scenario(SCENARIO)
    shown = runs["transition"].recording
    spans = _spans(scenario, shown)
    changes = {name: span[0] for name, span in spans.items() if span is not None}
    recordings = {name: run.recording for name, run in runs.items()}
    save(humanoid_figure(recordings, changes), out / "humanoid.png")
    robot, end = build_robot(scenario), float(shown.t[-1])
    times = [t for t in (0.0, 2.3, 4.0, 4.9, 9.8) if t <= end]
    try:
        snapshot_strip(shown, robot, times, out / "snapshots.png", size=(300, 420), direction=VIEW)
        film(shown, robot, out / "film.gif", speed=2.0, progress=progress)
    except SnapshotUnavailableError as error:
        return [str(error)]
    return []


VIEW = (150.0, -8.0)
"""Azimuth and elevation of the camera of the snapshots, degrees."""


def _event(scenario: Scenario, name: str) -> Event | None:
    """Find the event of a change."""
    what, number = CHANGES[name]
    found = [e for _, e in in_order(scenario.events) if f"{e.kind} {', '.join(e.tasks)}" == what]
    return found[number] if number < len(found) else None


def _spans(scenario: Scenario, recording: Recording) -> dict[str, tuple[float, float] | None]:
    """Tell from when to when every change takes place, None for those that do not."""
    found = {name: _span(_event(scenario, name), recording) for name in CHANGES}
    landing = found[LANDING]
    if landing is not None:
        touch = landing[0] - UNNOTICED
        for name, span in found.items():
            if span is not None and span[0] < touch < span[1]:
                found[name] = span[0], touch
    return found


def _span(event: Event | None, recording: Recording) -> tuple[float, float] | None:
    """Tell from when to when a change takes place, None where it did not."""
    start = None if event is None else began(event, recording)
    if event is None or start is None or not len(recording) or recording.t[-1] < start:
        return None
    if event.kind == "remove" and not _there(event.tasks[0], start, recording):
        return None
    return start, start + event.duration + TAIL


def _there(name: str, t: float, recording: Recording) -> bool:
    """Tell whether a task or a contact was in the stack at a time."""
    columns = (f"{GROUP}/{name}/progress", f"tasks/{name}/activation")
    found = next(recording[column] for column in columns if column in recording)
    return bool(np.isfinite(found[int(np.searchsorted(recording.t, t - TAIL))]))


def _force_step(
    recording: Recording, contact: str, span: tuple[float, float] | None
) -> float | None:
    """Find the largest change of a measured force from tick to tick, N."""
    if span is None:
        return None
    forces = recording.group(f"{GROUP}/{contact}/measured")
    inside = (recording.t[1:] >= span[0]) & (recording.t[1:] <= span[1])
    return float(np.max(np.abs(np.diff(forces, axis=0))[inside], initial=0.0))


def _apart(recording: Recording, landing: tuple[float, float] | None) -> float | None:
    """Compare planned and measured normal forces of the feet, but for touchdowns, N."""
    gaps: list[np.ndarray] = []
    for name in ("left", "right"):
        planned = np.nan_to_num(recording[f"{GROUP}/{name}/force/z"])
        gaps.append(recording[f"{GROUP}/{name}/measured/z"] - planned)
    calm = recording.t > SETTLED
    if landing is not None:
        calm &= np.abs(recording.t - landing[0]) > SETTLED
    gap = np.concatenate([one[calm] for one in gaps])
    return float(np.sqrt(np.mean(gap**2))) if gap.size else None


def _columns(recording: Recording, part: str) -> np.ndarray:
    names = [n for n in recording.names if n.startswith(f"{GROUP}/") and n.endswith(f"/{part}")]
    return np.column_stack([recording[name] for name in names])

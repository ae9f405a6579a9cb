"""Runs a scenario: recording, metrics and how it ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from opspace.controller import Controller, ReferenceController
from opspace.loop import Observer, Outcome, simulate
from opspace.loop.requests import FILE, Changes, RequestPlayer
from opspace.record import Recording, load
from opspace.record.format import write_json
from opspace.record.observer import State, TickRecorder
from opspace.runs.metrics import Metrics, measure
from opspace.runs.progress import ProgressBar
from opspace.scenario.build import Built, build
from opspace.scenario.events import late_tasks, levels_visited
from opspace.scenario.load import dump_scenario
from opspace.scenario.references import return_time
from opspace.scenario.schema import Scenario
from opspace.sim import Plant
from opspace.tasks import Task

METRICS = "metrics.json"
SCENARIO = "scenario.yaml"


@dataclass(frozen=True)
class RunResult:
    """What a run left behind.

    Attributes:
        directory: Recording, ``metrics.json`` and ``scenario.yaml`` lie here.
        outcome: How the run ended.
        recording: The recording.
        metrics: The numbers of ``metrics.json``.
    """

    directory: Path
    outcome: Outcome
    recording: Recording
    metrics: Metrics


def run_scenario(
    scenario: Scenario,
    out: Path,
    *,
    title: str = "run",
    progress: ProgressBar | None = None,
    overwrite: bool = False,
    requests: Path | None = None,
    controller: Callable[..., ReferenceController] = Controller,
) -> RunResult:
    """Simulate a scenario, record every tick and measure the run.

    Args:
        scenario: What to run.
        out: Directory to write to.
        title: What the progress bar calls it.
        progress: Bar that gets a line for this run.
        overwrite: Replace a recording that is already there.
        requests: File of requests of a run that was watched, to be asked for again.
        controller: Makes the controller.

    Returns:
        What the run left behind.

    Raises:
        ScenarioError: The scenario does not fit its robot.
        RecordingError: There is a recording already, the directory cannot be written, or the
            requests cannot be read.
    """
    built = build(scenario, controller)
    watching: list[Observer] = []
    asked = None
    if requests is not None:
        watching.append(RequestPlayer(changes_of(built), requests))
        asked = requests.read_bytes()
    recorder = TickRecorder(
        out,
        built.controller,
        built.header,
        tasks=late_tasks_of(built),
        levels=recorded_levels(built, everywhere=requests is not None),
        truth=truth_of(built.plant),
        **touching_in(built),
        overwrite=overwrite,
    )
    begin(out, scenario)
    (out / FILE).unlink(missing_ok=True)
    if asked is not None:
        (out / FILE).write_bytes(asked)
    line = progress.run(title, scenario.duration) if progress else None
    outcome = _simulate(built, recorder, [*watching, *([line] if line else [])])
    if line:
        line.finish(outcome.t)
    return result_of(scenario, out, outcome)


def late_tasks_of(built: Built) -> list[Task]:
    """List the tasks that are not in the stack at the start."""
    late = late_tasks(built.scenario.events, built.scenario.tasks)
    return [task for name, task in built.tasks.items() if name in late]


def recorded_levels(built: Built, *, everywhere: bool) -> dict[float, list[Task]]:
    """List, by number of the level, the tasks to record there.

    Args:
        built: The scenario.
        everywhere: Whether any task may come to any level, as when somebody asks for it.
    """
    visited = levels_visited(built.scenario.events, built.scenario.tasks)
    return {
        number: list(built.tasks.values()) if everywhere else [built.tasks[name] for name in names]
        for number, names in visited.items()
    }


def truth_of(plant: Plant) -> State | None:
    """Return what tells the true state where the sensors are noisy."""
    return (lambda: (plant.q, plant.v)) if plant.noisy else None


def touching_in(built: Built) -> dict[str, Any]:
    """Collect what a recorder is told about contacts."""
    if not built.contacts:
        return {}
    plant = built.plant
    return {"contacts": list(built.contacts.values()), "felt": lambda: plant.contact_forces}


def changes_of(built: Built) -> Changes:
    """Make what applies requests to a scenario."""
    return Changes(built.controller, built.tasks.values(), built.contacts.values())


def begin(out: Path, scenario: Scenario) -> None:
    """Put the scenario beside a recording that begins; the numbers of another one go."""
    (out / METRICS).unlink(missing_ok=True)
    (out / SCENARIO).write_text(dump_scenario(scenario), encoding="utf-8")


def result_of(scenario: Scenario, out: Path, outcome: Outcome) -> RunResult:
    """Measure a run that is over, and write the numbers beside its recording."""
    recording = load(out)
    metrics = measure(
        recording,
        limited_joint=limited_joint(scenario),
        return_time=first_return(scenario),
    )
    write_json(out / METRICS, metrics.to_json())
    return RunResult(out, outcome, recording, metrics)


def limited_joint(scenario: Scenario) -> str | None:
    """Name the joint that a scenario gives limits of its own, None where there is none."""
    limits = scenario.joint_limits
    return next(iter(limits.joints), None) if limits else None


def first_return(scenario: Scenario) -> float | None:
    """Time at which the first target begins to come back to its start [s], None without one."""
    times = (return_time(getattr(task, "target", None)) for task in scenario.tasks.values())
    return min((t for t in times if t is not None), default=None)


def _simulate(built: Built, recorder: TickRecorder, watching: list[Observer]) -> Outcome:
    """Run to the end and tell the recording how it came about, whatever happens."""
    try:
        outcome = simulate(
            built.plant,
            built.controller,
            built.scenario.duration,
            [recorder, built.triggers, *watching],
            built.stop,
        )
    except KeyboardInterrupt:
        recorder.close("interrupted")
        raise
    except BaseException as error:
        recorder.close("crashed", f"{type(error).__name__}: {error}")
        raise
    recorder.close("completed" if outcome.completed else "stopped", outcome.reason)
    return outcome

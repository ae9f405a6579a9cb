"""Runs a scenario that somebody watches, and changes, on a web page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from opspace.loop import Outcome, simulate
from opspace.record import load
from opspace.runs.run import (
    SCENARIO,
    RunResult,
    begin,
    late_tasks_of,
    recorded_levels,
    result_of,
    touching_in,
    truth_of,
)
from opspace.scenario.build import Built, build
from opspace.scenario.load import dump_scenario
from opspace.scenario.schema import Scenario
from opspace.view import Viewer

LONGEST = 600.0
"""A run that nobody ends is over after this time, s: a recording grows by some 100 MB a minute."""


def watch_scenario(
    scenario: Scenario,
    out: Path,
    *,
    host: str,
    port: int,
    duration: float = LONGEST,
    speed: float = 1.0,
    wait: bool = True,
    overwrite: bool = False,
    opened: Callable[[str], None] = lambda address: None,
    ended: Callable[[RunResult], None] = lambda result: None,
) -> RunResult:
    """Run a scenario on a web page, beyond its end, until it is interrupted.

    The recording, the scenario with the time that it took, and the requests lie in ``out``;
    `opspace.runs.run.run_scenario` with these requests gives the same recording without a page.

    Args:
        scenario: What to run.
        out: Directory to write to.
        host: Address to listen at.
        port: Port to listen at.
        duration: When it ends by itself, s.
        speed: Seconds of the run per second of the clock.
        wait: Begin when a browser has opened the page.
        overwrite: Replace a recording that is already there.
        opened: Told the address of the page.
        ended: Told about the run when it is over; the page is gone when this returns.

    Returns:
        What the run left behind.

    Raises:
        ScenarioError: The scenario does not fit its robot.
        RecordingError: There is a recording already, or the directory cannot be written.
        MissingExtraError: The viewer is not installed.
    """
    built = build(scenario)
    viewer = Viewer(
        built.controller,
        out,
        built.header,
        tasks=late_tasks_of(built),
        levels=recorded_levels(built, everywhere=True),
        truth=truth_of(built.plant),
        **touching_in(built),
        overwrite=overwrite,
        speed=speed,
        host=host,
        port=port,
        opened=opened,
        wait=wait,
    )
    with viewer:
        begin(out, scenario)
        outcome = _run(built, viewer, duration)
        result = _finish(scenario, out, outcome)
        ended(result)
    return result


def _run(built: Built, viewer: Viewer, duration: float) -> Outcome:
    """Run until somebody has seen enough; Ctrl-C is how one says so."""
    plant = built.plant
    try:
        outcome = simulate(plant, built.controller, duration, [viewer, built.triggers], built.stop)
    except KeyboardInterrupt:
        viewer.end("interrupted")
        return Outcome(False, plant.t, "interrupted")
    viewer.end("completed" if outcome.completed else "stopped", outcome.reason)
    return outcome


def _finish(scenario: Scenario, out: Path, outcome: Outcome) -> RunResult:
    """Let the scenario beside the recording say how long it really took."""
    ticks = max(len(load(out)), 1)
    took = scenario.model_copy(update={"duration": ticks * scenario.dt})
    (out / SCENARIO).write_text(dump_scenario(took), encoding="utf-8")
    return result_of(scenario, out, outcome)


def next_directory(parent: Path, name: str) -> Path:
    """Return the first of ``name-1``, ``name-2``, ... in a directory that is not there yet."""
    number = 1
    while (parent / f"{name}-{number}").exists():
        number += 1
    return parent / f"{name}-{number}"

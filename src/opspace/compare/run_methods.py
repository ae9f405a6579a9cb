"""Runs one scenario under several methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from opspace.compare.measures import Measures, Timed, Watch, measure
from opspace.compare.methods import METHODS, methods_left_out
from opspace.errors import unknown_name
from opspace.loop import StopRule, simulate
from opspace.plots import save
from opspace.plots.comparison import comparison_figure
from opspace.record.format import write_json
from opspace.runs.progress import ProgressBar
from opspace.scenario import Scenario
from opspace.scenario.build import build
from opspace.scenario.load import to_dict

GIVE_UP_SPEED = 50.0
"""Joint speed at which a run is given up where the scenario names none, rad/s or m/s."""

COLUMNS: Mapping[str, tuple[str, str]] = {
    "torque_step": ("torque step", "N·m"),
    "torque_step_outside": ("away from changes", "N·m"),
    "acceleration": ("acceleration", "rad/s²"),
    "jerk": ("its rate", "rad/s³"),
    "error_inside": ("error in changes", "m, rad"),
    "error_outside": ("error outside", "m, rad"),
    "leak": ("priority leak", "m/s², rad/s²"),
    "overshoot": ("beyond limits", "rad"),
    "tick": ("tick", "µs"),
}
"""Head and unit of each measure."""


@dataclass(frozen=True)
class Comparison:
    """A scenario under several methods.

    Attributes:
        scenario: What was run.
        rows: Measures by name of the method.
        left_out: Why other methods were not run that nobody had named, by name.
    """

    scenario: Scenario
    rows: Mapping[str, Measures]
    left_out: Mapping[str, str] = field(default_factory=dict[str, str])

    def to_json(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            "scenario": to_dict(self.scenario),
            "methods": {name: asdict(row) for name, row in self.rows.items()},
            "left_out": dict(self.left_out),
        }

    def table(self, keys: Sequence[str] | None = None) -> tuple[list[str], list[list[str]]]:
        """Write the measures, one row per method.

        Args:
            keys: Which measures, of `COLUMNS`; None for all.

        Returns:
            Heads with units, and rows.
        """
        keys = tuple(COLUMNS) if keys is None else keys
        heads = ["method", *(f"{COLUMNS[key][0]} [{COLUMNS[key][1]}]" for key in keys), "run"]
        rows = []
        for name, row in self.rows.items():
            numbers = [getattr(row, key) for key in keys]
            ended = "completed" if row.completed else f"stopped at {row.stopped_at:.2f} s"
            rows.append([name, *("-" if x is None else f"{x:.3g}" for x in numbers), ended])
        return heads, rows


def compare_scenario(
    scenario: Scenario,
    methods: Sequence[str] = (),
    out: Path | None = None,
    *,
    progress: ProgressBar | None = None,
) -> Comparison:
    """Run a scenario under several methods and measure all of them alike.

    Robot, plant, tasks, gains, references and events are those of the scenario; only the way in
    which tasks, limits and singular directions come and go differs.

    Args:
        scenario: The scenario.
        methods: Names of methods; none stands for all that are installed and can
            run it.
        out: Directory for ``compare.json`` and ``compare.png``; None writes nothing.
        progress: Bar that gets a line for each run.

    Returns:
        The measures.

    Raises:
        UnknownNameError: There is no such method.
        ScenarioError: The scenario does not fit its robot.
    """
    for name in methods:
        if name not in METHODS:
            raise unknown_name("method", name, METHODS)
    left_out = {} if methods else methods_left_out(scenario)
    wanted = methods or [name for name in METHODS if name not in left_out]
    rows = {name: _run(scenario, name, progress) for name in wanted}
    comparison = Comparison(scenario, rows, left_out)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        write_json(out / "compare.json", comparison.to_json())
        save(
            comparison_figure({name: asdict(row) for name, row in rows.items()}),
            out / "compare.png",
        )
    return comparison


def _run(scenario: Scenario, name: str, progress: ProgressBar | None) -> Measures:
    method = METHODS[name]
    built = build(method.scenario(scenario), method.controller)
    watch, timed = Watch(built.controller, scenario.events), Timed(built.controller)
    line = progress.run(name, scenario.duration) if progress else None
    observers = [watch, built.triggers, *([line] if line else [])]
    stop = StopRule(built.stop.max_joint_speed or GIVE_UP_SPEED, built.stop.max_torque)
    outcome = simulate(built.plant, timed, scenario.duration, observers, stop)
    if line:
        line.finish(outcome.t)
    return measure(watch, timed, outcome)

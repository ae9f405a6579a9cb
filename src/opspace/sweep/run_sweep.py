"""Runs what a sweep has not finished yet, and tells what it found."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from opspace.errors import InputError
from opspace.plan.entries import KERNELS
from opspace.scenario.load import dump_scenario, scenario_from
from opspace.sweep.cluster import run_on_ray
from opspace.sweep.limit_measures import UNITS
from opspace.sweep.store import Store
from opspace.sweep.sweep_plan import SweepPlan
from opspace.sweep.vary import flow
from opspace.sweep.workers import run_here

TABLE = "table.csv"
FAILED = "failed"
TIMEOUT = 120.0
"""Time allowed to one run, s."""


@dataclass(frozen=True)
class Sweep:
    """Rows of a sweep.

    Attributes:
        directory: Where they lie.
        rows: One per run, in the order of their numbers.
    """

    directory: Path
    rows: list[dict[str, Any]]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Rows of the runs that did not come to their end."""
        return [row for row in self.rows if row["ended"] != "completed"]

    def command(self, row: dict[str, Any]) -> str:
        """Write the command that repeats a run alone and records it."""
        return f"opspace run {self.directory / FAILED / _name(row)}.yaml"

    def numbers(self, name: str) -> np.ndarray:
        """Return one number of every run, NaN where it has none."""
        found = [row["numbers"].get(name) for row in self.rows]
        return np.array([np.nan if value is None else value for value in found], dtype=float)

    def endings(self) -> Counter[str]:
        """Count how runs ended."""
        return Counter(row["ended"] for row in self.rows)

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Write median, 99th percentile and largest value of every number."""
        rows = []
        for name, unit in UNITS.items():
            values = self.numbers(name)
            values = values[np.isfinite(values)]
            if values.size:
                shown = [np.median(values), np.percentile(values, 99), values.max()]
                rows.append(
                    [
                        name.replace("_", " "),
                        *(f"{x:.3g}" for x in shown),
                        "" if unit == "1" else unit,
                    ]
                )
        return ["", "median", "p99", "max", "unit"], rows


def run_sweep(
    plan: SweepPlan,
    out: Path,
    *,
    jobs: int | None = None,
    ray: str | None = None,
    timeout: float = TIMEOUT,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Run a sweep, or what is left of it.

    Args:
        plan: What is run.
        out: Directory of the sweep; one that was interrupted goes on where it was.
        jobs: How many runs at a time on this machine; None takes one per core.
        ray: Address of a Ray cluster that runs it instead.
        timeout: Time allowed to one run, s.
        progress: Told how many runs are finished, of how many.

    Returns:
        All rows.

    Raises:
        InputError: A number that cannot be used, or processes that end before their first run.
        ScenarioError: The first run is no scenario: a misspelt key, a value out of range.
        RecordingError: The directory holds something else.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs must be at least 1, got {jobs}")
    plan.scenario(0)
    store = Store(out, plan)
    left = sorted(set(range(plan.size)) - store.finished())
    for row in _rows(plan, left, jobs or os.cpu_count() or 1, ray, timeout):
        store.add(row)
        left.remove(row["index"])
        if progress is not None:
            progress(plan.size - len(left), plan.size)
    found = Sweep(out, store.rows())
    _write_table(found)
    _write_failed(found)
    return found


def _rows(
    plan: SweepPlan, left: Sequence[int], jobs: int, ray: str | None, timeout: float
) -> Iterator[dict[str, Any]]:
    if not left:
        return iter(())
    if ray is not None:
        return run_on_ray(plan, left, ray, timeout)
    # Once here rather than once in every process, at the same time.
    KERNELS.load()
    return run_here(plan, left, jobs, timeout)


def _name(row: dict[str, Any]) -> str:
    return f"{row['index']:06d}"


def _write_table(found: Sweep) -> None:
    keys = list(found.rows[0]["values"]) if found.rows else []
    statuses = sorted({name for row in found.rows for name in row["seconds"]})
    with (found.directory / TABLE).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        heads = ["index", "id", "ended", "t", *keys, *UNITS, *statuses, "reason"]
        writer.writerow(heads)
        for row in found.rows:
            values = [flow(row["values"][key]) for key in keys]
            numbers = [row["numbers"].get(name) for name in UNITS]
            seconds = [row["seconds"].get(name, 0.0) for name in statuses]
            start = [row["index"], row["id"], row["ended"], row["t"]]
            writer.writerow([*start, *values, *numbers, *seconds, row["reason"]])


def _write_failed(found: Sweep) -> None:
    directory = found.directory / FAILED
    for row in found.failed:
        if row["scenario"] is not None:
            directory.mkdir(exist_ok=True)
            path = directory / f"{_name(row)}.yaml"
            path.write_text(dump_scenario(scenario_from(row["scenario"])), encoding="utf-8")

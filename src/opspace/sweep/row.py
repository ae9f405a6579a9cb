"""One run of a sweep, from its number to its row."""

from __future__ import annotations

from typing import Any

import numpy as np

from opspace.errors import OpspaceError
from opspace.loop import simulate
from opspace.scenario.build import build
from opspace.scenario.load import to_dict
from opspace.sweep.limit_measures import LimitWatch
from opspace.sweep.sweep_plan import SweepPlan, run_id

ENDS = ("completed", "stopped", "refused", "crashed", "died", "timed out")
"""How a run can end: to its end; given up by a guard of the scenario; a scenario that cannot be run; an
exception; its process gone; its process stopped after the time allowed."""


def run_row(plan: SweepPlan, index: int) -> dict[str, Any]:
    """Run one scenario of a sweep.

    Args:
        plan: The sweep.
        index: Number of the run.

    Returns:
        The row, in JSON's own types; it depends on the plan and the number alone. Its scenario
        repeats the run with nothing else at hand.
    """
    row = empty_row(plan, index)
    try:
        scenario = plan.scenario(index)
        row["id"], row["scenario"] = run_id(scenario), to_dict(scenario)
        built = build(scenario)
        watch = LimitWatch(built)
        observers = [watch, built.triggers]
        outcome = simulate(built.plant, built.controller, scenario.duration, observers, built.stop)
    except OpspaceError as error:
        return {**row, "ended": "refused", "reason": str(error)}
    except Exception as error:
        return {**row, "ended": "crashed", "reason": f"{type(error).__name__}: {error}"}
    row["ended"] = "completed" if outcome.completed else "stopped"
    row["t"], row["reason"] = outcome.t, outcome.reason
    row["numbers"] = {name: _plain(value) for name, value in watch.numbers.items()}
    row["seconds"] = watch.seconds
    return row


def empty_row(plan: SweepPlan, index: int) -> dict[str, Any]:
    """Write what is known of a run before it has begun."""
    return {
        "index": index,
        "id": None,
        "ended": "",
        "reason": "",
        "values": plan.values(index),
        "t": None,
        "numbers": {},
        "seconds": {},
        "scenario": None,
    }


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

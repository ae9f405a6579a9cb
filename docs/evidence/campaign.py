"""What a campaign of `opspace sweep random` found.

``python docs/evidence/campaign.py results/sweep/random`` writes the tables of docs/safety.md from the
rows of a sweep, finished or not.
"""

import re
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from opspace.plots.labels import number
from opspace.record.format import read_json
from opspace.sweep.limit_measures import UNITS

PAGE = Path(__file__).resolve().parents[1] / "safety.md"
BLOCK = re.compile(r"(<!-- campaign -->\n).*?(<!-- /campaign -->)", re.DOTALL)
WORDS = {
    "not_finite": "torques that are not finite",
    "above_torque_limit": "torques above a motor's limit",
    "position_excess": "beyond a limit that could be respected",
    "position_outside": "beyond a limit, for whatever reason",
    "speed_excess": "faster than a limit that could be respected",
    "distance_excess": "nearer than the margin before it was said",
    "max_joint_speed": "joint speed",
    "max_torque_use": "torque as a part of its limit",
    "max_torque_step": "torque step within 1 ms",
    "max_hard_solves": "hard torques in one tick",
}


def read(directory):
    """Return the plan of a sweep and the rows that are there."""
    plan = read_json(directory / "sweep.json")
    rows = [read_json(path) for path in sorted((directory / "rows").glob("[0-9]*.json"))]
    return plan, rows


def table(heads, rows):
    """Write a table."""
    lines = [heads, ["---"] + ["---:"] * (len(heads) - 1), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def summary(plan, rows):
    """Say what was run and how it ended."""
    endings = Counter(row["ended"] for row in rows)
    ended = ", ".join(f"{count:,} {how}" for how, count in endings.most_common())
    seconds = sum(row["t"] for row in rows if row["t"] is not None)
    robots = Counter(row["scenario"]["robot"] for row in rows if row["scenario"])
    return (
        f"Seed {plan['seed']}, {len(rows):,} of {plan['runs']:,} runs, {seconds:,.0f} s of motion at "
        f"1 kHz on {len(robots)} arms: {ended}.\n{among_obstacles(rows)}"
    )


def among_obstacles(rows):
    """Say how often distances were lost, where nothing moved and where something did; empty without."""
    words = []
    for what, moves in (("still obstacles", False), ("moving ones", True)):
        chosen = [row for row in rows if moving(row) is moves]
        lost = sum("COLLISION_LOST" in row["seconds"] for row in chosen)
        if chosen:
            words.append(f"{lost:,} of {len(chosen):,} runs with {what}")
    return f"`COLLISION_LOST` came in {' and in '.join(words)}.\n" if words else ""


def moving(row):
    """Whether an obstacle of a run moves; None where there are none."""
    collisions = (row["scenario"] or {}).get("collisions")
    if not collisions:
        return None
    return any(any(entry["velocity"]) for entry in collisions["obstacles"].values())


def numbers_table(rows):
    """Write every number's distribution over the runs that have it, and in how many it is not zero."""
    lines = []
    for name, words in WORDS.items():
        values = np.array([row["numbers"].get(name) for row in rows], dtype=float)
        values = values[np.isfinite(values)]
        if not values.size:
            continue
        unit = "" if UNITS[name] == "1" else f" [{UNITS[name]}]"
        shown = [np.median(values), np.percentile(values, 99), values.max()]
        count = f"{np.count_nonzero(values):,}"
        lines.append([f"{words}{unit}", *(number(float(x)) for x in shown), count])
    return table(["largest in a run", "median", "99 %", "largest", "runs above 0"], lines)


def status_table(rows):
    """Write how often each status held."""
    runs, seconds = Counter(), Counter()
    for row in rows:
        runs.update(row["seconds"].keys())
        seconds.update(row["seconds"])
    total = sum(row["t"] for row in rows if row["t"] is not None)
    lines = [
        [f"`{name}`", f"{runs[name]:,}", f"{100.0 * seconds[name] / total:.2g} %"]
        for name in sorted(runs, key=runs.get, reverse=True)
    ]
    return table(["status", "runs", "of the time"], lines)


def main(directory):
    """Rewrite the block of docs/safety.md."""
    plan, rows = read(Path(directory))
    block = "\n".join([summary(plan, rows), numbers_table(rows), status_table(rows)])
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(BLOCK.sub(lambda m: m[1] + block + m[2], text), encoding="utf-8")
    print(block)


if __name__ == "__main__":
    main(*sys.argv[1:])

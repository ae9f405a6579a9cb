"""Measure what the width of the σ buffer buys and costs, and draw it.

``python docs/evidence/buffer_sweep.py`` runs everything (about ten minutes), writes
``buffer_sweep.csv``, the tables of docs/singularities.md and the figure; ``--draw`` starts from the
CSV file.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from buffer_document import DOCS, EVIDENCE, number, read_csv, replace_block, table, write_csv
from buffer_motions import DEFAULT, START, Reach, Run, run, tasks
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

import opspace as osc
from opspace.plots.style import (
    INK,
    LINE_COLORS,
    SMALL,
    TEXT_SIZE,
    dress,
    new_figure,
    save,
    text_color,
)

CSV = EVIDENCE / "buffer_sweep.csv"
DOCUMENT = DOCS / "singularities.md"
ARMS = {"puma560": "PUMA 560", "ur5": "UR5", "panda": "Panda"}
UPPERS = (0.15, 0.3, 0.7, 1.2, 1.8)
ONE = osc.Singularity(0.1, 0.6, release=1.0)
"""One buffer, as in the paper, with the edges that are best for it."""
ONE_UPPERS = (0.3, 0.6, 1.2)

EDGE = 0.95
"""The reachable motion goes so far towards the edge of the workspace."""
BEYOND = 0.25
"""How far outside the edge the unreachable target is, m."""
SPEED = 0.2
"""Mean speed of the way out of the workspace, m/s."""
RADIUS = 0.1
"""Radius of the circle, m."""


class Look(NamedTuple):
    """How an arm is drawn: colour, place of its name [N·m, mm], offset of the numbers [pt]."""

    color: str
    name: tuple[float, float]
    offset: tuple[float, float]


LOOKS = {
    "puma560": Look(LINE_COLORS[0], (0.5, 27.0), (13.0, 6.0)),
    "ur5": Look(LINE_COLORS[1], (26.0, 3.5), (10.0, 6.0)),
    "panda": Look(LINE_COLORS[2], (0.032, 26.0), (-11.0, -13.0)),
}
SHOWN = 1.2
"""Largest upper edge that is drawn."""


def buffers() -> Iterator[osc.Singularity | None]:
    """List no handling, two buffers of several widths, and one buffer of several widths."""
    yield None
    for upper in UPPERS:
        yield replace(DEFAULT, upper=upper)
    for upper in ONE_UPPERS:
        yield replace(ONE, upper=upper)


def circle(reach: Reach, singularity: osc.Singularity | None) -> Run:
    """Draw an upright circle across the arm, which starts at the reference posture."""
    reference = osc.Circle(
        reach.start - [0.0, RADIUS, 0.0],
        RADIUS,
        3.0,
        normal=(1.0, 0.0, 0.0),
        start_time=START,
        ramp=1.0,
    )
    return run(reach.robot, tasks(reference), START + 4.0, singularity=singularity)


def measure(reach: Reach, singularity: osc.Singularity | None) -> dict[str, float]:
    """Run the three motions with one buffer; a run that was given up counts as nan."""
    near, back = reach.out_and_back(EDGE * reach.way, 2.0, 0.5)
    edge = run(reach.robot, tasks(near), back + 2.5, singularity=singularity)
    way = reach.way + BEYOND
    far, back = reach.out_and_back(way, way / SPEED, 1.5)
    out = run(reach.robot, tasks(far), back + way / SPEED + 1.0, singularity=singularity, back=back)
    held = out.outcome.completed
    return {
        "circle_error": circle(reach, singularity).largest("position"),
        "edge_error": edge.largest("position") if edge.outcome.completed else float("nan"),
        "torque_step": out.torque_step if held else float("nan"),
        "joint_speed": out.joint_speed if held else float("nan"),
        "rest_speed": out.rest_speed,
        "final_error": out.final("position") if held else float("nan"),
    }


def everything() -> list[dict[str, str | float]]:
    """Measure every buffer on every arm."""
    rows: list[dict[str, str | float]] = []
    for arm in ARMS:
        reach = Reach.of(arm)
        for option in buffers():
            edges = {key: getattr(option, key) for key in EDGES} if option else NONE
            rows.append({"robot": arm, **edges, **measure(reach, option)})
            print(rows[-1], flush=True)
    return rows


EDGES = ("lower", "upper", "release")
NONE: Mapping[str, str] = dict.fromkeys(EDGES, "")


def buffer_table(rows: list[dict[str, str]]) -> str:
    """Write one line per buffer: the circle on the worst arm, then three numbers per arm."""
    heads = ["buffer", "circle [mm]"]
    for title in ARMS.values():
        heads += [f"{title}: near the edge [mm]", "torque step [N·m]", "joint speed [rad/s]"]
    lines: dict[tuple[str, ...], list[str]] = {}
    circles: dict[tuple[str, ...], float] = {}
    for row in rows:
        edges = tuple(row[key] for key in EDGES)
        values = (1e3 * float(row["edge_error"]), float(row["torque_step"]))
        cells = lines.setdefault(edges, [])
        cells += [number(x) for x in (*values, float(row["joint_speed"]))]
        circles[edges] = max(circles.get(edges, 0.0), 1e3 * float(row["circle_error"]))
    order = sorted(lines, key=lambda edges: [float(edges[k] or 0.0) for k in (2, 1, 0)])
    return table(heads, [[_name(edges), number(circles[edges]), *lines[edges]] for edges in order])


def _name(edges: tuple[str, ...]) -> str:
    lower, upper, release = edges
    if not lower:
        return "none"
    text = f"{lower} – {upper}{', one' if float(release) == 1.0 else ''}"
    default = f"{DEFAULT.lower:g}", f"{DEFAULT.upper:g}", f"{DEFAULT.release:g}"
    return f"**{text}**" if edges == default else text


def trade_off(rows: list[dict[str, str]]) -> Figure:
    """Draw the accuracy near the edge over what the way out of the workspace takes."""
    figure = new_figure(4.4)
    panels = figure.subplots(1, 2, sharey=True, width_ratios=(1.6, 1.0))
    for panel, key, what in (
        (panels[0], "torque_step", "out of reach: largest torque step [N·m]"),
        (panels[1], "joint_speed", "out of reach: fastest joint [rad/s]"),
    ):
        dress(panel, x=what)
        panel.set_xscale("log")
        panel.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        panel.xaxis.set_minor_formatter(NullFormatter())
        for arm, look in LOOKS.items():
            shown = [r for r in rows if r["robot"] == arm and float(r["upper"] or 9.0) <= SHOWN]
            _draw_arm(panel, shown, key, look, named=panel is panels[0])
    panels[0].set_ylabel("within reach: largest error [mm]", fontsize=TEXT_SIZE, color=INK)
    panels[0].set_xlim(0.024, 130.0)
    panels[1].set_xticks([1, 2, 4, 8])
    for arm, look in LOOKS.items():
        name = {"color": text_color(look.color), "fontweight": "bold", "fontsize": TEXT_SIZE}
        panels[0].text(*look.name, ARMS[arm], **name)
    return figure


def _draw_arm(
    panel: Axes, rows: list[dict[str, str]], key: str, look: Look, *, named: bool
) -> None:
    points = sorted(
        (float(r["upper"]), float(r["release"]), float(r[key]), 1e3 * float(r["edge_error"]))
        for r in rows
        if r["upper"]
    )
    fixed = [(upper, x, y) for upper, release, x, y in points if release < 1.0]
    other = [(x, y) for _, release, x, y in points if release == 1.0]
    color = look.color
    panel.plot([x for _, x, _ in fixed], [y for *_, y in fixed], "o-", color=color, ms=4)
    panel.plot(*zip(*other, strict=True), "o", color=color, ms=5, mfc="white", zorder=3)
    for upper, x, y in fixed:
        chosen = upper == DEFAULT.upper
        if chosen:
            panel.plot(x, y, "o", color=color, ms=9, zorder=4)
        if named and y > 1.0:
            panel.annotate(
                f"{upper:g}",
                (x, y),
                look.offset,
                textcoords="offset points",
                ha="center",
                fontsize=SMALL,
                fontweight="bold" if chosen else "normal",
                color=text_color(color),
            )


def main() -> None:
    """Measure, write the table, draw."""
    if "--draw" not in sys.argv:
        write_csv(CSV, everything())
    rows = read_csv(CSV)
    replace_block(DOCUMENT, "buffers", buffer_table(rows))
    save(trade_off(rows), DOCS / "images" / "buffers.png")


if __name__ == "__main__":
    main()

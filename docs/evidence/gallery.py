"""Draw the pictures of docs/gallery.md from runs of the examples: ``python docs/evidence/gallery.py``.

Words after the command are the numbers of the examples to draw.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from typing import NamedTuple

import gallery_panels as panels
import numpy as np

import opspace as osc
from opspace.plots.labels import Line, draw_lines, label_ends
from opspace.plots.style import FAINT, dress, line_color, new_figure, save

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images" / "gallery"


class Tape:
    """What an example simulates, seen without the example knowing."""

    def __init__(self) -> None:
        self.commands, self.q = [], []

    def observe(self, q: np.ndarray, v: np.ndarray, command: osc.Command) -> None:
        """See one tick."""
        self.q.append(q.copy())
        self.commands.append(command)

    @property
    def t(self) -> np.ndarray:
        """Times of the ticks, s."""
        return np.array([command.t for command in self.commands])

    @property
    def tau(self) -> np.ndarray:
        """Torques, N·m."""
        return np.array([command.tau for command in self.commands])

    def tasks(self, name: str, what: str, every: int = 5) -> tuple[np.ndarray, np.ndarray]:
        """Give times and an attribute of a task; 0 while it is not there."""
        seen = self.commands[::every]
        missing = osc.TaskStatus(0.0, (), np.zeros(0), 0.0)
        values = [getattr(command.tasks.get(name, missing), what) for command in seen]
        return self.t[::every], np.array(values)

    def tool(self, robot: osc.Robot, every: int = 5) -> tuple[np.ndarray, np.ndarray]:
        """Give times and positions of the tool, m."""
        found = []
        for q in self.q[::every]:
            robot.update(q, np.zeros(robot.nv))
            found.append(robot.position(robot.frame_id(robot.tool)).copy())
        return self.t[::every], np.array(found)


class Run(NamedTuple):
    """An example that has run: its names and its tape."""

    names: dict
    tape: Tape


def run(path: Path) -> Run:
    """Run an example with a tape in its simulation."""
    tape, simulate = Tape(), osc.simulate

    def watched(plant, controller, duration, observers=(), *rest):
        return simulate(plant, controller, duration, [*observers, tape], *rest)

    osc.simulate = watched
    try:
        return Run(runpy.run_path(str(path)), tape)
    finally:
        osc.simulate = simulate


def draw(found: list[panels.Panel], path: Path) -> None:
    """Draw panels beside each other, lines named at their ends."""
    figure = new_figure(2.9)
    named = {}
    for axes, panel in zip(figure.subplots(1, len(found), squeeze=False)[0], found, strict=True):
        lines = [
            Line(name, line_color(i), np.asarray(x), np.asarray(y))
            for i, (name, x, y) in enumerate(panel.lines)
        ]
        dress(axes, title=panel.title, x=panel.x, y=panel.y)
        for text, height in panel.marks:
            axes.axhline(height, color=FAINT, linewidth=1.0, linestyle="--")
            axes.text(0.98, height, text, fontsize=9, color="#606060", ha="right", va="bottom",
                      transform=axes.get_yaxis_transform())  # fmt: skip
        draw_lines(axes, lines)
        if panel.equal:
            axes.set_aspect("equal", adjustable="datalim")
        else:
            axes.margins(x=0.0, y=0.08)
        named[axes] = lines
    label_ends(named)
    save(figure, path)


def main(numbers: list[str]) -> None:
    """Draw the examples of these numbers, all if there are none."""
    for path in sorted((ROOT / "examples").glob("*.py")):
        if not numbers or path.stem.split("_")[0] in numbers:
            draw(getattr(panels, path.stem[3:])(run(path)), IMAGES / f"{path.stem}.png")


if __name__ == "__main__":
    asked = sys.argv[1:]
    del sys.argv[1:]  # examples read these words, too
    main(asked)

"""Let G1 lift a foot and a hand with continuous transitions and with a hard switch, and draw both.

``python docs/evidence/humanoid_lift.py`` runs everything (some two minutes on a quiet core), writes
``humanoid_lift.csv`` and the figure of docs/how-to/my-humanoid.md; ``--draw`` starts from the CSV
file and only renders the robot anew.
"""

from __future__ import annotations

import sys

import mujoco
import numpy as np
from buffer_document import DOCS, EVIDENCE, read_csv, write_csv
from g1_on_soles import g1_on_soles

import opspace as osc
from opspace.pictures.offscreen import View, canvas
from opspace.plots.style import (
    INK,
    TEXT_SIZE,
    VARIANT_COLORS,
    VARIANT_TITLES,
    dress,
    new_figure,
    save,
)

CSV = EVIDENCE / "humanoid_lift.csv"
PICTURE = DOCS / "images" / "humanoid.png"
END = 5.4
MOMENTS = (0.1, 2.55, 5.3)
"""Times of the pictures, s."""
SIZE = (315, 420)
CHANGES = {"foot lets go": 2.5, "hand comes in": 4.2}
BETWEEN = 10
"""Ticks from one row of the CSV file to the next."""


class Lift:
    """G1 leans over its left foot, lifts the right one, and reaches out with the hand."""

    def __init__(self, *, hard: bool) -> None:
        robot, soles, q = g1_on_soles()
        self.robot, self.hard = robot, hard
        robot.update(q, np.zeros(robot.nv))
        here = robot.com_position().copy()
        over = here + (0.03, 0.0, 0.0)
        over[1] = robot.position(robot.frame_id("left_ankle_roll_link"))[1] - 0.018
        com = osc.ComTask(osc.MinimumJerk(here, over, 2.0, start_time=0.2))
        self.foot = osc.PoseTask("right_ankle_roll_link", name="foot")
        self.hand = osc.PositionTask("right_rubber_hand", name="hand")
        torso = osc.OrientationTask("torso_link", name="torso")
        tasks = [osc.JointLimits(), com, torso, osc.PostureTask(kp=25.0)]
        self.stack = osc.Stack(tasks, contacts=soles)
        self.controller = osc.Controller(robot, self.stack, torque_limits="priority")
        self.plant = osc.Plant(robot, q, ground=osc.Ground(soles), substeps=2)
        self.rows: list[dict[str, float]] = []
        self.poses: list[np.ndarray] = []

    def run(self) -> None:
        """Go through the story, tick by tick."""
        plant, before, steps = self.plant, None, [0.0]
        for tick in range(round(END * 1000)):
            self.ask(tick)
            command = self.controller.step(plant.t, plant.q, plant.v)
            plant.advance(command.tau)
            if before is not None:
                steps.append(float(np.abs(command.tau - before).max()))
            before = command.tau
            if tick % BETWEEN == BETWEEN - 1:
                told = command.contacts.get("right")
                self.rows.append(
                    {
                        "t": plant.t,
                        "force": float(plant.contact_forces["right"][2]),
                        "planned": 0.0 if told is None else float(told.force[2]),
                        "step": max(steps),
                    }
                )
                steps = [0.0]
            if any(tick == round(moment * 1000) for moment in MOMENTS):
                self.poses.append(plant.q.copy())

    def ask(self, tick: int) -> None:
        """Ask for what this moment brings."""
        if tick == 2500:
            self.stack.insert(self.foot, 0.5, 0.0)  # the contact is above it until it has gone
            self.stack.remove("right", 0.0 if self.hard else 0.3)
        if tick == 3000:
            self.robot.update(self.plant.q, self.plant.v)
            start = self.robot.position(self.robot.frame_id("right_ankle_roll_link")).copy()
            way = osc.MinimumJerk(start, start + (0.08, 0.0, 0.14), 1.0, start_time=3.0)
            self.foot.target = osc.PoseReference(way, np.eye(3))
        if tick == 4200:
            self.robot.update(self.plant.q, self.plant.v)
            hand = self.robot.position(self.robot.frame_id("right_rubber_hand"))
            self.hand.target = hand + (0.12, -0.05, 0.22)
            self.hand.max_speed = 0.3
            self.stack.insert(self.hand, 1.5, 0.0 if self.hard else 0.5)


def rendered(lift: Lift) -> list[np.ndarray]:
    """Render the moments."""
    model = lift.plant.model
    model.vis.map.shadowclip, model.vis.quality.shadowsize = 4.0, 4096
    data, images = mujoco.MjData(model), []
    view = View(np.array([0.05, 0.0, 0.66]), 2.3, 150.0, -8.0)
    with canvas(model, SIZE) as drawing:
        for q in lift.poses:
            data.qpos[:] = q
            mujoco.mj_forward(model, data)
            drawing.show(data, view)
            images.append(drawing.pixels())
    return images


def draw(rows: list[dict[str, str]], images: list[np.ndarray]) -> None:
    """Draw the robot above the force of the foot and the torque steps."""
    figure = new_figure(5.6)
    grid = figure.add_gridspec(3, 3, height_ratios=(1.8, 1.0, 1.0))
    for k, (image, moment) in enumerate(zip(images, MOMENTS, strict=True)):
        panel = figure.add_subplot(grid[0, k])
        panel.imshow(image)
        panel.set_axis_off()
        panel.set_title(f"{moment:g} s", fontsize=TEXT_SIZE, color=INK)
    force, step = figure.add_subplot(grid[1, :]), figure.add_subplot(grid[2, :])
    for variant in ("switch", "transition"):
        own = [row for row in rows if row["variant"] == variant]
        t = [float(row["t"]) for row in own]
        look = {"color": VARIANT_COLORS[variant], "label": VARIANT_TITLES[variant]}
        force.plot(t, [float(row["force"]) for row in own], **look)
        step.semilogy(t, [max(float(row["step"]), 1e-4) for row in own], **look)
    dress(force, y="right foot [N]")
    dress(step, x="time [s]", y="torque step [N·m]")
    for panel in (force, step):
        for time in CHANGES.values():
            panel.axvline(time, color="#8c8c8c", lw=0.8, ls="--", zorder=0)
        panel.set_xlim(0.0, END)
    for text, time in CHANGES.items():
        force.text(time + 0.04, force.get_ylim()[1] * 0.88, text, fontsize=TEXT_SIZE, color=INK)
    force.legend(loc="lower left", fontsize=TEXT_SIZE, frameon=False)
    save(figure, PICTURE)


def main() -> None:
    """Run, write and draw."""
    lifts = {"transition": Lift(hard=False)}
    if "--draw" not in sys.argv:
        lifts["switch"] = Lift(hard=True)
    rows: list[dict[str, str | float]] = []
    for variant, lift in lifts.items():
        lift.run()
        rows += [{"variant": variant, **row} for row in lift.rows]
        print(variant, max(row["step"] for row in lift.rows), flush=True)
    if "--draw" not in sys.argv:
        write_csv(CSV, rows)
    draw(read_csv(CSV), rendered(lifts["transition"]))


if __name__ == "__main__":
    main()

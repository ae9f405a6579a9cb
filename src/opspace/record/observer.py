"""The observer that writes every tick of a run into a recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opspace.controller import Command, Controller
from opspace.record.format import Column, Ended
from opspace.record.writer import Recorder


def columns_of(controller: Controller) -> list[Column]:
    """List the columns of a controller's recording, in the order of `TickRecorder`'s rows.

    Args:
        controller: The controller that will be recorded.

    Returns:
        Columns with names, units and descriptions.
    """
    robot, stack = controller.robot, controller.stack
    columns = [Column("t", "s", "time")]
    for group, unit, what in (
        ("q", "rad", "joint position"),
        ("v", "rad/s", "joint velocity"),
        ("tau", "N·m", "commanded joint torque, bias included"),
    ):
        columns += [Column(f"{group}/{j}", unit, f"{what} of {j}") for j in robot.joint_names]
    columns += [Column(f"tool/{a}", "m", f"{robot.tool} position, {a}") for a in "xyz"]
    for task in stack:
        columns.append(Column(f"tasks/{task.name}/activation", "1", f"activation of {task.name}"))
        columns += [
            Column(f"tasks/{task.name}/error/{i}", unit, f"row {i}: desired minus actual")
            for i, unit in enumerate(task.units)
        ]
    for i, level in enumerate(stack.levels):
        size = min(sum(task.rows for task in level), robot.nv)
        names = ", ".join(task.name for task in level)
        columns += [
            Column(f"levels/{i}/sigma/{k}", "1", f"eigenvalue {k} of Eq. 25 of {names}")
            for k in range(size)
        ]
        columns += [
            Column(f"levels/{i}/activation/{k}", "1", f"activation of direction {k} of {names}")
            for k in range(size)
        ]
    if stack.limits is not None:
        columns += [
            Column(f"limits/{side.name}", "1", f"activation of the limit {side.name}")
            for side in stack.limits.sides
        ]
    return [
        *columns,
        Column("hard_solves", "1", "hard torques in the blend"),
        Column("status", "1", "status flags of the command"),
    ]


class TickRecorder:
    """Record a run: one row per tick, on disk before the plant advances.

    Args:
        directory: Where the recording is written.
        controller: The controller of the run.
        header: What the recording says about itself: scenario, seed, time step.
        overwrite: Replace a recording that is already there.

    Raises:
        RecordingError: There is a recording already, or the directory cannot be written.
    """

    def __init__(
        self,
        directory: Path,
        controller: Controller,
        header: Mapping[str, object],
        *,
        overwrite: bool = False,
    ) -> None:
        self._controller = controller
        self._tool = controller.robot.frame_id(controller.robot.tool)
        columns = columns_of(controller)
        self._width = len(columns)
        self._sizes = [
            min(sum(task.rows for task in level), controller.robot.nv)
            for level in controller.stack.levels
        ]
        self._recorder = Recorder(directory, columns, header, overwrite=overwrite)

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Write one tick."""
        controller = self._controller
        parts = [[command.t], q, v, command.tau, controller.robot.position(self._tool)]
        for task in controller.stack:
            found = command.tasks[task.name]
            parts += [[found.activation], found.error]
        for size, level in zip(self._sizes, command.levels, strict=True):
            parts += [_padded(level.sigma, size), _padded(level.activation, size)]
        if controller.stack.limits is not None:
            parts.append([command.limits.get(s.name, 0.0) for s in controller.stack.limits.sides])
        parts.append([float(command.hard_solves), float(command.status)])
        self._recorder.append(np.concatenate(parts))

    def close(self, how: Ended = "completed", reason: str = "") -> None:
        """Finish the recording and say how the run ended."""
        self._recorder.close(how, reason)


def _padded(values: np.ndarray, size: int) -> np.ndarray:
    padded = np.full(size, np.nan)
    padded[: values.size] = values
    return padded

"""A handle on the page, by which something is dragged elsewhere."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
import viser

from opspace.tasks.rotation import quaternion_from_matrix

DRAG_PERIOD = 0.05
"""Seconds between two requests while something is being dragged."""

STAYS = 3.0
"""Seconds that a handle stays where it was dragged to; then it follows what it belongs to again."""

Led = Callable[[dict[str, tuple[float, ...]]], None]
"""Takes where a handle was dragged to: ``position``, ``orientation`` as a quaternion wxyz, or both."""


class DragHandle:
    """Arrows and rings at something that can be dragged.

    Args:
        server: The server of the page.
        path: Name of the handle in the scene.
        led_by: What it can be dragged in: ``"position"``, ``"orientation"``.
        led: Told where it is dragged to, on the way and at the end.
    """

    def __init__(
        self, server: viser.ViserServer, path: str, led_by: Collection[str], led: Led
    ) -> None:
        self._led_by, self._led = led_by, led
        self._dragging, self._sent, self._released = False, 0.0, -math.inf
        self._handle = server.scene.add_transform_controls(
            path,
            scale=0.16,
            line_width=3.0,
            disable_axes="position" not in led_by,
            disable_sliders="position" not in led_by,
            disable_rotations="orientation" not in led_by,
            depth_test=False,
            visible=False,
        )
        self._handle.on_drag_start(self._begin)
        self._handle.on_update(self._go_on)
        self._handle.on_drag_end(self._end)

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self._handle.visible = visible

    def follow(self, position: np.ndarray, rotation: np.ndarray | None = None) -> None:
        """Put it where what it belongs to is, unless it is being dragged or has just been."""
        if self._dragging or time.monotonic() < self._released + STAYS:
            return
        self._handle.position = position
        if rotation is not None:
            self._handle.wxyz = np.array(quaternion_from_matrix(rotation))

    def _begin(self, event: Any) -> None:
        del event
        self._dragging = True

    def _go_on(self, event: Any) -> None:
        del event
        now = time.monotonic()
        if self._dragging and now - self._sent >= DRAG_PERIOD:
            self._sent = now
            self._send()

    def _end(self, event: Any) -> None:
        del event
        self._dragging, self._released = False, time.monotonic()
        self._send()

    def _send(self) -> None:
        place = {"position": self._handle.position, "orientation": self._handle.wxyz}
        self._led({what: tuple(float(x) for x in place[what]) for what in self._led_by})

"""Sliders of forces and of springs on the page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import viser

from opspace.view.controls import Ask

MOST_FORCE = 5.0
"""A slider goes to so many times the force that is wanted at the start."""
MOST_SPRING = 400.0
"""And one of a spring to so many per cent of its stiffness at the start."""
_SPRING_TAKES = 0.2


class PressControls:
    """Sliders that say how hard force tasks press, and how stiff springs are.

    A force is scaled along the direction that it has, down to where a touch is certain; a stiffness in
    all its rows alike.

    Args:
        server: The server of the page.
        ask: Takes messages to the run.
        tasks: What the recording says about the tasks.
    """

    def __init__(
        self, server: viser.ViserServer, ask: Ask, tasks: Mapping[str, Mapping[str, Any]]
    ) -> None:
        self._server, self._ask = server, ask
        for name, about in tasks.items():
            if "press" in about:
                self._force(name, np.array(about["press"]["force"]), about["press"]["least"])
            if any(about.get("stiffness", ())):
                self._spring(name, np.array(about["stiffness"]))

    def _force(self, name: str, force: np.ndarray, least: float) -> None:
        size = float(np.linalg.norm(force))
        slider = self._server.gui.add_slider(
            f"{name} [N]", round(least, 1), round(MOST_FORCE * size, 1), 0.1, round(size, 1)
        )

        def send(part: float) -> dict[str, Any]:
            return {"kind": "press", "force": (part / size * force).tolist()}

        self._attach(slider, name, send)

    def _spring(self, name: str, stiffness: np.ndarray) -> None:
        slider = self._server.gui.add_slider(f"{name} [%]", 0.0, MOST_SPRING, 1.0, 100.0)

        def send(part: float) -> dict[str, Any]:
            scaled: Sequence[float] = (part / 100.0 * stiffness).tolist()
            return {"kind": "spring", "stiffness": scaled, "duration": _SPRING_TAKES}

        self._attach(slider, name, send)

    def _attach(self, slider: Any, name: str, send: Callable[[float], dict[str, Any]]) -> None:
        @slider.on_update
        def _(event: Any) -> None:
            # None is the page's own doing.
            if event.client is not None:
                self._ask({"request": {**send(float(slider.value)), "tasks": [name]}})


def has_pressure(tasks: Mapping[str, Mapping[str, Any]]) -> bool:
    """Tell whether any task has something that `PressControls` can change."""
    return any("press" in about or any(about.get("stiffness", ())) for about in tasks.values())

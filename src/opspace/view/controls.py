"""Buttons, sliders and menus of the page, and what they ask for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import viser

Ask = Callable[[dict[str, Any]], None]
"""Takes a message to the run."""

SPEEDS = ("0.1×", "0.25×", "0.5×", "1×", "2×", "5×")
KP_MOST = 1000.0
"""Largest stiffness of the slider, 1/s²; more can be typed."""


class RunControls:
    """Pause, single ticks, speed, and the time that is shown.

    Args:
        server: The server of the page.
        ask: Takes messages to a run that goes on; None where the run is over.

    Attributes:
        follows: Whether the newest tick is shown.
        paused: Whether time stands still.
        speed: Seconds of the run per second of the clock.
        time: Time that is shown [s].
    """

    def __init__(self, server: viser.ViserServer, ask: Ask | None) -> None:
        self.follows = ask is not None
        self.paused = False
        self.speed = 1.0
        self.time = 0.0
        self._ask, self._steps = ask, 0
        self._buttons = server.gui.add_button_group("Run", ("Pause", "Go on", "Step", "Newest"))
        self._speed = server.gui.add_dropdown("Speed", SPEEDS, initial_value="1×")
        self._slider = server.gui.add_slider("Time [s]", 0.0, 1.0, 0.001, 0.0)
        self._buttons.on_click(lambda event: self._press(event.target.value))
        self._speed.on_update(lambda event: self._set_speed(event.target.value))
        self._slider.on_update(self._scrub)

    def show(self, first: float, last: float) -> None:
        """Show which part of the run there is, and which tick of it is on the page."""
        if self.follows:
            self.time = last
        self.time = min(max(self.time, first), last)
        if last > self._slider.max or first < self._slider.min:
            # In steps, or the page would have to build the slider anew with every picture.
            self._slider.max = last if self._ask is None else float(math.ceil(1.25 * last + 5.0))
            self._slider.min = first
        if abs(self._slider.value - self.time) > 1e-9:
            self._slider.value = self.time

    def take_steps(self) -> int:
        """Return how many ticks to go on, once."""
        steps, self._steps = self._steps, 0
        return steps

    def end(self) -> None:
        """Let a run that went on be over: it can still be played."""
        self._ask, self.paused = None, True

    def _press(self, button: str) -> None:
        if button == "Newest":
            self.follows = True
        elif button == "Step":
            self.paused = True
            if self._ask is None:
                self.follows, self._steps = False, self._steps + 1
            else:
                self.follows = True
                self._ask({"control": "step"})
        else:
            self.paused = button == "Pause"
            if self._ask is None:
                self.follows = False
            else:
                self.follows = True
                self._ask({"control": "pause" if self.paused else "resume"})

    def _set_speed(self, shown: str) -> None:
        self.speed = float(shown.removesuffix("×"))
        if self._ask is not None:
            self._ask({"control": "speed", "value": self.speed})

    def _scrub(self, event: Any) -> None:
        # None is the page's own doing, in `show`.
        if event.client is not None:
            self.follows, self.time = False, float(event.target.value)
            if self._ask is None:
                self.paused = True


class StackControls:
    """Buttons that change the stack and the gains.

    Args:
        server: The server of the page.
        ask: Takes messages to the run.
        tasks: What the recording says about the tasks.
        homes: Level where each task belongs, as far as it is known.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        ask: Ask,
        tasks: Mapping[str, Mapping[str, Any]],
        homes: Mapping[str, float],
    ) -> None:
        self._ask, self._tasks, self._homes = ask, tasks, homes
        names = tuple(tasks)
        first, second = names[0], names[1 % len(names)]
        self._task = server.gui.add_dropdown("Task", names, initial_value=first)
        self._level = server.gui.add_number("Level", self._home(first), step=0.5)
        self._duration = server.gui.add_slider("Duration [s]", 0.0, 3.0, 0.05, 0.5)
        once = server.gui.add_button_group("Change", ("Insert", "Remove", "Move"))
        self._other = server.gui.add_dropdown("Swap with", names, initial_value=second)
        swap = server.gui.add_button("Swap")
        self._kp = server.gui.add_slider("kp [1/s²]", 0.0, KP_MOST, 1.0, self._stiffness(first))
        self._kp.disabled = not self._has_gain(first)
        self._answer = server.gui.add_html(answer("", ""))
        once.on_click(lambda event: self._change(event.target.value.lower()))
        swap.on_click(lambda event: self._swap())
        self._task.on_update(self._choose)
        self._kp.on_update(self._set_gain)

    def answer(self, what: str, reason: str) -> None:
        """Show what became of a request; the reason is empty where it was fulfilled."""
        self._answer.content = answer(what, reason)

    def _change(self, kind: str) -> None:
        request: dict[str, Any] = {"kind": kind, "tasks": [self._task.value]}
        request["duration"] = float(self._duration.value)
        if kind != "remove":
            request["level"] = float(self._level.value)
        self._ask({"request": request})

    def _swap(self) -> None:
        names = [self._task.value, self._other.value]
        request = {"kind": "swap", "tasks": names, "duration": float(self._duration.value)}
        self._ask({"request": request})

    def _set_gain(self, event: Any) -> None:
        if event.client is None:
            return
        request = {"kind": "gain", "tasks": [self._task.value], "kp": float(self._kp.value)}
        self._ask({"request": {**request, "duration": 0.2}})

    def _choose(self, event: Any) -> None:
        del event
        self._level.value = self._home(self._task.value)
        self._kp.value = self._stiffness(self._task.value)
        self._kp.disabled = not self._has_gain(self._task.value)

    def _home(self, name: str) -> float:
        return self._homes.get(name, 0.0)

    def _has_gain(self, name: str) -> bool:
        """Tell whether kp is the stiffness of a task: not of those that press, nor of springs."""
        return not {"press", "stiffness"} & self._tasks[name].keys()

    def _stiffness(self, name: str) -> float:
        kp = self._tasks[name]["kp"]
        return min(float(kp[0] if isinstance(kp, list) else kp), KP_MOST)


class ContactControls:
    """Buttons that insert and remove contacts.

    Args:
        server: The server of the page.
        ask: Takes messages to the run.
        contacts: Names of the contacts.
    """

    def __init__(self, server: viser.ViserServer, ask: Ask, contacts: Sequence[str]) -> None:
        self._ask = ask
        names = tuple(contacts)
        self._contact = server.gui.add_dropdown("Contact", names, initial_value=names[0])
        self._duration = server.gui.add_slider("Takes [s]", 0.0, 3.0, 0.05, 0.3)
        self._waits = server.gui.add_checkbox("Waits until the others carry", True)
        buttons = server.gui.add_button_group("Contact goes", ("Insert contact", "Remove contact"))
        buttons.on_click(lambda event: self._change(event.target.value.split()[0].lower()))

    def _change(self, kind: str) -> None:
        request: dict[str, Any] = {"kind": kind, "tasks": [self._contact.value]}
        request["duration"] = float(self._duration.value)
        if kind == "remove":
            request["wait"] = bool(self._waits.value)
        self._ask({"request": request})


def answer(what: str, reason: str) -> str:
    """Write what became of a request."""
    color = "#BB5566" if reason else "#8c8c8c"
    text = f"{what}: {reason}" if reason else f"{what}: done" if what else ""
    return (
        '<div data-opspace="answer" style="font-size:12px;line-height:16px;min-height:32px;'
        f'padding:0 12px;color:{color}">{escape(text)}</div>'
    )

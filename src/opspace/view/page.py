"""The page: one recording, drawn again and again from its newest or its chosen tick."""

from __future__ import annotations

import contextlib
import io
import socket
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from opspace.errors import InputError, ModelWarning, missing_extra
from opspace.record.contact_columns import GROUP
from opspace.record.growing import GrowingRecording
from opspace.record.obstacle_columns import HEADER_KEY
from opspace.record.wrench_columns import touched
from opspace.robots import Robot, load_robot
from opspace.robots.joint_units import effort_unit

try:
    import viser
except ImportError:
    raise missing_extra("viser", "view") from None

from opspace.view import panels
from opspace.view.charts import Chart, sigma_columns, torque_columns
from opspace.view.collision_scene import CollisionScene
from opspace.view.contact_scene import ContactScene
from opspace.view.controls import Ask, ContactControls, RunControls, StackControls
from opspace.view.distance_panel import distances
from opspace.view.frame import FrameReader
from opspace.view.press_controls import PressControls, has_pressure
from opspace.view.scene import RobotScene
from opspace.view.touch_panel import touches
from opspace.view.touch_scene import TouchScene

PICTURES = 25.0
"""Pictures per second."""

CHARTS = 5.0
"""Charts per second."""

_WIDTH = 340.0
_TRAIL_SECONDS = 4.0


class Page:
    """A web page that shows a recording, which may still be growing.

    Args:
        directory: The recording.
        host: Address to listen at; 127.0.0.1 lets nobody in from outside.
        port: Port to listen at; the next free one is taken where it is in use.
        ask: Takes messages to the run that writes the recording; None where it is over.

    Raises:
        MissingExtraError: The viewer is not installed.
        RecordingError: There is no recording.
        InputError: The recording lacks what a page shows, or nobody can listen at the address.
    """

    def __init__(self, directory: Path, host: str, port: int, ask: Ask | None) -> None:
        recording = GrowingRecording(directory)
        if ask is None and not len(recording.data):
            raise InputError(f"{directory} is a recording without a tick")
        if not {"robot", "tasks"} <= recording.header.keys():
            raise InputError(f"{directory} does not say what it is about; record it again")
        self._reader = FrameReader(recording)
        self._about = recording.header
        _check_host(host)
        # It greets on the standard output, which belongs to whoever started the page.
        with contextlib.redirect_stdout(io.StringIO()):
            self._server = viser.ViserServer(host, port, label="opspace", verbose=False)
        self._controls: StackControls | None = None
        self._build(directory, ask)
        robot = _robot(self._about["robot"])
        self._apart: CollisionScene | None = None
        if (guard := self._about.get(HEADER_KEY)) is not None:
            move = None if ask is None else self._move
            self._apart = CollisionScene(self._server, robot, guard, move)
        self._scene = RobotScene(
            self._server,
            robot,
            self._about["tasks"],
            None if ask is None else self._drag,
        )
        touching = self._about.get(GROUP, {})
        self._contacts = ContactScene(self._server, robot, touching) if touching else None
        self._presses = {
            n: one["press"] for n, one in self._about["tasks"].items() if "press" in one
        }
        self._touches: TouchScene | None = None
        if self._presses:
            self._touches = TouchScene(self._server, robot, self._presses, touched(self._about))
        self._ask = ask
        self._charted = self._drawn = 0.0
        self._shown: tuple[int, bool] | None = None

    @property
    def address(self) -> str:
        """Where a browser finds the page."""
        host = self._server.get_host()
        here = "localhost" if host in ("127.0.0.1", "0.0.0.0") else host
        return f"http://{here}:{self._server.get_port()}"

    def on_visit(self, call: Callable[[], None]) -> None:
        """Call a function whenever a browser opens the page."""
        self._server.on_client_connect(lambda client: call())

    def answer(self, what: str, reason: str) -> None:
        """Show what became of a request."""
        if self._controls is not None:
            self._controls.answer(what, reason)

    def end(self) -> None:
        """Tell the page that the run is over; what was recorded can still be looked at."""
        self._ask = None
        self._run.end()

    def show(self) -> None:
        """Draw one picture, if there is something new to see."""
        now = time.monotonic()
        rows = self._reader.recording.refresh()
        if rows == 0:
            return
        times = self._reader.recording.data[:, 0]
        if self._ask is None and not self._run.paused and self._drawn:
            self._run.time += self._run.speed * (now - self._drawn)
        self._drawn = now
        self._run.show(float(times[0]), float(times[-1]))
        row = rows - 1 if self._run.follows else self._reader.row_at(self._run.time)
        if steps := self._run.take_steps():
            row = min(row + steps, rows - 1)
            self._run.time = float(times[row])
        state = (row, self._run.follows)
        if state != self._shown:
            with self._server.atomic():
                self._draw(row, now)
            self._shown = state

    def serve(self) -> None:
        """Draw pictures until the process is interrupted."""
        while True:
            self.show()
            time.sleep(1.0 / PICTURES)

    def close(self) -> None:
        """Stop listening."""
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def _draw(self, row: int, now: float) -> None:
        frame = self._reader.at(row)
        tool = self._reader.recording.group("tool")
        trail = self._reader.history(row, _TRAIL_SECONDS, 80, tool)[:, 1:]
        live = self._ask is not None and self._run.follows
        self._scene.show(frame, trail, live)
        if self._apart is not None:
            self._apart.shapes_shown = self._shapes_shown.value
            gaps = self._apart.show(frame, live)
            self._distances.content = distances(gaps, self._apart.margin)
        if self._contacts is not None:
            self._contacts.show(frame)
        if self._touches is not None:
            self._touches.show(frame)
        self._head.content = panels.head(frame, self._note(live))
        pressed = touches(frame, self._presses)
        self._bars.content = panels.contacts(frame) + pressed + panels.tasks(frame)
        if now - self._charted >= 1.0 / CHARTS or self._run.paused:
            self._charted = now
            self._joints.content = panels.joints(frame, self._reader.joints, self._about["robot"])
            if not self._charts:
                self._charts = self._add_charts()
            for chart in self._charts:
                chart.show(row)

    def _note(self, live: bool) -> str:
        if self._ask is None:
            return "recorded" if self._reader.recording.ended else "recorded, cut short"
        if self._run.paused:
            return "paused"
        return "live" if live else "live, looking back"

    def _build(self, directory: Path, ask: Ask | None) -> None:
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 68, 136))
        gui.set_panel_label(f"opspace · {self._about['robot']['name']} · {directory.name}")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_WIDTH)
        self._head = gui.add_html("")
        self._run = RunControls(self._server, ask)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Tasks"):
            self._bars = gui.add_html("")
            if ask is not None and self._about["tasks"]:
                gui.add_divider()
                homes = _homes(self._about)
                self._controls = StackControls(self._server, ask, self._about["tasks"], homes)
            if ask is not None and self._about.get(GROUP):
                gui.add_divider()
                ContactControls(self._server, ask, list(self._about[GROUP]))
            if ask is not None and has_pressure(self._about["tasks"]):
                gui.add_divider()
                PressControls(self._server, ask, self._about["tasks"])
        with tabs.add_tab("Joints"):
            self._joints = gui.add_html("")
        if HEADER_KEY in self._about:
            with tabs.add_tab("Distances"):
                self._shapes_shown = gui.add_checkbox("Shapes of the links", False)
                self._distances = gui.add_html("")
            self._shapes_shown.on_update(lambda event: self._draw_anew())
        self._chart_tab = tabs.add_tab("Charts")
        self._charts: list[Chart] = []

    def _add_charts(self) -> list[Chart]:
        """Make the charts, for which there must be a tick to draw."""
        reader = self._reader
        units = self._about["robot"].get("units") or ["rad"]
        efforts = ", ".join(dict.fromkeys(map(effort_unit, units)))
        shown = {f"torque [{efforts}] over time [s]": torque_columns(reader)}
        if weakest := sigma_columns(reader):
            shown["weakest σ of a level [1], 0 without one, over time [s]"] = weakest
        with self._chart_tab:
            return [Chart(self._server, reader, title, names) for title, names in shown.items()]

    def _draw_anew(self) -> None:
        """Let the next picture be drawn although it shows the same tick."""
        self._shown = None

    def _move(self, obstacle: str, position: tuple[float, ...]) -> None:
        if self._ask is not None:
            request = {"kind": "place", "obstacle": obstacle, "position": list(position)}
            self._ask({"request": request})

    def _drag(self, task: str, place: dict[str, tuple[float, ...]]) -> None:
        if self._ask is not None:
            request: dict[str, Any] = {"kind": "lead", "tasks": [task]}
            request.update({what: list(values) for what, values in place.items()})
            self._ask({"request": request})


def _robot(about: dict[str, Any]) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)  # who recorded has seen them
        found = load_robot(
            about["file"] or about["name"],
            floating_base=about["floating_base"],
            locked=about["locked_joints"],
        )
    if found.nv != len(about["joints"]):
        raise InputError(
            f"robot {found.name!r} has {found.nv} joints now, the recording {len(about['joints'])}"
        )
    for name, frame in about.get("frames", {}).items():
        found.add_frame(name, frame["parent"], frame["placement"])
    found.tool = about["tool"]
    return found


def _check_host(host: str) -> None:
    # The web server would wait for ever where it cannot listen.
    try:
        socket.create_server((host, 0)).close()
    except OSError as error:
        raise InputError(f"no page can be opened at the address {host!r}: {error}") from None


def _homes(about: dict[str, Any]) -> dict[str, float]:
    """Return the level of every task: where it is at the start, or where its scenario puts it."""
    levels = {name: task["level"] for name, task in about["tasks"].items()}
    for name, entry in about.get("scenario", {}).get("tasks", {}).items():
        if levels.get(name) is None:
            levels[name] = entry.get("level")
    return {name: float(level) for name, level in levels.items() if level is not None}

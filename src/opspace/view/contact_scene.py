"""Contacts on the page: soles, cones, planned and measured forces, and the centre of mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import viser

from opspace.robots.protocol import Robot
from opspace.view import contact_shapes as shapes
from opspace.view.frame import Frame
from opspace.view.panels import blend_rgb

PLANNED, MEASURED = (0, 68, 136), (221, 170, 51)
CENTRE, GROUND = (187, 85, 102), (60, 60, 60)
_BALL = 0.012
_Lines = Sequence[tuple[np.ndarray, tuple[int, int, int]]]


class ContactScene:
    """What a robot stands on and holds on to.

    Args:
        server: The server of the page.
        robot: The robot that the page moves.
        about: What the recording says about the contacts.
    """

    def __init__(
        self, server: viser.ViserServer, robot: Robot, about: Mapping[str, Mapping[str, Any]]
    ) -> None:
        self._robot, self._about = robot, about
        nothing, black = np.zeros((1, 2, 3), np.float32), np.zeros((1, 2, 3), np.uint8)
        self._forces, self._cones, self._support = (
            server.scene.add_line_segments(f"/contacts/{name}", nothing, black, thickness=width)
            for name, width in (("forces", 0.008), ("cones", 0.003), ("support", 0.005))
        )
        self._pressed = {
            name: server.scene.add_icosphere(
                f"/contacts/pressure/{name}", radius=_BALL, color=PLANNED, visible=False
            )
            for name in about
        }
        self._com = server.scene.add_icosphere(
            "/contacts/com", radius=2.0 * _BALL, color=CENTRE, visible=False
        )

    def show(self, frame: Frame) -> None:
        """Draw a tick; the robot is where the frame has it."""
        weight = max(float(np.linalg.norm(self._robot.gravity[:3])), 1.0)
        places = {name: shapes.place_of(one, self._robot) for name, one in self._about.items()}
        forces: list[tuple[np.ndarray, tuple[int, int, int]]] = []
        cones: list[tuple[np.ndarray, tuple[int, int, int]]] = []
        carrying: list[shapes.ContactPlace] = []
        for contact in frame.contacts:
            place, there = places[contact.name], shapes.known(contact)
            pressed = shapes.pressure_point(place, contact)
            forces.append(
                (shapes.arrow(pressed, np.nan_to_num(contact.measured), weight), MEASURED)
            )
            forces.append((shapes.arrow(pressed, np.nan_to_num(contact.force), weight), PLANNED))
            ball = self._pressed[contact.name]
            ball.visible, ball.position = there and contact.activation > 0.0, pressed
            if there:
                color = blend_rgb(contact.progress)
                used = blend_rgb(1.0 - float(np.nan_to_num(contact.cone_use)))
                friction = float(self._about[contact.name]["friction"])
                cones += [
                    (shapes.outline(place.corners), color),
                    (shapes.cone(place, friction), used),
                ]
                if contact.activation > 0.0:
                    carrying.append(place)
        polygon = shapes.support(carrying)
        below = [(shapes.outline(polygon), GROUND)]
        known = not np.isnan(frame.com).any()
        self._com.visible = known
        if known:
            self._com.position = frame.com
            floor = float(polygon[0, 2]) if len(polygon) else 0.0
            below.append((shapes.plumb(frame.com, floor), CENTRE))
        for handle, lines in ((self._forces, forces), (self._cones, cones), (self._support, below)):
            _draw(handle, lines)


def _draw(handle: Any, lines: _Lines) -> None:
    """Give a handle its lines; the page never draws lines that it has got without a point."""
    points = [one for one, _ in lines if len(one)]
    handle.visible = bool(points)
    if not points:
        return
    colors = [np.tile(np.array(color, float), (len(one), 2, 1)) for one, color in lines if len(one)]
    handle.points = np.concatenate(points).astype(np.float32)
    # As an amount of light, which is what the page takes for colours by point.
    handle.colors = (255.0 * (np.concatenate(colors) / 255.0) ** 2.2).astype(np.uint8)

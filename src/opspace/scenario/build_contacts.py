"""Builds contacts and the ground from what a scenario says about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from opspace.contacts import GroundContact
from opspace.errors import InputError, OpspaceError, unknown_name
from opspace.robots.protocol import Robot
from opspace.scenario.contact_entries import height_of
from opspace.scenario.schema import Scenario
from opspace.sim import Ground

HEIGHT = 2
"""Where in a configuration the height of a floating base is."""


def build_contacts(scenario: Scenario, robot: Robot) -> dict[str, GroundContact]:
    """Build every contact of a scenario.

    Args:
        scenario: The scenario.
        robot: The robot.

    Returns:
        Contacts by name.

    Raises:
        ScenarioError: A frame that the robot does not have, or a value that cannot be used.
    """
    built: dict[str, GroundContact] = {}
    if scenario.contacts and not robot.floating_base:
        raise scenario.error(
            ("contacts",), f"robot {robot.name!r} is bolted down; give it floating_base: true"
        )
    for name, entry in scenario.contacts.items():
        if entry.frame not in robot.frame_names:
            error = unknown_name("frame", entry.frame, robot.frame_names)
            raise scenario.error(("contacts", name, "frame"), str(error))
        try:
            built[name] = entry.build(name)
        except OpspaceError as error:
            raise scenario.error(("contacts", name), str(error)) from error
    return built


def build_ground(scenario: Scenario, contacts: Mapping[str, GroundContact]) -> Ground | None:
    """Build what the contacts of a scenario touch, None where there is nothing.

    Raises:
        ScenarioError: A number that cannot be used.
    """
    if scenario.ground is None or not contacts:
        return None
    try:
        return scenario.ground.build(contacts)
    except InputError as error:
        raise scenario.error(("ground",), str(error)) from error


def set_down(
    scenario: Scenario, robot: Robot, q: np.ndarray, touching: Sequence[GroundContact]
) -> np.ndarray:
    """Move the base of a robot so that its lowest contact is on the floor.

    A configuration that the scenario writes out is left as it is written.

    Args:
        scenario: The scenario.
        robot: The robot; its state is changed.
        q: (nq,) configuration.
        touching: The contacts that are there at the start.

    Returns:
        (nq,) configuration.
    """
    if not touching or not isinstance(scenario.start, str):
        return q
    robot.update(q, np.zeros(robot.nv))
    lowered = np.array(q)
    lowered[HEIGHT] -= height_of(touching, robot)
    return lowered

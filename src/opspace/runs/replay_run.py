"""Replay a recording with the controller of its scenario."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from opspace.command import Command
from opspace.errors import RecordingError
from opspace.loop.requests import FILE, RequestPlayer
from opspace.record import load
from opspace.record.contact_columns import felt_in
from opspace.record.replay import Replay
from opspace.record.replay import replay as replay_with
from opspace.runs.run import changes_of
from opspace.scenario.build import SCENARIO_KEY, build
from opspace.scenario.load import scenario_from


def replay(directory: Path) -> Replay:
    """Replay a recording of `opspace run`, or of a black box whose header names a scenario.

    What was asked for during the run, where it was watched, is asked for again.

    Args:
        directory: Directory of the recording.

    Returns:
        What was found, see `opspace.record.replay.replay`.

    Raises:
        RecordingError: There is no recording, it names no scenario, or its requests cannot be read.
        ScenarioError: The scenario cannot be used.
    """
    recording = load(directory)
    scenario = recording.header.get(SCENARIO_KEY)
    if not isinstance(scenario, dict):
        raise RecordingError(
            f"{directory}: the recording names no scenario; opspace.replay(recording, controller) "
            "replays it in Python with the controller that it was made with"
        )
    built = build(scenario_from(scenario))
    forces = iter(felt_in(recording))
    built.triggers.feel = lambda: next(forces, {})
    asked = recording.directory / FILE
    if not asked.exists():
        return replay_with(recording, built.controller, built.triggers.observe)
    player = RequestPlayer(changes_of(built), asked)

    def observe(q: np.ndarray, v: np.ndarray, command: Command) -> None:
        built.triggers.observe(q, v, command)
        player.observe(q, v, command)

    return replay_with(recording, built.controller, observe)

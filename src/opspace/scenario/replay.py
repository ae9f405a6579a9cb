"""Replay a recording with the controller of its scenario."""

from __future__ import annotations

from pathlib import Path

from opspace.errors import RecordingError
from opspace.record import load
from opspace.record.replay import Replay
from opspace.record.replay import replay as replay_with
from opspace.scenario.build import SCENARIO_KEY, build
from opspace.scenario.load import scenario_from


def replay(directory: Path) -> Replay:
    """Replay a recording of `opspace run`, or of a black box whose header names a scenario.

    Args:
        directory: Directory of the recording.

    Returns:
        What was found, see `opspace.record.replay.replay`.

    Raises:
        RecordingError: There is no recording, or it names no scenario.
        ScenarioError: The scenario cannot be used.
    """
    recording = load(directory)
    scenario = recording.header.get(SCENARIO_KEY)
    if not isinstance(scenario, dict):
        raise RecordingError(
            f"{directory}: the recording names no scenario; opspace.replay(recording, controller) "
            "replays it in Python with the controller that it was made with"
        )
    return replay_with(recording, build(scenario_from(scenario)).controller)

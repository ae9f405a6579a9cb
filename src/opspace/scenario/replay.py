"""Put the recorded states of a run to a fresh controller: the same torques must come out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from opspace.controller import Status
from opspace.errors import RecordingError
from opspace.record import load
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario
from opspace.scenario.run import SCENARIO
from opspace.sim.requests import FILE, Changes, RequestPlayer


@dataclass(frozen=True)
class Replay:
    """What a replay found.

    Attributes:
        ticks: How many ticks were replayed.
        gap: Largest difference between a recorded torque and the one that came out, N·m.
        gap_at: Time of that tick, s.
        seconds: By name of a status how long it held, s.
        first: By name of a status when it held first, s.
        ended: How the recorded run ended, and why.
    """

    ticks: int
    gap: float
    gap_at: float
    seconds: dict[str, float]
    first: dict[str, float]
    ended: str


def replay(directory: Path) -> Replay:
    """Replay a recording of `opspace run`.

    The scenario lies beside the recording; every recorded state goes to a controller built from it,
    at its time and in its order, so a fault shows itself again at the same tick.

    Args:
        directory: Directory of the recording.

    Returns:
        What was found.

    Raises:
        RecordingError: There is no recording, or no scenario beside it.
        ScenarioError: The scenario cannot be used.
    """
    recording = load(directory)
    path = recording.directory / SCENARIO
    if not path.is_file():
        raise RecordingError(f"{directory}: there is no {SCENARIO} beside the recording")
    scenario = load_scenario(path)
    built = build(scenario)
    q, v, tau = (recording.group(name) for name in ("q", "v", "tau"))
    gap, gap_at = 0.0, 0.0
    count = {status: 0 for status in Status if status}
    first: dict[str, float] = {}
    changes = Changes(built.controller, built.tasks.values())
    asked = directory / FILE
    again = RequestPlayer(changes, asked) if asked.exists() else None
    for t, q_now, v_now, tau_then in zip(recording.t.tolist(), q, v, tau, strict=True):
        command = built.controller.step(t, q_now, v_now)
        if again is not None:
            again.observe(q_now, v_now, command)
        difference = float(np.max(np.abs(command.tau - tau_then)))
        if difference > gap:
            gap, gap_at = difference, t
        for status in count:
            if status in command.status:
                count[status] += 1
                first.setdefault(str(status.name), t)
    seconds = {str(s.name): n * scenario.dt for s, n in count.items() if n}
    ended = f"{recording.ended.how} {recording.ended.reason}".strip()
    return Replay(len(recording), gap, gap_at, seconds, first, ended)

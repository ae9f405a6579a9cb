"""When the events of a scenario began in a run, those included that waited for something."""

from __future__ import annotations

import numpy as np

from opspace.record import Recording
from opspace.record.contact_columns import GROUP
from opspace.scenario.events import Event
from opspace.scenario.triggers import Waiting


def began(event: Event, recording: Recording) -> float | None:
    """Find when an event began.

    Args:
        event: The event.
        recording: A run of its scenario.

    Returns:
        Time of the first tick that knew of it, s; None where what it waits for was not felt.

    Raises:
        UnknownNameError: The recording has no such contact.
    """
    if event.when is None:
        return event.at
    name = event.when.contact
    normal = recording.header[GROUP][name]["normal"] or [0.0, 0.0, 1.0]
    if f"{GROUP}/{name}/measured/x" not in recording:
        return None
    forces = recording.group(f"{GROUP}/{name}/measured") @ np.array(normal)
    present = np.nan_to_num(recording[f"{GROUP}/{name}/progress"])
    waiting = Waiting(event, lambda at: None)
    times = recording.t.tolist()
    for t, after, force, progress in zip(
        times, times[1:], forces.tolist(), present.tolist(), strict=False
    ):
        if waiting.due(t, lambda _, found=(force, progress): found):
            return after
    return None

"""What a recording says about itself, for formats that have room for it."""

from __future__ import annotations

import json
from typing import Any

from opspace.record import Recording

# The columns are in the schemas or the names of the lines; the others are facts of the file format.
_ELSEWHERE = ("columns", "format", "format_version")


def facts(recording: Recording) -> dict[str, str]:
    """Gather scenario, seed, versions, how the run ended, and anything else in the header.

    Args:
        recording: The run.

    Returns:
        Text by name; what is no text in the header is JSON.
    """
    known = {key: value for key, value in recording.header.items() if key not in _ELSEWHERE}
    known |= {"ended": recording.ended.how, "reason": recording.ended.reason}
    known |= {key: value for key, value in recording.meta.items() if key not in known}
    return {key: _text(value) for key, value in known.items() if value != ""}


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)

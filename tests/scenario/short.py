"""Scenarios that take a moment."""

from opspace.scenario import scenario_from

HOLD = {
    "robot": "puma560",
    "start": "home",
    "duration": 0.05,
    "tasks": {
        "orientation": {"type": "orientation", "level": 0},
        "position": {
            "type": "position",
            "level": 1,
            "target": {
                "type": "out_and_back",
                "offset": [1e-4, 0.0, 0.0],
                "out_duration": 0.02,
                "back_duration": 0.02,
            },
        },
        "posture": {"type": "posture", "level": 2, "kp": 25.0, "target": "home"},
    },
}


def short(*overrides, **changes):
    """The scenario above with other values."""
    return scenario_from({**HOLD, **changes}, overrides)

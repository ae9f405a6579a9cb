"""What handles on the page have in common."""

DRAG_PERIOD = 0.05
"""Seconds between two requests while something is being dragged."""

STAYS = 3.0
"""Seconds that a handle stays where it was dragged to; then it follows what it belongs to again."""

"""Columns of ``Stance.place`` and ``Stance.numbers``: a contact as whole numbers and as numbers."""

from __future__ import annotations

# Body and last joint that carry the frame, rows of the contact, the first among those of all.
PLACE_BODY, PLACE_JOINT, PLACE_ROWS, PLACE_FIRST = range(4)
PLACE_SIZE = 4

# The placement of the frame on the body and the point in it lie as in ``Tick.numbers``, for the same
# kernel reads them; the axes of a surface, by rows, are where a task has its other frame. An edge has
# its direction in the frame in the place of the first axis, and nothing in that of the second.
SURFACE = 12
NUMBERS_SIZE = 27

BASE_SIZE = 6
"""Coordinates of a floating base; they have no motor."""
MOST_EDGES = 16
"""Rows of a cone, at most."""
NORMAL = 2
"""Component of a force that points out of the surface."""
SOLE_ROWS = 6
"""Rows of a contact that holds its frame's rotation as well, and has moments."""
EDGE_ROWS = 5
"""Rows of a contact whose frame turns about its own x: all components of a force but that moment."""
EACH = MOST_EDGES + 1
"""Bounds of a contact: its cone, and its largest force."""

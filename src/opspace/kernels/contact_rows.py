"""Contacts as rows above everything: J q̈ = −k_d J v − J̇ v, and the motions that they leave free."""

from __future__ import annotations

import math

from opspace.kernels.columns import LOCAL
from opspace.kernels.corners import insert
from opspace.kernels.inertia import whiten_rows
from opspace.kernels.level import project, solve_level, take_alternative
from opspace.kernels.motion import A, R, V, move_joints, place_point
from opspace.kernels.stance_columns import (
    EDGE_ROWS,
    NORMAL,
    PLACE_BODY,
    PLACE_FIRST,
    PLACE_JOINT,
    PLACE_ROWS,
    SOLE_ROWS,
    SURFACE,
)
from opspace.kernels.walk import start_at
from opspace.law.scalars import STILLING, TINY
from opspace.machine.jit import jit


@jit
def evaluate_contacts(work):
    """Fill J (6 contacts, n), its whitened form and what is wanted of it, in the contacts' own axes."""
    stance = work.stance
    if stance.count[0] == 0:
        return
    move_joints(work)
    for c in range(stance.count[0]):
        joint = stance.place[c, PLACE_JOINT]
        place_point(work, stance.numbers[c], 0, stance.place[c, PLACE_BODY], joint, LOCAL, True)
        _axes(work, c)
        first = stance.place[c, PLACE_FIRST]
        end = first + stance.place[c, PLACE_ROWS]
        for i in range(end - first):
            part = component_of(end - first, i)
            _row(work, c, first + i, 3 * (part // 3), part % 3)
        whiten_rows(work.inertia, joint, first, end, stance.J, stance.Jw)


@jit
def component_of(rows, i):
    """Which component of (force, moment) row i of a contact with so many rows is."""
    return i + 1 if rows == EDGE_ROWS and i > NORMAL else i


@jit
def _axes(work, c):
    """Axes of a contact in the world, by rows: those of its frame, or of the surface."""
    rows = work.stance.place[c, PLACE_ROWS]
    for i in range(9):
        number = work.stance.numbers[c, SURFACE + i]
        work.contact_axes[c, i] = work.motion[0, R + i] if rows == SOLE_ROWS else number
    if rows == EDGE_ROWS:
        _lay_down(work.contact_axes[c], work.motion[0])


@jit
def _lay_down(axes, x):
    """Axes of an edge: x along it on the surface, from its direction in the frame and the normal."""
    ax, ay, az = axes[0], axes[3], axes[6]
    for k in range(3):
        axes[3 * k] = x[R + 3 * k] * ax + x[R + 3 * k + 1] * ay + x[R + 3 * k + 2] * az
    upwards, size = 0.0, 0.0
    for k in range(3):
        upwards += axes[3 * k] * axes[3 * k + 2]
    for k in range(3):
        axes[3 * k] -= upwards * axes[3 * k + 2]
        size += axes[3 * k] * axes[3 * k]
    size = max(math.sqrt(size), TINY)
    for k in range(3):
        axes[3 * k] /= size
    for k in range(3):
        i, j = 3 * ((k + 1) % 3), 3 * ((k + 2) % 3)
        axes[3 * k + 1] = axes[i + 2] * axes[j] - axes[j + 2] * axes[i]


@jit
def _row(work, c, row, block, axis):
    """One row: a component along an axis of the contact, of its motion or its turning."""
    x, J, into = work.motion[0], work.motion_J[0], work.stance.J[row]
    n = work.v.shape[0]
    for a in range(n):
        into[a] = 0.0
    rate, drift = 0.0, 0.0
    for k in range(3):
        factor = work.contact_axes[c, 3 * k + axis]
        rate += factor * x[V + block + k]
        drift += factor * x[A + block + k]
        for a in range(n):
            into[a] += factor * J[block + k, a]
    work.stance.wanted[row] = -STILLING * rate - drift


@jit
def contact_corners(work):
    """Find the corners of the chain in which contacts close.

    Reads motion (contacts,); writes order, corner_links and corner_weight.

    Returns:
        Number of corners; the first has those only that are closed.
    """
    stance, h, order = work.stance, work.stance.motion, work.stance.order
    links = 0
    for c in range(stance.count[0]):
        if 0.0 < h[c] < 1.0:
            links = insert(c, h, order, links)
    total, before = 0, 1.0
    for link in range(links + 1):
        after = h[order[link]] if link < links else 0.0
        if before > after:
            stance.corner_links[total], stance.corner_weight[total] = link, before - after
            total += 1
        before = after
    return total


@jit
def close_contacts(work, links):
    """Begin with the contacts that are closed and the ``links`` most active of those on their way.

    What they decide and leave free goes to depth 0, on which everything else builds. No buffer fades
    what the ground holds.
    """
    stance, space, n = work.stance, work.space, work.v.shape[0]
    start_at(0, n, space)
    count = 0
    for c in range(stance.count[0]):
        if stance.motion[c] >= 1.0:
            count = take_rows(stance, c, count, space.rows)
    for k in range(links):
        count = take_rows(stance, stance.order[k], count, space.rows)
    if count == 0:
        return
    project(0, count, n, stance.Jw, stance.wanted, space)
    found = solve_level(0, count, n, stance.Jw, False, stance.exact, space)
    if found > 1:
        for i in range(found):
            if space.share[0, i] > 0.5:  # all of the weight: directions are there or not
                take_alternative(0, i, n, space)
    for a in range(n):
        space.u[0, a] = space.u[1, a]
    for k in range(space.free[1]):
        for a in range(n):
            space.Z[0, k, a] = space.Z[1, k, a]
    space.free[0] = space.free[1]


@jit
def take_rows(stance, c, count, rows):
    """List the rows of a contact."""
    for i in range(stance.place[c, PLACE_ROWS]):
        rows[count] = stance.place[c, PLACE_FIRST] + i
        count += 1
    return count

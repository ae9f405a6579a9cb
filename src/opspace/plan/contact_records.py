"""The record of what a robot with a floating base touches: rows, forces and their projection."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.kernels.stance_columns import (
    BASE_SIZE,
    EACH,
    MOST_EDGES,
    NUMBERS_SIZE,
    PLACE_SIZE,
    SOLE_ROWS,
)
from opspace.machine.field_table import Field, Record, RecordTable
from opspace.machine.lanes import whole
from opspace.plan.bound_records import BOUNDS

_INT = np.int64
_plan = partial(Field, writer="plan", lives="plan")
_refresh = partial(Field, writer="refresh", lives="tick")
_after = partial(Field, lives="tick")
_kept = partial(Field, lives="kept")
_EACH = f"{SOLE_ROWS} contacts"
_BOUNDS = f"4 n + {4 * SOLE_ROWS + EACH} contacts + distances"
_WHOLE = f"whole n + {SOLE_ROWS} contacts"

STANCE = RecordTable(
    "Stance",
    "What a robot touches, in the contacts' own axes, and the memory of the projection behind the law. "
    "Its coordinates are changes of the motion, then of the forces; `opspace.kernels.stance_columns` "
    "names columns.",
    _refresh("count", (1,), "contacts that are there", dtype=_INT),
    _refresh("rows", (1,), "their rows", dtype=_INT),
    _refresh("place", ("contacts", PLACE_SIZE), "where each is, and its rows", dtype=_INT),
    _refresh("numbers", ("contacts", NUMBERS_SIZE), "its frame, point and surface", "m"),
    _refresh("motion", ("contacts",), "h_m"),
    _refresh("force", ("contacts",), "h_f"),
    _refresh("most", ("contacts",), "largest normal force", "N"),
    _refresh("edges", ("contacts",), "rows of the cone", dtype=_INT),
    _refresh("cone", ("contacts", MOST_EDGES, SOLE_ROWS), "rows C of C λ <= 0"),
    _refresh("metric", (_EACH,), "diagonal of R", start=1.0),
    _refresh("reference", (_EACH,), "force that is wanted of it", "N, N·m"),
    _plan("room", ("n",), "what the motors give where they are asked", "N·m", start=np.inf),
    _plan("exact", (BASE_SIZE,), "options of a level without a buffer"),
    Field("J", (_EACH, "whole n"), "Jacobians", "m, 1"),
    Field("Jw", (_EACH, "whole n"), "whitened rows J U⁻ᵀ"),
    Field("wanted", (_EACH,), "J q̈ that keeps each where it is", "m/s², rad/s²"),
    Field("order", ("contacts + 1",), "those on their way, the most active first", dtype=_INT),
    Field("corner_links", ("contacts + 1",), "how many of them each corner has", dtype=_INT),
    Field("corner_weight", ("contacts + 1",), "weights of the corners"),
    Field("moving", ("contacts",), "those whose force is on its way", dtype=_INT),
    Field("on", ("contacts",), "whether each carries, in a corner", dtype=_INT),
    Field("asked", (_EACH,), "λ*, what the forces would be without limits", "N, N·m"),
    Field("share", (_EACH,), "what they are in a corner", "N, N·m"),
    Field("listed", (_EACH,), "rows of those that carry, in a corner", dtype=_INT),
    Field("carried", (_EACH,), "λ", "N, N·m"),
    Field("pull", ("n",), "M q̈ + b", "N·m"),
    Field("given_up", (BASE_SIZE,), "wrench that the law wanted and does not get", "N, N·m"),
    _after("hindrance", (1,), "that, as a multiple of what a contact that goes may cost"),
    Field("G", (BASE_SIZE, BASE_SIZE), "products of the base's rows"),
    Field("L", (BASE_SIZE, BASE_SIZE), "their Cholesky factor"),
    Field("g", (BASE_SIZE,), "any vector"),
    Field("K", ("n", "n"), "W in the basis of the free motions"),
    Field("C", ("n", "n"), "its lower Cholesky factor"),
    Field("moves", ("n", "n"), "whitened motions, as rows"),
    Field("accelerations", ("n", "n"), "q̈ of each", "rad/s²"),
    Field("torques", ("n", "n"), "torque of each", "N·m"),
    Field("loose", (_EACH,), "how far each force moves with its coordinate", "N, N·m"),
    Field("E", (BASE_SIZE, _WHOLE), "rows of the base, then reflectors"),
    Field("scale", (BASE_SIZE,), "their scales"),
    Field("lower", (BASE_SIZE, whole(BASE_SIZE)), "lower triangular factor"),
    Field("X", (BASE_SIZE, BASE_SIZE), "its columns, then σ times left singular vectors"),
    Field("turned", (BASE_SIZE, BASE_SIZE), "right singular vectors, as rows"),
    Field("sigma", (BASE_SIZE,), "singular values"),
    Field("start", (BASE_SIZE,), "shortest change that gives the base what it lacks"),
    Field("row", (_WHOLE,), "any row of coordinates"),
    Field("trial", ("n",), "q̈ at a point that may not be the last", "rad/s²"),
    _kept("remembered", (1,), "bounds that held at the tick before", dtype=_INT),
    _kept("held", (_BOUNDS,), "which they were", dtype=_INT),
    _kept("pressed", (_BOUNDS,), "their multipliers", "√J/s"),
    Field("place_of", (_BOUNDS,), "where each of them is among those of now", dtype=_INT),
    Field("tolerance", (_BOUNDS,), "excess that is rounding", "√J/s"),
    Field("bounds", (), "", lives="plan", of=BOUNDS),
)


def make_stance(
    n: int, contacts: int, room: np.ndarray | None = None, distances: int = 0
) -> Record:
    """Make the memory for so many contacts of a robot with n coordinates.

    Args:
        n: Velocity coordinates.
        contacts: Contacts that can be there at once.
        distances: Distances that can be kept at once.
        room: (n,) what the motors give where they are asked, N·m; None is without end.
    """
    apart = EACH * contacts + distances
    bounds = BOUNDS.make({"n": n + SOLE_ROWS * contacts, "distances": apart})
    given: dict[str, np.ndarray | Record] = {"bounds": bounds}
    if room is not None:
        given["room"] = room
    return STANCE.make({"n": n, "contacts": contacts, "distances": distances}, given)


def no_stance() -> Record:
    """Give the memory of a robot that is bolted down."""
    return make_stance(0, 0)

"""The record of a projection: bounds as unit normals, and the memory to keep them."""

from __future__ import annotations

import math

import numpy as np

from opspace.machine.field_table import Field, RecordTable

_INT = np.int64
_work = Field

_BOUNDS = "4 n + distances"

BOUNDS = RecordTable(
    "Bounds",
    "Bounds on accelerations and torques, and the memory to keep them.",
    _work("lower", ("n",), "least accelerations", "rad/s²", start=-math.inf),
    _work("upper", ("n",), "largest accelerations", "rad/s²", start=math.inf),
    _work("least", ("n",), "least torques beside the bias", "N·m", start=-math.inf),
    _work("most", ("n",), "largest torques beside the bias", "N·m", start=math.inf),
    _work("W", ("n", "n"), "metric in x = Uᵀ q̈, see `opspace.law.task_metric`"),
    _work("C", ("n", "n"), "its lower Cholesky factor"),
    _work("P", ("n", "n"), "what levels leave to those below, see `opspace.law.motions_left`"),
    _work(
        "UD", ("n", "n"), "what one stack leaves, U D Uᵀ: Uᵀ without its diagonal of ones, and D"
    ),
    _work("above", ("n",), "what levels with others below want", "√J/s"),
    _work("left", ("2 n",), "upper and lower as positions ask for them", "rad/s²", start=math.inf),
    _work("gave_way", ("2 n",), "what levels below give way to upper and lower", "rad/s²"),
    _work("normal", (_BOUNDS, "n"), "every bound as unit normal · z <= bound, in z = Cᵀ x"),
    _work("way", ("2 n", "n"), "where what levels below move gives way to each bound"),
    _work("size", (_BOUNDS,), "length of each normal before"),
    _work(
        "owner",
        (_BOUNDS,),
        "which of upper, lower, most, least, n each, then distances, it is",
        dtype=_INT,
    ),
    _work(
        "taken",
        (_BOUNDS,),
        "what each of these takes from its joint or distance",
        "rad/s², N·m, m/s²",
    ),
    _work("bound", (_BOUNDS,), "the bounds", "√J/s"),
    _work("softness", (_BOUNDS,), "their softness"),
    _work("scale", (_BOUNDS,), "the numbers that say whether each is broken", "√J/s"),
    _work("multiplier", (_BOUNDS,), "multipliers of the bounds", "√J/s"),
    _work("wanted", (_BOUNDS,), "multipliers of those that hold, if alone", "√J/s"),
    _work("active", (_BOUNDS,), "the bounds that hold", dtype=_INT),
    _work("z", ("n",), "the point that the law wants", "√J/s"),
    _work("x", ("n",), "the point that is projected", "√J/s"),
    _work("y", ("n",), "its projection", "√J/s"),
    _work("row", ("n",), "a normal before it has unit length"),
    _work("r", (_BOUNDS,), "right-hand side of the multipliers", "√J/s"),
    _work("G", (_BOUNDS, _BOUNDS), "products of the normals that hold"),
    _work("factor", (_BOUNDS, _BOUNDS), "Cholesky factor of G"),
)

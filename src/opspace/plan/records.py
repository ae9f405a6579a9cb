"""What kernels read and write, record by record; the robot's own are in `opspace.robots.bodies`."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from opspace.kernels.columns import (
    KIND_SIZE,
    NUMBERS_SIZE,
    OPTION_SIZE,
    VARIABLE_SIZE,
)
from opspace.law.press_columns import MEMORY_SIZE, PRESS_SIZE
from opspace.law.scalars import MOST_UNREST
from opspace.machine.field_table import Field, RecordTable
from opspace.plan.bound_records import BOUNDS
from opspace.plan.contact_records import STANCE
from opspace.plan.cycle_records import CYCLES
from opspace.plan.distance_records import DISTANCES
from opspace.plan.integral_records import INTEGRALS
from opspace.plan.led_records import LED
from opspace.plan.quiet_records import QUIET
from opspace.robots.bodies import DYNAMICS, RIGID_BODIES

SIZES = {
    "n": "joints (velocity coordinates)",
    "nq": "coordinates of a configuration",
    "bodies": "bodies of the robot, the world included",
    "links": "moving links with a mass",
    "tasks": "tasks",
    "rows": "rows of all tasks",
    "slots": "places of tasks; a task that moves between levels has several",
    "slot_rows": "rows of all places",
    "levels": "levels of the stack",
    "variables": "activations in time: the tasks' presences, then their changes of place",
    "limits": "joint limits, sides counted",
    "balls": "balls of the robot that keep away from something",
    "sets": "convex sets that they keep away from",
    "faces": "faces of those that are meshes",
    "distances": "pairs of a ball and a set",
    "contacts": "contacts that can be there at once, none of a robot that is bolted down",
    "presses": "force tasks",
    "led": "tasks, where the tick leads them to their targets on ways, else 0",
    "led_rows": "rows of all tasks there",
    "corners": "corners that the blend can have",
    "whole": "rounded up to whole vectors of eight numbers; what is behind is zero",
    "widest": "the largest of rows + limits, n and 6 contacts, at least one",
    "states": "states of a batch",
    "watched": "3 where ticks and states are watched, else 0",
    "last_nq": "coordinates of a configuration there, else 0",
    "last_n": "joints there, else 0",
    "told": "numbers that a robot tells: time, configuration, velocity, accepted torque",
    "ring": "cycles that a loop remembers",
    "given": "states that own activations are given for: one that stands for all, or all",
    "here": "rows of one level",
    "free": "motions that the levels above it leave free",
    "fewer": "the smaller of these two",
    "more": "the larger",
}
"""What the names in shapes stand for."""

_INT = np.int64
_work = Field
_kept = partial(Field, lives="kept")
_reported = partial(Field, lives="reported")
_after = partial(Field, lives="tick")
_plan = partial(Field, writer="plan", lives="plan")
_refresh = partial(Field, writer="refresh", lives="plan")
_tuned = partial(Field, writer="plan, refresh, tick", lives="plan")
_terms = partial(Field, writer="refresh, tick", lives="tick")
_robot = partial(Field, writer="robot", lives="tick")
_body = partial(Field, writer="robot", lives="robot")
_record = partial(Field, shape=(), lives="plan", meaning="")
_caller = partial(Field, writer="caller")

INERTIA = RecordTable(
    "Inertia",
    "Factor of an inertia, and where it is not zero.",
    _work("L", ("n", "whole n"), "Uᵀ, lower triangular, M = U Uᵀ", "√(kg·m²)"),
    _work("white", ("n", "whole n"), "U⁻ᵀ, lower triangular", "1/√(kg·m²)"),
    _work("spare", ("whole n",), "any vector"),
    _work("product", ("whole n",), "any other vector"),
    _plan("before", ("n",), "coordinate before each one, −1 for none", dtype=_INT),
    _plan("start", ("n",), "first of the neighbours of which each carries the next", dtype=_INT),
    _plan("end", ("n",), "one after the last that each carries", dtype=_INT),
)

_DEPTHS = "levels + 2"

SPACE = RecordTable(
    "Space",
    "The memory of a walk down the levels. A first axis of levels + 2 is the depth: what the levels "
    "above have decided; joint limits are level 0, what damps the rest is the last.",
    _work("Z", (_DEPTHS, "n", "whole n"), "basis of the motions still free, as rows"),
    _work("u", (_DEPTHS, "whole n"), "whitened torque so far", "√J/s"),
    _work("free", (_DEPTHS,), "number of motions still free", dtype=_INT),
    _work("V", (_DEPTHS, "n", "whole n"), "directions of a level that branches, then the rest"),
    _work("strength", (_DEPTHS, "n"), "what each direction adds to the torque", "√J/s"),
    _work("share", (_DEPTHS, "n + 1"), "weight of each number of directions"),
    _work("path", (_DEPTHS,), "weight of the branch that led here"),
    _work("cursor", (_DEPTHS, 6), "where a node is, see `opspace.kernels.walk`", dtype=_INT),
    _work("alternatives", (_DEPTHS,), "number of alternatives of the group", dtype=_INT),
    _reported("top", (_DEPTHS,), "strongest weight that a level has been solved with"),
    _reported(
        "chosen", (_DEPTHS,), "slots present at a level when that was, a bit set", dtype=_INT
    ),
    _reported("width", (_DEPTHS,), "motions free above a level when that was", dtype=_INT),
    _work("off", (_DEPTHS,), "whether a direction was faded when that was", dtype=_INT),
    _work("faded", (1,), "whether one of the level solved last is", dtype=_INT),
    _work("B", ("widest", "whole n"), "rows of a level in the basis of the free motions"),
    _work("C", ("n", "whole widest"), "their columns, when there are more rows than columns"),
    _work("column", ("n",), "free motions that the rows move, then the others", dtype=_INT),
    _work("residual", ("whole widest",), "what the levels above leave to be done", "√J/s"),
    _work("rows", ("widest",), "the rows of a level that are present", dtype=_INT),
    _work("G", ("n", "whole n"), "products of rows or columns"),
    _work("L", ("n", "whole n"), "lower triangular factor"),
    _work("X", ("n", "whole n"), "its inverse"),
    _work("Y", ("n", "n"), "right singular vectors"),
    _work("x", ("whole widest",), "any vector"),
    _work("y", ("whole widest",), "any other vector"),
    _work("scale", ("widest",), "scales of reflectors"),
    _work("sigma", ("n",), "singular values"),
    _work("motion", ("n",), "whitened velocity Uᵀ q̇", "√J"),
    _work("unrest", ("widest",), "how far each row was from rest lately, squared", start=1.0),
    _reported("unrest_there", (_DEPTHS,), "how far a level was when `top` was found"),
    _reported("kept", ("slot_rows", "whole n"), "B of each level when `top` was found"),
    _plan("first_kept", (_DEPTHS,), "row where that begins for each level", dtype=_INT),
    _work("motors", (1,), "whether torque limits are kept", dtype=_INT),
    _record("inertia", of=INERTIA),
    _work("start", ("n",), "torque before the first level, within limits", "N·m"),
    _plan("limit", ("n",), "largest torque of each joint", "N·m", start=math.inf),
    _work("torque", (_DEPTHS, "n"), "torque so far", "N·m"),
    _work("part", ("n",), "torque that a level adds", "N·m"),
    _work("got", (_DEPTHS, 2), "sums of weight times scale, and of weight"),
)

TICK = RecordTable(
    "Tick",
    "Everything that one tick reads, writes and works with. `opspace.kernels.columns` names the "
    "columns of `kind`, `numbers`, `variable`, `limit` and `option`.",
    _robot("q", ("nq",), "configuration; quaternions wxyz", "rad, m"),
    _robot("v", ("n",), "velocity", "rad/s, m/s"),
    _robot("M", ("n", "n"), "joint-space inertia", "kg·m²"),
    _robot("bias", ("n",), "b + g", "N·m"),
    _robot("axes", ("n", 6), "motion that a unit of each velocity gives to a body"),
    _robot("placement", ("bodies", 12), "rotation by columns, then position", "m"),
    _body("parent", ("n",), "coordinate before each one, −1 for none", dtype=_INT),
    _body("mass_place", ("links", 2), "body and joint of each mass", dtype=_INT),
    _body("mass", ("links", 4), "mass, and its centre on the body", "kg, m"),
    _tuned("kind", ("tasks", KIND_SIZE), "a task as whole numbers", dtype=_INT),
    _tuned("numbers", ("tasks", NUMBERS_SIZE), "a task as numbers"),
    _plan("coordinate", ("rows",), "coordinate of each row of a joint task", dtype=_INT),
    _plan("endless", ("rows",), "whether that joint turns without end", dtype=_INT),
    _plan("select", ("rows", 6), "what a row selects of a motion"),
    _refresh("goal", ("rows", 3), "q, v, a that joint tasks want", "rad, rad/s, rad/s²"),
    _refresh("kp", ("rows",), "gain on the error", "1/s²"),
    _refresh("kv", ("rows",), "gain on its rate", "1/s"),
    _refresh(
        "spring", ("rows", 3), "K, 2 ζ √K and force of impedance rows", "N/m, N·m/rad, N, N·m"
    ),
    _tuned("press", ("presses", PRESS_SIZE), "force tasks, see `opspace.law.press_columns`"),
    _work("press_axes", (6, 6), "rows of a force task in world axes"),
    _plan("row_weight", ("rows",), "1/√reference", start=1.0),
    _plan("row_reference", ("rows",), "σ that is usual for each", "1/kg, 1/(kg·m²)", start=1.0),
    _plan("row_near", ("rows",), "1/e₀ of `opspace.law.scalars.unrest_of`", "1/m, 1/rad"),
    _kept("row_unrest", ("rows",), "how far each row was from rest lately", start=MOST_UNREST),
    _kept("unrest_at", (1,), "time of the tick that this is of", "s", start=math.inf),
    _plan(
        "variable", ("variables", VARIABLE_SIZE), "an activation in time, as `ramp` takes it", "s"
    ),
    _kept("group", ("variables",), "how each activation is blended", dtype=_INT),
    _plan("slots", ("slots", 3), "depth, first row, rows, in the order of the levels", dtype=_INT),
    _plan("slot_on", ("slots",), "variables that are on when a task is there", dtype=_INT),
    _plan("slot_off", ("slots",), "variables that are off then", dtype=_INT),
    _plan("slot_place", ("slots",), "those of `slot_on` that choose its place", dtype=_INT),
    _refresh("own", ("tasks",), "activation of each task by its own function", start=1.0),
    _plan("limit_joint", ("limits",), "joint of each limit", dtype=_INT),
    _tuned("limit", ("limits", 11), "joint limits, see `opspace.kernels.limit_rows`"),
    _plan("torque_limit", ("n",), "what the motors give to both sides of its middle", "N·m"),
    _plan("torque_middle", ("n",), "the middle of what the motors give", "N·m"),
    _plan("option", (OPTION_SIZE,), "options of the controller"),
    _reported("tau", ("n",), "the torque", "N·m"),
    _reported("h", ("tasks",), "activation of each task"),
    _reported("share", ("slots",), "how much of a task is at each of its places"),
    _reported("error", ("rows",), "x_d − x", "m, rad"),
    _reported("limit_h", ("limits",), "how much each joint limit takes part"),
    _reported("distance", ("distances",), "of two bodies that are kept apart", "m"),
    _reported("distance_taken", ("distances",), "what each takes from how it shrinks", "m/s²"),
    _reported("contact_force", ("contacts", 6), "planned, in the contact's axes", "N, N·m"),
    _reported("contact_axes", ("contacts", 9), "its axes in the world, by rows"),
    _reported("contact_use", ("contacts",), "part of its cone that the force uses"),
    _reported("scale", (_DEPTHS,), "part of its torque that each level got"),
    _terms("wanted", ("rows",), "f*, the commanded acceleration", "m/s², rad/s²"),
    _work("Jw", ("rows + limits", "whole n"), "whitened rows Ĵ = W J U⁻ᵀ"),
    _terms("J", ("rows", "whole n"), "Jacobians", "m, 1"),
    _terms("drift", ("rows",), "J̇ q̇", "m/s², rad/s²"),
    _terms("torque", ("tasks", "n"), "balanced torque of each task that has one", "N·m"),
    _work("reaction", ("n",), "what tasks expect of the world, balanced as bias", "N·m"),
    _work("reaction_part", (1,), "how much of it the motors can give"),
    _work("balance", ("n",), "bias and reaction", "N·m"),
    _work("fw", ("rows + limits",), "f̂ = W f̃", "√J/s"),
    _work("velocity", ("n", 6), "motion of the body behind each joint", "m/s, rad/s"),
    _work("acceleration", ("n", 6), "its rate at zero joint acceleration", "m/s², rad/s²"),
    _work("motion", (3, 24), "frames of a task, see `opspace.kernels.motion`"),
    _plan(
        "carried_by", ("n", "whole n"), "one where a joint carries that of the row, which counts"
    ),
    _work("across", (6, "whole n"), "axes by components", "m, 1"),
    _work("motion_J", (3, 6, "whole n"), "their Jacobians", "m, 1"),
    _work("motion_error", (6,), "error of a motion", "m, rad"),
    _work("value", ("variables",), "activations at this time"),
    _work("low", ("variables",), "activations of the chain when they lean one way"),
    _work("width", ("variables",), "by how much they are larger when they lean the other way"),
    _work("order", ("variables + 1",), "the chain, the most active first", dtype=_INT),
    _work("first", ("variables + 1",), "the first few of them, bit sets", dtype=_INT),
    _work("first_weight", ("variables + 1",), "weights of those"),
    _work("corner_on", ("2 corners",), "slots that are on in each corner, bit sets", dtype=_INT),
    _work("corner_weight", ("2 corners",), "weights of the corners"),
    _work("here", ("slots",), "how much of a task is at each of its places and there at all"),
    _work("below", ("slots",), "levels below each, those on their way in part"),
    _work("seen_share", ("2 slots",), "how much of each task levels see, then all of it"),
    _work("seen_weight", ("2 slots",), "what its rows count then, see `opspace.law.motions_left`"),
    _work("limit_on", ("limits + 1", "limits"), "limits that are on in each corner", dtype=_INT),
    _work("limit_weight", ("limits + 1",), "weights of those corners"),
    _work("limit_order", ("limits + 1",), "the chain of the limits", dtype=_INT),
    _work("rest", ("n + 1",), "f̂ of what no task uses, and whether there is one", "√J/s"),
    _work("u", ("n",), "whitened torque", "√J/s"),
    _work("drop", ("whole n",), "whitened bias", "√J/s"),
    _after("joint_acceleration", ("n",), "q̈ of the torque", "rad/s²"),
    _work("wanted_acceleration", ("n",), "q̈ of the law's torque", "rad/s²"),
    _work("wanted_tau", ("n",), "the law's torque", "N·m"),
    _work("later_q", ("nq",), "configuration in the middle of the tick", "rad, m"),
    _work("later_v", ("n",), "velocity then", "rad/s, m/s"),
    _work("change", ("n",), "by how much q̈ differs then", "rad/s²"),
    _work("gravity", ("n",), "g, see `opspace.kernels.gravity`", "N·m"),
    _record("later", of=DYNAMICS),
    _record("later_inertia", of=INERTIA),
    _record("inertia", of=INERTIA),
    _record("space", of=SPACE),
    _record("bodies", of=RIGID_BODIES),
    _record("dynamics", of=DYNAMICS),
    _record("bounds", of=BOUNDS),
    _record("distances", of=DISTANCES),
    _record("stance", of=STANCE),
    _record("led", of=LED),
)


REMEMBERED = RecordTable(
    "Remembered",
    "What a tick takes over from the one before, the same for every state of a batch.",
    _caller("group", ("variables",), "how each activation is blended", dtype=_INT),
    _caller("remembers", ("tasks",), "whether the turn is known", dtype=_INT),
    _caller("turn", ("tasks", 4), "last rotation of the task, quaternion wxyz"),
    _caller("press", ("presses", MEMORY_SIZE), "what force tasks remember"),
    _caller("row_unrest", ("rows",), "how far each row was from rest lately"),
    _caller("unrest_at", (1,), "time of that tick", "s"),
)

STATES = RecordTable(
    "States",
    "Many states of a robot, each the tick after the same one before.",
    _caller("Q", ("states", "nq"), "configurations; quaternions wxyz", "rad, m"),
    _caller("V", ("states", "n"), "velocities", "rad/s, m/s"),
    _caller("own", ("given", "tasks"), "activation of each task by its own function"),
    _work("tau", ("states", "n"), "the torques", "N·m"),
    _record("before", of=REMEMBERED),
)

SPECTRUM = RecordTable(
    "Spectrum",
    "The directions of one level, strongest first, as a report gives them.",
    _caller("B", ("here", "free"), "its rows in the basis of the free motions"),
    _caller("option", (OPTION_SIZE,), "options of the controller"),
    _caller("unrest", (1,), "how far the level is from rest at its target"),
    _work("C", ("fewer", "more"), "B, or its transpose where that has fewer rows"),
    _work("Y", ("fewer", "fewer"), "vectors of the smaller side, as rows"),
    _work("sigma", ("fewer",), "σ"),
    _work("activation", ("fewer",), "how much of each direction is used", start=1.0),
    _work("response", ("fewer",), "how much of the force each gives", start=1.0),
    _work("directions", ("here", "fewer"), "directions of the rows, as columns"),
)

TABLES = (
    TICK,
    SPACE,
    INERTIA,
    BOUNDS,
    DISTANCES,
    STANCE,
    LED,
    RIGID_BODIES,
    DYNAMICS,
    STATES,
    REMEMBERED,
    SPECTRUM,
    CYCLES,
    QUIET,
    INTEGRALS,
)

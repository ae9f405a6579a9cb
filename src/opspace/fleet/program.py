"""The kernel of a fleet: the tick of a plan for one robot per thread."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np

from opspace.fleet.exact_limits import EXACTLY, rests_of
from opspace.fleet.fleet_kernel import fleet_kernel
from opspace.fleet.given_motion import INSTEAD
from opspace.fleet.kernels_in_cpp import translate
from opspace.fleet.layout import LANES, RobotLayout
from opspace.fleet.led_targets import IN_TICK, WITHOUT_WAYS
from opspace.fleet.no_integrals import WITHOUT
from opspace.fleet.one_by_one import ONE_BY_ONE
from opspace.fleet.one_robot import robot_tick
from opspace.fleet.precision import constants_of
from opspace.fleet.robot_record import ROBOT, WAYS
from opspace.fleet.told_arrays import ToldArrays
from opspace.fleet.warp_library import warp, workspace_of
from opspace.kernels.columns import VARIABLE_SIZE
from opspace.plan.plan import Plan

START = 2
"""Column of an activation in time that holds when it starts."""

MOST_LOCAL = {"cpu": 4 * 1024 * 1024, "cuda": 128 * 1024}
"""Bytes that a robot may work in as local memory of its thread; with more it works in a workspace.
On a processor that is the stack, which all robots use one after the other. A card lays local memory out
for all threads that it can run at once, however few robots there are (on an H100 for 270 336), and no
thread has more than 512 KiB. A workspace is as large as the fleet. The code is the same, and so is every
bit: only how far apart the numbers of one robot are is another number in it. Tiles, a block of threads
for each robot, would have more of a card at work where robots are few, and would be another source of
everything that is in `opspace.kernels`."""

LANES_OF = {"cpu": 1, "cuda": LANES}
"""Robots that share a part of a workspace: on a processor the numbers of one lie together."""

NOW = "(times.shape[0] > 1 ? times.data[i] : times.data[0])"
"""The time of a robot, s."""

KINDS = {np.float64: "double", np.float32: "float", np.int64: "I"}
"""Types of numbers in C++."""

LOOP = re.compile(r"^( *)(for \(I )", re.M)
LAMBDA = re.compile(r"^(static constexpr auto \w+ = \[\]\([^)]*\)) \{$", re.M)
ROLLED = {"cpu": '_Pragma("clang loop unroll(disable)")', "cuda": '_Pragma("unroll 1")'}
"""Loops stay loops: rolled out they take a compiler many times as long."""

EXACT = (
    *(f"opspace.kernels.{name}" for name in ("dynamics", "projection", "room_below")),
    "opspace.law.swift_motion",
    "opspace.kernels.swift_way",
    "opspace.fleet.led_targets",
)
"""Modules that count with sixteen digits in every fleet, as `opspace.fleet.layout.DIGITS` do."""

OPTIONS = {
    "cpu": (("optimization_level", 1), ("cpu_compiler_flags", "-march=native")),
    "cuda": (),
}
"""Of Warp's compiler. What it would do by itself on a processor, write every function out where it is
called, takes ten times as long and gives slower code."""


class FleetProgram:
    """What runs a plan for many robots, and the arrays that all of them read.

    Args:
        plan: A plan that nothing else uses.
        arrays: What each task of the plan is told and tells.
        dtype: Type of the numbers, ``"float64"`` or ``"float32"``.
        device: Where the arrays are.
        kind: What the kernel is for, ``"cpu"`` or ``"cuda"``.
        given: Inertia and bias of every robot if dynamics are given, M and bias.
        ended: (count,) of float64, when the last tick of every robot was, s.
        lanes: How many robots share a part of a workspace; None lets the size of one robot decide.
        poison: Begin all memory as numbers that are none, so that whatever is read before it is
            written shows.

    Attributes:
        fixed: Numbers that robots share.
        whole: Whole numbers that they share, and where the arrays of the tasks are.
        kernel: The kernel of Warp.
        memory: Bytes of the arrays that each robot has for itself.
        workspace: Where they are if they are more than `MOST_LOCAL`, for all robots; None if they are
            local memory of the threads.
    """

    def __init__(
        self,
        plan: Plan,
        arrays: list[ToldArrays],
        dtype: str,
        device: Any,
        kind: str,
        *,
        ended: Any,
        given: tuple[Any, Any] | None = None,
        lanes: int | None = None,
        poison: bool = False,
    ) -> None:
        wp = warp()
        real = getattr(wp, dtype)
        sizes = plan.size.by_name()
        paced = any(task.is_paced for task in arrays)
        tasks, rows = sizes["tasks"], sizes["rows"]
        ways = {"ways": tasks if paced else 0, "way_rows": rows if paced else 0}
        robot = ROBOT.make({**sizes, "given": tasks if given else 0})
        records = {"robot": robot, "ways": WAYS.make(ways)}
        layout = RobotLayout(plan.tick, records, poison=poison, lanes=lanes)
        self.memory = layout.memory_of(np.dtype(dtype).itemsize)
        if lanes is None and self.memory > MOST_LOCAL[kind]:
            lanes = LANES_OF[kind]
            layout = RobotLayout(plan.tick, records, poison=poison, lanes=lanes)
        self._addresses: list[int] = []
        self._first = layout.integers.size
        self.workspace, place = None, ""
        if lanes is not None:
            self.workspace = workspace_of(ended.shape[0], self.memory, lanes, device)
            place = self._address(self.workspace)
        lines = _lines(plan, arrays, given, self._address)
        integrates = any(task.integrates for task in arrays)
        if integrates or any(task.presses or task.rests for task in arrays):
            timing = _time_lines(arrays, self._address(ended))
            lines = lines[0] + timing[0], lines[1] + timing[1]
        numbers = layout.numbers
        if paced:
            timing = _way_lines(arrays, self._address)
            lines = lines[0] + timing[0], lines[1] + timing[1]
        if dtype == "float32":
            lines[0].append(
                f"for (int k = 0; k < {sizes['limits']}; ++k) "
                f"robot.limit_rest_().at(k) = fixed[{numbers.size} + k];"
            )
            numbers = np.concatenate([numbers, rests_of(plan.tick.limit)])
        code, name = _translated(dtype, given is not None, integrates, paced)
        text = "\n".join(
            [
                f"typedef {'double' if dtype == 'float64' else 'float'} real;",
                "typedef long long I;",
                "const real* fixed = fixed_.data; const I* whole = (const I*)whole_.data;",
                layout.types(),
                code,
                layout.definitions(place),
                *lines[0],
                f"{name}(work, robot);",
                *lines[1],
                "",
            ]
        )
        self.kernel = fleet_kernel(_for_compiler(text, kind), dtype, OPTIONS[kind])
        self.fixed = wp.array(numbers, dtype=real, device=device)
        whole = np.concatenate([layout.integers, np.array(self._addresses, np.int64)])
        self.whole = wp.array(whole, dtype=wp.int64, device=device)

    def _address(self, array: Any) -> str:
        """Say where the array of a task begins; Warp's arrays stay where they are."""
        self._addresses.append(array.ptr)
        return f"whole[{self._first + len(self._addresses) - 1}]"


def _lines(
    plan: Plan, arrays: list[ToldArrays], given: tuple[Any, Any] | None, address: Any
) -> tuple[list[str], list[str]]:
    """Write what a robot reads before its tick and what it tells after it."""
    nq, n = plan.axes.q.size, plan.n
    before = [
        f"{{ const real* from = {_row('q')}; for (int k = 0; k < {nq}; ++k) work.q_()(k) = from[k]; }}",
        f"{{ const real* from = {_row('v')}; for (int k = 0; k < {n}; ++k) work.v_()(k) = from[k]; }}",
    ]
    after = [
        f"{{ real* to = {_row('tau')}; for (int k = 0; k < {n}; ++k) to[k] = work.tau_()(k); }}"
    ]
    variables, limits = plan.size.variables, plan.size.limits
    start = f"ramps.data + (long long)i * {variables * VARIABLE_SIZE}"
    before.append(
        f"{{ const double now = times.shape[0] > 1 ? times.data[i] : times.data[0]; "
        f"const double* from = {start}; "
        f"for (int k = 0; k < {variables * VARIABLE_SIZE}; ++k) work.variable_().at(k) = "
        f"real(k % {VARIABLE_SIZE} == {START} ? from[k] - now : from[k]); }}"
    )
    groups = f"groups.data + (long long)i * {variables}"
    before.append(f"for (int k = 0; k < {variables}; ++k) work.group_().at(k) = ({groups})[k];")
    after.append(f"for (int k = 0; k < {variables}; ++k) ({groups})[k] = work.group_().at(k);")
    after.append("status.data[i] = robot.status_()(0); solves.data[i] = robot.solves_()(0);")
    after.append(
        f"for (int k = 0; k < {limits}; ++k) limits.data[(long long)i * {limits} + k] = "
        "work.limit_h_().at(k);"
    )
    told = [
        (0, "in", x, f"work.{k}_()", 0) for k, x in zip(("M", "bias"), given or (), strict=False)
    ]
    for i, (task, packed) in enumerate(zip(arrays, plan.packed, strict=True)):
        told += [(i, *place) for place in task.places(i, packed.rows)]
    for i, way, array, inside, first in told:
        kind = KINDS[warp().dtype_to_numpy(array.dtype)]
        size = int(np.prod(array.shape[1:], dtype=int))
        at = f"(({kind}*){address(array)} + (long long)i * {size})"
        if "in" in way:
            before.append(f"for (int k = 0; k < {size}; ++k) {inside}.at({first} + k) = {at}[k];")
        if "out" in way:
            guard = f"if (robot.found_()({i})) " if way == "in, out where found" else ""
            after.append(
                f"{guard}for (int k = 0; k < {size}; ++k) {at}[k] = {inside}.at({first} + k);"
            )
    return before, after


def _time_lines(arrays: list[ToldArrays], ended: str) -> tuple[list[str], list[str]]:
    """Write how long it is since the tick before, and which tasks have no integrals."""
    last = f"((double*){ended})[i]"
    before = [f"robot.since_()(0) = real({NOW} - {last});"]
    before += [f"robot.ki_()({i}) = 0;" for i, task in enumerate(arrays) if not task.integrates]
    return before, [f"{last} = {NOW};"]


def _way_lines(arrays: list[ToldArrays], address: Any) -> tuple[list[str], list[str]]:
    """Write what ways need: their limits, and how long it is since each began."""
    before, after = [], []
    for i, task in enumerate(arrays):
        before += [f"work.ways_().pace_()({i}, {k}) = {x!r};" for k, x in enumerate(task.paces)]
        if task.is_paced:
            begun = f"((double*){address(task.begun)})[i]"
            before.append(f"work.ways_().age_()({i}) = {NOW} - {begun};")
            after.append(f"if (work.ways_().begins_()({i})) {begun} = {NOW};")
    return before, after


def _for_compiler(text: str, kind: str) -> str:
    """Say what a compiler shall leave as it is."""
    text = LOOP.sub(rf"\1{ROLLED[kind]} \2", text)
    if kind == "cuda":  # it writes functions out where they are called unless it is told not to
        text = LAMBDA.sub(r"\1 __attribute__((noinline)) {", text)
    return text


def _row(array: str) -> str:
    return f"(real*)((char*){array}.data + i * (long long){array}.strides[0])"


@cache
def _translated(dtype: str, given: bool, integrates: bool, paced: bool) -> tuple[str, str]:
    instead = {
        **IN_TICK,
        **ONE_BY_ONE,
        **(INSTEAD if given else {}),
        **({} if integrates else WITHOUT),
    }
    if not paced:
        instead |= WITHOUT_WAYS
    if dtype == "float32":
        instead |= EXACTLY
    return translate(robot_tick, constants_of(dtype), instead, EXACT)

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
from opspace.fleet.layout import RobotLayout
from opspace.fleet.no_integrals import WITHOUT
from opspace.fleet.one_robot import robot_tick
from opspace.fleet.precision import constants_of
from opspace.fleet.robot_record import ROBOT
from opspace.fleet.task_arrays import TaskArrays
from opspace.fleet.warp_library import warp
from opspace.kernels.columns import VARIABLE_SIZE
from opspace.plan.plan import Plan

START = 2
"""Column of an activation in time that holds when it starts."""

LOOP = re.compile(r"^( *)(for \(I )", re.M)
LAMBDA = re.compile(r"^(static constexpr auto \w+ = \[\]\([^)]*\)) \{$", re.M)
ROLLED = {"cpu": '_Pragma("clang loop unroll(disable)")', "cuda": '_Pragma("unroll 1")'}
"""Loops stay loops: rolled out they take a compiler many times as long."""

EXACT = tuple(f"opspace.kernels.{name}" for name in ("dynamics", "projection", "room_below"))
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
        poison: Begin all memory as numbers that are none, so that whatever is read before it is
            written shows.

    Attributes:
        fixed: Numbers that robots share.
        whole: Whole numbers that they share, and where the arrays of the tasks are.
        kernel: The kernel of Warp.
        memory: Bytes of the arrays that each robot has for itself.
    """

    def __init__(
        self,
        plan: Plan,
        arrays: list[TaskArrays],
        dtype: str,
        device: Any,
        kind: str,
        *,
        ended: Any,
        given: tuple[Any, Any] | None = None,
        poison: bool = False,
    ) -> None:
        wp = warp()
        real = getattr(wp, dtype)
        sizes = plan.size.by_name()
        robot = ROBOT.make({**sizes, "given": sizes["tasks"] if given else 0})
        layout = RobotLayout(plan.tick, {"robot": robot}, poison=poison)
        self._addresses: list[int] = []
        self._first = layout.integers.size
        lines = _lines(plan, arrays, given, self._address)
        integrates = any(task.integrates for task in arrays)
        if integrates:
            timing = _time_lines(arrays, self._address(ended))
            lines = lines[0] + timing[0], lines[1] + timing[1]
        numbers = layout.numbers
        if dtype == "float32":
            lines[0].append(
                f"for (int k = 0; k < {sizes['limits']}; ++k) "
                f"robot.limit_rest_().p[k] = fixed[{numbers.size} + k];"
            )
            numbers = np.concatenate([numbers, rests_of(plan.tick.limit)])
        code, name = _translated(dtype, given is not None, integrates)
        text = "\n".join(
            [
                f"typedef {'double' if dtype == 'float64' else 'float'} real;",
                "typedef long long I;",
                "const real* fixed = fixed_.data; const I* whole = (const I*)whole_.data;",
                layout.types(),
                code,
                layout.definitions(),
                *lines[0],
                f"{name}(work, robot);",
                *lines[1],
                "",
            ]
        )
        self.kernel = fleet_kernel(_for_compiler(text, kind), dtype, OPTIONS[kind])
        self.memory = layout.memory_of(np.dtype(dtype).itemsize)
        self.fixed = wp.array(numbers, dtype=real, device=device)
        whole = np.concatenate([layout.integers, np.array(self._addresses, np.int64)])
        self.whole = wp.array(whole, dtype=wp.int64, device=device)

    def _address(self, array: Any) -> str:
        """Say where the array of a task begins; Warp's arrays stay where they are."""
        self._addresses.append(array.ptr)
        return f"whole[{self._first + len(self._addresses) - 1}]"


def _lines(
    plan: Plan, arrays: list[TaskArrays], given: tuple[Any, Any] | None, address: Any
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
        f"for (int k = 0; k < {variables * VARIABLE_SIZE}; ++k) work.variable_().p[k] = "
        f"real(k % {VARIABLE_SIZE} == {START} ? from[k] - now : from[k]); }}"
    )
    groups = f"groups.data + (long long)i * {variables}"
    before.append(f"for (int k = 0; k < {variables}; ++k) work.group_().p[k] = ({groups})[k];")
    after.append(f"for (int k = 0; k < {variables}; ++k) ({groups})[k] = work.group_().p[k];")
    after.append("status.data[i] = robot.status_()(0); solves.data[i] = robot.solves_()(0);")
    after.append(
        f"for (int k = 0; k < {limits}; ++k) limits.data[(long long)i * {limits} + k] = "
        "work.limit_h_().p[k];"
    )
    told = [
        (0, "in", x, f"work.{k}_().p") for k, x in zip(("M", "bias"), given or (), strict=False)
    ]
    for i, (task, packed) in enumerate(zip(arrays, plan.packed, strict=True)):
        told += [(i, *place) for place in task.places(i, packed.rows)]
    for i, way, array, inside in told:
        kind = "real" if array.dtype is not warp().int64 else "I"
        size = int(np.prod(array.shape[1:], dtype=int))
        at = f"(({kind}*){address(array)} + (long long)i * {size})"
        if "in" in way:
            before.append(f"for (int k = 0; k < {size}; ++k) {inside}[k] = {at}[k];")
        if "out" in way:
            guard = f"if (robot.found_()({i})) " if way == "in, out where found" else ""
            after.append(f"{guard}for (int k = 0; k < {size}; ++k) {at}[k] = {inside}[k];")
    return before, after


def _time_lines(arrays: list[TaskArrays], ended: str) -> tuple[list[str], list[str]]:
    """Write what integrals need: how long it is since the tick before, and which tasks have none."""
    last = f"((double*){ended})[i]"
    now = "(times.shape[0] > 1 ? times.data[i] : times.data[0])"
    before = [f"robot.since_()(0) = real({now} - {last});"]
    before += [f"robot.ki_()({i}) = 0;" for i, task in enumerate(arrays) if not task.integrates]
    return before, [f"{last} = {now};"]


def _for_compiler(text: str, kind: str) -> str:
    """Say what a compiler shall leave as it is."""
    text = LOOP.sub(rf"\1{ROLLED[kind]} \2", text)
    if kind == "cuda":  # it writes functions out where they are called unless it is told not to
        text = LAMBDA.sub(r"\1 __attribute__((noinline)) {", text)
    return text


def _row(array: str) -> str:
    return f"(real*)((char*){array}.data + i * (long long){array}.strides[0])"


@cache
def _translated(dtype: str, given: bool, integrates: bool) -> tuple[str, str]:
    instead = {**(INSTEAD if given else {}), **({} if integrates else WITHOUT)}
    if dtype == "float32":
        instead |= EXACTLY
    return translate(robot_tick, constants_of(dtype), instead, EXACT)

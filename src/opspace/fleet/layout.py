"""Where the arrays of a plan are for one robot of a fleet, as C++."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from opspace.kernels.columns import (
    KEEP_TORQUE,
    LIMIT_BOUND,
    LIMIT_LAW,
    LIMIT_PROFILE,
    ROOM,
    SIGMA_PROFILE,
    SINGULAR,
    TASK_BIAS,
)
from opspace.machine.field_table import Field, Record

FROZEN = (
    SINGULAR, SIGMA_PROFILE, TASK_BIAS, ROOM, LIMIT_LAW, LIMIT_PROFILE, LIMIT_BOUND, KEEP_TORQUE,
)  # fmt: skip
"""Options that choose between ways to compute; what is not chosen need not be compiled."""

BEGUN = ("kind", "numbers", "limit")
"""What the plan begins and a tick goes on with, each robot for itself."""
EMPTY = (
    *("U", "motors", "M", "bias", "placement", "velocity", "acceleration", "force", "inertia"),
    *("count", "rows", "remembered", "spring"),
)
"""What a tick does not write everywhere and reads as zero there: a fleet stands on nothing."""


class RobotLayout:
    """All arrays of a plan: what robots share, in two blocks, and what each works in.

    Args:
        tick: The plan's arrays, as a new plan has them.
        records: Other records by their names in C++, whose arrays every robot has for itself.
        poison: Whether memory that nothing has to begin begins as numbers that are none.

    Attributes:
        numbers: What robots share, as numbers.
        integers: The same as whole numbers.
    """

    def __init__(
        self, tick: Record, records: Mapping[str, Record], *, poison: bool = False
    ) -> None:
        self._poison = poison
        self._kinds: dict[tuple[str, tuple[int, ...]], str] = {}
        self._structs: list[str] = []
        self._memory: dict[int, str] = {}
        self._lines: list[str] = []
        self._shared: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        self._sizes = [0, 0]
        self._option = tick.option
        self._record("work", tick)
        for name, record in records.items():
            self._record(name, record)
        self.numbers, self.integers = (
            np.concatenate([*map(np.ravel, found), np.zeros(1)]) for found in self._shared
        )

    def types(self) -> str:
        """Return the types of all arrays and records."""
        return "\n".join([*_array_types(self._kinds, self._frozen()), *self._structs])

    def memory(self) -> str:
        """Return the definitions of all records, for one robot."""
        return "\n".join(self._lines)

    def _record(self, name: str, record: Record) -> None:
        fields: list[str] = []
        self._lines.append(f"Of_{name} {name};")
        for path, field, array in _arrays(record, ""):
            kind = self._kind(path, array)
            memory = self._memory.get(id(array))
            if memory is None or not array.size:
                memory = self._memory[id(array)] = self._begin(field, path, array)
            fields.append(f"{name}.{path} = {kind}{{{memory}}};")
        self._structs += _structs(f"Of_{name}", record, self._kind)
        self._lines += fields

    def _kind(self, path: str, array: np.ndarray) -> str:
        if path == "option_":
            return "Options"
        key = ("I" if array.dtype == np.int64 else "real"), array.shape
        return self._kinds.setdefault(key, "_".join([key[0], *map(str, array.shape)]))

    def _begin(self, field: Field, path: str, array: np.ndarray) -> str:
        """Say where an array begins: among what is shared, or in memory of its own."""
        whole = int(array.dtype == np.int64)
        kind = "I" if whole else "real"
        if not array.size:
            return f"({kind}*)0"
        shared = set(field.writer.split(", ")) <= {"plan", "robot"} and field.lives in (
            "plan",
            "robot",
        )
        place = ""
        if shared or field.name in BEGUN:
            place = f"({kind}*){'whole' if whole else 'fixed'} + {self._sizes[whole]}"
            self._shared[whole].append(array)
            self._sizes[whole] += array.size
        if shared:
            return place
        name = f"at_{len(self._memory)}"
        if place:
            self._lines.append(
                f"{kind} {name}[{array.size}]; for (int k = 0; k < {array.size}; ++k) "
                f"{name}[k] = ({place})[k];"
            )
        elif field.name in EMPTY:
            self._lines.append(f"{kind} {name}[{array.size}] = {{}};")
            if field.name == "placement":
                self._lines.append(f"{name}[0] = {name}[4] = {name}[8] = real(1);")
        elif self._poison:
            none = "I(123456789)" if whole else "real(NAN)"
            self._lines.append(
                f"{kind} {name}[{array.size}]; for (int k = 0; k < {array.size}; ++k) "
                f"{name}[k] = {none};"
            )
        else:
            self._lines.append(f"{kind} {name}[{array.size}];")
        return name

    def _frozen(self) -> dict[int, float]:
        return {i: float(self._option[i]) for i in FROZEN}


def _arrays(record: Record, prefix: str) -> Iterator[tuple[str, Field, np.ndarray]]:
    for field, value in zip(record._table.fields, record, strict=True):
        path = f"{prefix}{field.name}_"
        if isinstance(value, Record):
            yield from _arrays(value, f"{path}.")
        else:
            yield path, field, value


def _structs(name: str, record: Record, kind: Callable[[str, np.ndarray], str]) -> list[str]:
    found: list[str] = []
    fields: list[str] = []
    for field, value in zip(record._table.fields, record, strict=True):
        if isinstance(value, Record):
            inner = f"{name}_{field.name}"
            found += _structs(inner, value, kind)
            fields.append(f"{inner} {field.name}_;")
        else:
            fields.append(f"{kind(f'{field.name}_', value)} {field.name}_;")
    return [*found, f"struct {name} {{ {' '.join(fields)} }};"]


def _array_types(
    kinds: Mapping[tuple[str, tuple[int, ...]], str], frozen: Mapping[int, float]
) -> Iterator[str]:
    """Write the types of arrays, those with fewer dimensions first: their rows are of those."""
    wanted = dict(kinds)
    for item, shape in kinds:
        for k in range(1, len(shape)):
            part = shape[k:]
            wanted.setdefault((item, part), "_".join([item, *map(str, part)]))
    for (item, shape), name in sorted(wanted.items(), key=lambda kind: len(kind[0][1])):
        yield _array_type(item, shape, name)
    chosen = "".join(f"i == {i} ? real({x!r}) : " for i, x in frozen.items())
    yield (
        "struct Options { const real* p; "
        f"CUDA_CALLABLE real operator()(I i) const {{ return {chosen}p[i]; }} }};"
    )


def _array_type(item: str, shape: Sequence[int], name: str) -> str:
    steps = [*itertools.accumulate(reversed([*shape[1:], 1]), lambda a, b: a * b)]
    steps = list(reversed(steps))
    axes = range(len(shape))
    given = ", ".join(f"I i{k}" for k in axes)
    place = " + ".join(f"i{k} * {steps[k]}" for k in axes)
    parts = [
        f"{item}* p;",
        f"CUDA_CALLABLE {item}& operator()({given}) const {{ return p[{place}]; }}",
        f"CUDA_CALLABLE {name} from(I i) const {{ return {name}{{p + i * {steps[0]}}}; }}",
        *(f"CUDA_CALLABLE I n{k}() const {{ return {shape[k]}; }}" for k in axes),
    ]
    for k in range(1, len(shape)):
        row = "_".join([item, *map(str, shape[k:])])
        some = ", ".join(f"I i{c}" for c in range(k))
        start = " + ".join(f"i{c} * {steps[c]}" for c in range(k))
        parts.append(
            f"CUDA_CALLABLE {row} operator()({some}) const {{ return {row}{{p + {start}}}; }}"
        )
    column = ""
    if len(shape) == 2:
        column = (
            f"struct {name}_column {{ {item}* p; "
            f"CUDA_CALLABLE {item}& operator()(I i) const {{ return p[i * {steps[0]}]; }} }};\n"
        )
        parts.append(
            f"CUDA_CALLABLE {name}_column column(I i) const {{ return {name}_column{{p + i}}; }}"
        )
    return f"{column}struct {name} {{ {' '.join(parts)} }};"

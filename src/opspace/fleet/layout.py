"""Where the arrays of a plan are for one robot of a fleet, as C++."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence

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
    *("count", "rows", "remembered", "spring", "kp", "kv"),
)
"""What a tick does not write everywhere and reads as zero there: a fleet stands on nothing, and springs
have no gains."""

DIGITS = ("dynamics", "later", "bounds", "ways")
"""Records that count with sixteen digits in every fleet. Inertias seen from the origin of the world lose
three where wrists are light, and the multipliers of bounds that contradict each other seven. What a way
to a target has to make good across itself is a difference of near numbers."""

PLACES = {"real": ("numbers", "fixed"), "double": ("exact", "fixed"), "I": ("integers", "whole")}
"""Where arrays of a type are that a robot has for itself, and those that robots share."""

BLOCKS = "numbers, exact, integers, fixed, whole"


class RobotLayout:
    """All arrays of a plan: what robots share, in two blocks, and what each works in, in three others.

    A record in C++ is where the blocks begin, and each of its arrays a place in one of them that the
    compiler knows.

    Args:
        tick: The plan's arrays, as a new plan has them.
        records: Other records by their names in C++, whose arrays every robot has for itself; the
            tick's own reaches them by these names.
        poison: Whether memory that nothing has to begin begins as numbers that are none.

    Attributes:
        numbers: What robots share, as numbers.
        integers: The same as whole numbers.
    """

    def __init__(
        self, tick: Record, records: Mapping[str, Record], *, poison: bool = False
    ) -> None:
        self._poison = poison
        self._records = {**records, "work": tick}
        self._kinds: dict[tuple[str, tuple[int, ...]], str] = {}
        self._option = tick.option
        found = {id(a): (f, a) for r in self._records.values() for f, a in _arrays(r) if a.size}
        exact = {
            id(array): (field, array)
            for name in DIGITS
            for field, array in _arrays(records[name] if name in records else getattr(tick, name))
            if array.dtype == np.float64 and array.size and not _shared(field)
        }
        rest = [pair for key, pair in found.items() if key not in exact]
        self._blocks = {
            "real": _Blocks([pair for pair in rest if pair[1].dtype == np.float64], np.float64),
            "double": _Blocks(exact.values(), np.float64),
            "I": _Blocks([pair for pair in rest if pair[1].dtype == np.int64], np.int64),
        }
        self._structs = [
            text for name, record in self._records.items() for text in self._struct(name, record)
        ]
        self.numbers, self.integers = (self._blocks[kind].shared for kind in ("real", "I"))

    def types(self) -> str:
        """Return the types of all arrays and records."""
        return "\n".join([*_array_types(self._kinds, self._frozen()), *self._structs])

    def memory_of(self, number: int) -> int:
        """Return how many bytes a robot has for itself if a number has so many."""
        sizes = {"real": number, "double": 8, "I": 8}
        return sum(blocks.size * sizes[kind] for kind, blocks in self._blocks.items())

    def definitions(self) -> str:
        """Return the definitions of all records, for one robot."""
        lines = [
            line
            for kind, blocks in self._blocks.items()
            for line in blocks.begin(kind, *PLACES[kind], self._poison)
        ]
        lines += [f"const Of_{name} {name}{{{BLOCKS}}};" for name in self._records]
        return "\n".join(lines)

    def _struct(self, name: str, record: Record) -> Iterator[str]:
        """Write the type of a record, after those of the records in it."""
        parts = ["real* numbers; double* exact; I* integers; const real* fixed; const I* whole;"]
        for field, value in zip(record._table.fields, record, strict=True):
            if isinstance(value, Record):
                yield from self._struct(f"{name}_{field.name}", value)
                kind, place = f"Of_{name}_{field.name}", BLOCKS
            else:
                kind, place = self._kind(field.name, value), self._place(value)
            parts.append(
                f"CUDA_CALLABLE {kind} {field.name}_() const {{ return {kind}{{{place}}}; }}"
            )
        if name == "work":
            others = (other for other in self._records if other != name)
            parts += [
                f"CUDA_CALLABLE Of_{other} {other}_() const {{ return Of_{other}{{{BLOCKS}}}; }}"
                for other in others
            ]
        yield f"struct Of_{name} {{ {' '.join(parts)} }};"

    def _kind(self, name: str, array: np.ndarray) -> str:
        if name == "option":
            return "Options"
        key = self._type(array), array.shape
        return self._kinds.setdefault(key, "_".join([key[0], *map(str, array.shape)]))

    def _type(self, array: np.ndarray) -> str:
        if id(array) in self._blocks["double"].own:
            return "double"
        return "I" if array.dtype == np.int64 else "real"

    def _place(self, array: np.ndarray) -> str:
        """Say where an array begins."""
        kind = self._type(array)
        if not array.size:
            return f"({kind}*)0"
        blocks, (own, shared) = self._blocks[kind], PLACES[kind]
        if id(array) in blocks.own:
            return f"{own} + {blocks.own[id(array)]}"
        return f"({kind}*){shared} + {blocks.of_all[id(array)]}"

    def _frozen(self) -> dict[int, float]:
        return {i: float(self._option[i]) for i in FROZEN}


class _Blocks:
    """Numbers of one type: a block that robots share, and one that each has for itself.

    What a robot begins as the plan begins it comes first in both, what begins as zero next.
    """

    def __init__(self, arrays: Iterable[tuple[Field, np.ndarray]], dtype: type) -> None:
        some = list(arrays)
        begun = [array for field, array in some if field.name in BEGUN]
        shared = [array for field, array in some if field.name not in BEGUN and _shared(field)]
        own = [(f, a) for f, a in some if f.name not in BEGUN and not _shared(f)]
        empty = [array for field, array in own if field.name in EMPTY]
        rest = [array for field, array in own if field.name not in EMPTY]
        self.own, self.size = _places([*begun, *empty, *rest])
        self.of_all, _ = _places([*begun, *shared])
        self.shared = np.concatenate([*map(np.ravel, [*begun, *shared]), np.zeros(1, dtype)])
        self._begun = sum(array.size for array in begun)
        self._known = self._begun + sum(array.size for array in empty)
        self._turns = [self.own[id(a)] for f, a in own if f.name == "placement"]

    def begin(self, kind: str, name: str, source: str, poison: bool) -> Iterator[str]:
        """Write the definition of a robot's own block."""
        yield f"{kind} {name}[{self.size + 1}];"
        yield f"for (int k = 0; k < {self._begun}; ++k) {name}[k] = {source}[k];"
        yield f"for (int k = {self._begun}; k < {self._known}; ++k) {name}[k] = 0;"
        for k in self._turns:
            yield f"{name}[{k}] = {name}[{k + 4}] = {name}[{k + 8}] = 1;"
        if poison:
            none = "I(123456789)" if kind == "I" else f"{kind}(NAN)"
            yield f"for (int k = {self._known}; k < {self.size}; ++k) {name}[k] = {none};"


def _places(arrays: Sequence[np.ndarray]) -> tuple[dict[int, int], int]:
    """Put arrays one behind the other, and return where each begins and where the last ends."""
    ends = [0, *itertools.accumulate(array.size for array in arrays)]
    return {id(array): start for array, start in zip(arrays, ends, strict=False)}, ends[-1]


def _shared(field: Field) -> bool:
    """Tell whether an array is the same for all robots."""
    return set(field.writer.split(", ")) <= {"plan", "robot"} and field.lives in ("plan", "robot")


def _arrays(record: Record) -> Iterator[tuple[Field, np.ndarray]]:
    for field, value in zip(record._table.fields, record, strict=True):
        if isinstance(value, Record):
            yield from _arrays(value)
        else:
            yield field, value


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

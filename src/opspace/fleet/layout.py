"""Where the arrays of a plan are for one robot of a fleet, as C++."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

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

BEGUN = ("kind", "numbers", "limit", "press")
"""What the plan begins and a tick goes on with, each robot for itself."""
EMPTY = (
    "L", "across", "motors", "M", "bias", "placement", "velocity", "acceleration", "force", "inertia",
    "count", "rows", "remembered", "spring", "kp", "kv",
)  # fmt: skip
"""What a tick does not write everywhere and reads as zero there: a fleet stands on nothing, and springs
have no gains."""

DIGITS = ("dynamics", "later", "bounds", "ways")
"""Records that count with sixteen digits in every fleet. Inertias seen from the origin of the world lose
three where wrists are light, and the multipliers of bounds that contradict each other seven. What a way
to a target has to make good across itself is a difference of near numbers."""

LANES = 32
"""Threads that cards run as one. In a workspace the same number of as many robots lies side by side."""

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
        lanes: None where each robot works in local memory of its thread; else how many robots share a
            part of a workspace, in which the same number of each lies beside that of the next.

    Attributes:
        numbers: What robots share, as numbers.
        integers: The same as whole numbers.
    """

    def __init__(
        self,
        tick: Record,
        records: Mapping[str, Record],
        *,
        poison: bool = False,
        lanes: int | None = None,
    ) -> None:
        self._poison = poison
        self._lanes, self._step = lanes, lanes or 1
        self._records = {**records, "work": tick}
        self._kinds: dict[_Kind, str] = {}
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
        return "\n".join([*_array_types(self._kinds, self._frozen(), self._step), *self._structs])

    def memory_of(self, number: int) -> int:
        """Return how many bytes a robot has for itself if a number has so many."""
        sizes = {"real": number, "double": 8, "I": 8}
        found = sum(blocks.size * sizes[kind] for kind, blocks in self._blocks.items())
        return -(-found // 8) * 8

    def definitions(self, workspace: str = "") -> str:
        """Return the definitions of all records, for one robot.

        Args:
            workspace: Where the workspace begins, unless robots work in local memory.
        """
        lines = []
        if self._lanes:
            each = " + ".join(f"{b.size} * sizeof({kind})" for kind, b in self._blocks.items())
            lines = [
                f"char* part = (char*){workspace} + (I)(i / {self._lanes}) * {self._lanes} * ({each});"
            ]
        # Numbers of eight bytes come first, so that all are where their type wants them.
        for kind in ("double", "I", "real"):
            blocks, (own, shared) = self._blocks[kind], PLACES[kind]
            if self._lanes:
                lines += [
                    f"{kind}* const {own} = ({kind}*)part + i % {self._lanes};",
                    f"part += {blocks.size * self._lanes} * sizeof({kind});",
                ]
            else:
                lines.append(f"{kind} {own}[{blocks.size + 1}];")
            lines += blocks.begin(kind, own, shared, self._step, self._poison)
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
        kind = self._type(array)
        key = _Kind(kind, array.shape, own=id(array) in self._blocks[kind].own)
        return self._kinds.setdefault(key, key.name)

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
            return f"{own} + {blocks.own[id(array)] * self._step}"
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

    def begin(self, kind: str, name: str, source: str, step: int, poison: bool) -> Iterator[str]:
        """Write how a robot's own block begins, whose numbers are so many places apart."""
        yield f"for (int k = 0; k < {self._begun}; ++k) {name}[k * {step}] = {source}[k];"
        yield f"for (int k = {self._begun}; k < {self._known}; ++k) {name}[k * {step}] = 0;"
        for k in self._turns:
            yield " = ".join(f"{name}[{(k + c) * step}]" for c in (0, 4, 8)) + " = 1;"
        if poison:
            none = "I(123456789)" if kind == "I" else f"{kind}(NAN)"
            rest = f"int k = {self._known}; k < {self.size}; ++k"
            yield f"for ({rest}) {name}[k * {step}] = {none};"


class _Kind(NamedTuple):
    """A type of arrays.

    Attributes:
        item: Type of its numbers.
        shape: Its shape.
        own: Whether each robot has one for itself.
    """

    item: str
    shape: tuple[int, ...]
    own: bool

    @property
    def name(self) -> str:
        """What it is called in C++."""
        return "_".join([self.item if self.own else f"{self.item}_of_all", *map(str, self.shape)])


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


def _array_types(kinds: Iterable[_Kind], frozen: Mapping[int, float], step: int) -> Iterator[str]:
    """Write the types of arrays, those with fewer dimensions first: their rows are of those."""
    wanted = {kind._replace(shape=kind.shape[k:]) for kind in kinds for k in range(len(kind.shape))}
    for kind in sorted(wanted, key=lambda kind: (len(kind.shape), kind)):
        yield _array_type(kind, step if kind.own else 1)
    chosen = "".join(f"i == {i} ? real({x!r}) : " for i, x in frozen.items())
    yield (
        "struct Options { const real* p; "
        f"CUDA_CALLABLE real operator()(I i) const {{ return {chosen}p[i]; }} }};"
    )


def _array_type(kind: _Kind, step: int) -> str:
    """Write a type of arrays whose neighbouring numbers are so many places apart."""
    item, shape, name = kind.item, kind.shape, kind.name
    steps = [*itertools.accumulate(reversed([*shape[1:], step]), lambda a, b: a * b)]
    steps = list(reversed(steps))
    axes = range(len(shape))
    given = ", ".join(f"I i{k}" for k in axes)
    place = " + ".join(f"i{k} * {steps[k]}" for k in axes)
    parts = [
        f"{item}* p;",
        f"CUDA_CALLABLE {item}& operator()({given}) const {{ return p[{place}]; }}",
        f"CUDA_CALLABLE {item}& at(I k) const {{ return p[k * {step}]; }}",
        f"CUDA_CALLABLE {name} from(I i) const {{ return {name}{{p + i * {steps[0]}}}; }}",
        *(f"CUDA_CALLABLE I n{k}() const {{ return {shape[k]}; }}" for k in axes),
    ]
    for k in range(1, len(shape)):
        row = kind._replace(shape=shape[k:]).name
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
        one = f"{name}_column{{p + i * {step}}}"
        parts.append(f"CUDA_CALLABLE {name}_column column(I i) const {{ return {one}; }}")
    return f"{column}struct {name} {{ {' '.join(parts)} }};"

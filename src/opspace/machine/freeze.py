"""Records that stay where they are, as constants: kernels compiled for them alone know their sizes."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from opspace.machine.field_table import RecordTable
from opspace.machine.kernel_entry import KernelEntry
from opspace.machine.lanes import LINE

MEMORY = "opspace_memory"
"""Symbol of the memory of such kernels, which is theirs alone."""

WORD, INDEX, BYTE = ir.IntType(64), ir.IntType(32), ir.IntType(8)
TYPES: dict[Any, Any] = {float: ir.DoubleType(), int: WORD, None: ir.VoidType()}


class Frozen(NamedTuple):
    """What kernels are compiled for alone.

    Attributes:
        names: Names of the kernels.
        words: (N,) uint64, contents of the records; an address counts words from the first one.
        addresses: Which words are addresses.
        handles: Word from which on there are handles.
        roots: Word where the handle of each record begins, by the name of its table; others are given.
        constants: Arrays that nobody writes: first word and number of words of each.
        vectorise: Whether loops are to be vectorised.
    """

    names: tuple[str, ...]
    words: np.ndarray
    addresses: np.ndarray
    handles: int
    roots: Mapping[str, int]
    constants: tuple[tuple[int, int], ...]
    vectorise: bool

    @property
    def stamp(self) -> str:
        """Return what changes with everything that is frozen into the code."""
        told = hashlib.sha256(repr((self.names, *self.roots.items(), self.constants)).encode())
        for first, count in (*self.constants, (self.handles, self.words.size - self.handles)):
            told.update(self.words[first : first + count].tobytes())
        return told.hexdigest()[:16]


def freeze(module: Any, entries: Sequence[KernelEntry], frozen: Frozen) -> None:
    """Have entries of a module take constants instead of the records that they are called with.

    Args:
        module: The module, parsed.
        entries: Its entries.
        frozen: The records.
    """
    more = ir.Module()
    handles = _memory(more, frozen)
    for entry in entries:
        module.get_function(entry.symbol).name = f"any_{entry.symbol}"
        _define(more, entry, frozen, handles)
    module.link_in(llvm.parse_assembly(str(more)))


def _memory(module: ir.Module, frozen: Frozen) -> Any:
    """Define the memory, what is constant of it, and the handles; return these."""
    memory: Any = ir.GlobalVariable(module, ir.ArrayType(WORD, frozen.words.size), MEMORY)
    memory.initializer = ir.Constant(memory.value_type, None)
    memory.align = LINE
    numbers = frozen.words.view(np.int64).tolist()
    places = [(first, first + count) for first, count in frozen.constants]
    places.append((frozen.handles, frozen.words.size))
    parts = [_constant(module, f"constants_{first}", end - first) for first, end in places]

    def address(word: int) -> Any:
        for (first, end), part in zip(places, parts, strict=True):
            if first <= word < end:
                return _at(part, word - first).ptrtoint(WORD)
        return _at(memory, word).ptrtoint(WORD)

    points = set(frozen.addresses.tolist())
    for (first, end), part in zip(places, parts, strict=True):
        content = [
            address(numbers[i]) if i in points else WORD(numbers[i]) for i in range(first, end)
        ]
        part.initializer = ir.Constant(part.value_type, content)
    return parts[-1]


def _constant(module: ir.Module, name: str, size: int) -> Any:
    part: Any = ir.GlobalVariable(module, ir.ArrayType(WORD, size), name)
    part.linkage, part.global_constant = "internal", True
    return part


def _at(part: Any, word: int) -> Any:
    return part.gep((INDEX(0), INDEX(word)))


def _define(module: ir.Module, entry: KernelEntry, frozen: Frozen, handles: Any) -> None:
    """Define an entry that passes on what it is given, the constant record where there is one."""
    address = BYTE.as_pointer()
    kinds = [TYPES.get(kind, address) for kind in entry.takes]
    call = ir.FunctionType(TYPES[entry.gives], kinds)
    general = ir.Function(module, call, f"any_{entry.symbol}")
    function = ir.Function(module, call, entry.symbol)
    builder = ir.IRBuilder(function.append_basic_block())
    given = [
        _at(handles, frozen.roots[kind.name] - frozen.handles).bitcast(address)
        if isinstance(kind, RecordTable) and kind.name in frozen.roots
        else argument
        for kind, argument in zip(entry.takes, function.args, strict=True)
    ]
    result = builder.call(general, given)
    if entry.gives is None:
        builder.ret_void()
    else:
        builder.ret(result)

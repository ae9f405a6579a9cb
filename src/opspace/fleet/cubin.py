"""What a graphics card needs to run a kernel, read from the kernel as it is compiled for one."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

INFO, CODE = ".nv.info", ".text."
REGISTERS, FRAME = 0x2F, 0x11
"""Of what the compiler notes about functions: a symbol and a number each."""
PAIR = 4
"""The form of a note that has bytes of its own."""
INSTRUCTION = 16
"""Bytes of an instruction."""


class Needs(NamedTuple):
    """What one thread of a kernel takes.

    Attributes:
        registers: Registers of 32 bits.
        local: Bytes of local memory, the stack.
        instructions: Instructions, of all functions.
    """

    registers: int
    local: int
    instructions: int


def needs_of(cubin: bytes) -> Needs:
    """Read what the kernels of an ELF file for graphics cards take, at most.

    A kernel's registers and stack contain those of the functions that it calls.
    """
    sections = list(_sections(cubin))
    noted: dict[int, int] = {REGISTERS: 0, FRAME: 0}
    for name, place, size in sections:
        if name == INFO:
            for attribute, number in _notes(cubin[place : place + size]):
                if attribute in noted:
                    noted[attribute] = max(noted[attribute], number)
    code = sum(size for name, _, size in sections if name.startswith(CODE))
    return Needs(noted[REGISTERS], noted[FRAME], code // INSTRUCTION)


def _sections(elf: bytes) -> Iterator[tuple[str, int, int]]:
    """Give name, place and size of each section of a file of 64 bits."""
    (table,) = struct.unpack_from("<Q", elf, 0x28)
    width, count, names = struct.unpack_from("<HHH", elf, 0x3A)
    found = []
    for k in range(count):
        name, _, _, _, place, size = struct.unpack_from("<IIQQQQ", elf, table + k * width)
        found.append((name, place, size))
    start = found[names][1]
    for name, place, size in found:
        end = elf.index(b"\0", start + name)
        yield elf[start + name : end].decode(), place, size


def _notes(part: bytes) -> Iterator[tuple[int, int]]:
    """Give attribute and number of the notes that name a symbol and a number."""
    place = 0
    while place < len(part):
        form, attribute, size = struct.unpack_from("<BBH", part, place)
        place += 4
        if form != PAIR:
            continue
        if size == 8:
            yield attribute, struct.unpack_from("<II", part, place)[1]
        place += size

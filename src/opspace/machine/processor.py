"""Processors that an object is compiled for, and LLVM made ready for them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import Any, NamedTuple

import llvmlite
from llvmlite import binding as llvm


class Processor(NamedTuple):
    """What an object is compiled for.

    Attributes:
        triple: Instruction set, system and format.
        cpu: LLVM's name of the processor.
        features: What it can, in LLVM's words.
    """

    triple: str
    cpu: str
    features: str

    @property
    def name(self) -> str:
        """Part of a file's name; another compiler may give other last bits."""
        said = "\n".join((*self, llvmlite.__version__))
        return f"{self.cpu}-{hashlib.sha256(said.encode()).hexdigest()[:12]}"

    @property
    def kind(self) -> str:
        """Part of the name of a file that is shipped, whatever compiler is installed beside it."""
        return f"{self.triple.split('-')[0]}-{self.cpu}"

    def runs_on(self, triple: str) -> bool:
        """Tell whether a process of that triple takes such objects: instruction set and system."""
        set_, system = self.triple.split("-")[0], "-linux-"
        return triple.startswith(f"{set_}-") and system in triple

    def machine(self) -> Any:
        """Return LLVM's object for it."""
        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu, features=self.features, opt=2, reloc="pic", codemodel="default"
        )


LINUX = "unknown-linux-gnu"
SHIPPED = (
    Processor(f"x86_64-{LINUX}", "x86-64-v3", ""),
    Processor(f"x86_64-{LINUX}", "x86-64-v2", ""),
    Processor(f"aarch64-{LINUX}", "generic", ""),
)
"""What a wheel has objects for, the fastest first. Machines that run the same object agree in every
bit, so these are what a checkout compiles for, too."""

V2 = frozenset({"cx16", "popcnt", "sahf", "sse3", "sse4.1", "sse4.2", "ssse3"})
V3 = frozenset({"avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"})
NEEDS: Mapping[str, frozenset[str]] = MappingProxyType(
    {"x86-64-v3": V2 | V3, "x86-64-v2": V2, "generic": frozenset()}
)
"""What a processor must be able to do, in LLVM's words, to run an object."""


def host() -> Processor:
    """Return the first of `SHIPPED` that this machine runs, or else this machine as it is."""
    own = exactly()
    able = {word[1:] for word in own.features.split(",") if word.startswith("+")}
    for one in SHIPPED:
        if one.runs_on(own.triple) and NEEDS[one.cpu] <= able:
            return one
    return own


def exactly() -> Processor:
    """Return the processor that this is run on, with all that it can do."""
    with suppress(RuntimeError):  # needed by the LLVM of some versions, refused by that of others
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    try:
        features = llvm.get_host_cpu_features().flatten()
    except RuntimeError:  # nothing is known beyond the name
        features = ""
    return Processor(llvm.get_process_triple(), llvm.get_host_cpu_name(), features)

"""Processors that an object is compiled for, and LLVM made ready for them."""

from __future__ import annotations

import hashlib
from contextlib import suppress
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

    def machine(self) -> Any:
        """Return LLVM's object for it."""
        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu, features=self.features, opt=2, reloc="pic", codemodel="default"
        )


def host() -> Processor:
    """Return the processor that this is run on."""
    with suppress(RuntimeError):  # needed by the LLVM of some versions, refused by that of others
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    try:
        features = llvm.get_host_cpu_features().flatten()
    except RuntimeError:  # nothing is known beyond the name
        features = ""
    return Processor(llvm.get_process_triple(), llvm.get_host_cpu_name(), features)

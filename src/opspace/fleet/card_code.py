"""The kernel of a fleet compiled for a graphics card, which need not be there."""

from __future__ import annotations

import re
import shutil
import subprocess
import sysconfig
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from opspace.errors import InputError
from opspace.fleet.cubin import Needs, needs_of
from opspace.fleet.fleet import Fleet
from opspace.fleet.warp_library import warp

SPILLS = re.compile(r"(\d+) bytes spill stores, (\d+) bytes spill loads")


@dataclass(frozen=True)
class CardCode:
    """What one robot of a fleet takes of a graphics card.

    Attributes:
        arch: The kind of card, as ``"sm_90"``.
        needs: Registers, local memory and instructions.
        workspace: Bytes of a workspace that a robot takes beside that.
        spills: Bytes that are written to memory and read from it again for want of registers, in all
            functions together; None where there is no ``ptxas``, NVIDIA's assembler, that is as new
            as what Warp compiles with.
        seconds: How long compiling took.
    """

    arch: str
    needs: Needs
    workspace: int
    spills: tuple[int, int] | None
    seconds: float


def card_code(fleet: Fleet, arch: str = "sm_90") -> CardCode:
    """Compile the kernel of a fleet for a kind of card.

    Args:
        fleet: The fleet, on any device.
        arch: The kind of card.

    Raises:
        InputError: Warp does not compile for it.
    """
    program, number = fleet.program_for("cuda"), _number(arch)
    module = program.kernel.module
    with tempfile.TemporaryDirectory() as place:
        start = perf_counter()
        compiled = _compiled(module, number, place, ptx=False)
        seconds = perf_counter() - start
        needs = needs_of(compiled.read_bytes())
        # Warp ends the text with a zero, which the assembler takes for more of it.
        text = _compiled(module, number, place, ptx=True).read_bytes().rstrip(b"\0")
        found = (_spills(assembler, arch, text, Path(place)) for assembler in _assemblers())
        spills = next((known for known in found if known is not None), None)
    workspace = 0 if program.workspace is None else program.memory
    return CardCode(arch, needs, workspace, spills, seconds)


def _number(arch: str) -> int:
    known = {f"sm_{number}": number for number in warp().get_cuda_supported_archs()}
    if arch not in known:
        raise InputError(f"Warp does not compile for {arch!r} (valid: {', '.join(known)})")
    return known[arch]


def _compiled(module: Any, number: int, place: str, *, ptx: bool) -> Path:
    (found,) = warp().compile_aot_module(module, arch=number, module_dir=place, use_ptx=ptx)
    return Path(found)


def _assemblers() -> list[str]:
    """Find ``ptxas`` in the package ``nvidia-cuda-nvcc`` and on the path."""
    packages = Path(sysconfig.get_path("purelib")) / "nvidia"
    on_path = shutil.which("ptxas")
    return [*map(str, sorted(packages.glob("*/bin/ptxas"))), *([on_path] if on_path else [])]


def _spills(assembler: str, arch: str, text: bytes, place: Path) -> tuple[int, int] | None:
    """Let an assembler tell what is spilled; None where it is too old to read the text."""
    source = place / "kernel.ptx"
    source.write_bytes(text)
    command = [assembler, "-v", f"-arch={arch}", str(source), "-o", str(place / "kernel.cubin")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None
    each = [(int(stored), int(loaded)) for stored, loaded in SPILLS.findall(done.stderr)]
    return sum(stored for stored, _ in each), sum(loaded for _, loaded in each)

"""Compile in a process of its own: this one needs no compiler, and keeps its memory free of it."""

from __future__ import annotations

import logging
import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from opspace.machine.freeze import Frozen
from opspace.machine.processor import Processor

log = logging.getLogger("opspace")

PROGRAM = """
import gc, os, pickle, sys
answer, frozen = os.dup(1), sys.stdin.buffer.read()
os.dup2(2, 1)  # whatever is printed on the way is no part of the object
sys.path[:] = {path!r}
from opspace.machine.translate import translate_only
translate_only()
from {module} import ENTRIES
from opspace.machine.compile_object import compile_objects
from opspace.machine.processor import Processor
with os.fdopen(answer, "wb") as answer:
    processors = [Processor(*one) for one in {processors!r}]
    pickle.dump(compile_objects(ENTRIES, processors, pickle.loads(frozen)), answer)
gc.freeze()  # the end of the process need not look through all that was made
"""


def compile_apart(
    module: str, processors: Sequence[Processor], frozen: Frozen | None = None
) -> list[bytes] | None:
    """Have another process compile, and wait for it.

    Args:
        module: Module with the ``ENTRIES``.
        processors: What for.
        frozen: Records that they are compiled for alone; None is any.

    Returns:
        The object for each, None where no other process can be started.
    """
    # An application with Python inside would be started a second time.
    own = Path(sys.executable or "").stem.lower().startswith("python")
    if not own or getattr(sys, "frozen", False):
        return None
    path = [entry for entry in sys.path if type(entry) is str]
    program = PROGRAM.format(path=path, module=module, processors=[*map(tuple, processors)])
    # How a user has numba treat functions of the user's own is nothing to kernels.
    environment = {k: x for k, x in os.environ.items() if not k.startswith("NUMBA_")}
    # It writes an error in colours about every overload that it tries and does not take.
    environment["NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"] = "1"
    try:
        done = subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            input=pickle.dumps(frozen),
            capture_output=True,
            check=True,
        )
    except OSError as error:
        log.debug("no process could be started to compile: %s", error)
    except subprocess.CalledProcessError as error:
        log.debug("compiling in another process failed:\n%s", error.stderr.decode(errors="replace"))
    else:
        return pickle.loads(done.stdout)
    return None

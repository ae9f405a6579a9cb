"""Compile in a process of its own, so that this one runs what every later start runs."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import config

log = logging.getLogger("opspace")

NESTED = "OPSPACE_COMPILES_APART"
"""Set in the environment of the process that compiles, which starts no other one."""

Calls = Callable[[], list[tuple[Any, tuple[Any, ...]]]]
"""Gives compiled functions, each with arguments of the types that it is compiled for."""


def compile_apart(calls: Calls) -> None:
    """Have another process compile functions and keep them on the disk; wait for it.

    A process that compiles links a function to copies of its parts that were optimised apart from
    it, one that reads from the disk to those compiled into it. Sums are taken in another order in
    the two, and results differ in their last bits: a run could not be repeated exactly by the next
    start. Where no other process can be started, nothing happens; the caller compiles by itself.

    Args:
        calls: A function that can be imported by its name.
    """
    # An application with Python inside would be started a second time, and again by that one.
    own = Path(sys.executable or "").stem.lower().startswith("python")
    if not own or getattr(sys, "frozen", False) or NESTED in os.environ:
        return
    environment = {**os.environ, NESTED: "1"}
    if directory := getattr(config, "CACHE_DIR", ""):  # it may have been set in this process
        environment["NUMBA_CACHE_DIR"] = directory
    program = (
        f"import sys; sys.path[:] = {[entry for entry in sys.path if type(entry) is str]!r}\n"
        f"from {calls.__module__} import {calls.__name__} as calls\n"
        "for compiled, arguments in calls():\n"
        "    compiled(*arguments)\n"
    )
    try:
        subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=True,
        )
    except OSError as error:
        log.debug("no process could be started to compile: %s", error)
    except subprocess.CalledProcessError as error:
        log.debug("compiling in another process failed:\n%s", error.stderr.decode(errors="replace"))

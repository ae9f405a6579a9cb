"""Runs of the command, in a process of its own: long runs without the checks of every array."""

import subprocess
import sys

from opspace.record import load


def run_by_command(name, out, *overrides):
    """The recording of ``opspace run``."""
    words = ["run", name, "--out", str(out), *(w for o in overrides for w in ("--set", o))]
    program = f"from opspace.cli import main; main({words!r})"
    subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)
    return load(out)

"""The command of opspace in a process that hears Ctrl-C, whoever started the tests."""

import subprocess
import sys

PROGRAM = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from opspace.cli import main; main()"
)


def started(*words, **options):
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *words], stdout=subprocess.PIPE, text=True, **options
    )

"""A Python of its own for a program, with the warnings that the suite was asked for."""

import os
import sys

WARNINGS = "OPSPACE_TEST_WARNINGS"


def ask_for(warnings):
    """Have every other Python treat warnings so, as pytest's own option -W says; None is errors."""
    if warnings:
        os.environ[WARNINGS] = warnings[-1]


def python(*words):
    """Return the command that runs Python with some words."""
    return [sys.executable, "-W", os.environ.get(WARNINGS, "error"), *words]

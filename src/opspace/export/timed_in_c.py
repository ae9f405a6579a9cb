"""Exported controllers for the benchmark, timed by a program in C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from opspace.bench.scenes import SCENES, Scene
from opspace.bench.timing import TimesItself
from opspace.errors import InputError, unknown_name
from opspace.export.c_library import export_c

NAMES = {False: "in C", True: "in C, own kernels"}
"""What the subjects are called, by whether the kernels are compiled for them alone."""

DRIVE = """
#include <time.h>
#include "controller.h"

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e6 * (double)time.tv_sec + 1e-3 * (double)time.tv_nsec;
}

/* Step through states again and again; write how long each step takes, us. */
void drive(const double *q, const double *v, int states, int count, double *durations)
{
    static opspace *c;
    double tau[CONTROLLER_N];
    c = c ? c : opspace_open(&controller);
    for (int i = 0; i < count; i++) {
        double start = now();
        opspace_step(c, 0.0, q + i % states * CONTROLLER_NQ, v + i % states * CONTROLLER_N, tau);
        durations[i] = now() - start;
    }
}
"""


def check_in_c(names: Iterable[str]) -> None:
    """Check that scenes can be timed in C.

    Raises:
        InputError: There is no C compiler; a scene has transitions on their way, or forces.
        UnknownNameError: There is no such scene.
    """
    if shutil.which("cc") is None:
        raise InputError("a benchmark in C needs a C compiler (cc)")
    valid = [name for name, one in SCENES.items() if not one.transitions and one.pressed is None]
    for name in names:
        if name not in SCENES:
            raise unknown_name("scene", name, SCENES)
        if name not in valid:
            raise unknown_name("scene that is timed in C", name, valid)


def timed_in_c(scene: Scene) -> dict[str, TimesItself]:
    """Export the controller of a scene and compile it, with the kernels of all and with its own.

    Args:
        scene: One that `check_in_c` lets pass; it holds what it finds at its first state.
    """
    return {name: _built(scene, own) for own, name in NAMES.items()}


def _built(scene: Scene, own_kernels: bool) -> TimesItself:
    controller = scene.controller()
    q, v = scene.states(controller.robot)
    controller.step(0.0, q[0], v[0])
    with tempfile.TemporaryDirectory() as directory:
        folder = export_c(controller, Path(directory) / "c", moves=0, own_kernels=own_kernels)
        (folder / "drive.c").write_text(DRIVE, encoding="utf-8")
        sources = sorted(path.name for path in folder.glob("*.c"))
        words = ("cc", "-O2", "-shared", "-fPIC", *sources, "opspace_kernels.o", "-lm")
        subprocess.run([*words, "-o", "drive.so"], cwd=folder, check=True, capture_output=True)
        library = ctypes.CDLL(str(folder / "drive.so"))  # stays when its file goes

    def timed(q: np.ndarray, v: np.ndarray, durations: np.ndarray) -> None:
        arrays = [ctypes.c_void_p(x.ctypes.data) for x in (q, v, durations)]
        library.drive(*arrays[:2], len(q), durations.size, arrays[2])

    return TimesItself(timed)

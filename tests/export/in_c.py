"""An exported controller, built and called from here."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from opspace.export.c_library import export_c

CC = shutil.which("cc")
with_cc = pytest.mark.skipif(CC is None, reason="no C compiler is installed (cc)")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror")


def compiled(directory, *sources, out, options=()):
    library = sorted(path.name for path in directory.glob("opspace*.c"))
    words = (*STRICT, *options, *sources, *library, "opspace_kernels.o", "-lm", "-o", out)
    subprocess.run([CC, *words], cwd=directory, check=True)
    return directory / out


class InC:
    """The exported controller, called from here."""

    def __init__(self, directory, controller, **options):
        export_c(controller, directory, **options)
        path = compiled(
            directory, "controller.c", out="controller.so", options=("-shared", "-fPIC")
        )
        self.n, self.library = controller.robot.nv, ctypes.CDLL(str(path))
        self.library.opspace_open.restype = ctypes.c_void_p
        self.library.opspace_step.restype = ctypes.c_int64
        self.library.opspace_read.restype = ctypes.c_void_p
        model = ctypes.byref(ctypes.c_char.in_dll(self.library, "controller"))
        self.own = ctypes.c_void_p(self.library.opspace_open(model))
        assert self.own

    def step(self, t, q, v):
        tau = np.full(self.n, np.nan)
        status = self.library.opspace_step(self.own, ctypes.c_double(t), *map(pointer, (q, v, tau)))
        return status, tau

    def set(self, what, task, *given):
        i = self.library.opspace_find_task(self.own, task.name.encode())
        return self._call(f"set_{what}", i, *given)

    def restart(self):
        self._call("restart")

    def move(self, task, level, t, duration):
        return self._call("move", self._task(task), float(level), t, duration)

    def swap(self, first, second, t, duration):
        return self._call("swap", self._task(first), self._task(second), t, duration)

    def touch(self, contact, present, duration, *, wait=True):
        i = self.library.opspace_find_contact(self.own, contact.name.encode())
        return self._call("set_contact", i, present, duration, int(wait))

    def contact_row(self, contact):
        i = self.library.opspace_find_contact(self.own, contact.name.encode())
        return self._call("contact_row", i)

    def _task(self, task):
        return self.library.opspace_find_task(self.own, task.name.encode())

    def _call(self, name, *given):
        words = [x if isinstance(x, int) else number_or_pointer(x) for x in given]
        return getattr(self.library, f"opspace_{name}")(self.own, *words)

    def read(self, name):
        found = self._numbers(name)
        return None if found is None else np.array(found)

    def write(self, name, x):
        """Write where no program may."""
        found = self._numbers(name)
        for i in range(len(found)):
            found[i] = x

    def _numbers(self, name):
        count = ctypes.c_int64()
        found = self.library.opspace_read(self.own, name.encode(), ctypes.byref(count))
        return None if found is None else (ctypes.c_double * count.value).from_address(found)


def pointer(array):
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)


def number_or_pointer(x):
    if x is None:
        return None
    return ctypes.c_double(x) if isinstance(x, float) else pointer(x)

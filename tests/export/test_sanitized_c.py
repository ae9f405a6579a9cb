"""The library in C reads and writes its own memory only, and calls nothing but C's own libraries."""

import shutil
import subprocess

import pytest

import opspace as osc
from tests.export.in_c import CC, STRICT, with_cc
from tests.export.test_moves_in_c import four
from tests.export.test_own_kernels import on_ways
from tests.export.test_standing_in_c import standing

PROGRAM = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "controller.h"

enum { STEPS = 3000 };
static unsigned seed = 1;

static int one_of(int count)
{
    seed = 1664525u * seed + 1013904223u;
    return (int)((seed >> 8) % (unsigned)count);
}

/* Sends a task somewhere, with a velocity or without. */
static void aim(opspace *c, const opspace_task *one, int task)
{
    double x[12 + CONTROLLER_N] = {0.0}, velocity[6 + CONTROLLER_N] = {0.0};
    for (int i = 0; i < one->position + one->joints; i++)
        x[i] = 1e-2 * one_of(50);
    for (int i = 0; i < one->orientation; i += 4)
        x[one->position + i] = 1.0;
    velocity[0] = 1e-2 * one_of(2);
    opspace_set_target(c, task, x, one_of(2) ? velocity : NULL, NULL);
}

/* Asks for anything that a program may ask for. */
static void ask(opspace *c, double t)
{
    const opspace_model *m = &controller;
    double level = m->level[one_of(m->levels)], duration = 0.01 * one_of(5);
    double start = t + 0.005 * (one_of(7) - 3);
    int first = one_of(m->tasks), second = one_of(m->tasks);
    switch (one_of(5)) {
    case 0:
        opspace_move(c, first, level, start, duration);
        break;
    case 1:
        opspace_swap(c, first, second, start, duration);
        break;
    case 2:
        opspace_set_presence(c, first, one_of(2), start, duration);
        break;
    case 3:
        aim(c, &m->task[first], first);
        break;
    default:
        opspace_set_contact(c, one_of(m->contacts + 1), one_of(2), duration, one_of(2));
    }
}

int main(void)
{
    const double rest[CONTROLLER_NQ] = {REST};
    double q[CONTROLLER_NQ], v[CONTROLLER_N], tau[CONTROLLER_N], sum = 0.0;
    for (int k = 0; k < 3; k++) {
        opspace *c = opspace_open(&controller);
        if (!c)
            return EXIT_FAILURE;
        for (int i = 0; i < STEPS; i++) {
            double t = 1e-3 * i;
            for (int a = 0; a < CONTROLLER_NQ; a++)
                q[a] = rest[a] + 1e-3 * one_of(10);
            for (int a = 0; a < CONTROLLER_N; a++)
                v[a] = 1e-2 * (one_of(10) - 5);
            while (one_of(3))
                ask(c, t);
            if (one_of(500) == 0)
                opspace_restart(c);
            if (opspace_step(c, t, q, v, tau) < 0)
                return EXIT_FAILURE;
            sum += tau[CONTROLLER_N - 1];
        }
        opspace_close(c);
    }
    opspace_close(NULL);
    printf("%d\\n", sum == sum);
    return EXIT_SUCCESS;
}
"""
BUILDS = {
    "arm": lambda: four()[0],
    "arm on ways": lambda: on_ways("puma560"),
    "quadruped": lambda: standing("solo12")[0],
}


def built(folder, name, *options):
    controller = BUILDS[name]()
    osc.export_c(controller, folder, moves=3)
    rest = ", ".join(map(repr, controller.robot.q_reference.tolist()))
    (folder / "main.c").write_text(PROGRAM.replace("REST", rest))
    library = sorted(path.name for path in folder.glob("*.c"))
    words = (*STRICT, *options, *library, "opspace_kernels.o", "-lm", "-o", "program")
    subprocess.run([CC, *words], cwd=folder, check=True)
    return folder / "program"


@with_cc
@pytest.mark.slow
@pytest.mark.parametrize("name", BUILDS)
def test_sanitizers_find_nothing(name, tmp_path):
    flags = ("-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    program = built(tmp_path, name, *flags)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "1\n"), done.stderr[-2000:]


@with_cc
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_valgrind_finds_nothing(tmp_path):
    program = built(tmp_path, "arm", "-g", "-O1")
    words = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", program]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "1\n"), done.stderr[-2000:]


@with_cc
@pytest.mark.skipif(shutil.which("readelf") is None, reason="readelf is not installed")
def test_nothing_is_needed_but_the_libraries_of_c(tmp_path):
    program = built(tmp_path, "arm", "-O1")
    words = ["readelf", "--dynamic", program]
    told = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    needed = {line.split("[")[1].rstrip("]") for line in told.splitlines() if "NEEDED" in line}
    assert needed <= {"libc.so.6", "libm.so.6"}

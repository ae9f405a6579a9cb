"""A program in C computes what the controller computes, to the last bit."""

import ctypes
import os
import re
import shutil
import subprocess

import numpy as np
import pytest

import opspace as osc
from opspace.export.c_library import export_c
from opspace.plan.entries import KERNELS
from opspace.plan.image import image
from opspace.stack import Blending
from tests.controller.test_uneven_motors import uneven
from tests.docs.pages import DOCS, commands_of
from tests.docs.test_pages import programs_of, run_blocks
from tests.export.in_c import CC, STRICT, InC, compiled, with_cc

PROGRAM = """
#include <stdio.h>
#include <stdlib.h>
#include "controller.h"

/* Reads t, q and v again and again, and writes the status and the torque of each. */
int main(void)
{
    enum { NUMBERS = 1 + CONTROLLER_NQ + CONTROLLER_N };
    double given[NUMBERS], tau[1 + CONTROLLER_N];
    opspace *c = opspace_open(&controller);
    if (!c)
        return EXIT_FAILURE;
    while (fread(given, sizeof *given, NUMBERS, stdin) == NUMBERS) {
        const double *q = given + 1, *v = q + CONTROLLER_NQ;
        tau[0] = (double)opspace_step(c, given[0], q, v, tau + 1);
        fwrite(tau, sizeof *tau, 1 + CONTROLLER_N, stdout);
    }
    opspace_close(c);
    return EXIT_SUCCESS;
}
"""


def start(name="puma560", later=False, **options):
    """A controller with a task for the hand, one for how it is turned, and a posture."""
    robot = osc.load_robot(name)
    tool = robot.frame_id(robot.tool)
    robot.update(robot.q_reference, np.zeros(robot.nv))
    hand = osc.PositionTask(target=robot.position(tool) + 0.05)
    turn = osc.OrientationTask(target=robot.rotation(tool).copy())
    posture = osc.PostureTask(target=robot.q_reference)
    stack = osc.Stack([hand, turn] if later else [hand, turn, posture], limits=osc.JointLimits())
    return osc.Controller(robot, stack, period=1e-3, **options), (hand, turn, posture)


def states(robot, count, spread, seed=0):
    rng = np.random.default_rng(seed)
    q = robot.q_reference + spread * rng.normal(size=(count, robot.nq))
    v = spread * rng.normal(size=(count, robot.nv))
    return 1e-3 * np.arange(count), q, v


@with_cc
@pytest.mark.parametrize("name", ["puma560", "ur5", "panda"])
def test_a_program_gives_the_same_bits_in_random_states(name, tmp_path):
    controller, _ = start(name, torque_limits="priority")
    export_c(controller, tmp_path)
    (tmp_path / "main.c").write_text(PROGRAM)
    program = compiled(tmp_path, "main.c", "controller.c", out="program")
    T, Q, V = states(controller.robot, 200, 0.5)
    given = np.column_stack([T, Q, V])
    done = subprocess.run([program], input=given.tobytes(), capture_output=True, check=True)
    found = np.frombuffer(done.stdout).reshape(len(T), -1)
    commands = [controller.step(*state) for state in zip(T.tolist(), Q, V, strict=True)]
    np.testing.assert_array_equal(found[:, 1:], [command.tau for command in commands])
    np.testing.assert_array_equal(found[:, 0], [int(command.status) for command in commands])
    seen = {int(command.status) for command in commands}
    assert len(seen) > 2, "the states should show more than ordinary ticks"


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@with_cc
def test_what_is_asked_for_while_it_runs_gives_the_same_bits(tmp_path):
    controller, (hand, turn, posture) = start(gravity="robot")
    stack, other = controller.stack, InC(tmp_path, controller)
    goal, R = hand._target.goal + 0.1, turned(2.0) @ turn._target.goal
    bent = controller.robot.q_reference + 0.3
    gains = np.array([50.0, 60.0, 70.0]), np.array([10.0, 11.0, 12.0])
    statuses = set()
    T, Q, V = states(controller.robot, 160, 0.05)
    for k, (t, q, v) in enumerate(zip(T.tolist(), Q, V, strict=True)):
        if k == 20:
            hand.target, turn.target = goal, R
            assert other.set("target", hand, goal, None, None) == 0
            assert other.set("target", turn, turn._target.goal, None, None) == 0  # a bit rounder
        if k in (40, 47):
            stack.remove(posture, duration=0.02)
            assert other.set("presence", posture, 0, t, 0.02) == 0
        if k == 55:  # on its way out
            stack.insert(posture, level=2, duration=0.015)
            assert other.set("presence", posture, 1, t, 0.015) == 0
        if k == 80:
            posture.target = bent
            assert other.set("target", posture, bent, None, None) == 0
        if k == 100:
            hand.kp, hand.kv = gains
            assert other.set("gains", hand, *gains) == 0
        if k == 120:
            hand.activation = lambda robot, t: 0.25
            assert other.set("activation", hand, 0.25) == 0
        command = controller.step(t, q, v)
        status, tau = other.step(t, q, v)
        np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        np.testing.assert_array_equal(
            other.read("h"), [command.tasks[one.name].activation for one in (hand, turn, posture)]
        )
        statuses.add(status)
    assert other.read("nothing") is None
    assert other.read("kind") is None, "whole numbers are not doubles"


def pressing():
    """A controller that presses, gives way with a spring, and is told what it touches."""
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(robot.nv))
    press = osc.ForceTask(force=-8.0, axes_frame="world", name="press")
    press.activation = osc.Contact(press)
    spring = osc.ImpedanceTask(target=robot.position(robot.frame_id(robot.tool)) - 0.01)
    stack = osc.Stack([press, spring, osc.PostureTask(robot.q_reference)])
    return osc.Controller(robot, stack, period=1e-3), press


@with_cc
def test_a_program_that_presses_gives_the_same_bits(tmp_path):
    controller, press = pressing()
    ours = InC(tmp_path, controller)
    T, Q, V = states(controller.robot, 60, 0.1)
    wrench, down = np.array([0.3, 0.1, 0.0, 0.0, 0.02, 0.0]), np.array([-12.0])
    assert ours.step(0.0, Q[0], V[0])[0] == -4
    assert ours.set("wrench", press, 0.0, np.full(6, np.nan)) == -3
    assert ours.set("wrench", controller.stack.members[2].task, 0.0, wrench) == -3
    assert ours.set("force", press, np.array([0.0])) == -3
    assert ours.set("gains", press, np.zeros(1), np.array([1.0])) == -3
    assert ours.set("target", press, wrench, None, None) == -3
    for k, (t, q, v) in enumerate(zip(T.tolist(), Q, V, strict=True)):
        wrench[2] = -0.3 * k
        given = None if 30 <= k < 45 else wrench.copy()
        if given is not None:
            assert ours.set("wrench", press, t, given) == 0
        if k == 20:
            press.force = -12.0
            assert ours.set("force", press, down) == 0
        command = controller.step(t, q, v, wrenches={controller.robot.tool: given})
        status, tau = ours.step(t, q, v)
        assert status == int(command.status)
        np.testing.assert_array_equal(tau, command.tau)
    assert press.touch.confidence > 0.5


@with_cc
def test_a_task_that_is_absent_at_first_comes_as_in_a_stack(tmp_path):
    complete, (*_, posture) = start()
    other = InC(tmp_path, complete, absent=[posture.name])
    controller, (*_, guest) = start(later=True)
    T, Q, V = states(controller.robot, 60, 0.05)
    for k, (t, q, v) in enumerate(zip(T.tolist(), Q, V, strict=True)):
        if k == 20:
            controller.stack.insert(guest, level=2, duration=0.02)
            assert other.set("presence", posture, 1, t, 0.02) == 0
        command, (status, tau) = controller.step(t, q, v), other.step(t, q, v)
        assert status == command.status
        if k <= 20:
            np.testing.assert_allclose(tau, command.tau, rtol=1e-9, atol=1e-9)
        else:
            np.testing.assert_array_equal(tau, command.tau)


@with_cc
def test_what_cannot_be_used_is_refused_and_changes_nothing(tmp_path):
    controller, (hand, turn, posture) = start()
    other = InC(tmp_path, controller)
    t, q, v = 0.0, controller.robot.q_reference.copy(), np.zeros(controller.robot.nv)
    first = controller.step(t, q, v)
    bad, none = np.array([1.0, np.nan, 0.0] * 3), osc.PositionTask(name="nobody")
    refused, no_task, not_finite = -3, -2, -1
    assert other.set("target", hand, bad, None, None) == refused
    assert other.set("target", turn, np.ones(9), None, None) == refused
    assert other.set("target", turn, -np.eye(3), None, None) == refused
    assert other.set("target", hand, np.zeros(3), bad, None) == refused
    assert other.set("target", none, bad, None, None) == no_task
    assert other.set("gains", hand, -np.ones(3), np.ones(3)) == refused
    assert other.set("activation", hand, 1.5) == refused
    assert other.set("presence", posture, 0, t, -1.0) == refused
    assert other.set("presence", posture, 0, float("nan"), 1.0) == refused
    status, tau = other.step(t, np.full_like(q, np.nan), v)
    assert (status, np.isnan(tau).all()) == (not_finite, True), "the torque is as it was"
    status, tau = other.step(t, q, v)
    assert status == first.status
    np.testing.assert_array_equal(tau, first.tau)
    assert osc.Status(other.step(t + 0.1, q, v)[0]) & osc.Status.TIME_JUMP
    other.restart()
    assert other.step(t, q, v)[0] == first.status


ASKERS = """
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include "controller.h"

enum { WISHES = 2000 };
static const int tasks[] = {CONTROLLER_TASK_position, CONTROLLER_TASK_joint1};
static opspace *c;
static int going = 2, strange;

/* Moves a target again and again, ever further; whoever finds no room tries again. */
static void *ask(void *which)
{
    for (int k = 1; k <= WISHES; k++) {
        double x[3] = {1e-5 * k, 1e-5 * k, 1e-5 * k};
        int answer;
        do
            answer = opspace_set_target(c, *(const int *)which, x, NULL, NULL);
        while (answer == OPSPACE_BUSY);
        if (answer)
            __atomic_fetch_add(&strange, 1, __ATOMIC_RELAXED);
    }
    __atomic_fetch_sub(&going, 1, __ATOMIC_RELEASE);
    return NULL;
}

int main(void)
{
    double q[CONTROLLER_NQ] = {0.0, 1.0, -2.9, 0.0, -1.2, 0.0}, v[CONTROLLER_N] = {0.0};
    double tau[CONTROLLER_N];
    pthread_t askers[2];
    int steps = 0, there = 1;
    c = opspace_open(&controller);
    if (!c)
        return EXIT_FAILURE;
    for (int i = 0; i < 2; i++)
        pthread_create(&askers[i], NULL, ask, (void *)&tasks[i]);
    while (there) {
        there = __atomic_load_n(&going, __ATOMIC_ACQUIRE);
        if (opspace_step(c, 1e-3 * steps++, q, v, tau) < 0)
            strange++;
    }
    for (int i = 0; i < 2; i++)
        pthread_join(askers[i], NULL);
    for (int i = 0; i < 2; i++) /* what was still on its way; a step reads every letter there is */
        opspace_step(c, 1e-3 * steps++, q, v, tau);
    const double *error = opspace_read(c, "error", NULL);
    printf("%d %.17g %.17g\\n", strange, error[controller.task[tasks[0]].first_row],
        error[controller.task[tasks[1]].first_row]);
    opspace_close(c);
    return EXIT_SUCCESS;
}
"""


@with_cc
@pytest.mark.parametrize("fast", [10.0, 1e152, 1e160])
def test_motors_that_give_more_one_way_and_brakes_give_the_same_bits(fast, tmp_path):
    robot = uneven(-0.3, 1.5)
    robot.update(robot.q_reference, np.zeros(7))
    hand = osc.PositionTask(target=robot.position(robot.tool) + 0.05)
    stack = osc.Stack([osc.JointLimits(), hand, osc.PostureTask(target=robot.q_reference)])
    controller = osc.Controller(robot, stack, torque_limits="priority", period=1e-3)
    c = InC(tmp_path, controller)
    least, most = robot.torque_range
    for k, v in enumerate([np.zeros(7), fast * np.array([1.0, -1.0] * 3 + [1.0])]):
        command = controller.step(1e-3 * k, robot.q_reference, v)
        status, tau = c.step(1e-3 * k, robot.q_reference, v)
        np.testing.assert_array_equal(tau, command.tau)
        assert status == command.status
        assert np.all((least - 1e-9 <= tau) & (tau <= most + 1e-9))
    assert (osc.Status.FAULT in command.status) == (fast > 1e3)


CMAKE = """
cmake_minimum_required(VERSION 3.13)
project(robot LANGUAGES C)
add_subdirectory(arm)
add_executable(program main.c)
target_link_libraries(program opspace::controller)
"""


@with_cc
@pytest.mark.skipif(shutil.which("cmake") is None, reason="cmake is not installed")
def test_a_project_of_cmake_takes_it_in_as_a_folder(tmp_path):
    controller, _ = start()
    export_c(controller, tmp_path / "arm")
    (tmp_path / "main.c").write_text(PROGRAM)
    (tmp_path / "CMakeLists.txt").write_text(CMAKE)
    build = tmp_path / "build"
    for words in (["-S", tmp_path, "-B", build], ["--build", build]):
        subprocess.run(["cmake", *words], check=True, capture_output=True)
    T, Q, V = states(controller.robot, 5, 0.1)
    given = np.column_stack([T, Q, V])
    done = subprocess.run(
        [build / "program"], input=given.tobytes(), capture_output=True, check=True
    )
    found = np.frombuffer(done.stdout).reshape(len(T), -1)
    commands = [controller.step(*state) for state in zip(T.tolist(), Q, V, strict=True)]
    np.testing.assert_array_equal(found[:, 1:], [command.tau for command in commands])


@with_cc
def test_threads_ask_while_another_steps_and_nothing_is_lost_or_waited_for(tmp_path):
    robot = osc.load_robot("puma560")
    hand = osc.PositionTask(target=[0.3, 0.1, 0.9])
    stack = osc.Stack(
        [hand, osc.JointTask("joint1", target=0.0), osc.PostureTask(0.0 * robot.q_reference)]
    )
    controller = osc.Controller(robot, stack, period=1e-3)
    export_c(controller, tmp_path)
    (tmp_path / "main.c").write_text(ASKERS)
    program = compiled(tmp_path, "main.c", "controller.c", out="program", options=("-pthread",))
    told = subprocess.run([program], capture_output=True, check=True, text=True).stdout.split()
    assert told[0] == "0"
    hand.target = np.full(3, 2000 * 1e-5)
    stack["joint1"].target = 2000 * 1e-5
    q = np.array([0.0, 1.0, -2.9, 0.0, -1.2, 0.0])
    command = controller.step(0.0, q, np.zeros(6))
    assert float(told[1]) == command.tasks["position"].error[0]
    assert float(told[2]) == command.tasks["joint1"].error[0]


@with_cc
def test_more_wishes_than_there_is_room_for_are_refused_and_none_is_lost(tmp_path):
    controller, (hand, _, _) = start()
    c = InC(tmp_path, controller)
    q, v = controller.robot.q_reference, np.zeros(6)
    goals = [hand.target + 1e-3 * k for k in range(70)]
    answers = [c.set("target", hand, goal, None, None) for goal in goals]
    assert answers == [0] * 64 + [-5] * 6
    c.step(0.0, q, v)
    controller.robot.update(q, v)
    at = controller.robot.position(controller.robot.tool)
    np.testing.assert_allclose(c.read("error")[:3], goals[63] - at, atol=1e-12)
    assert c.set("target", hand, goals[69], None, None) == 0
    c.step(1e-3, q, v)
    np.testing.assert_allclose(c.read("error")[:3], goals[69] - at, atol=1e-12)


@with_cc
def test_the_page_of_the_library_is_right(tmp_path):
    page = DOCS / "how-to" / "c-library.md"
    done = run_blocks(programs_of(page), tmp_path)
    assert done.returncode == 0, done.stderr
    (line,) = (one for one in commands_of(page) if one.startswith("cc ") and "main.c" in one)
    words = [CC, *STRICT, *line.split()[1:]]
    subprocess.run(" ".join(words), cwd=tmp_path, check=True, shell=True)
    done = subprocess.run([tmp_path / "hold"], capture_output=True, text=True, check=True)
    assert done.stdout == "guest: 1\n"


FRANKA = """
#pragma once
#include <array>
#include <functional>
#include <string>
namespace franka {
struct Duration { double toSec() const { return 0.0; } };
struct RobotState {
    std::array<double, 7> q, dq, tau_J_d;
    Duration time;
};
struct Torques {
    Torques(const std::array<double, 7> &tau) : tau_J(tau) {}
    std::array<double, 7> tau_J;
};
inline Torques MotionFinished(Torques last) { return last; }
constexpr double kMaxCutoffFrequency = 1000.0;
struct Robot {
    Robot(const std::string &) {}
    void control(std::function<Torques(const RobotState &, Duration)>, bool, double) {}
};
}
"""


@with_cc
@pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler is installed (c++)")
def test_the_callback_of_the_page_is_a_program(tmp_path):
    """Against a stand-in of libfranka, whose names are those of the real one."""
    controller, _ = start()
    export_c(controller, tmp_path / "arm")
    (tmp_path / "include" / "franka").mkdir(parents=True)
    (tmp_path / "include" / "franka" / "robot.h").write_text(FRANKA)
    (tmp_path / "libfranka.a").write_bytes(b"!<arch>\n")  # everything is in the header
    page = DOCS / "how-to" / "c-library.md"
    program = (
        page.read_text(encoding="utf-8").split('```cpp title="franka.cpp"\n')[1].split("```")[0]
    )
    (tmp_path / "franka.cpp").write_text(program)
    places = {"CPLUS_INCLUDE_PATH": str(tmp_path / "include"), "LIBRARY_PATH": str(tmp_path)}
    for line in commands_of(page):
        if line.startswith("c++ ") or line.startswith("cc -O2 -c "):
            words = line.replace(" -I", " -Wall -Wextra -Werror -I", 1)
            environment = {**os.environ, **places}
            subprocess.run(words, cwd=tmp_path, check=True, shell=True, env=environment)
    subprocess.run([tmp_path / "franka"], check=True)


@with_cc
@pytest.mark.parametrize("older", ["kernels", "structure"])
def test_kernels_and_structures_of_another_version_are_not_used(older, tmp_path):
    controller, _ = start()
    export_c(controller, tmp_path)
    source = tmp_path / "controller.c"
    stamp = re.search(r'"(\w+)-(\w+)"', source.read_text())
    assert stamp is not None
    assert stamp[1] == KERNELS.stamp
    part = stamp[1 if older == "kernels" else 2]
    source.write_text(source.read_text().replace(part, part[::-1]))
    (tmp_path / "main.c").write_text(PROGRAM)
    program = compiled(tmp_path, "main.c", "controller.c", out="program")
    assert subprocess.run([program], stdin=subprocess.DEVNULL, check=False).returncode == 1


def changed(**options):
    return lambda: start(**options)[0]


def with_task(task, **options):
    def build():
        robot = osc.load_robot("puma560")
        return osc.Controller(robot, osc.Stack([task]), **options)

    return build


def on_its_way():
    controller, (*_, posture) = start()
    controller.stack.remove(posture, duration=1.0, start_time=5.0)
    return controller


X = (0.5, 0.1, 0.6)


def own_activation():
    task = osc.PositionTask(target=X)
    task.activation = lambda robot, t: 1.0
    return task


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (changed(on_time_jump="hold"), "on_time_jump"),
        (on_its_way, "a request that waits"),
        (changed(blending=type("Mine", (Blending,), {})("chain")), "the blending Mine"),
        (with_task(osc.PositionTask(name="hand")), "'hand' will hold"),
        (
            with_task(osc.PositionTask(target=osc.MinimumJerk(X, np.add(X, 0.1), 1.0))),
            "reference in time",
        ),
        (with_task(own_activation()), "activation"),
    ],
)
def test_what_only_python_can_do_is_refused_by_name(build, said, tmp_path):
    with pytest.raises(osc.InputError, match=said):
        export_c(build(), tmp_path)
    assert not list(tmp_path.iterdir())


def test_names_are_checked(tmp_path):
    controller, _ = start()
    with pytest.raises(osc.UnknownNameError, match="hnad"):
        export_c(controller, tmp_path, absent=["hnad"])
    with pytest.raises(osc.InputError, match="no name for a model in C"):
        export_c(controller, tmp_path, "two words")
    with pytest.raises(osc.UnknownNameError, match="quartic"):
        export_c(controller, tmp_path, profile="quartic")
    export_c(controller, tmp_path)
    with pytest.raises(osc.InputError, match="already exists"):
        export_c(controller, tmp_path)


def test_an_image_leads_where_the_handle_leads():
    controller, _ = start()
    controller.warm_up()
    controller.step(0.0, controller.robot.q_reference, np.zeros(controller.robot.nv))
    handle = controller._plan.handle
    found = image(handle)
    words = found.words.copy()
    words[found.addresses] = words[found.addresses] * 8 + words.ctypes.data

    def same(one, address):
        place = address
        for name, field in one.fields.items():
            (first,) = np.frombuffer((ctypes.c_uint64 * 1).from_address(place), np.uint64)
            if not isinstance(field, np.ndarray):
                same(field, int(first))
                place += 8
                continue
            place += 8 * (1 + field.ndim)
            if field.size:
                assert words.ctypes.data <= first < words.ctypes.data + words.nbytes
                kept = (ctypes.c_char * field.nbytes).from_address(int(first))
                assert bytes(kept) == field.tobytes(), name

    same(handle, words.ctypes.data + 8 * found.handle)

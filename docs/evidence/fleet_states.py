"""A million states of a fleet: is every torque a number, and how far is single precision from double?

A quarter each is drawn at random in the joints' ranges; with joints turned to multiples of a right
angle, where arms are singular, some of them by a hair beside; with joints at their limits or past
them, many moving further out; and with both. Prints the table of docs/how-to/fleet.md.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

import opspace as osc

KINDS = ("anywhere", "right angles", "at limits", "right angles at limits")
BLOCK = 25_000
SPEED = 2.0
"""Largest speed of a joint, rad/s."""


def states(robot: osc.Robot, kind: str, count: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Draw configurations and velocities of a kind, in single precision, which both forms can hold."""
    low, high = np.maximum(robot.q_lower, -np.pi), np.minimum(robot.q_upper, np.pi)
    shape = (count, robot.nv)
    q, v = rng.uniform(low, high, shape), rng.uniform(-SPEED, SPEED, shape)
    if "right angles" in kind:
        beside = rng.choice([0.0, 1e-7, 1e-4, 1e-2], shape) * rng.choice([-1.0, 1.0], shape)
        turned = np.round(q / (np.pi / 2)) * (np.pi / 2) + beside
        q = np.where(rng.random(shape) < 0.7, turned, q)
    if "at limits" in kind:
        upper = rng.random(shape) < 0.5
        past = rng.choice([0.0, 1e-6, 0.02], shape)
        there = rng.random(shape) < 0.5
        q = np.where(there, np.where(upper, high + past, low - past), q)
        v = np.where(there & (rng.random(shape) < 0.7), np.abs(v) * np.where(upper, 1, -1), v)
    v[rng.random(count) < 0.1] = 0.0
    return [q.astype(np.float32), v.astype(np.float32)]


def tau_of(fleet: osc.Fleet, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Compute the torques of states that no robot has come to from others."""
    fleet.reset()
    dtype = np.dtype(fleet.dtype)
    return fleet.step(0.0, q.astype(dtype), v.astype(dtype)).numpy().astype(float)


def measured(name: str, count: int, seed: int) -> Iterator[tuple[str, np.ndarray, np.ndarray, int]]:
    """Give kind, difference over largest torque, status, and torques that are no numbers."""
    robot = osc.load_robot(name)
    robot.update(robot.q_reference, np.zeros(robot.nv))
    stack = osc.Stack(
        [
            osc.JointLimits(),
            osc.PositionTask(target=robot.position(robot.frame_id(robot.tool)), name="hand"),
            osc.OrientationTask(target=robot.rotation(robot.frame_id(robot.tool)), name="turn"),
            osc.PostureTask(target=robot.q_reference),
        ]
    )
    block = min(BLOCK, count)
    double, single = (
        osc.Fleet(robot, stack, block, device="cpu", dtype=dtype, torque_limits="priority")
        for dtype in ("float64", "float32")
    )
    rng = np.random.default_rng(seed)
    for _ in range(max(1, count // (len(KINDS) * block))):
        for kind in KINDS:
            q, v = states(robot, kind, block, rng)
            want, tau = tau_of(double, q, v), tau_of(single, q, v)
            wrong = int((~np.isfinite(want)).sum() + (~np.isfinite(tau)).sum())
            error = np.abs(tau - want).max(axis=1) / np.abs(want).max(axis=1)
            yield kind, error, double.status.numpy().copy(), wrong


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="panda")
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    errors, lost, wrong = defaultdict(list), defaultdict(list), 0
    for kind, error, status, none in measured(given.robot, given.count, given.seed):
        errors[kind].append(error)
        lost[kind].append(status & int(osc.Status.LIMIT_LOST) != 0)
        wrong += none
    print(
        f"{given.robot}, {sum(e.size for some in errors.values() for e in some)} states,", end=" "
    )
    print(f"torques that are no numbers: {wrong}")
    print("| states | of which | median | 99 % | 99.9 % | worst |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind in KINDS:
        error, gone = np.concatenate(errors[kind]), np.concatenate(lost[kind])
        for name, some in (("all bounds kept", error[~gone]), ("LIMIT_LOST", error[gone])):
            if some.size:
                parts = " | ".join(f"{np.quantile(some, x):.1e}" for x in (0.5, 0.99, 0.999, 1.0))
                print(f"| {kind} | {some.size / error.size:.0%} {name} | {parts} |")


if __name__ == "__main__":
    main()

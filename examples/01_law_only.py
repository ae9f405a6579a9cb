"""The law without any robot: two tasks that want the same joint, and one that fades."""

import numpy as np

import opspace as osc

M = np.diag([2.0, 1.0, 0.5])  # inertia of three joints
first = np.array([[1.0, 1.0, 0.0]])  # wants the sum of joints 1 and 2
second = np.array([[0.0, 1.0, 1.0]])  # wants the sum of joints 2 and 3

for h in (0.0, 0.5, 1.0):
    tasks = [
        osc.TaskSet(first, [1.0], priority=0, activation=h),
        osc.TaskSet(second, [2.0], priority=1),
    ]
    tau = osc.task_torque(M, tasks)
    got = np.linalg.solve(M, tau)
    wanted = (first @ got)[0], (second @ got)[0]
    print(f"activation {h:.1f}: torque {tau.round(3)}, tasks get {np.round(wanted, 3)}")

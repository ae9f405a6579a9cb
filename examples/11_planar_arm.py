"""A planar arm in twenty lines of NumPy, without any robot file: its tip goes out of reach and back."""

import numpy as np

import opspace as osc

LENGTH, MASS, DT = 0.3, 1.0, 0.001  # four links, a point mass at the end of each
q, v = np.array([0.3, 0.6, 0.5, 0.4]), np.zeros(4)
home = q.copy()


def arm(q, v):
    """Return inertia, Coriolis torque, and position, Jacobian and drift of the tip."""
    angle, rate = np.cumsum(q), np.cumsum(v)
    along = LENGTH * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    M, bias = np.zeros((4, 4)), np.zeros(4)
    for i in range(4):  # the end of link i
        J = np.array([across[j : i + 1].sum(axis=0) for j in range(4)]).T
        drift = -(along[: i + 1] * rate[: i + 1, None] ** 2).sum(axis=0)
        M += MASS * J.T @ J
        bias += MASS * J.T @ drift
    return M, bias, along.sum(axis=0), J, drift


start = arm(q, v)[2]
far = np.array([1.6, 0.0])  # m from the base, while the arm ends at 1.2 m
there = osc.MinimumJerk(start, far, 2.0)
path = osc.Chain((0.0, there), (2.5, osc.MinimumJerk(far, start, 2.0, start_time=2.5)))
times, torques, sigmas = np.arange(0.0, 5.0, DT), [], []
for t in times:
    M, bias, tip, J, drift = arm(q, v)
    x, dx, ddx = path(t)
    wanted = ddx + 20.0 * (dx - J @ v) + 100.0 * (x - tip)
    tasks = [
        osc.TaskSet(J, wanted - drift, priority=0),
        osc.TaskSet(np.eye(4), 25.0 * (home - q) - 10.0 * v, priority=1),
    ]
    tau = osc.task_torque(M, tasks, singular=osc.SigmaBuffer(0.05, 0.25)) + bias
    torques.append(tau)
    sigmas.append(np.linalg.eigvalsh(J @ np.linalg.solve(M, J.T))[0])
    v = v + DT * np.linalg.solve(M, tau - bias)
    q = q + DT * v

steps = np.abs(np.diff(torques, axis=0)).max()
print(f"smallest sigma {min(sigmas):.3f} 1/kg, largest torque step {steps:.3f} N·m per ms")
print(f"back within {np.linalg.norm(arm(q, v)[2] - start):.1e} m")

"""Make a controller of one's own continuous by feeding it intermediate desired values."""

import numpy as np

import opspace as osc


def own_controller(task_sets):
    """Solve in strict order with pseudo-inverses: any controller that takes tasks would do."""
    L = np.linalg.cholesky(M)
    u, N = np.zeros(len(M)), np.eye(len(M))
    for task in sorted(task_sets, key=lambda task: task.priority):
        J = np.linalg.solve(L, task.J.T).T
        inverse = np.linalg.pinv(J @ N, rcond=1e-10)
        u = u + inverse @ (task.f - J @ u)
        N = N - inverse @ (J @ N)
    return L @ u


rng = np.random.default_rng(1)
A = rng.normal(size=(5, 5))
M = A @ A.T + np.eye(5)
J1, J2 = rng.normal(size=(3, 5)), rng.normal(size=(3, 5))
f1, f2 = rng.normal(size=3), rng.normal(size=3)

for h in (0.0, 0.01, 0.99, 1.0):
    tasks = [osc.TaskSet(J1, f1, 0, activation=h), osc.TaskSet(J2, f2, 1)]
    values = osc.intermediate_values(own_controller, tasks, M)
    fed = [task.replace(f=f, activation=1.0) for task, f in zip(tasks, values, strict=True)]
    gap = np.abs(own_controller(fed) - osc.task_torque(M, tasks)).max()
    print(
        f"activation {h:.2f}: torque {own_controller(fed).round(2)}, gap to the library {gap:.0e}"
    )

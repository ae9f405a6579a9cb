"""Rows on a Ray cluster that exists already."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from opspace.errors import OpspaceError, missing_extra
from opspace.sweep.row import empty_row, run_row
from opspace.sweep.sweep_plan import SweepPlan

AHEAD = 2
"""Tasks that wait for each core, so that none of them is idle."""


def run_on_ray(
    plan: SweepPlan, indices: Sequence[int], address: str, timeout: float
) -> Iterator[dict[str, Any]]:
    """Run rows on a Ray cluster; its nodes need the same versions of opspace and what it needs.

    Args:
        plan: The sweep.
        indices: Numbers of the runs.
        address: Of the cluster, as ``ray.init`` takes it.
        timeout: Time without any finished run after which the cluster is given up, s.

    Yields:
        Rows, in the order in which they are finished.

    Raises:
        MissingExtraError: Ray is not installed.
        OpspaceError: There is no cluster at this address, or it has stopped answering.
    """
    try:
        import ray  # noqa: PLC0415 # pyright: ignore[reportMissingImports] - an extra
        from ray.exceptions import RayError  # noqa: PLC0415 # pyright: ignore[reportMissingImports]
    except ImportError:
        raise missing_extra("ray", "sweep") from None
    try:
        ray.init(address=address, ignore_reinit_error=True, log_to_driver=False)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise OpspaceError(f"--ray {address}: no cluster answers: {error}") from error
    remote = ray.remote(max_retries=2)(run_row)
    shared = ray.put(plan)
    room = AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
    waiting = list(reversed(indices))
    running: dict[Any, int] = {}
    while waiting or running:
        while waiting and len(running) < room:
            index = waiting.pop()
            running[remote.remote(shared, index)] = index
        done, _ = ray.wait(list(running), num_returns=1, timeout=timeout)
        if not done:
            raise OpspaceError(f"--ray {address}: no run has finished for {timeout:g} s")
        index = running.pop(done[0])
        try:
            yield ray.get(done[0])
        except RayError as error:
            reason = f"{type(error).__name__}: {error}".splitlines()[0]
            yield {**empty_row(plan, index), "ended": "died", "reason": reason}

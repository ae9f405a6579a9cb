"""The kernel of Warp around the code of one robot."""

# Warp reads the arguments of kernels when they are made, so there is no `annotations` from the future,
# and what a type is depends on what is computed.
# pyright: reportInvalidTypeForm=false

from functools import cache
from typing import Any

from opspace.fleet.warp_library import warp


@cache
def fleet_kernel(text: str, dtype: str, options: tuple[tuple[str, Any], ...]) -> Any:
    """Make the kernel that runs this code for every robot.

    Warp compiles it at its first launch, and keeps it on the disk by its contents.

    Args:
        text: The code for robot ``i``, which reads and writes the arguments by their names.
        dtype: Type of the numbers.
        options: Of Warp's compiler.
    """
    wp = warp()
    numbers, matrix = wp.array(dtype=getattr(wp, dtype)), wp.array2d(dtype=getattr(wp, dtype))
    doubles, ramps_of = wp.array(dtype=wp.float64), wp.array3d(dtype=wp.float64)
    whole_numbers, groups_of = wp.array(dtype=wp.int64), wp.array2d(dtype=wp.int64)
    answers = wp.array(dtype=wp.int32)

    @wp.func_native(text)
    def fleet_robot(
        i: int,
        times: doubles,
        q: matrix,
        v: matrix,
        tau: matrix,
        fixed_: numbers,
        whole_: whole_numbers,
        ramps: ramps_of,
        groups: groups_of,
        status: answers,
        solves: answers,
        limits: matrix,
    ): ...

    @wp.kernel(module="unique", enable_backward=False, module_options=dict(options))
    def fleet_tick(
        times: doubles,
        q: matrix,
        v: matrix,
        tau: matrix,
        fixed_: numbers,
        whole_: whole_numbers,
        ramps: ramps_of,
        groups: groups_of,
        status: answers,
        solves: answers,
        limits: matrix,
    ):
        fleet_robot(
            wp.tid(), times, q, v, tau, fixed_, whole_, ramps, groups, status, solves, limits
        )

    return fleet_tick

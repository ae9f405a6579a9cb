"""MuJoCo's motion axes and placements in the form that compiled code reads."""

from __future__ import annotations

from opspace.machine.kept_code import compile_and_keep


@compile_and_keep
def world_axes(cdof, origins, com, axes):
    """Bring motion axes about the centre of mass of each tree to the world's origin.

    Args:
        cdof: (n, 6) MuJoCo's axes, angular then linear.
        origins: (n,) body whose subtree's centre of mass each axis refers to.
        com: (bodies, 3) centres of mass of the subtrees, m.
        axes: (n, 6) filled, linear then angular.
    """
    for j in range(axes.shape[0]):
        x, y, z = com[origins[j]]
        a, b, c = cdof[j, 0], cdof[j, 1], cdof[j, 2]
        axes[j, 0] = cdof[j, 3] + y * c - z * b
        axes[j, 1] = cdof[j, 4] + z * a - x * c
        axes[j, 2] = cdof[j, 5] + x * b - y * a
        axes[j, 3], axes[j, 4], axes[j, 5] = a, b, c


@compile_and_keep
def placements(xmat, xpos, placement):
    """Write rotations (by columns) and positions into the rows."""
    for i in range(xpos.shape[0]):
        for column in range(3):
            for row in range(3):
                placement[i, 3 * column + row] = xmat[i, 3 * row + column]
            placement[i, 9 + column] = xpos[i, column]

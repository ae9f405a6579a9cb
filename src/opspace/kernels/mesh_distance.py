"""Distance of a point to a convex mesh, compiled; see `opspace.law.polyhedra`."""

from __future__ import annotations

import math

from opspace.machine.jit import jit

NORMAL = 9
"""Where the normal begins in a face, behind its three corners."""


@jit
def from_mesh(x, face, first, count, ball):
    """Signed distance of a centre to a mesh that is not grown, m, and its gradient in world axes.

    Args:
        x: (12,) axes of the mesh by columns, and its origin.
        face: (faces, 12) corners and normals in those axes.
        first: The first face of this mesh.
        count: How many it has.
        ball: (9,) whose first three numbers are the centre.
    """
    rx, ry, rz = ball[0] - x[9], ball[1] - x[10], ball[2] - x[11]
    px = x[0] * rx + x[1] * ry + x[2] * rz
    py = x[3] * rx + x[4] * ry + x[5] * rz
    pz = x[6] * rx + x[7] * ry + x[8] * rz
    highest, facing = -math.inf, first
    best, nx, ny, nz = math.inf, 0.0, 0.0, 0.0
    for i in range(first, first + count):
        f = face[i]
        ux, uy, uz = px - f[0], py - f[1], pz - f[2]
        height = f[NORMAL] * ux + f[NORMAL + 1] * uy + f[NORMAL + 2] * uz
        if height > highest:
            highest, facing = height, i
        # No point of a face is nearer than its plane, and the nearest lies on one that faces the point.
        if height <= 0.0 or height * height >= best:
            continue
        b, c = _nearest_in(f, ux, uy, uz)
        wx = ux - b * (f[3] - f[0]) - c * (f[6] - f[0])
        wy = uy - b * (f[4] - f[1]) - c * (f[7] - f[1])
        wz = uz - b * (f[5] - f[2]) - c * (f[8] - f[2])
        square = wx * wx + wy * wy + wz * wz
        if square < best:
            best, nx, ny, nz = square, wx, wy, wz
    rho = highest
    if highest > 0.0 and best > 0.0:
        rho = math.sqrt(best)
        nx, ny, nz = nx / rho, ny / rho, nz / rho
    else:
        nx, ny, nz = face[facing, NORMAL], face[facing, NORMAL + 1], face[facing, NORMAL + 2]
    return (
        rho,
        x[0] * nx + x[3] * ny + x[6] * nz,
        x[1] * nx + x[4] * ny + x[7] * nz,
        x[2] * nx + x[5] * ny + x[8] * nz,
    )


@jit
def _nearest_in(f, ux, uy, uz):
    """Shares of the two sides of a triangle at its point nearest to u, seen from its first corner.

    The plane is divided among the corners, the sides and the inside (Ericson 2005, 5.1.5).
    """
    ax, ay, az = f[3] - f[0], f[4] - f[1], f[5] - f[2]
    bx, by, bz = f[6] - f[0], f[7] - f[1], f[8] - f[2]
    aa, ab, bb = (
        ax * ax + ay * ay + az * az,
        ax * bx + ay * by + az * bz,
        bx * bx + by * by + bz * bz,
    )
    ua, ub = ax * ux + ay * uy + az * uz, bx * ux + by * uy + bz * uz
    if ua <= 0.0 and ub <= 0.0:
        return 0.0, 0.0
    if ua >= aa and ub - ab <= ua - aa:
        return 1.0, 0.0
    if ub >= bb and ua - ab <= ub - bb:
        return 0.0, 1.0
    return _beyond_corners(aa, ab, bb, ua, ub)


@jit
def _beyond_corners(aa, ab, bb, ua, ub):
    """The same where the nearest point is no corner, from the products of the sides and u."""
    # Twice the areas that the point makes with the sides, times that of the triangle.
    along_b = bb * ua - ab * ub
    along_a = aa * ub - ab * ua
    across = aa * bb - ab * ab - along_b - along_a
    if along_a <= 0.0 and 0.0 <= ua <= aa:
        return ua / aa, 0.0
    if along_b <= 0.0 and 0.0 <= ub <= bb:
        return 0.0, ub / bb
    # Along the third side, from the second corner to the third.
    share = (ub - ab - (ua - aa)) / (aa + bb - 2.0 * ab)
    if across <= 0.0 and 0.0 <= share <= 1.0:
        return 1.0 - share, share
    size = aa * bb - ab * ab
    return along_b / size, along_a / size

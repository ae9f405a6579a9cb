"""One level of the hierarchy, with its weak directions fading out (Section 4.1)."""

from __future__ import annotations

import math

from opspace.kernels.algebra import (
    apply_reflectors,
    apply_reflectors_transposed,
    cholesky,
    householder,
    invert_lower,
    invert_root,
    singular_values,
)
from opspace.kernels.compiled_scalars import fade
from opspace.kernels.whole_vectors import (
    add,
    add_sizes,
    clear_after,
    combine,
    combined,
    copy,
    dot,
    dots,
    fill,
    put_unit,
    whole,
)
from opspace.law.scalars import RANK_TOLERANCE
from opspace.machine.jit import jit

REGULAR = 1e-6
"""Without a buffer, a level whose smallest σ is above this fraction of ‖J‖² has full rank."""


NORMAL = 1e-4
"""Normal equations lose the digits of the condition number twice: above this fraction of ‖B‖² they
lose four."""


@jit
def project(d, count, n, J, f, space):
    """Put the rows ``space.rows[:count]`` before depth ``d``: B = Ĵ Z and the residual f − Ĵ û.

    Args:
        d: Depth of the levels above in the arrays of ``space``.
        count: Number of rows m.
        n: Number of joints.
        J: (rows, n) whitened rows of every task set.
        f: (rows,) their desired values, √J/s.
        space: `SPACE`; Z, u, free are read, B (count, free) and residual (count,) written.
    """
    Z, u, B, rows, residual = space.Z[d], space.u[d], space.B, space.rows, space.residual
    r, end = space.free[d], whole(n)
    for i in range(count):
        row, into = J[rows[i]], B[i]
        residual[i] = f[rows[i]] - dot(row, u, 0, end)
        if r == n:  # nothing is used yet, and Z is the identity
            copy(row, into, 0, end)
            continue
        dots(row, Z, r, into, end)


@jit
def solve_level(d, count, n, J, last, buffer, space):
    """Solve the rows that `project` has put before what depth ``d`` has decided.

    û_l = û_{l−1} + (Ĵ_l N_{l−1})⁺ (f_l − Ĵ_l û_{l−1}), for every alternative i: the i strongest
    directions of JN JNᵀ = U Σ Uᵀ (Eq. 25), each as far as it responds, with weight
    h(σ_i) − h(σ_{i+1}).

    Args:
        d: Depth of the levels above in the arrays of ``space``.
        count: Number of rows m.
        n: Number of joints.
        J: (rows, n) whitened rows of every task set.
        last: Whether nothing is below, so that what is left free does not matter.
        buffer: (on, lower, upper, profile, upper edge of the release, damping, then lower edge, that of
            the release and upper edge at rest), see `opspace.law.SigmaBuffer`; without ``on`` only
            exact dependence is removed.
        space: `SPACE`; B and residual are read, u, Z, free of depth d + 1 written, or for a level
            that branches V, strength, share.

    Returns:
        Number of alternatives; 1 stands for a result that is already at depth d + 1.
    """
    r = space.free[d]
    bound = _bound(count, n, J, buffer, space.rows)
    used = _use_columns(count, r, space)
    if r <= count:
        if _solve_tall(d, count, n, r, bound, space):
            return 1
        _singular_tall(count, r, space)
        rank = r
    else:
        if count == 1 and _solve_row(d, n, used, last, bound, space):
            return 1
        if _solve_wide(d, count, n, used, last, bound, space):
            return 1
        _singular_wide(count, space)
        rank = count
    threshold = 0.0
    if buffer[0] == 0.0:
        threshold = RANK_TOLERANCE * _largest(count, n, J, space)
    return _alternatives(d, count, n, used, rank, threshold, buffer, space)


@jit
def _use_columns(m, r, space):
    """Leave out the free motions that no row moves, where enough are left: columns of zeros in B.

    Returns:
        How many are left; ``space.column`` lists them, then the others.
    """
    B, column, size = space.B, space.column, space.x
    if r <= m:
        for b in range(r):
            column[b] = b
        return r
    fill(0.0, size, 0, whole(r))
    for i in range(m):
        add_sizes(B[i], size, 0, whole(r))
    used = 0
    for b in range(r):
        if size[b] != 0.0:
            column[used] = b
            used += 1
    if used == r or used < m:
        for b in range(r):
            column[b] = b
        return r
    for i in range(m):
        for c in range(used):
            B[i, c] = B[i, column[c]]
        clear_after(B[i], used, whole(used))
    others = used
    for b in range(r):
        if size[b] == 0.0:
            column[others] = b
            others += 1
    return used


@jit
def _bound(count, n, J, buffer, rows):
    """What all eigenvalues must exceed for a level to be solved without its spectrum."""
    if buffer[0] != 0.0:
        return buffer[2]
    # Before projection: a level of which nothing is left is rounding noise, however regular.
    size = 0.0
    for i in range(count):
        size += dot(J[rows[i]], J[rows[i]], 0, whole(n))
    return REGULAR * size


@jit
def _solve_row(d, n, used, last, bound, space):
    """One row: a step along it; the others are turned by the reflector that makes it the first."""
    row, column, Z, left, along = space.B[0], space.column, space.Z[d], space.Z[d + 1], space.y
    end = whole(n)
    size = dot(row, row, 0, whole(used))
    if not size > bound:
        return False
    fill(0.0, along, 0, end)
    for c in range(used):
        add(row[c], Z[column[c]], along, 0, end)
    copy(space.u[d], space.u[d + 1], 0, end)
    add(space.residual[0] / size, along, space.u[d + 1], 0, end)
    r = space.free[d]
    space.free[d + 1] = r - 1
    if last:
        return True
    norm = math.sqrt(size)
    pivot = row[0]
    alpha = -norm if pivot > 0.0 else norm
    scale = 1.0 / (norm * (norm + abs(pivot)))
    add(-alpha, Z[column[0]], along, 0, end)
    for c in range(1, used):
        copy(Z[column[c]], left[c - 1], 0, end)
        add(-row[c] * scale, along, left[c - 1], 0, end)
    for c in range(used, r):
        copy(Z[column[c]], left[c - 1], 0, end)
    return True


@jit
def _solve_wide(d, m, n, used, last, bound, space):
    """Rows that are all active: x = Q L⁻¹ residual; what is left free is the rest of Q."""
    B, x, scale = space.B, space.x, space.scale
    householder(B, m, used, scale, space.L)
    if not _regular(m, bound, space):
        return False
    clear_after(space.residual, m, whole(m))
    dots(space.residual, space.X, m, x, whole(m))
    r = space.free[d]
    space.free[d + 1] = r - m
    if used < r or (not last and r - m > m):
        _turn_basis(d, m, n, used, r, space)
        return True
    end = whole(n)
    clear_after(x, m, whole(r))
    apply_reflectors(B, m, r, scale, x)
    if r == n:  # the basis is the identity
        copy(space.u[d], space.u[d + 1], 0, end)
        add(1.0, x, space.u[d + 1], 0, end)
    else:
        _step(n, r, space.Z[d], x, space.u[d], space.u[d + 1])
    if not last:
        for j in range(m, r):
            _complement(d, m, n, r, j, x, space, space.Z[d + 1, j - m])
    return True


@jit
def _regular(m, bound, space):
    """Whether all eigenvalues of L Lᵀ are above a bound; X is L⁻¹ then.

    None is below 1/‖L⁻¹‖², by Frobenius, which is near the smallest: the others are rarely looked at.
    """
    L, X, G = space.L, space.X, space.G
    if invert_lower(L, m, X) * bound < 1.0:
        return True
    for i in range(m):
        dots(L[i], L, i + 1, G[i], whole(i + 1))
    return cholesky(G, m, bound, space.Y)


@jit
def _turn_basis(d, m, n, used, r, space):
    """Step along the first m vectors of the basis turned by Qᵀ; the others are what is left free.

    The same as column by column, and cheaper where many are left.
    """
    turned, column, Z, left = space.V[d], space.column, space.Z[d], space.Z[d + 1]
    end = whole(n)
    for c in range(used):
        copy(Z[column[c]], turned[c], 0, end)
    _turn(m, n, used, space.B, space.scale, turned, space.y)
    _step(n, m, turned, space.x, space.u[d], space.u[d + 1])
    for c in range(m, used):
        copy(turned[c], left[c - m], 0, end)
    for c in range(used, r):
        copy(Z[column[c]], left[c - m], 0, end)


@jit
def _turn(m, n, r, B, scale, turned, w):
    """Turn a basis so that its first m vectors are those that the rows use."""
    end = whole(n)
    for k in range(m):
        combined(B[k], turned, k, r, w, end)
        for b in range(k, r):
            add(-scale[k] * B[k, b], w, turned[b], 0, end)


@jit
def _solve_tall(d, m, n, r, bound, space):
    """At least as many rows as free motions, all of them used: least squares, nothing is left free."""
    B, C, x, residual = space.B, space.C, space.x, space.residual
    size = 0.0
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
        clear_after(C[b], m, whole(m))
        size += dot(C[b], C[b], 0, whole(m))
    enough = NORMAL * size
    if not _solve_normal(m, r, max(bound, enough), space):
        if bound >= enough:
            return False
        householder(C, r, m, space.scale, space.L)
        if not _regular(r, bound, space):
            return False
        copy(residual, space.y, 0, whole(m))
        clear_after(space.y, m, whole(m))
        apply_reflectors_transposed(C, r, m, space.scale, space.y)
        combined(space.y, space.X, 0, r, x, whole(r))
    _step(n, r, space.Z[d], x, space.u[d], space.u[d + 1])
    space.free[d + 1] = 0
    return True


@jit
def _solve_normal(m, r, bound, space):
    """Solve BᵀB x = Bᵀ residual, at a third of the cost of an orthogonal factorisation.

    Returns:
        Whether all eigenvalues of BᵀB are above the bound; otherwise there is no x.
    """
    C, G, X, y, x, end = space.C, space.G, space.X, space.y, space.x, whole(m)
    clear_after(space.residual, m, end)
    for a in range(r):
        dots(C[a], C, a + 1, G[a], end)
    if not invert_root(G, r, y, X) * bound < 1.0 and not cholesky(G, r, bound, space.Y):
        return False
    dots(space.residual, C, r, x, end)
    dots(x, X, r, y, whole(r))
    combined(y, X, 0, r, x, whole(r))
    return True


@jit
def _step(n, count, vectors, x, before, after):
    """û_l = û_{l−1} + Σ x_b vectors_b."""
    end = whole(n)
    copy(before, after, 0, end)
    combine(x, vectors, 0, count, after, 0, end)


@jit
def _complement(d, m, n, used, j, x, space, vector):
    """Column j of Q, in joint coordinates."""
    put_unit(1.0, j, x, whole(used))
    apply_reflectors(space.B, m, used, space.scale, x)
    _combine(n, used, space.free[d], space.Z[d], space.column, x, vector)


@jit
def _combine(n, used, r, Z, column, x, vector):
    """Σ x_c times the vectors of Z that are used, of r in all."""
    end = whole(n)
    if used == n:  # the basis is the identity, and all of it is used
        copy(x, vector, 0, end)
        return
    fill(0.0, vector, 0, end)
    if r == n:  # the basis is the identity
        for c in range(used):
            vector[column[c]] = x[c]
        return
    for c in range(used):
        add(x[c], Z[column[c]], vector, 0, end)


@jit
def _singular_wide(m, space):
    """Singular values of L, hence of the level; C gets σ_i u_i as rows."""
    C, L = space.C, space.L
    for i in range(m):
        for j in range(m):
            C[i, j] = L[j, i] if j >= i else 0.0
    singular_values(C, m, m, space.Y, space.sigma)


@jit
def _singular_tall(m, r, space):
    B, C = space.B, space.C
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
    singular_values(C, r, m, space.Y, space.sigma)


@jit
def _largest(count, n, J, space):
    """‖J‖₂ of the rows before projection, by power iteration on J Jᵀ."""
    x, y, rows, z = space.x, space.y, space.rows, space.G[0]
    for i in range(count):
        y[i] = 1.0 + 0.1 * i
    norm = 0.0
    # Only the order of magnitude counts: the threshold is far from any singular value that matters.
    for _ in range(20):
        for a in range(n):
            total = 0.0
            for i in range(count):
                total += J[rows[i], a] * y[i]
            z[a] = total
        norm = 0.0
        for i in range(count):
            total = 0.0
            for a in range(n):
                total += J[rows[i], a] * z[a]
            x[i] = total
            norm += total * total
        norm = math.sqrt(norm)
        if norm == 0.0:
            return 0.0
        for i in range(count):
            y[i] = x[i] / norm
    return math.sqrt(norm)


@jit
def _alternatives(d, m, n, used, rank, threshold, buffer, space):
    """Directions, what each adds, and the weights of the chain; the i strongest are alternative i."""
    _directions(d, m, n, used, rank, space)
    sigma, strength, share, C, residual = (
        space.sigma,
        space.strength,
        space.share,
        space.C,
        space.residual,
    )
    before, unrest = 1.0, 0.0
    for i in range(m):
        unrest += space.unrest[space.rows[i]]
    unrest = math.sqrt(unrest)
    faded = 0
    for i in range(rank):
        h, response = 0.0, 1.0
        if buffer[0] != 0.0:
            code, square = int(buffer[3]), sigma[i] * sigma[i]
            response = fade(code, square, buffer[1], buffer[2], buffer[6], buffer[8], unrest)
            h = fade(code, square, buffer[1], buffer[4], buffer[6], buffer[7], unrest)
        elif sigma[i] > threshold:
            h = 1.0
        strength[d, i] = 0.0
        if h > 0.0:
            total = 0.0
            for a in range(m):
                total += C[i, a] * residual[a]
            strength[d, i] = response / h * total / (sigma[i] * sigma[i])
            if response < 1.0 and buffer[5] > 0.0:
                along = 0.0
                for a in range(n):
                    along += space.V[d, i, a] * space.motion[a]
                strength[d, i] -= (1.0 - response) * buffer[5] * along
        if h < 1.0:
            faded = 1
        share[d, i] = before - h
        before = h
    share[d, rank] = before
    space.faded[0] = faded
    return rank + 1


@jit
def _directions(d, m, n, used, rank, space):
    """V: right singular vectors in joint coordinates, then an orthonormal basis of the rest."""
    B, Y, Z, V, x, scale, column = (
        space.B,
        space.Y,
        space.Z[d],
        space.V[d],
        space.x,
        space.scale,
        space.column,
    )
    r = space.free[d]
    for i in range(rank):
        for b in range(whole(used)):
            x[b] = Y[i, b] if b < rank else 0.0
        if m < r:
            apply_reflectors(B, m, used, scale, x)
        _combine(n, used, r, Z, column, x, V[i])
    for j in range(rank, used):
        _complement(d, m, n, used, j, x, space, V[j])
    for j in range(used, r):
        copy(Z[column[j]], V[j], 0, whole(n))


@jit
def take_alternative(d, i, n, space):
    """Put the alternative with the ``i`` strongest directions at depth d + 1."""
    V, strength, before, after, left = (
        space.V[d],
        space.strength[d],
        space.u[d],
        space.u[d + 1],
        space.Z[d + 1],
    )
    r = space.free[d]
    space.free[d + 1] = r - i
    if i == 0:
        V = space.Z[d]  # as it was, so that the identity stays one
    end = whole(n)
    copy(before, after, 0, end)
    combine(strength, V, 0, i, after, 0, end)
    for k in range(i, r):
        copy(V[k], left[k - i], 0, end)

"""Factorisations of small matrices, rows contiguous, results in the caller's arrays."""

from __future__ import annotations

import math

from opspace.kernels.whole_vectors import (
    add,
    clear_after,
    clear_before,
    combine,
    copy,
    dot,
    dots,
    put,
    put_at,
    put_unit,
    whole,
    whole_before,
)
from opspace.machine.jit import jit

SWEEPS = 30
"""One-sided Jacobi converges quadratically; six sweeps are usual, this many cannot be needed."""

EPSILON = 2e-15


@jit
def cholesky(A, n, shift, L):
    """Factor A − shift·I = L Lᵀ into the lower triangle of L, its diagonal inverted.

    Returns:
        Whether it is positive definite, that is whether every eigenvalue of A is above the shift;
        otherwise L is not usable.
    """
    for i in range(n):
        if not cholesky_row(A, i, shift, L):
            return False
    return True


@jit
def cholesky_row(A, i, shift, L):
    """Factor row i of `cholesky` where the rows before it are.

    Returns:
        Whether the matrix is positive definite so far.
    """
    for j in range(i + 1):
        s = A[i, j]
        if i == j:
            s -= shift
        for k in range(j):
            s -= L[i, k] * L[j, k]
        if i == j:
            if not s > 0.0:
                return False
            L[i, i] = 1.0 / math.sqrt(s)
        else:
            L[i, j] = s * L[j, j]
    return True


@jit
def solve_lower(L, n, x):
    """Overwrite x with L⁻¹ x, for L as `cholesky` leaves it."""
    for i in range(n):
        s = x[i]
        for k in range(i):
            s -= L[i, k] * x[k]
        x[i] = s * L[i, i]


@jit
def solve_lower_transposed(L, n, x):
    """Overwrite x with L⁻ᵀ x, for L as `cholesky` leaves it."""
    for i in range(n - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, n):
            s -= L[k, i] * x[k]
        x[i] = s * L[i, i]


@jit
def householder(B, m, r, scale, L):
    """Factor B = L Qᵀ for the rows of B (m <= r): each row becomes a reflector, L (m, m) lower.

    Args:
        B: (m, r) rows on entry, padded with zeros; on return row k holds reflector k, zeros before it.
        m: Number of rows.
        r: Length of the rows.
        scale: (m,) filled with 2/‖reflector‖², 0 where nothing is reflected.
        L: (m, m) filled, its rows padded with zeros.
    """
    end = whole(r)
    for k in range(m):
        row, first = B[k], whole_before(k)
        copy(row, L[k], 0, whole(k + 1))
        clear_after(L[k], k + 1, whole(m))
        clear_before(row, k)
        norm2 = dot(row, row, first, end)
        norm = math.sqrt(norm2)
        if norm == 0.0:
            scale[k] = 0.0
            put_at(0.0, k, L[k])
            continue
        pivot = row[k]
        alpha = -norm if pivot > 0.0 else norm
        put_at(pivot - alpha, k, row)
        # ‖reflector‖² = 2 ‖row‖ (‖row‖ + |pivot|), which cannot cancel.
        scale[k] = 1.0 / (norm * (norm + abs(pivot)))
        put_at(alpha, k, L[k])
        for i in range(k + 1, m):
            add(-scale[k] * dot(row, B[i], first, end), row, B[i], first, end)


@jit
def apply_reflectors(B, m, r, scale, x):
    """Overwrite x (r,) with Q x, Q the product of the reflectors in B; x is padded as its rows."""
    end = whole(r)
    for k in range(m - 1, -1, -1):
        first = whole_before(k)
        add(-scale[k] * dot(B[k], x, first, end), B[k], x, first, end)


@jit
def apply_reflectors_transposed(B, m, r, scale, x):
    """Overwrite x (r,) with Qᵀ x, Q the product of the reflectors in B; x is padded as its rows."""
    end = whole(r)
    for k in range(m):
        first = whole_before(k)
        add(-scale[k] * dot(B[k], x, first, end), B[k], x, first, end)


@jit
def invert_lower(L, m, X):
    """Fill X (m, m) with the inverse of L, lower; the rows of both are padded with zeros.

    Returns:
        ‖X‖², by Frobenius; no number where L is singular.
    """
    size = 0.0
    for i in range(m):
        row, inverse, end = X[i], 1.0 / L[i, i], whole(i + 1)
        put_unit(-1.0, i, row, whole(m))
        combine(L[i], X, 0, i, row, 0, end)
        put(-inverse, row, row, 0, end)
        size += dot(row, row, 0, end)
    return size


@jit
def invert_root(G, m, root, X):
    """Fill X (m, m), its rows padded with zeros, with the inverse of the Cholesky factor of G.

    Args:
        G: (m, m), of which the lower half is read, its rows padded.
        m: Number of rows.
        root: (m,) padded, to work in: row after row of the factor.
        X: Filled.

    Returns:
        ‖X‖², by Frobenius, the sum of all 1/λ; no number where G is not positive definite.
    """
    size = 0.0
    for i in range(m):
        row, end = X[i], whole(i + 1)
        dots(G[i], X, i, root, whole(i))
        inverse = 1.0 / math.sqrt(G[i, i] - dot(root, root, 0, whole(i)))
        put_unit(-1.0, i, row, whole(m))
        combine(root, X, 0, i, row, 0, end)
        put(-inverse, row, row, 0, end)
        size += dot(row, row, 0, end)
    return size


@jit
def singular_values(C, k, m, Y, s):
    """Singular value decomposition by one-sided Jacobi rotations, accurate also for small values.

    Args:
        C: (k, m) the matrix's k columns as rows on entry; on return σ_i times the left vectors.
        k: Number of columns.
        m: Number of rows.
        Y: (k, k) filled with the right vectors as rows, orthonormal whatever the rank is.
        s: (k,) filled with the singular values, largest first.
    """
    for i in range(k):
        for j in range(k):
            Y[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        if not _sweep(C, k, m, Y):
            break
    for i in range(k):
        s[i] = math.sqrt(_dot(C, i, i, m))
    for i in range(k):
        largest = i
        for j in range(i + 1, k):
            if s[j] > s[largest]:
                largest = j
        if largest != i:
            s[i], s[largest] = s[largest], s[i]
            for a in range(m):
                C[i, a], C[largest, a] = C[largest, a], C[i, a]
            for a in range(k):
                Y[i, a], Y[largest, a] = Y[largest, a], Y[i, a]


@jit
def _sweep(C, k, m, Y):
    rotated = False
    for i in range(k - 1):
        for j in range(i + 1, k):
            aa, bb, ab = _dot(C, i, i, m), _dot(C, j, j, m), _dot(C, i, j, m)
            # Columns of zeros need no rotation; below the smallest normal numbers all is noise.
            if abs(ab) <= EPSILON * math.sqrt(aa * bb) or abs(ab) < 1e-290:
                continue
            rotated = True
            zeta = (bb - aa) / (2.0 * ab)
            tangent = 1.0 / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
            if zeta < 0.0:
                tangent = -tangent
            cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
            sine = cosine * tangent
            _rotate(C, i, j, m, cosine, sine)
            _rotate(Y, i, j, k, cosine, sine)
    return rotated


@jit
def _dot(C, i, j, m):
    s = 0.0
    for a in range(m):
        s += C[i, a] * C[j, a]
    return s


@jit
def _rotate(C, i, j, m, cosine, sine):
    for a in range(m):
        x, y = C[i, a], C[j, a]
        C[i, a] = cosine * x - sine * y
        C[j, a] = sine * x + cosine * y

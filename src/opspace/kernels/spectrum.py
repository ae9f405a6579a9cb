"""The spectrum of a level, for its report."""

from __future__ import annotations

from opspace.kernels.algebra import singular_values
from opspace.kernels.columns import (
    RELEASE_UPPER,
    REST_LOWER,
    REST_RELEASE,
    REST_UPPER,
    SIGMA_LOWER,
    SIGMA_PROFILE,
    SIGMA_UPPER,
    SINGULAR,
)
from opspace.kernels.compiled_scalars import fade
from opspace.machine.jit import jit


@jit
def spectrum(level):
    """Directions of a level, strongest first: σ, activation, response, vectors as columns (Eq. 25).

    Args:
        level: `opspace.plan.records.SPECTRUM`; reads B, option and unrest.
    """
    B, C, Y, sigma, option = level.B, level.C, level.Y, level.sigma, level.option
    m, free = B.shape
    k = min(m, free)
    wide = m <= free
    # The smaller side is decomposed; the vectors of the rows come out on either.
    for i in range(m):
        for b in range(free):
            if wide:
                C[i, b] = B[i, b]
            else:
                C[b, i] = B[i, b]
    singular_values(C, k, C.shape[1], Y, sigma)
    for i in range(k):
        for a in range(m):
            if wide:
                level.directions[a, i] = Y[i, a]
            elif sigma[i] > 0.0:
                level.directions[a, i] = C[i, a] / sigma[i]
        sigma[i] *= sigma[i]
        if option[SINGULAR] != 0.0:
            code, lower, rest = int(option[SIGMA_PROFILE]), option[SIGMA_LOWER], option[REST_LOWER]
            level.response[i] = fade(
                code,
                sigma[i],
                lower,
                option[SIGMA_UPPER],
                rest,
                option[REST_UPPER],
                level.unrest[0],
            )
            level.activation[i] = fade(
                code, sigma[i], lower, option[RELEASE_UPPER], rest, option[REST_RELEASE],
                level.unrest[0],
            )  # fmt: skip

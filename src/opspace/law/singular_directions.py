"""Singular directions: each eigenvector of a level's projected inverse inertia fades on its own.

The projected inverse inertia of a level, JN JNᵀ = U Σ Uᵀ (Eq. 25), is split by its eigenvectors. A
direction whose eigenvalue σ falls through a buffer leaves the level smoothly, and its joint motion goes
back to the levels below. The split must be made here, in whitened coordinates: singular vectors of J
itself couple the two parts through the inertia and step at the edge of the buffer.
"""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from opspace.errors import InputError
from opspace.law.activation import Buffer
from opspace.law.hierarchy import Partial
from opspace.law.scalars import (
    PROFILES,
    REST_LOWER,
    REST_RELEASE,
    REST_UPPER,
    fade,
)


@dataclass(frozen=True)
class SigmaBuffer:
    """Buffers on the eigenvalues σ of Λ⁻¹ = J_p A⁻¹ Nᵀ J_pᵀ, Eq. 25 and Fig. 4 of the paper.

    A direction near singularity has two needs. It must be asked for less, or the torque grows without
    bound; and it must be given to the levels below, or nothing holds the arm that is stretched out. The
    first, its *response* ρ(σ), falls from 1 at ``upper`` to 0 at ``lower``: the direction's acceleration
    is ρ times what the tasks ask for, and 1 − ρ times damping of the joint motion along it. At rest this
    leaves no error. The second, its *activation* h(σ), falls only from ``release`` to ``lower``.

    Where a level rests at its targets inside the release, the levels below would pull it off them. So
    there are two pairs of buffers: these, and a pair below them for levels at rest, from 0.2 to 1 and
    (the release) to 0.6 times ``lower``, mixed by the profile of how far from rest a level is
    (``TaskSet.unrest``). What is asked for near rest is small, and its torque too, at small σ.

    Eigenvalues are those of the rows as the task sets scale them: with ``TaskSet.sigma_reference`` left
    at 1 they are in 1/kg and 1/(kg·m²) and the buffer is absolute, as in the paper (0.01 to 0.02); with
    a reference given they are dimensionless multiples of it and the buffer is relative.

    Args:
        lower: σ at and below which a direction is absent; must be > 0.
        upper: σ at and above which a direction answers in full.
        profile: Name of the activation profile.
        release: σ at and above which a direction belongs to its level alone; None is ``upper``, the one
            buffer of the paper, in which response and activation are the same, also at rest.
        damping: d of the joint motion along a direction that answers in part, 1/s.

    Raises:
        InputError: Not 0 < lower < release <= upper, or a damping below 0.
        UnknownNameError: There is no such profile.
    """

    lower: float
    upper: float
    profile: str = "quintic"
    release: float | None = None
    damping: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.lower < self.release_upper <= self.upper < float("inf"):
            between = "" if self.release is None else "release <= "
            found = "" if self.release is None else f", release={self.release}"
            raise InputError(
                f"a sigma buffer needs 0 < lower < {between}upper, "
                f"got lower={self.lower}, upper={self.upper}{found}"
            )
        if not 0.0 <= self.damping < float("inf"):
            raise InputError(f"the damping of a sigma buffer must be >= 0, got {self.damping}")
        Buffer(self.lower, self.upper, self.profile)

    @property
    def release_upper(self) -> float:
        """Upper edge of the release."""
        return self.upper if self.release is None else self.release

    @property
    def at_rest(self) -> tuple[float, float, float]:
        """Lower edge, upper edge of the release and upper edge at rest."""
        if self.release is None:
            return self.lower, self.upper, self.upper
        release = min(REST_RELEASE * self.lower, self.release_upper)
        return REST_LOWER * self.lower, release, min(REST_UPPER * self.lower, self.upper)

    def activation(self, sigma: float, unrest: float = 1.0) -> float:
        """Activation h(σ) of a direction, 0 below the buffer and 1 above the release."""
        return self._there(sigma, self.release_upper, self.at_rest[1], unrest)

    def response(self, sigma: float, unrest: float = 1.0) -> float:
        """Response ρ(σ) of a direction, 0 below the buffer and 1 above; never more than h."""
        return self._there(sigma, self.upper, self.at_rest[2], unrest)

    def _there(self, sigma: float, upper: float, rest_upper: float, unrest: float) -> float:
        code = PROFILES.index(self.profile)
        return fade(code, sigma, self.lower, upper, self.at_rest[0], rest_upper, unrest)


@dataclass(frozen=True)
class Spectrum:
    """The directions of one level, strongest first.

    Attributes:
        sigma: Eigenvalues of the projected inverse inertia, shape (k,), k = min(rows, free motions);
            empty where the certificate made the eigen-decomposition unnecessary.
        activation: Activation of each direction, shape (k,).
        response: Response of each direction, shape (k,).
        directions: Eigenvectors as columns, in the level's stacked rows, shape (m, k).
    """

    sigma: Float[np.ndarray, " k"]
    activation: Float[np.ndarray, " k"]
    response: Float[np.ndarray, " k"]
    directions: Float[np.ndarray, "m k"]


class Alternative(NamedTuple):
    """One way in which a level may act, and its weight in the blend."""

    weight: float
    partial: Partial


class LevelOutcome(NamedTuple):
    """Every alternative of a level and the spectrum behind them."""

    alternatives: list[Alternative]
    spectrum: Spectrum | None


def solve_level_smoothly(
    J: Float[np.ndarray, "m n"],
    f: Float[np.ndarray, " m"],
    above: Partial,
    buffer: SigmaBuffer,
    motion: Float[np.ndarray, " n"],
    *,
    unrest: float = 1.0,
    want_spectrum: bool = False,
) -> LevelOutcome:
    """Add one level whose weak directions fade out (Section 4.1 of the paper).

    With r = f_l − Ĵ_l û_{l−1} and the motion y = Lᵀ q̇, direction i contributes

        V_i (ρ(σ_i)/h(σ_i) (u_iᵀ r)/√σ_i − (1 − ρ(σ_i)) d V_iᵀ y)

    The level's alternatives are its i strongest directions, i = 0 … k, with weights
    h(σ_i) − h(σ_{i+1}): the chain rule. Direction i is there with h(σ_i) in all, so that what it
    answers to the tasks is ρ in the mean. It is continuous where two eigenvalues cross and their
    eigenvectors are arbitrary, because the set that would separate them then has weight 0.

    Args:
        J: Whitened Jacobian of the level, shape (m, n).
        f: Desired value of the level, shape (m,).
        above: Result of the levels above.
        buffer: Where directions fade.
        motion: Whitened velocity y, shape (n,).
        unrest: How far the level is from rest at its targets.
        want_spectrum: Compute the spectrum even where the certificate makes it unnecessary.

    Returns:
        Alternatives with weight > 0 and the spectrum (None when it was skipped).
    """
    JN = J @ above.Z
    residual = f - J @ above.u
    if not want_spectrum:
        certified = _certified_regular(JN, residual, above, buffer)
        if certified is not None:
            return LevelOutcome([Alternative(1.0, certified)], None)
    U, s, Vt = np.linalg.svd(JN)
    sigma = s**2
    activation = np.array([buffer.activation(x, unrest) for x in sigma.tolist()])
    response = activation
    if buffer.release is not None:
        response = np.array([buffer.response(x, unrest) for x in sigma.tolist()])
    k = s.size
    strength = np.zeros(k)
    on = activation > 0.0
    strength[on] = (response[on] / activation[on]) * (U[:, :k].T @ residual)[on] / s[on]
    strength[on] -= ((1.0 - response) * buffer.damping * (Vt[:k] @ (above.Z.T @ motion)))[on]
    steps = [1.0, *activation.tolist(), 0.0]
    alternatives = [
        Alternative(
            steps[i] - steps[i + 1],
            Partial(above.u + above.Z @ (Vt[:i].T @ strength[:i]), above.Z @ Vt[i:].T),
        )
        for i in range(k + 1)
        if steps[i] > steps[i + 1]
    ]
    return LevelOutcome(alternatives, Spectrum(sigma, activation, response, U[:, :k]))


def spectrum_of(J: Float[np.ndarray, "m n"], above: Partial) -> Spectrum:
    """Directions of a level that no buffer fades: all active."""
    U, s, _ = np.linalg.svd(J @ above.Z)
    return Spectrum(s**2, np.ones(s.size), np.ones(s.size), U[:, : s.size])


def _certified_regular(
    JN: Float[np.ndarray, "m r"],
    residual: Float[np.ndarray, " m"],
    above: Partial,
    buffer: SigmaBuffer,
) -> Partial | None:
    """Solve the level without its spectrum if a bound proves that no direction is in the buffer.

    1/trace(Λ) <= σ_min, and with JNᵀ = Q R the trace of Λ = (JN JNᵀ)⁻¹ is ‖R⁻¹‖²_F.

    Returns:
        The level's result, or None where the bound proves nothing.
    """
    m, r = JN.shape
    if m == 0 or m > r:
        return None
    Q, R = np.linalg.qr(JN.T, mode="complete")
    # A zero on the diagonal is an exactly singular level, whose bound is 0.
    if np.min(np.abs(np.diag(R))) ** 2 < buffer.upper:
        return None
    R_inverse = np.linalg.inv(R[:m])
    if 1.0 / np.sum(R_inverse**2) < buffer.upper:
        return None
    return Partial(above.u + above.Z @ (Q[:, :m] @ (R_inverse.T @ residual)), above.Z @ Q[:, m:])

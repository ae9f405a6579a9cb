"""The nearest acceleration within bounds: what the law wants, as far as it can be had."""

# W is the metric, not a constant; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from opspace.law.hierarchy import Level, WhitenedTask
from opspace.law.scalars import (
    CLEANINGS,
    HANDOVERS,
    HARD,
    ROUNDING,
    SOFT,
    SOFT_APART,
    UNBOUNDED,
    hardened,
    level_weight,
    yielding,
)


class Nearest(NamedTuple):
    """An acceleration within bounds, and what holds it there.

    Attributes:
        acceleration: (n,) q̈, rad/s².
        upper: (n,) by how much each upper bound on an acceleration lowers its joint's, rad/s²; 0 where
            it does not act.
        lower: (n,) the same of each lower bound.
        motors: Whether a bound on a torque acts.
        rows: (k,) by how much each bound on a combination of accelerations lowers it; 0 where it does
            not act.
    """

    acceleration: Float[np.ndarray, " n"]
    upper: Float[np.ndarray, " n"]
    lower: Float[np.ndarray, " n"]
    motors: bool
    rows: Float[np.ndarray, " k"]


def levels_below(levels: Sequence[Level], shares: Sequence[float]) -> list[float]:
    """Count the levels below each, those on their way in part.

    A level counts as far as anything of it is there, 1 − Π (1 − h_k), so nothing steps where one comes
    or goes.

    Args:
        levels: Their members, most important first.
        shares: h_k, how much of each task set is there.
    """
    counts: list[float] = []
    below = 0.0
    for level in reversed(levels):
        counts.insert(0, below)
        below += 1.0 - math.prod(1.0 - shares[k] for k in level.members)
    return counts


def task_metric(
    whitened: Sequence[WhitenedTask], levels: Sequence[Level], shares: Sequence[float], n: int
) -> Float[np.ndarray, "n n"]:
    """Measure how far an acceleration is from another by what the tasks see of the difference.

        W = I + Σ_l ω_l Σ_{k in l} h_k Ĵ_kᵀ Ĵ_k,   ω_l = `level_weight` of `levels_below`

    in x = Lᵀ q̈, where the inertia is I: smooth in the activations.

    Args:
        whitened: Every task set.
        levels: Their levels, most important first.
        shares: h_k, how much of each task set is there.
        n: Number of joints.

    Returns:
        W, (n, n).
    """
    W = np.eye(n)
    for level, below in zip(levels, levels_below(levels, shares), strict=True):
        for k in sorted(level.members):
            W += level_weight(below) * shares[k] * (whitened[k].J.T @ whitened[k].J)
    return W


def nearest_point(
    x: Float[np.ndarray, " n"],
    rows: Float[np.ndarray, "k n"],
    bounds: Float[np.ndarray, " k"],
    softness: Float[np.ndarray, " k"],
    ways: Float[np.ndarray, "k n"] | None = None,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " k"]]:
    """Find the point nearest to x with rows · y <= bounds.

        min (y − x)ᵀ P⁻¹ (y − x) + Σ excess²/softness

    with rows of unit length, or shorter ones, which are softer. The dual is a least-squares problem in
    multipliers that are not negative; the answer is a continuous function of everything given. It
    asks for P times each row and not for its inverse, so a motion may be one that P has not.

    Args:
        x: (n,).
        rows: (k, n) of unit length or less.
        bounds: (k,) finite.
        softness: (k,) above 0.
        ways: (k, n) rows P, P symmetric and not negative; None is the rows, P the identity.

    Returns:
        The point, (n,), and the multipliers, (k,): it is x − waysᵀ multipliers.
    """
    ways = rows if ways is None else ways
    gap = rows @ x - bounds
    rounding = ROUNDING * (np.abs(bounds) + np.abs(rows) @ np.abs(x))
    y, multipliers, held = x, np.zeros(bounds.size), np.zeros(bounds.size, dtype=bool)
    for _ in range(10 * bounds.size):
        over = np.where(held, 0.0, rows @ y - bounds)
        broken = over > rounding
        if not np.any(broken):
            break
        held[np.argmax(np.where(broken, over, 0.0))] = True
        while not _hold(rows @ ways.T, gap, softness, held, multipliers):
            held &= multipliers > 0.0
        y = x - ways.T @ multipliers
    return y, multipliers


def _hold(
    products: Float[np.ndarray, "k k"],
    gap: Float[np.ndarray, " k"],
    softness: Float[np.ndarray, " k"],
    held: Bool[np.ndarray, " k"],
    multipliers: Float[np.ndarray, " k"],
) -> bool:
    """Move the multipliers of held bounds towards what holds them, until one of them is zero.

    Returns:
        Whether they came all the way.
    """
    G, now = products[np.ix_(held, held)], multipliers[held]
    wanted = np.linalg.solve(G + np.diag(softness[held]), gap[held])
    falling = wanted <= 0.0
    if not np.any(falling):
        multipliers[held] = wanted
        return True
    shares = np.divide(now, now - wanted, out=np.ones_like(now), where=falling & (now > wanted))
    share = np.min(shares, where=falling, initial=1.0)
    moved = now + share * (wanted - now)
    multipliers[held] = np.where(falling & (shares <= share), 0.0, moved)
    return False


def cleaned(
    x: Float[np.ndarray, " n"],
    rows: Float[np.ndarray, "k n"],
    bounds: Float[np.ndarray, " k"],
    softness: Float[np.ndarray, " k"],
    turns: int,
    ways: Float[np.ndarray, "k n"] | None = None,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " k"]]:
    """Find `nearest_point` several times, each time from the last one.

    Args:
        x: (n,).
        rows: (k, n) of unit length or less.
        bounds: (k,) finite.
        softness: (k,) above 0; that of distances is `hardened` on the way.
        turns: How many times.
        ways: (k, n) where the point goes for each bound, see `nearest_point`.

    Returns:
        The point, (n,), and the sum of the multipliers, (k,).
    """
    total = np.zeros(bounds.size)
    for turn in range(turns):
        if turn == HANDOVERS and np.any(softness >= SOFT_APART):
            softness = np.array([hardened(one) for one in softness.tolist()])
        x, multipliers = nearest_point(x, rows, bounds, softness, ways)
        total += multipliers
    return x, total


def nearest_within(
    x: Float[np.ndarray, " n"],
    rows: Float[np.ndarray, "k n"],
    bounds: Float[np.ndarray, " k"],
    softness: Float[np.ndarray, " k"],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " k"]]:
    """Find the point nearest to x with rows · y <= bounds, whatever the length of the rows.

    What softness leaves of the excess where much is asked for is projected away again.

    Args:
        x: (n,).
        rows: (k, n); a row that is zero bounds nothing.
        bounds: (k,), those from `UNBOUNDED` on are none.
        softness: (k,) above 0, of rows of unit length; what is infinitely soft bounds nothing.

    Returns:
        The point, (n,), and by how much each bound moved it along its row, (k,).
    """
    size = np.linalg.norm(rows, axis=1)
    there = (bounds < UNBOUNDED) & (size > 0.0) & (softness < np.inf)
    taken = np.zeros(bounds.size)
    unit, limits = rows[there] / size[there, None], bounds[there] / size[there]
    x, multipliers = cleaned(x, unit, limits, softness[there], CLEANINGS)
    taken[there] = multipliers * size[there]
    return x, taken


def nearest_acceleration(
    L: Float[np.ndarray, "n n"],
    W: Float[np.ndarray, "n n"],
    acceleration: Float[np.ndarray, " n"],
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
    torque_lower: Float[np.ndarray, " n"],
    torque_upper: Float[np.ndarray, " n"],
    combined: Float[np.ndarray, "k n"] | None = None,
    most: Float[np.ndarray, " k"] | None = None,
    give_way: Float[np.ndarray, " k"] | None = None,
) -> Nearest:
    """Find the acceleration within bounds that is nearest in a metric.

        min (q̈ − q̈₀)ᵀ L W Lᵀ (q̈ − q̈₀) + Σ excess²/softness
        lower <= q̈ <= upper,   torque_lower <= A q̈ <= torque_upper,   combined q̈ <= most

    with every bound taken as a unit normal in the metric; what softness leaves of the excess where much
    is asked for is projected away again.

    Args:
        L: (n, n) Cholesky factor of the inertia A.
        W: (n, n) metric in x = Lᵀ q̈, see `task_metric`.
        acceleration: (n,) q̈₀, rad/s².
        lower: (n,) least accelerations, -inf where there is none.
        upper: (n,) largest accelerations, inf where there is none.
        torque_lower: (n,) least torques beside the bias, N·m.
        torque_upper: (n,) largest torques beside the bias, N·m.
        combined: (k, n) combinations of accelerations that are bounded, such as those with which
            distances shrink; None for none.
        most: (k,) their bounds, inf where there is none.
        give_way: (k,) their softness, see `softness_of_rows`; None is `SOFT` for all.

    Returns:
        q̈ and what holds it.
    """
    n = acceleration.size
    C = L @ np.linalg.cholesky(W)  # L W Lᵀ = C Cᵀ, the point is z = Cᵀ q̈
    joints = np.linalg.inv(C).T
    motors = np.linalg.solve(C, L @ L.T).T
    rows = np.concatenate([joints, -joints, motors, -motors])
    bounds = np.concatenate([upper, -lower, torque_upper, -torque_lower])
    softness = np.repeat([SOFT, HARD], 2 * n)
    if combined is not None and most is not None:
        rows = np.concatenate([rows, np.linalg.solve(C, combined.T).T])
        bounds = np.concatenate([bounds, most])
        soft = np.full(most.size, SOFT) if give_way is None else give_way
        softness = np.concatenate([softness, soft])
    taken = np.zeros(bounds.size)
    if not np.any((bounds < UNBOUNDED) & (np.linalg.norm(rows, axis=1) > 0.0)):
        return Nearest(acceleration, taken[:n], taken[:n], motors=False, rows=taken[4 * n :])
    z, taken = nearest_within(C.T @ acceleration, rows, bounds, softness)
    motors_act = bool(np.any(taken[2 * n : 4 * n]))
    return Nearest(np.linalg.solve(C.T, z), taken[:n], taken[n : 2 * n], motors_act, taken[4 * n :])


def softness_of_rows(
    combined: Float[np.ndarray, "k n"],
    most: Float[np.ndarray, " k"],
    M: Float[np.ndarray, "n n"],
    motors: Float[np.ndarray, " n"],
    least: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """Say how soft bounds on combinations of accelerations are, by what motors can do about them.

        reach = ‖diag(Γ̄) A⁻¹ Gᵀ‖,   softness = `SOFT_APART` + `yielding`(most, reach, least)

    Args:
        combined: (k, n) G.
        most: (k,) their bounds, m/s².
        M: (n, n) inertia A.
        motors: (n,) largest torques Γ̄, N·m; inf where nobody says.
        least: (k,) what each counts as asking for, see `opspace.law.scalars.asked_for`, m/s².

    Returns:
        (k,) softness of the rows of unit length, inf where they bound nothing.
    """
    way = np.linalg.solve(M, combined.T).T
    known = np.where(way == 0.0, 0.0, motors)
    reach = np.linalg.norm(way * known, axis=1)
    told = zip(most.tolist(), reach.tolist(), least.tolist(), strict=True)
    return np.array([SOFT_APART + yielding(*asked) for asked in told])


def excess(
    acceleration: Float[np.ndarray, " n"],
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
) -> float:
    """Tell by how much accelerations leave their bounds.

    Args:
        acceleration: (n,) rad/s².
        lower: (n,) least accelerations.
        upper: (n,) largest accelerations.

    Returns:
        The largest excess over max(1, |bound|), below or at zero where there is none.
    """
    over = np.concatenate([acceleration - upper, lower - acceleration])
    return _largest(over, np.abs(np.concatenate([upper, lower])))


def excess_of_rows(
    acceleration: Float[np.ndarray, " n"],
    combined: Float[np.ndarray, "k n"],
    most: Float[np.ndarray, " k"],
) -> float:
    """Tell by how much combinations of accelerations leave their bounds, as `excess` does."""
    return _largest(combined @ acceleration - most, np.abs(most))


def _largest(over: Float[np.ndarray, " k"], bound: Float[np.ndarray, " k"]) -> float:
    there = bound < UNBOUNDED
    return float(np.max(over[there] / np.maximum(1.0, bound[there]), initial=-np.inf))

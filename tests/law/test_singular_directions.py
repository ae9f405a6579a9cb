"""Singular directions: continuity at every place where a cut or another split would step."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import InputError
from opspace.law import Buffer, SigmaBuffer, TaskSet, task_torque
from opspace.law.hierarchy import start
from opspace.law.singular_directions import solve_level_smoothly
from tests.budget import examples
from tests.law.stacks import inertia, stacks

MANY = examples(60)
SEEDS = st.integers(0, 2**32 - 1)
BUFFER = SigmaBuffer(0.01, 0.02)


def orthonormal(rng, rows, columns):
    Q, _ = np.linalg.qr(rng.normal(size=(columns, columns)))
    return Q[:rows]


def whitened_stack(L, U, sigma, V, f, below):
    """A level with eigenvalues ``sigma`` of Λ⁻¹ exactly, above ``below``, for the inertia L Lᵀ."""
    J = U @ np.diag(np.sqrt(sigma)) @ V @ L.T
    return [TaskSet(J, f, 0), *below]


class Sweep:
    """One level of three directions on seven joints above a task that takes some of the rest."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.L = np.linalg.cholesky(inertia(rng, 7))
        self.U, self.V = orthonormal(rng, 3, 3).T, orthonormal(rng, 3, 7)
        self.f = rng.normal(size=3)
        self.below = [
            TaskSet(rng.normal(size=(2, 7)), rng.normal(size=2), 1),
            TaskSet(rng.normal(size=(1, 7)), rng.normal(size=1), 2),
        ]

    def torque(self, sigma, **options):
        tasks = whitened_stack(self.L, self.U, np.asarray(sigma), self.V, self.f, self.below)
        return task_torque(self.L @ self.L.T, tasks, **{"singular": BUFFER, **options})


def largest_steps(torque, start, end):
    """Largest step on a path of 8 intervals, and on the worst of them refined tenfold."""

    def steps(a, b, n):
        path = [torque(a + (b - a) * i / n) for i in range(n + 1)]
        return np.max(np.abs(np.diff(path, axis=0)), axis=1)

    coarse = steps(start, end, 8)
    worst = int(np.argmax(coarse))
    width = (end - start) / 8
    fine = steps(start + worst * width, start + (worst + 1) * width, 10)
    return coarse[worst], np.max(fine)


@examples(30)
@given(SEEDS, st.sampled_from([0.01, 0.02]))
def test_torque_is_continuous_where_sigma_crosses_an_edge(seed, edge):
    sweep = Sweep(seed)
    below, above = sweep.torque([1, 0.5, edge - 1e-9]), sweep.torque([1, 0.5, edge + 1e-9])
    assert np.max(np.abs(above - below)) < 1e-5 * np.max(np.abs(above))
    coarse, fine = largest_steps(lambda s: sweep.torque([1, 0.5, s]), edge - 1e-3, edge + 1e-3)
    assert fine <= 0.4 * coarse + 1e-10


@examples(30)
@given(SEEDS, st.floats(0.012, 0.018))
def test_torque_is_continuous_where_two_sigmas_cross_in_the_buffer(seed, at):
    """The level below uses two of seven joints' motions, so giving back the wrong one would show."""
    sweep = Sweep(seed)
    coarse, fine = largest_steps(lambda d: sweep.torque([1, at + d, at - d]), -1e-4, 1.07e-4)
    assert fine <= 0.4 * coarse + 1e-10
    one, other = sweep.torque([1, at + 1e-9, at]), sweep.torque([1, at, at + 1e-9])
    assert np.max(np.abs(one - other)) < 1e-5 * max(1.0, np.max(np.abs(one)))


@MANY
@given(SEEDS, st.floats(0.0, 2 * np.pi))
def test_torque_does_not_depend_on_the_eigenvectors_of_equal_sigmas(seed, angle):
    sweep = Sweep(seed)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    expected = sweep.torque([1, 0.015, 0.015])
    sweep.U, sweep.V = sweep.U @ turn, turn.T @ sweep.V  # the same Jacobian, factored differently
    atol = 1e-9 * max(1.0, np.max(np.abs(expected)))
    np.testing.assert_allclose(sweep.torque([1, 0.015, 0.015]), expected, rtol=0, atol=atol)


@MANY
@given(SEEDS)
def test_torque_at_exactly_zero_sigma_is_the_stack_without_that_direction(seed):
    sweep = Sweep(seed)
    at_zero = sweep.torque([1, 0.5, 0.0])
    np.testing.assert_allclose(at_zero, sweep.torque([1, 0.5, 1e-12]), rtol=0, atol=1e-4)
    U = sweep.U[:, :2]
    J = np.diag(np.sqrt([1, 0.5])) @ sweep.V[:2] @ sweep.L.T
    without = [TaskSet(J, U.T @ sweep.f, 0), *sweep.below]
    np.testing.assert_allclose(
        at_zero, task_torque(sweep.L @ sweep.L.T, without, singular=BUFFER), rtol=0, atol=1e-9
    )


@MANY
@given(SEEDS, st.floats(0.02, 5.0))
def test_with_every_sigma_above_the_buffer_the_torque_is_that_of_the_plain_law(seed, smallest):
    sweep = Sweep(seed)
    sigma = [smallest + 1, smallest + 0.5, smallest]
    plain = sweep.torque(sigma, singular=None)
    tiny = SigmaBuffer(1e-9, 2e-9)  # the lower levels of the random stack are regular for this one
    for skip_certificate in (True, False):
        smooth = sweep.torque(sigma, singular=tiny, info=skip_certificate)
        tau = smooth[0] if skip_certificate else smooth
        np.testing.assert_allclose(tau, plain, rtol=0, atol=1e-10 * max(1, np.max(np.abs(plain))))


@MANY
@given(stacks(), st.floats(1e-3, 0.5), st.sampled_from(["idv", "chain"]))
def test_the_certificate_changes_nothing(stack, upper, blending):
    buffer = SigmaBuffer(upper / 2, upper)
    with_spectra, _ = task_torque(stack.M, stack.tasks, blending, singular=buffer, info=True)
    certified = task_torque(stack.M, stack.tasks, blending, singular=buffer)
    np.testing.assert_allclose(
        certified, with_spectra, rtol=0, atol=1e-9 * max(1, np.max(np.abs(with_spectra)))
    )


@MANY
@given(SEEDS, st.integers(1, 5), st.integers(0, 4), st.floats(1e-3, 1.0))
def test_the_certificate_is_never_wrong(seed, rows, extra, upper):
    """It answers only where the smallest eigenvalue really is above the buffer."""
    rng = np.random.default_rng(seed)
    n = rows + extra
    J = 10.0 ** rng.uniform(-1.5, 0.5) * rng.normal(size=(rows, n))
    outcome = solve_level_smoothly(
        J, rng.normal(size=rows), start(n), SigmaBuffer(upper / 2, upper), np.zeros(n)
    )
    smallest = np.linalg.svd(J, compute_uv=False)[-1] ** 2
    if outcome.spectrum is None:
        assert smallest >= upper * (1 - 1e-9)
    if smallest >= rows * upper * 1.001:
        assert outcome.spectrum is None  # 1/trace(Λ) >= σ_min / rows


@MANY
@given(SEEDS)
def test_a_dropped_direction_goes_back_to_the_levels_below(seed):
    """A lower task that wants just the freed motion gets all of it."""
    sweep = Sweep(seed)
    wish = TaskSet((sweep.V[2:] @ sweep.L.T), [1.7], 1)
    tasks = whitened_stack(sweep.L, sweep.U, np.array([1, 0.5, 0.005]), sweep.V, sweep.f, [wish])
    M = sweep.L @ sweep.L.T
    tau = task_torque(M, tasks, singular=BUFFER)
    np.testing.assert_allclose(wish.J @ np.linalg.solve(M, tau), [1.7], atol=1e-9)
    held = task_torque(M, tasks)
    assert abs((wish.J @ np.linalg.solve(M, held) - 1.7).item()) > 1e-6 or abs(sweep.f[2]) < 1e-6


def split_by_svd_of_J(M, J, f, below, buffer):
    """The same idea with the singular vectors of J instead of the eigenvectors of Λ⁻¹.

    The strong directions are solved as one task, the weak one below it in its null space and
    scaled by its activation: what a reader of "singular value decomposition" might build.
    """
    U, _, _ = np.linalg.svd(J)
    weak, strong = U[:, -1:], U[:, :-1]
    sigma = float((weak.T @ J @ np.linalg.solve(M, J.T) @ weak).item())
    h = Buffer(buffer.lower, buffer.upper)(sigma).value
    upper = TaskSet(strong.T @ J, strong.T @ f, 0)
    tau = task_torque(M, [upper])
    coupling = weak.T @ J @ np.linalg.solve(M, tau)
    JN_weak = weak.T @ J
    force = h * (weak.T @ f - coupling) / max(sigma, 1e-12)
    return tau + JN_weak.T @ force, sigma, task_torque(M, [TaskSet(J, f, 0)])


def test_splitting_by_the_svd_of_J_steps_at_the_edge_and_ours_does_not():
    svd_gap, our_gap = [], []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        M = inertia(rng, 7)
        J, f = rng.normal(size=(3, 7)), rng.normal(size=3)
        _, sigma, plain = split_by_svd_of_J(M, J, f, [], SigmaBuffer(1e-6, 2e-6))
        # Put the buffer's upper edge just where the configuration is: nothing is in it yet.
        edge = SigmaBuffer(sigma * 0.5, sigma * (1 - 1e-9))
        by_svd, _, _ = split_by_svd_of_J(M, J, f, [], edge)
        svd_gap.append(np.linalg.norm(by_svd - plain) / np.linalg.norm(plain))
        smallest = np.linalg.eigvalsh(J @ np.linalg.solve(M, J.T))[0]
        ours = task_torque(
            M, [TaskSet(J, f, 0)], singular=SigmaBuffer(smallest * 0.5, smallest * (1 - 1e-9))
        )
        our_gap.append(np.linalg.norm(ours - plain) / np.linalg.norm(plain))
    assert np.median(svd_gap) > 1e-2
    assert max(our_gap) < 1e-9


@MANY
@given(SEEDS, st.floats(0.1, 10.0))
def test_a_reference_makes_the_buffer_relative(seed, reference):
    sweep = Sweep(seed)
    sigma = np.array([1, 0.5, 0.015])
    M = sweep.L @ sweep.L.T
    J = sweep.U @ np.diag(np.sqrt(sigma)) @ sweep.V @ sweep.L.T
    low = [TaskSet(t.J, t.f, t.priority, sigma_reference=1e-6) for t in sweep.below]
    absolute = task_torque(M, [TaskSet(J, sweep.f, 0), *low], singular=BUFFER)
    scaled = TaskSet(J, sweep.f, 0, sigma_reference=reference)
    relative = SigmaBuffer(BUFFER.lower / reference, BUFFER.upper / reference)
    np.testing.assert_allclose(
        task_torque(M, [scaled, *low], singular=relative), absolute, rtol=0, atol=1e-8
    )


def test_the_directions_are_reported():
    sweep = Sweep(3)
    _, info = sweep.torque([1, 0.5, 0.015], info=True)
    top = info.levels[0].spectrum
    np.testing.assert_allclose(top.sigma, [1, 0.5, 0.015], atol=1e-12)
    np.testing.assert_allclose(top.activation, [1, 1, 0.5], atol=1e-9)
    np.testing.assert_allclose(np.abs(top.directions.T @ sweep.U), np.eye(3), atol=1e-9)
    assert info.level_solves == 1 + 2 * 2  # two alternatives below the branching level


@pytest.mark.parametrize("edges", [(0.0, 0.1), (0.2, 0.1), (0.1, 0.1), (-1, 1), (0.1, np.inf)])
def test_a_buffer_needs_increasing_positive_edges(edges):
    with pytest.raises(InputError, match="sigma buffer needs 0 < lower < upper"):
        SigmaBuffer(*edges)


# -- at rest ---------------------------------------------------------------------------------------

TWO = SigmaBuffer(0.05, 0.7, release=0.3, damping=10.0)


@given(sigma=st.floats(0.0, 1.0), more=st.floats(0.0, 0.1), unrest=st.floats(0.0, 1.5))
def test_what_is_there_grows_with_sigma_and_answers_no_more_than_it_is_there(sigma, more, unrest):
    assert TWO.activation(sigma, unrest) <= TWO.activation(sigma + more, unrest) + 1e-15
    assert TWO.response(sigma, unrest) <= TWO.response(sigma + more, unrest) + 1e-15
    assert TWO.response(sigma, unrest) <= TWO.activation(sigma, unrest) + 1e-15


@given(sigma=st.floats(0.0, 1.0))
def test_far_from_rest_the_buffers_are_those_of_motion(sigma):
    bare = SigmaBuffer(0.05, 0.7), SigmaBuffer(0.05, 0.3)
    for unrest in (1.0, 3.0):
        assert TWO.response(sigma, unrest) == bare[0].response(sigma)
        assert TWO.activation(sigma, unrest) == bare[1].activation(sigma)
    if sigma >= 0.05:
        assert TWO.response(sigma, 0.0) == TWO.activation(sigma, 0.0) == 1.0
    one = SigmaBuffer(0.05, 0.7)
    for unrest in (0.0, 0.5, 1.0):  # the paper's form knows no rest
        assert one.response(sigma, unrest) == one.activation(sigma, unrest) == one.response(sigma)


@examples(40)
@given(seed=SEEDS, unrest=st.floats(0.0, 1.0), smallest=st.floats(0.0, 0.5))
def test_torque_is_continuous_in_how_far_a_level_is_from_rest(seed, unrest, smallest):
    """Also where σ is zero or two are equal."""
    sweep = Sweep(seed)

    def torque(unrest):
        tasks = whitened_stack(
            sweep.L, sweep.U, np.array([0.6, smallest, smallest]), sweep.V, sweep.f, sweep.below
        )
        tasks[0] = TaskSet(tasks[0].J, tasks[0].f, 0, unrest=unrest)
        return task_torque(sweep.L @ sweep.L.T, tasks, singular=TWO)

    step = np.max(np.abs(torque(unrest + 1e-7) - torque(unrest)))
    assert step <= 1e-4 * max(1.0, np.max(np.abs(torque(0.0))))


@given(seed=SEEDS)
def test_at_rest_the_law_is_the_plain_one_above_the_lower_edge(seed):
    sweep = Sweep(seed)
    tasks = whitened_stack(
        sweep.L, sweep.U, np.array([0.6, 0.2, 0.051]), sweep.V, sweep.f, sweep.below
    )
    tasks[0] = TaskSet(tasks[0].J, tasks[0].f, 0, unrest=0.0)
    M = sweep.L @ sweep.L.T
    found, plain = task_torque(M, tasks, singular=TWO), task_torque(M, tasks)
    # Levels below may be singular themselves, and far.
    alone = task_torque(M, tasks[:1], singular=TWO), task_torque(M, tasks[:1])
    np.testing.assert_allclose(alone[0], alone[1], atol=1e-9 * np.max(np.abs(plain)))
    assert np.all(np.isfinite(found))

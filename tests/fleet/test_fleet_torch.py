"""Tensors of torch and arrays of a fleet are the same memory, both ways."""

import numpy as np
import pytest

import opspace as osc
from opspace.fleet.warp_library import as_warp
from tests.fleet.fleets import COUNT, Beside

wp = pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")
torch = pytest.importorskip("torch", reason="torch is not installed")


@pytest.fixture
def both():
    return Beside(alone=True).prepare()


def tensors(both, seed=7):
    return [torch.from_numpy(x) for x in both.states(np.random.default_rng(seed))]


def test_steps_read_and_write_tensors_where_they_lie(both):
    fleet, (q, v) = both.fleet, tensors(both)
    wide = torch.full((COUNT, both.n + 3), 7.0, dtype=torch.float64)
    tau = wide[:, 1 : 1 + both.n]
    assert fleet.step(0.0, q, v, tau) is tau
    np.testing.assert_array_equal(tau.numpy(), fleet.step(0.0, q, v).numpy())
    assert (wide[:, 0] == 7.0).all()
    assert (wide[:, 1 + both.n :] == 7.0).all()
    before = tau.clone()
    q += 0.1
    assert not torch.equal(fleet.step(0.0, q, v, tau), before)
    for tensor in (q, tau, q.requires_grad_()):
        shared = as_warp(tensor, "q", tuple(tensor.shape), wp.float64, fleet.device)
        assert shared.ptr == tensor.data_ptr()


def test_what_a_task_is_told_and_tells_is_shared_with_tensors(both):
    fleet, (q, v) = both.fleet, tensors(both)
    told = {
        name: wp.to_torch(getattr(fleet["position"], name)) for name in ("target", "activation")
    }
    error, tau = wp.to_torch(fleet["position"].error), wp.to_torch(fleet.tau)
    fleet.step(0.0, q, v)
    before, torque = error.clone(), tau.clone()
    told["target"] += torch.tensor([0.0, 0.0, 0.1])
    fleet.step(0.0, q, v)
    torch.testing.assert_close(
        error - before, torch.tensor([[0.0, 0.0, 0.1]]).double().expand(6, 3)
    )
    assert not torch.equal(tau, torque)
    told["activation"][2] = 0.0
    fleet.step(0.0, q, v)
    assert wp.to_torch(fleet["position"].presence).tolist() == [1.0, 1.0, 0.0, 1.0, 1.0, 1.0]


def test_robots_are_named_by_tensors(both):
    fleet, (q, v) = both.fleet, tensors(both)
    fleet.step(0.0, q, v)
    fleet.remove("posture", 0.0, robots=torch.tensor([1, 4]))
    fleet.step(0.01, q, v)
    done = torch.tensor([False, True, False, False, False, False])
    assert fleet["posture"].presence.numpy().tolist() == [1.0, 0.0, 1.0, 1.0, 0.0, 1.0]
    fleet.reset(done)
    fleet.step(0.02, q, v)
    assert fleet["posture"].presence.numpy().tolist() == [1.0, 1.0, 1.0, 1.0, 0.0, 1.0]


def test_tensors_of_another_type_or_shape_are_refused_by_name(both):
    fleet, (q, v) = both.fleet, tensors(both)
    with pytest.raises(osc.InputError, match=r"q must have .* numbers of float64"):
        fleet.step(0.0, q.float(), v)
    with pytest.raises(osc.InputError, match=r"v must have shape \(6, 6\)"):
        fleet.step(0.0, q, v[:3])
    with pytest.raises(osc.InputError, match="side by side"):
        fleet.step(0.0, q.T.contiguous().T, v)

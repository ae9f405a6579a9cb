"""How far tasks were from rest lately is remembered in a program in C, to the last bit."""

import numpy as np
import pytest

import opspace as osc
from tests.controller.test_rest_memory import course, remembered, stretched
from tests.export.in_c import InC, with_cc


@with_cc
@pytest.mark.parametrize("own_kernels", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_memory_is_kept_in_c_through_removals_and_restarts(own_kernels, tmp_path):
    q, hand, controller = stretched(osc.Controller)
    stack, other = controller.stack, InC(tmp_path, controller, own_kernels=own_kernels)
    rows, pause = slice(3, 6), 0.0
    for k, (t, here, v) in enumerate(course(q, 320, 2)):
        if k in (60, 110):
            stack.remove(hand, duration=0.02)
            assert other.set("presence", hand, 0, t, 0.02) == 0
        if k in (70, 160):  # on its way out, and after it has been away
            stack.insert(hand, 1, duration=0.02)
            assert other.set("presence", hand, 1, t, 0.02) == 0
        if k == 250:
            controller.restart()
            other.restart()
            pause = 3.0
        command = controller.step(t + pause, here, v)
        status, tau = other.step(t + pause, here, v)
        if own_kernels:
            np.testing.assert_allclose(tau, command.tau, rtol=0, atol=1e-8, err_msg=f"tick {k}")
        else:
            np.testing.assert_array_equal(tau, command.tau, err_msg=f"tick {k}")
        assert status == command.status
        if "position" in (known := remembered(controller)):
            kept = other.read("row_unrest")[rows]
            np.testing.assert_allclose(kept, known["position"], rtol=0, atol=1e-12)

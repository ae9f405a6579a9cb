"""Every state of a fleet has a torque, in single precision nearly that of double."""

from pathlib import Path

import numpy as np
import pytest

import opspace as osc

pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"


@pytest.mark.slow
def test_singular_states_and_states_at_limits_have_a_torque(monkeypatch):
    monkeypatch.syspath_prepend(EVIDENCE)
    import fleet_states  # pyright: ignore[reportMissingImports]

    kept, seen = [], 0
    for _, error, status, wrong in fleet_states.measured("puma560", 200_000, seed=1):
        assert wrong == 0
        kept.append(error[status & int(osc.Status.LIMIT_LOST) == 0])
        seen |= int(np.bitwise_or.reduce(status))
    wanted = osc.Status.DIRECTION_OFF | osc.Status.JOINT_LIMIT | osc.Status.LIMIT_LOST
    assert wanted in osc.Status(seen)
    errors = np.concatenate(kept)
    assert np.median(errors) < 1e-5
    assert np.quantile(errors, 0.99) < 1e-4

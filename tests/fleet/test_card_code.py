"""What a kernel takes of a graphics card is read from what Warp compiles for one; none is needed."""

from pathlib import Path

import numpy as np
import pytest

import opspace as osc
from opspace.bench.fleet_on_card import LARGE, fleet_on_card
from opspace.fleet.card_code import card_code
from opspace.fleet.cubin import needs_of
from opspace.fleet.program import MOST_LOCAL
from opspace.robots import available_robots

wp = pytest.importorskip("warp", reason="fleets run in Warp: pip install 'opspace[gpu]'")

SUMS = """
{} x[{}]; for (int k = 0; k < {}; ++k) x[k] = given.data[(k * i) % 64];
for (int k = 1; k < {}; ++k) x[given.data[k] > 0 ? k : 0] += x[(k * k) % 7];
out.data[i] = x[i % {}];
"""


def compiled(kind, size, place):
    """Compile a kernel whose threads each keep so many numbers, at places that nobody knows before."""

    @wp.func_native(SUMS.format(kind, *[size] * 4))
    def keep(i: int, given: wp.array(dtype=float), out: wp.array(dtype=float)): ...

    @wp.kernel(module="unique", enable_backward=False)
    def keep_all(given: wp.array(dtype=float), out: wp.array(dtype=float)):
        keep(wp.tid(), given, out)

    (found,) = wp.compile_aot_module(keep_all.module, arch=90, module_dir=place, use_ptx=False)
    return needs_of(Path(found).read_bytes())


def test_local_memory_is_what_each_thread_keeps(tmp_path):
    few, many = (compiled("float", size, tmp_path / str(size)) for size in (100, 900))
    assert many.local - few.local == pytest.approx(4 * 800, abs=32)
    assert few.local == pytest.approx(4 * 100, abs=32)
    for needs in (few, many):
        assert 0 < needs.registers <= 255
        assert needs.instructions > 0


def test_a_card_that_warp_does_not_know_is_refused_by_name():
    stack = osc.Stack([osc.PostureTask()])
    fleet = osc.Fleet(osc.load_robot("puma560"), stack, 1, device="cpu")
    with pytest.raises(osc.InputError, match=r"'sm_1' \(valid: .*sm_90"):
        card_code(fleet, "sm_1")


@pytest.mark.slow
@pytest.mark.parametrize("spread", [False, True])
def test_the_kernel_of_a_fleet_compiles_for_a_card(spread, monkeypatch):
    if spread:  # as for a robot that is larger
        monkeypatch.setitem(MOST_LOCAL, "cuda", 0)
    stack = osc.Stack([osc.JointLimits(), osc.PoseTask(), osc.PostureTask()])
    fleet = osc.Fleet(osc.load_robot("puma560"), stack, 1, device="cpu", dtype="float32")
    code = card_code(fleet, "sm_90")
    assert 0 < code.needs.registers <= 255
    # Local memory holds the robot's arrays and little else: no call copies them.
    own = fleet.program_for("cuda").memory
    assert code.workspace == (own if spread else 0)
    kept = 0 if spread else own
    assert kept <= code.needs.local < kept + 4096
    assert code.spills is None or all(spilled >= 0 for spilled in code.spills)
    assert np.isfinite(code.seconds)


@pytest.mark.slow
def test_a_thread_of_a_card_has_room_for_a_humanoid():
    if "talos" not in {info.name for info in available_robots() if info.installed}:
        pytest.skip("needs opspace[robots]")
    ((_, _, _, registers, local, workspace, *_),) = fleet_on_card("sm_90", [LARGE], ["float32"])
    assert int(registers) <= 255
    assert int(local) < 4096
    assert int(workspace) > MOST_LOCAL["cuda"]

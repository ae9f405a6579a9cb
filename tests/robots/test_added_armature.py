"""URDF has no word for the inertia of motors: who loads a robot may give it; the plant has it, too."""

import numpy as np
import pytest

import opspace as osc
from opspace.errors import ModelError
from opspace.robots.mujoco_model import model_of


@pytest.mark.parametrize("backend", ["pinocchio", "mujoco"])
@pytest.mark.parametrize("name", ["g1", "ur5"])
def test_it_adds_to_the_diagonal_at_the_joints_and_nowhere_else(name, backend):
    bare, heavy = (osc.load_robot(name, backend=backend, armature=a) for a in (0.0, 0.2))
    added = np.where(bare.actuated, 0.2, 0.0)
    assert np.max(np.abs(heavy.M - bare.M - np.diag(added))) < 1e-12
    assert np.array_equal(heavy.gravity, bare.gravity)
    assert np.array_equal(model_of(heavy).dof_armature, added)


def test_humanoids_by_name_have_some():
    assert osc.load_robot("g1").description.armature == 0.01
    assert osc.load_robot("ur5").description.armature == 0.0


def test_what_brings_its_own_is_refused():
    with pytest.raises(ModelError, match="says itself"):
        osc.load_robot("puma560", armature=0.1)
    with pytest.raises(ModelError, match="says itself"):
        osc.load_robot(model_of(osc.load_robot("ur5")), armature=0.1)
    with pytest.raises(ModelError, match="at least 0"):
        osc.load_robot("ur5", armature=-1.0)

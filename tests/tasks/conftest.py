from __future__ import annotations

import numpy as np
import pytest

from tests.tasks.harness import ROBOTS, make_robot


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request, tmp_path_factory):
    return make_robot(request.param, tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return make_robot("puma560", tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return make_robot("tree", tmp_path_factory.mktemp("robot"))


@pytest.fixture
def rng():
    return np.random.default_rng(20260311)

"""Runs of both experiments, made once."""

import pytest

from tests.plots import synthetic


@pytest.fixture(scope="session")
def singularity(tmp_path_factory):
    return synthetic.experiment(tmp_path_factory.mktemp("singularity"), "singularity")


@pytest.fixture(scope="session")
def joint_limit(tmp_path_factory):
    return synthetic.experiment(tmp_path_factory.mktemp("joint-limit"), "joint-limit")

from __future__ import annotations

from pathlib import Path

import pytest

from tests.robots.samples import MJCF, URDF


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write the inline robots to files."""
    directory = tmp_path_factory.mktemp("robots")
    paths = {"oddity": directory / "oddity.urdf", "medley": directory / "medley.xml"}
    paths["oddity"].write_text(URDF)
    paths["medley"].write_text(MJCF)
    return paths

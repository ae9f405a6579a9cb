"""What is to be cited is what is installed."""

from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("key", ["title", "version", "license", "abstract"])
def test_the_citation_says_what_the_package_says(key):
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    named = {"title": "name", "abstract": "description"}.get(key, key)
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'{named} = "{cited[key].rstrip(".")}"\n' in project

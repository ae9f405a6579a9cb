"""Every example runs as a user would run it, says something, and is short."""

import subprocess
from pathlib import Path

import pytest
from tests.another_python import python

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))

EXTRAS = {"13_environment": ("gpu", "warp"), "14_writing": ("gpu", "warp")}
"""Examples that need an extra, and the package that it brings."""


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path):
    if path.stem in EXTRAS:
        extra, package = EXTRAS[path.stem]
        pytest.importorskip(package, reason=f"{path.name} needs pip install 'opspace[{extra}]'")
    done = subprocess.run(
        python(str(path)),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


def test_examples_are_numbered_and_short():
    numbers = [int(path.name.split("_")[0]) for path in EXAMPLES]
    assert numbers == list(range(1, len(EXAMPLES) + 1))
    assert all(len(path.read_text(encoding="utf-8").splitlines()) < 60 for path in EXAMPLES)

"""What is said of the humanoid that lifts a foot is what its file has."""

import csv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "docs" / "how-to" / "my-humanoid.md")


@pytest.fixture(scope="module")
def largest():
    with (ROOT / "docs" / "evidence" / "humanoid_lift.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    variants = {row["variant"] for row in rows}
    return {v: max(float(row["step"]) for row in rows if row["variant"] == v) for v in variants}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_caption_has_the_numbers_of_the_run(page, largest):
    text = page.read_text(encoding="utf-8")
    assert f"{largest['switch']:.1f} N·m" in text
    assert f"{largest['transition']:.3f} N·m" in text
    assert "humanoid.png" in text


def test_the_hard_switch_is_twenty_times_rougher(largest):
    assert largest["switch"] > 20.0 * largest["transition"]

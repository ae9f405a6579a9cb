"""Documents for users hold: their programs run, their links lead somewhere, pictures are small."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
# Blocks with their names, run in order in one namespace as a reader would. In this process, shape
# checks would make them several times slower.
RUNNER = """
import json, sys
namespace = {"__name__": "document"}
for name, block in json.load(sys.stdin):
    exec(compile(block, name, "exec"), namespace)
"""


def prose_of(path):
    """Leave out the blocks of code."""
    return re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)


def blocks_of(path):
    return re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.DOTALL)


# theory.md has its own test.
WITH_PROGRAMS = [page for page in PAGES if blocks_of(page) and page.stem != "theory"]


def anchors_of(path):
    headings = re.findall(r"^#+ (.*)$", prose_of(path), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def targets_of(path):
    found = re.findall(r"\]\(([^)\s]+)\)", prose_of(path))
    return [target for target in found if "://" not in target]


def run_blocks(blocks, cwd):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", RUNNER],
        input=json.dumps(blocks),
        capture_output=True,
        encoding="utf-8",
        cwd=cwd,
        check=False,
    )


@pytest.mark.parametrize("page", WITH_PROGRAMS, ids=lambda path: path.name)
def test_the_code_blocks_run_in_order(page, tmp_path):
    named = [(f"{page.name}, block {i}", block) for i, block in enumerate(blocks_of(page), 1)]
    done = run_blocks(named, tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_ten_lines_end_as_the_readme_says(tmp_path):
    first = blocks_of(ROOT / "README.md")[0]
    printed = run_blocks([("README.md", first)], tmp_path).stdout
    assert printed.startswith("True Status.DIRECTION_OFF"), printed


def test_a_failing_block_is_noticed(tmp_path):
    assert run_blocks([("broken", "assert False")], tmp_path).returncode != 0


def test_the_programs_are_found():
    assert {"README.md", "singularities.md", "recordings.md"} <= {
        page.name for page in WITH_PROGRAMS
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_links_lead_to_files_and_headings(page):
    missing = []
    for target in targets_of(page):
        name, _, anchor = target.partition("#")
        other = (page.parent / name) if name else page
        if not other.exists() or (anchor and anchor not in anchors_of(other)):
            missing.append(target)
    assert not missing


def test_every_picture_is_shown_and_small():
    shown = {
        (page.parent / target).resolve()
        for page in PAGES
        for target in targets_of(page)
        if target.endswith((".png", ".gif"))
    }
    pictures = set((ROOT / "docs" / "images").resolve().glob("*"))
    assert pictures == shown
    assert max(path.stat().st_size for path in pictures) < 250_000

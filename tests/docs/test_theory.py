"""docs/theory.md holds: its links lead to the code, its numbers are today's."""

import importlib
import os
import re
import subprocess
import sys
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
from tests.another_python import python

DOCS = Path(__file__).parents[2] / "docs"
EVIDENCE = DOCS / "evidence"
TEXT = (DOCS / "theory.md").read_text(encoding="utf-8")
PROSE = re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL)
MATH = re.findall(r"\$\$(.+?)\$\$|\$(.+?)\$", PROSE, flags=re.DOTALL)
SOURCES = re.findall(r"\[`([\w.]+)`\]\(\.\./src/([\w/]+)\.py\)", TEXT)


def rows_of(text):
    """Split the rows of Markdown tables into cells."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.fixture
def curves(monkeypatch):
    """Import docs/evidence/curves.py for one test."""
    monkeypatch.syspath_prepend(EVIDENCE)
    yield importlib.import_module("curves")
    for path in EVIDENCE.glob("*.py"):
        sys.modules.pop(path.stem, None)


def test_every_code_block_proves_something():
    blocks = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    assert len(blocks) >= 8
    assert all("assert" in block or "def " in block for block in blocks)


def test_every_equation_of_the_paper_has_its_row():
    section = PROSE.split("## 13.")[1]
    numbers = re.findall(r"^\| (\d+) \|.*\]\(\.\./src/", section, flags=re.MULTILINE)
    assert [int(number) for number in numbers] == list(range(1, 26))


@pytest.mark.parametrize(("name", "module"), sorted(set(SOURCES)))
def test_named_functions_are_where_the_links_say(name, module):
    imported = importlib.import_module(module.replace("/", "."))
    found = reduce(getattr, name.split("."), imported)
    assert found.__module__ == imported.__name__


def test_the_measured_numbers_are_those_of_the_script():
    # As a reader would run it; in this process, shape checks would make it five times slower.
    script = python(str(EVIDENCE / "measure.py"))
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    output = subprocess.run(
        script, capture_output=True, encoding="utf-8", check=True, env=environment
    )
    measured = rows_of(output.stdout)
    claims = {row[0] for row in measured}
    assert len(claims) == len(measured) >= 15
    assert [row for row in rows_of(PROSE) if row[0] in claims] == measured


def test_the_figures_show_what_the_text_says(curves):
    c = curves.insertion()
    assert c.compensated[0] == pytest.approx(c.without, abs=1e-9)
    assert c.compensated[-1] == pytest.approx(c.with_both, abs=1e-9)
    assert abs(c.printed[0] - c.without) > 1.0
    s = curves.stretching()
    largest = {name: np.abs(np.diff(getattr(s, name))).max() for name in ("cut", "by_jacobian")}
    assert min(largest.values()) > 1.0
    assert np.abs(np.diff(s.by_sigma)).max() < 0.2
    assert np.allclose(s.by_sigma[s.sigma > 0.02], s.unprotected[s.sigma > 0.02])


def test_the_figures_are_small_and_committed():
    figures = re.findall(r"!\[[^\]]+\]\((evidence/[^)]+)\)", TEXT)
    assert len(figures) == 2
    assert all((DOCS / figure).stat().st_size < 150_000 for figure in figures)


def test_formulas_survive_markdown():
    """Markdown eats backslashes before punctuation, pairs of stars, and bars in tables."""
    assert PROSE.count("$") % 2 == 0
    inline = [formula for _, formula in MATH if formula]
    assert len(inline) > 100
    for formula in inline:
        assert not re.search(r"\\[^\w\s]|[*|]|[}\)\]]_", formula), formula
        assert formula == formula.strip(), formula
    for line in PROSE.splitlines():
        assert line.count("$") % 2 == 0, line

"""docs/architecture.md follows a tick as it goes, and the house stands as it says."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import opspace
from opspace.controller import stages

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PACKAGE = Path(opspace.__file__).parent
SECTION = PAGE.split("## One tick, followed by name")[1].split("\n## ")[0]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in SECTION.splitlines()
    if line.startswith("| `")
]
NAMED = re.compile(r"`([\w/]+\.py)`((?: `\w+`)+)")
MAY_IMPORT = (
    "kernels",
    "law.press_columns",
    "law.scalars",
    "law.swift_motion",
    "law.way_columns",
    "law",
    "command",
    "machine.array_vectors",
    "machine.jit",
    "machine.lanes",
    "machine.sine_vectors",
    "machine.system_calls",
    "robots.joint_kinds",
)


def named(cell):
    return {(file, name) for file, names in NAMED.findall(cell) for name in names.split("`")[1::2]}


@pytest.fixture(scope="module")
def trace():
    script = ROOT / "docs" / "evidence" / "trace_tick.py"
    done = subprocess.run(
        [sys.executable, script, "-v"], capture_output=True, encoding="utf-8", check=True
    )
    head, *calls = done.stdout.splitlines()
    return head, [tuple(call.strip().split(": ")) for call in calls]


def test_the_stages_are_those_of_the_tick(trace):
    listed = [row[0].strip("`") for row in ROWS]
    called = [name for file, name in trace[1] if file == "controller/stages.py"]
    first_calls = list(dict.fromkeys(name for name in called if name in listed))
    assert set(first_calls) == set(listed)
    assert all(callable(getattr(stages, name)) for name in listed)
    assert len(listed) >= 12


def test_what_the_readable_form_calls_is_in_the_trace(trace):
    calls = set(trace[1])
    classes = {("law/tasksets.py", "TaskSet"): ("law/tasksets.py", "__init__")}
    for row in ROWS:
        found = {classes.get(one, one) for one in named(row[3])}
        assert found <= calls, row


def test_the_kernels_are_where_it_says():
    for row in ROWS:
        assert named(row[4])
        for file, name in named(row[4]):
            tree = ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
            assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_numbers_are_those_of_the_trace(trace):
    functions, files, moves = map(int, re.findall(r"\d+", trace[0]))
    text = " ".join(SECTION.split())
    assert f"through {functions} functions in {files} files" in text
    assert f"moves between files {moves} times" in text


def test_kernels_climb_nowhere():
    for path in (PACKAGE / "kernels").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("opspace"):
                module = node.module.removeprefix("opspace.")
                assert module.split(".")[0] == "kernels" or module in MAY_IMPORT, (path, module)
                if module == "law":
                    assert [alias.name for alias in node.names] == ["scalars"]


@pytest.mark.parametrize("number", [13, 18, 20, 23, 25])
def test_an_equation_is_found_by_its_number(number):
    files = [
        path.relative_to(PACKAGE).parts[0]
        for path in PACKAGE.rglob("*.py")
        if re.search(rf"Eq\. {number}\b", path.read_text(encoding="utf-8"))
    ]
    assert "law" in files

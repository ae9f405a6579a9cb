"""What is kept of compiled code is as old as exactly what is frozen into it."""

import ast
import shutil

import pytest

from opspace.machine import sources


def imports_of(path):
    """Files of the package that a module names in its imports, read from its syntax tree."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("opspace"):
            place = sources.PACKAGE.joinpath(*node.module.split(".")[1:])
            parts = [place / f"{alias.name}.py" for alias in node.names]
            modules = [path for path in parts if path.is_file()]
            yield from modules
            if len(modules) < len(parts):  # a name of the module itself
                yield from (place.with_suffix(".py"), place / "__init__.py")


def test_whatever_kernels_import_counts():
    found = set(sources.sources())
    assert found >= set((sources.PACKAGE / "kernels").glob("*.py"))
    machine = sources.PACKAGE / "machine"
    assert {path.name for path in found if path.parent == machine} == {
        *sources.COMPILERS,
        "lanes.py",
        "system_calls.py",
    }
    for path in found:
        if path.parent == machine:
            continue
        assert {file for file in imports_of(path) if file.is_file()} <= found, path
    assert sources.PACKAGE / "law" / "scalars.py" in found
    assert not any("plan" in path.parts or "controller" in path.parts for path in found)


@pytest.fixture
def copy(tmp_path, monkeypatch):
    package = tmp_path / "opspace"
    shutil.copytree(sources.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(sources, "PACKAGE", package)
    return package


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("law/scalars.py", "BRANCH_HOLD = 0.25 * math.pi", "BRANCH_HOLD = 0.3 * math.pi"),
        ("law/scalars.py", "RANK_TOLERANCE = 1e-8", "RANK_TOLERANCE = 1e-7"),
        ("command.py", "DIRECTION_OFF = 1", "DIRECTION_OFF = 2"),
        ("kernels/level.py", "NORMAL = 1e-4", "NORMAL = 1e-5"),
        ("machine/jit.py", 'error_model="numpy"', 'error_model="python"'),
    ],
)
def test_a_changed_constant_makes_what_is_kept_old(copy, file, old, new):
    before = sources.stamp()
    text = (copy / file).read_text(encoding="utf-8")
    assert old in text
    (copy / file).write_text(text.replace(old, new), encoding="utf-8")
    assert sources.stamp() != before


def test_times_and_plumbing_make_nothing_old(copy):
    before = sources.stamp()
    for path in copy.rglob("*.py"):
        path.touch()
    for file in ("plan/plan.py", "plan/pack_task.py", "controller/controller.py", "tasks/gains.py"):
        text = (copy / file).read_text(encoding="utf-8")
        (copy / file).write_text(text + "\nMORE = 1\n", encoding="utf-8")
    assert sources.stamp() == before

"""``import opspace`` is cheap and offers every public name."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import opspace


def test_the_package_alone_imports_nothing_heavy():
    script = """
import sys
import opspace
dir(opspace), opspace.__all__, opspace.__version__
heavy = {"numpy", "scipy", "pinocchio", "mujoco", "matplotlib", "pydantic", "numba"}
sys.exit(repr(sorted(heavy & set(sys.modules))))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stderr == "[]\n"


@pytest.mark.parametrize("name", opspace.__all__)
def test_every_name_is_there(name):
    assert getattr(opspace, name) is getattr(opspace, name)
    assert name in dir(opspace)


def test_what_type_checkers_see_is_what_is_imported():
    tree = ast.parse(Path(opspace.__file__).read_text(encoding="utf-8"))
    seen = {
        (node.module, alias.name, alias.asname)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("opspace.")
        for alias in node.names
    }
    assert seen == {(module, name, name) for name, module in opspace._HOME.items()}


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'PoistionTask'"):
        opspace.PoistionTask

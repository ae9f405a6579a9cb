"""One name, one thing: whoever searches the source for a class or a file finds one."""

import ast
from collections import Counter
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "opspace"
FILES = sorted(SOURCE.rglob("*.py"))

SAME_CLASS: set[str] = set()
SAME_FILE = {
    "__init__.py",
    "__main__.py",
}


def twice(names):
    return {name for name, count in Counter(names).items() if count > 1}


def test_no_two_classes_share_a_name():
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in FILES]
    classes = [node.name for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)]
    assert len(classes) > 200
    assert twice(classes) <= SAME_CLASS


def test_no_two_files_share_a_name():
    assert twice(file.name for file in FILES) <= SAME_FILE

"""Documents for users hold: programs run, commands exist, links lead somewhere."""

import importlib
import json
import re
import shlex
import subprocess
from importlib import metadata
from pathlib import Path

import pytest
import typer
from tests.another_python import python
from tests.docs.pages import (
    DOCS,
    PAGES,
    ROOT,
    anchors_of,
    blocks_of,
    commands_of,
    name_of,
    prose_of,
    targets_of,
)

from opspace import cli

# The blocks of a page in their order and in one folder, as a reader would: a block with a title is
# saved, Python shares one namespace, and commands that are quick are run. In a process of its own:
# shape checks would make it several times slower.
RUNNER = """
import json, shlex, sys
from pathlib import Path
from opspace.cli import main
namespace = {"__name__": "document"}
for number, (language, title, text) in enumerate(json.load(sys.stdin), 1):
    if title:
        Path(title).write_text(text, encoding="utf-8")
    elif language == "python":
        exec(compile(text, f"block {number}", "exec"), namespace)
    elif language == "sh":
        for line in text.splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] != ["opspace"] or words[1] in ("sweep", "view"):
                continue
            if words[1] == "check" or any(Path(word).exists() for word in words[2:]):
                # The first half second of a run shows whether its file is good.
                short = ["--set", "duration=0.5"] if words[1] == "run" else []
                try:
                    main([*words[1:], *short])
                except SystemExit as end:
                    assert not end.code, line
"""


def is_example(block):
    """Whether a block only names an example, which has a test of its own."""
    return block.text.startswith('--8<-- "examples/')


def run_blocks(blocks, folder):
    return subprocess.run(
        python("-c", RUNNER),
        input=json.dumps(blocks),
        capture_output=True,
        encoding="utf-8",
        cwd=folder,
        check=False,
    )


def programs_of(page):
    return [block for block in blocks_of(page) if not is_example(block)]


WITH_PROGRAMS = [
    page for page in PAGES if any(block.language == "python" for block in programs_of(page))
]
EXTRAS = {
    "docs/how-to/fleet.md": ["warp"],
    "docs/how-to/fleet-training.md": ["warp", "mujoco", "mujoco_warp", "torch"],
}
"""Pages that need packages which are not always there."""
WITH_FILES = [page for page in PAGES if any(block.title for block in programs_of(page))]


@pytest.mark.parametrize("page", sorted({*WITH_PROGRAMS, *WITH_FILES}), ids=name_of)
def test_the_code_blocks_run_in_order(page, tmp_path):
    for package in EXTRAS.get(name_of(page), ()):
        pytest.importorskip(package, reason=f"{name_of(page)} needs {package}")
    done = run_blocks(programs_of(page), tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_ten_lines_end_as_the_readme_says(tmp_path):
    first = next(block for block in blocks_of(ROOT / "README.md") if block.language == "python")
    printed = run_blocks([first], tmp_path).stdout
    assert printed.startswith("True Status.DIRECTION_OFF"), printed


@pytest.mark.parametrize(
    "blocks",
    [
        [("python", "", "assert False")],
        [("yaml", "a.yaml", "robot: nobody\n"), ("sh", "", "opspace run a.yaml")],
    ],
    ids=["program", "command"],
)
def test_a_failing_block_is_noticed(blocks, tmp_path):
    assert run_blocks(blocks, tmp_path).returncode != 0


def test_the_programs_are_found():
    found = {name_of(page) for page in WITH_PROGRAMS}
    assert {"README.md", "docs/theory.md", "docs/tutorial.md", "docs/how-to/mujoco.md"} <= found
    unknown = {block.language for page in PAGES for block in blocks_of(page)}
    # Patches are applied by test_worked_examples, C and C++ compiled by export/test_c_library.
    assert unknown <= {"python", "sh", "yaml", "xml", "text", "diff", "c", "cpp", "cmake"}


def parse_opspace(words):
    """Parse a command line of opspace without running it; a typo raises a usage error."""
    group = typer.main.get_command(cli.app)
    if not words or words[0].startswith("-"):
        assert set(words) <= {"--help", "--version", "-h"}, words
        return
    command = group.commands[words[0]]
    if len(words) > 1 and "--help" not in words:
        command.make_context(words[0], words[1:])


def check_command(line):
    """Refuse a line of a shell block that a reader could not run."""
    words = [word for word in shlex.split(line) if not re.fullmatch(r"[A-Z_]+=\w+", word)]
    if words[0] == "opspace":
        parse_opspace(words[1:])
    elif words[0] == "make":
        assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    elif words[:2] == ["pip", "install"]:
        asked = re.fullmatch(r"(?:opspace|\.)(?:\[([\w,]+)\])?", words[2])
        assert asked, line
        extras = metadata.metadata("opspace").get_all("Provides-Extra", [])
        assert set((asked[1] or "all").split(",")) <= set(extras), line
    elif words[0] in {"cc", "c++"}:  # run by export/test_c_library
        assert words[-1] in {"hold", "arm/opspace*.c", "franka"}, line
    elif words[:2] == ["colcon", "build"]:
        package = words[words.index("--packages-select") + 1]
        assert (ROOT / "ros2" / package / "package.xml").is_file(), line
    elif words[:2] == ["python", "-m"]:
        importlib.import_module(words[2]).parser().parse_args(words[3:])
    elif words[0] == "python":
        assert (ROOT / words[1]).is_file(), line
    else:
        assert (words[0], words[-1]) == ("taskset", "my_robot.py"), line


@pytest.mark.parametrize("page", [page for page in PAGES if commands_of(page)], ids=name_of)
def test_commands_and_their_options_exist(page):
    for line in commands_of(page):
        check_command(line)


@pytest.mark.parametrize("line", ["opspace run a.yaml --otu b", "opspace rnu a.yaml", "make tset"])
def test_a_command_that_does_not_exist_is_noticed(line):
    with pytest.raises((typer.BadParameter.__bases__[0], KeyError, AssertionError)):
        check_command(line)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
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
    pictures = {path for path in (DOCS / "images").resolve().rglob("*") if path.is_file()}
    assert pictures == shown
    assert max(path.stat().st_size for path in pictures) < 250_000


def test_the_gallery_shows_every_example():
    shown = [block.text for block in blocks_of(DOCS / "gallery.md")]
    examples = sorted(path.name for path in (ROOT / "examples").glob("*.py"))
    assert shown == [f'--8<-- "examples/{name}"\n' for name in examples]
    pictures = re.findall(r"\]\(images/gallery/(\w+)\.png\)", prose_of(DOCS / "gallery.md"))
    assert pictures == [Path(name).stem for name in examples]


def test_the_reference_has_every_public_name():
    import opspace

    shown = [
        name
        for page in sorted((DOCS / "reference").glob("*.md"))
        for name in re.findall(r"^::: opspace\.(\w+)$", page.read_text("utf-8"), re.MULTILINE)
    ]
    assert sorted(shown) == sorted(set(opspace.__all__) - {"__version__"})

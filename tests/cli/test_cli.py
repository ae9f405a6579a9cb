"""The frame of the command line: help, exit status, errors on one line, results as JSON."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from opspace import cli
from opspace.errors import InputError
from opspace.robots.registry import available_robots


def run(capsys, *words):
    """Call the command in this process; give its exit status and what it wrote."""
    with pytest.raises(SystemExit) as stop:
        cli.main(words)
    written = capsys.readouterr()
    return stop.value.code, written.out, written.err


def command_names():
    return [command.name or command.callback.__name__ for command in cli.app.registered_commands]


@pytest.mark.parametrize("words", [[], *([name] for name in command_names())])
def test_every_help_has_an_example(capsys, words):
    status, out, err = run(capsys, *words, "--help")
    assert status == 0
    assert " ".join(["Example: opspace", *words]) in out
    assert err == ""


def test_no_command_shows_the_help(capsys):
    assert run(capsys)[:2] == run(capsys, "--help")[:2]


def test_the_version_is_printed(capsys):
    status, out, _ = run(capsys, "--version")
    assert status == 0
    assert out.startswith("opspace ")
    module = [sys.executable, "-m", "opspace", "--version"]
    assert subprocess.run(module, capture_output=True, text=True, check=True).stdout == out


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["robts"], "'robts'. Did you mean 'robots'?"),
        (["robots", "--jsn"], "--json"),
        (["robots", "surplus"], "surplus"),
        (["--nothing"], "--nothing"),
    ],
)
def test_bad_words_are_named_on_one_line(capsys, words, named):
    status, out, err = run(capsys, *words)
    assert (status, out) == (2, "")
    assert err.startswith("opspace: error: ")
    assert named in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (InputError("kp must not be\nnegative"), 2, "opspace: error: kp must not be negative\n"),
        (KeyboardInterrupt(), 130, "opspace: interrupted\n"),
    ],
)
def test_errors_become_one_line_and_a_status(capsys, monkeypatch, error, status, line):
    def fail():
        raise error

    monkeypatch.setattr("opspace.robots.registry.available_robots", fail)
    assert run(capsys, "robots") == (status, "", line)


def test_a_defect_is_not_dressed_up_as_bad_input(monkeypatch):
    def fail():
        raise ZeroDivisionError

    monkeypatch.setattr("opspace.robots.registry.available_robots", fail)
    with pytest.raises(ZeroDivisionError):
        cli.main(["robots"])


def test_the_robots_are_the_same_in_table_and_json(capsys):
    table = run(capsys, "robots")[1]
    found = json.loads(run(capsys, "robots", "--json")[1])
    assert [robot["name"] for robot in found] == [robot.name for robot in available_robots()]
    rows = table.splitlines()[2:]
    assert len(rows) == len(found)
    for row, robot in zip(rows, found, strict=True):
        assert row.split()[:3] == [robot["name"], robot["kind"], str(robot["dof"])]
        assert robot["description"] in row


def test_help_loads_nothing_heavy():
    """It would otherwise take seconds."""
    script = """
import sys
from opspace.cli import main
try:
    main(["--help"])
except SystemExit:
    heavy = {"numpy", "scipy", "pinocchio", "mujoco", "matplotlib", "pydantic", "ruckig", "yaml"}
    sys.exit(repr(sorted(heavy & set(sys.modules))))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stderr == "[]\n"


def test_a_reader_that_leaves_early_is_no_error():
    with subprocess.Popen(
        [sys.executable, "-c", "from opspace.cli import main; main(['robots', '--json'])"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""


def test_the_installed_command_is_this_one():
    """The name in pyproject.toml leads here."""
    command = Path(sys.executable).with_name("opspace")
    if not command.exists():
        pytest.skip("the package is not installed in this environment")
    done = subprocess.run(
        [command, "robots", "--json"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert json.loads(done.stdout)

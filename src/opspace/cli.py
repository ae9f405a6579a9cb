"""The ``opspace`` command: thin functions that import what they need when they are called."""
# ruff: noqa: PLC0415 - nobody should wait for a simulator to read --help

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated

import typer

from opspace.errors import OpspaceError

BAD_INPUT = 2
INTERRUPTED = 130

_UNBROKEN = 10_000

# Typer brings its own copy of click or uses the installed one, depending on its version; the base
# of its BadParameter is the usage error of the one in use.
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]

app = typer.Typer(
    name="opspace",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Args:
        arguments: The words after ``opspace``; None takes those of the process.

    Raises:
        SystemExit: Always; 0 when the command did what was asked, 2 for bad input, 130 after
            Ctrl-C.
    """
    status = _status(arguments)
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader, such as head, has seen enough; the interpreter's own flush must not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(status)


def _status(arguments: Sequence[str] | None) -> int:
    try:
        status = app(arguments, prog_name="opspace", standalone_mode=False)
    except OpspaceError as error:
        return _refuse(str(error))
    except _UsageError as error:
        context = getattr(error, "ctx", None)
        command = context.command_path if context else "opspace"
        return _refuse(f"{_one_line(error)} (see {command} --help)")
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    if status == INTERRUPTED:
        print("opspace: interrupted", file=sys.stderr)
    return status if isinstance(status, int) else 0


def _refuse(message: str) -> int:
    print(f"opspace: error: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT


def _one_line(error: Exception) -> str:
    words = error.format_message() if hasattr(error, "format_message") else str(error)  # pyright: ignore[reportAttributeAccessIssue]
    return words.rstrip(".")


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib import metadata

        print(f"opspace {metadata.version('opspace')}")
        raise typer.Exit


@app.callback(
    invoke_without_command=True,
    epilog="Example: opspace robots",
)
def _opspace(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Operational space control whose tasks come, go and change rank without a step in torque."""
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command(epilog="Example: opspace robots --json")
def robots(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """List the robots that have a name."""
    from opspace.robots.registry import available_robots

    found = available_robots()
    if as_json:
        print(json.dumps([asdict(robot) for robot in found], indent=1, ensure_ascii=False))
        return
    _print_table(
        ("name", "kind", "dof", "installed", "description"),
        [
            (
                robot.name,
                robot.kind,
                str(robot.dof),
                "yes" if robot.installed else f"no: needs {robot.package}",
                robot.description,
            )
            for robot in found
        ],
    )


def _print_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(*heads, box=box.HORIZONTALS, show_edge=False, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    # A file or a pipe has no width, and what reads it should find whole rows.
    width = None if sys.stdout.isatty() else _UNBROKEN
    Console(width=width, markup=False, emoji=False, highlight=False).print(table)

"""Hook of the site: the page of the command line is what the commands' own help says."""

import io
from contextlib import redirect_stdout

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

from opspace.cli import app

MARK = "<!-- commands -->"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put the help of all commands where the page has the mark."""
    return markdown.replace(MARK, commands()) if MARK in markdown else markdown


def commands() -> str:
    """Write a section per command, in the order of the help."""
    sections = [f"```text\n{help_of()}\n```"]
    for command in app.registered_commands:
        name = command.name or command.callback.__name__
        sections.append(f"## opspace {name}\n\n```text\n{help_of(name)}\n```")
    return "\n\n".join(sections)


def help_of(*words: str) -> str:
    """Give the help of a command as a terminal shows it."""
    with redirect_stdout(io.StringIO()) as text:
        app([*words, "--help"], prog_name="opspace", standalone_mode=False)
    return text.getvalue().strip()

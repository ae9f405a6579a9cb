"""What the documents contain: blocks of code with their language and title, links, headings."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
FENCE = re.compile(r"^(`{3,})(\w*)(?: title=\"([^\"]+)\")?\n(.*?)^\1$", re.DOTALL | re.MULTILINE)


class Block(NamedTuple):
    """A block of code of a page."""

    language: str
    title: str
    text: str


def name_of(page):
    return str(page.relative_to(ROOT))


def blocks_of(page):
    found = FENCE.findall(page.read_text(encoding="utf-8"))
    return [Block(language, title, text) for _, language, title, text in found]


def prose_of(page):
    """Leave out the blocks of code."""
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def anchors_of(page):
    headings = re.findall(r"^#+ (.*)$", prose_of(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def targets_of(page):
    found = re.findall(r"\]\(([^)\s]+)\)", prose_of(page))
    return [target for target in found if "://" not in target]


def commands_of(page):
    """List the lines of shell blocks, without comments, and the commands in the text."""
    lines = [
        line.split(" # ")[0].strip()
        for block in blocks_of(page)
        if block.language == "sh"
        for line in block.text.splitlines()
    ]
    return [*filter(None, lines), *re.findall(r"`(opspace [^`]+)`", prose_of(page))]

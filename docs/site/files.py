"""Hook of the site: links to files of the repository lead to pages that show the files.

Documents are read in the repository as well, where such links lead to the files themselves.
"""

import os
import re
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
CHANGELOG = "changelog.md"
LANGUAGES = {".py": "python", ".yaml": "yaml", ".md": "markdown"}
CODE = re.compile(r"(```.*?```)", re.DOTALL)
LINK = re.compile(r"\]\((?!\w+:|#)([^)\s#]+)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the changelog, and a page for every file and folder that a document links to."""
    text = moved((ROOT / "CHANGELOG.md").read_text("utf-8"), ".", CHANGELOG, files)
    files.append(File.generated(config, CHANGELOG, content=text))
    for page in list(files.documentation_pages()):
        for target, _ in links_of(page.content_string):
            path = in_repository(target, PurePosixPath("docs", page.src_uri).parent)
            if path and not files.get_file_from_path(shown_at(path)):
                content = contents(ROOT / path)
                files.append(File.generated(config, shown_at(path), content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead links to files of the repository to their pages."""
    return moved(
        markdown, f"docs/{PurePosixPath(page.file.src_uri).parent}", page.file.src_uri, files
    )


def links_of(text: str) -> list[tuple[str, str]]:
    """List targets and anchors, without those in blocks of code."""
    return LINK.findall(CODE.sub("", text))


def in_repository(target: str, folder: PurePosixPath) -> str | None:
    """Give the path of a target that the site would not show by itself."""
    path = PurePosixPath(os.path.normpath(folder / target))
    inside = path.is_relative_to("docs") and path.suffix not in {".py", ""}
    return None if inside or not (ROOT / path).exists() else str(path)


def shown_at(path: str) -> str:
    """Give the place in the site of a file or folder of the repository."""
    return f"files/{path}.md"


def contents(path: Path) -> str:
    """Show a file as a block of code, a folder as a list."""
    name = path.relative_to(ROOT)
    if path.is_dir():
        names = [f"- `{entry.name}`" for entry in sorted(path.iterdir()) if entry.suffix == ".py"]
        return f"# {name}\n\n" + "\n".join(names) + "\n"
    text = path.read_text("utf-8")
    return f"# {path.name}\n\n`{name}`\n\n````{LANGUAGES.get(path.suffix, 'text')}\n{text}````\n"


def moved(text: str, folder: str, place: str, files: Files) -> str:
    """Rewrite links that hold for a folder of the repository into those of a page of the site."""

    def link(match: re.Match[str]) -> str:
        target, anchor = match[1], match[2] or ""
        path = os.path.normpath(PurePosixPath(folder, target))
        shown = shown_at(path)
        if not files.get_file_from_path(shown):
            shown = path.removeprefix("docs/")
        if not files.get_file_from_path(shown):
            return match[0]  # for mkdocs to complain about
        return f"]({os.path.relpath(shown, PurePosixPath(place).parent)}{anchor})"

    parts = CODE.split(text)
    return "".join(part if CODE.match(part) else LINK.sub(link, part) for part in parts)

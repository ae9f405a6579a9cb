"""Hook of the site: formulas become MathML, which browsers show without scripts.

The font comes with a package, since not every machine has one for mathematics.
"""

import html
import re
from importlib import resources

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

INLINE = re.compile(r'<span class="arithmatex">\\\((.+?)\\\)</span>', re.DOTALL)
BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.+?)\\\]\s*</div>', re.DOTALL)
TAG = re.compile(r"\\tag\{(.+?)\}")
SPACE = re.compile(r"(?<!\\)\\ ")  # the converter would show it as text
BARE = re.compile(r"\\mathbb (\w)")  # the converter wants braces
FONT = resources.files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf"
# Signs that the converter chooses less well than TeX does.
BETTER = {"<mi>&#x029F5;</mi>": "<mo>&#x2216;</mo>", "&#x0002A;": "&#x2217;"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Put the font beside the style sheet that names it."""
    files.append(File.generated(config, "site/math.ttf", content=FONT.read_bytes()))
    return files


def on_page_content(content: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Replace what the Markdown extension marked as a formula."""
    content = BLOCK.sub(lambda match: block(html.unescape(match[1])), content)
    content = INLINE.sub(lambda match: mathml(html.unescape(match[1]), "inline"), content)
    if "arithmatex" in content:
        raise ValueError(f"{page.file.src_uri}: a formula was marked but not converted")
    return content


def block(formula: str) -> str:
    """Set a formula on a line of its own, its number at the right."""
    tag = TAG.search(formula)
    number = f"<span>({tag[1]})</span>" if tag else ""
    formula = SPACE.sub(r"\\;", TAG.sub("", formula))
    return f'<div class="formula">{mathml(formula, "block")}{number}</div>'


def mathml(formula: str, display: str) -> str:
    """Convert a formula of LaTeX."""
    formula = BARE.sub(r"\\mathbb{\1}", formula)
    found = convert(formula, display=display)
    for sign, better in BETTER.items():
        found = found.replace(sign, better)
    return found

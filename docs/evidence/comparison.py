"""Runs `opspace compare` on the show-piece and writes its table and figure into the documents."""

import re
from pathlib import Path

from opspace.compare import METHODS, Comparison, compare_scenario
from opspace.runs.progress import ProgressBar
from opspace.scenario import load_scenario

SCENARIO = "showpiece-panda"
ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "results" / "compare" / SCENARIO
PAGES = {
    "README.md": ("torque_step", "jerk", "error_inside", "leak", "overshoot"),
    "docs/comparison.md": None,
}
BLOCK = re.compile(r"(<!-- comparison -->\n).*?(<!-- /comparison -->)", re.DOTALL)


def markdown(comparison: Comparison, keys: tuple[str, ...] | None) -> str:
    """Write the table, with all measures or some."""
    heads, rows = comparison.table(keys)
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def kept(old: str, table: str) -> str:
    """Rows of a method that is not installed here stay as they were measured."""
    absent = [name for name, method in METHODS.items() if not method.installed()]
    rows = [row for row in old.splitlines(keepends=True) if row.split(" | ")[0][2:] in absent]
    return table + "".join(rows)


def main() -> None:
    """Run every method and rewrite the blocks between the markers."""
    with ProgressBar() as progress:
        found = compare_scenario(load_scenario(SCENARIO), (), OUT, progress=progress)
    for page, keys in PAGES.items():
        path = ROOT / page
        text = path.read_text(encoding="utf-8")
        table = markdown(found, keys)
        new = BLOCK.sub(lambda m, t=table: m[1] + kept(m[0], t) + m[2], text)
        path.write_text(new, encoding="utf-8")
    (ROOT / "docs/images/comparison.png").write_bytes((OUT / "compare.png").read_bytes())


if __name__ == "__main__":
    main()

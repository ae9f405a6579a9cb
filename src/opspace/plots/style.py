"""The look of every figure, set on each artist so that nothing global changes."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from opspace.errors import InputError

WIDTH = 9.0
"""Width of a figure [in]: 1350 pixels, for a page that shows it 900 wide."""

DPI = 150
FORMATS: Mapping[str, dict[str, Any]] = MappingProxyType(
    {
        ".png": {"Software": None},
        ".pdf": {"CreationDate": None},
        ".svg": {"Date": None},
    }
)
"""What a figure can be written as, by the ending of its file, without what changes with every run."""
TEXT_SIZE = 10.5
SMALL = 9.5
INK, FAINT, GRID, BAND = "#303030", "#8c8c8c", "#e8e8e8", "#eaf1f5"
LINE = 1.6
_LONGEST = 80

# Paul Tol's high-contrast scheme: told apart under colour blindness and in grey.
VARIANT_COLORS: Mapping[str, str] = MappingProxyType(
    {"without": "#BB5566", "switch": "#DDAA33", "transition": "#004488"}
)
VARIANT_TITLES: Mapping[str, str] = MappingProxyType(
    {
        "without": "without the method",
        "switch": "hard switch",
        "transition": "continuous transition",
    }
)

# Paul Tol's muted scheme, neighbours far apart.
LINE_COLORS = (
    "#332288",
    "#44AA99",
    "#CC6677",
    "#999933",
    "#66B5E0",
    "#882255",
    "#117733",
    "#CBB34D",
    "#AA4499",
)


def overlaid(variant: str) -> dict[str, Any]:
    """Return the look of a variant among others; a chattering switch must not hide them."""
    order = ("switch", "without", "transition").index(variant)
    alpha = 0.6 if variant == "switch" else 1.0
    return {"color": VARIANT_COLORS[variant], "zorder": 2.0 + 0.1 * order, "alpha": alpha}


def line_color(index: int) -> str:
    """Return the colour of the line of this number; a joint has the same in every figure."""
    return LINE_COLORS[index % len(LINE_COLORS)]


def text_color(color: str) -> str:
    """Return a colour dark enough for text in the colour of a line."""
    red, green, blue = to_rgb(color)
    return to_hex((0.75 * red, 0.75 * green, 0.75 * blue))


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Make an empty figure.

    Args:
        height: In inches.
        width: In inches.

    Returns:
        The figure, on a canvas of its own.
    """
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def dress(axes: Axes, *, title: str = "", x: str = "", y: str = "") -> None:
    """Give a panel its spines, grid and texts.

    Args:
        axes: The panel.
        title: What it shows.
        x: Label of the horizontal axis, with its unit in brackets.
        y: Label of the vertical axis, with its unit in brackets.
    """
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(colors=INK, labelsize=SMALL, length=3.0)
    axes.tick_params(which="minor", length=0)
    axes.grid(visible=True, color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.set_title(title, loc="left", fontsize=TEXT_SIZE, color=INK, fontweight="bold")
    axes.set_xlabel(x, fontsize=TEXT_SIZE, color=INK)
    axes.set_ylabel(y, fontsize=TEXT_SIZE, color=INK)


def file_name(kind: str, shown: Sequence[str]) -> str:
    """Name the file of a figure by what it shows, so that two figures do not meet in one file.

    Args:
        kind: What the name begins with.
        shown: What is to be seen; nothing for what is always shown.

    Returns:
        The name without an ending.
    """
    name = re.sub(r"[^\w.-]+", "-", "-".join([kind, *shown]))
    if len(name) <= _LONGEST:
        return name
    return f"{name[:_LONGEST]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def save(figure: Figure, path: Path | str) -> Path:
    """Write a figure; the same figure gives the same bytes.

    Args:
        figure: The figure.
        path: File to write, ending in .png, .pdf or .svg.

    Returns:
        The path.

    Raises:
        InputError: The file has another ending or cannot be written.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise InputError(f"{path}: a figure ends in {', '.join(FORMATS)}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Names inside an SVG are drawn at random but for this; restored at once.
        with rc_context({"svg.hashsalt": "opspace"}):
            figure.savefig(path, format=ending[1:], dpi=DPI, metadata=FORMATS[ending])
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    return path

"""Draw the figures of docs/theory.md: ``python docs/evidence/figures.py``."""

from __future__ import annotations

from pathlib import Path

import curves
import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

HERE = Path(__file__).parent
GOOD, BAD, OTHER, FAINT = "#0b6e99", "#c1440e", "#8a5a9e", "#8c8c8c"


def style() -> None:
    """Set a plain look that is the same on every machine."""
    mpl.use("Agg")
    mpl.rcParams.update(
        {
            "svg.hashsalt": "opspace",
            "font.size": 10.5,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "grid.color": "#e6e6e6",
            "axes.axisbelow": True,
            "figure.facecolor": "white",
            "lines.linewidth": 2.0,
        }
    )


def insertion() -> plt.Figure:
    """Draw the torque before, while and after a task is inserted."""
    c = curves.insertion()
    figure, axes = plt.subplots(figsize=(7.4, 3.8), layout="constrained")
    for x, level in (([-0.22, 0.0], c.without), ([1.0, 1.22], c.with_both)):
        axes.plot(x, [level, level], color="black", lw=2.6)
    axes.plot([*c.h, 1.22], [*c.printed, c.printed[-1]], color=BAD)
    axes.plot([0.0, 0.0], [c.without, c.printed[0]], color=BAD, ls=":", lw=1.6)
    axes.plot(c.h, c.compensated, color=GOOD)
    axes.text(-0.21, c.without + 0.25, "position alone, Eq. 14", ha="left")
    axes.text(1.21, c.with_both - 0.62, "both tasks realised", ha="right")
    axes.text(0.33, -2.3, "with compensation", color=GOOD, ha="left")
    axes.text(0.07, c.printed[0] - 0.62, "as printed, Eq. 17–18", color=BAD, ha="left")
    axes.set(
        xlim=(-0.22, 1.22),
        ylim=(-9.5, 0.9),
        xticks=np.linspace(0, 1, 6),
        xlabel="activation $h_1$ of an orientation inserted above a position",
        ylabel="torque of joint 2 [N·m]",
    )
    return figure


def stretching() -> plt.Figure:
    """Draw the torque over the weakest eigenvalue of a stretching arm."""
    c = curves.stretching()
    lower, upper = curves.PUBLISHED.lower, curves.PUBLISHED.upper
    figure, axes = plt.subplots(figsize=(7.4, 4.2), layout="constrained")
    axes.axvspan(lower, upper, color="#edf3f6", zorder=0)
    axes.text((lower + upper) / 2, 9.4, "buffer", color="#55717f", ha="center", va="top")
    axes.plot(c.sigma, c.unprotected, color=FAINT, ls=":")
    axes.plot(c.sigma, c.cut, color=OTHER, lw=1.6)
    axes.plot(c.sigma, c.by_jacobian, color=BAD, lw=1.6)
    axes.plot(c.sigma, c.by_sigma, color=GOOD, lw=2.4)
    axes.text(0.0062, 7.4, "no handling", color="#6b6b6b", ha="left")
    axes.text(0.0205, -1.0, "parts along the singular vectors of J", color=BAD, ha="left")
    axes.text(0.0235, 4.35, "eigenvectors of Λ⁻¹", color=GOOD, ha="left")
    axes.annotate(
        "hard cut at 0.015",
        (0.0149, 2.6),
        (0.0092, 2.6),
        color=OTHER,
        ha="right",
        va="center",
        arrowprops={"arrowstyle": "-", "color": OTHER, "shrinkB": 0},
    )
    axes.set(
        xlim=(0, 0.04),
        ylim=(-2, 10),
        xlabel="smallest eigenvalue σ of Λ⁻¹ [1/kg] (0: stretched out)",
        ylabel="torque of joint 2 [N·m]",
    )
    return figure


def main() -> None:
    """Write both figures beside this file."""
    style()
    for draw in (insertion, stretching):
        figure = draw()
        figure.savefig(HERE / f"{draw.__name__}.svg", metadata={"Date": None})
        plt.close(figure)


if __name__ == "__main__":
    main()

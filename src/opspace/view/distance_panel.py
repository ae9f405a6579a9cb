"""The pairs of bodies that are nearest, as the page writes them beside the robot."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from opspace.tasks.nearest_points import Gap
from opspace.view.panels import blend_color

PAIRS = 8
"""As many pairs are shown."""

REACH = 0.2
"""Distance that fills a bar, m."""


def distances(gaps: Sequence[Gap], margin: float) -> str:
    """Draw the distance of the nearest pairs as bars with a mark at the margin.

    Args:
        gaps: The pairs, the nearest first.
        margin: Distance that is kept, m.
    """
    mark = 100.0 * min(margin / REACH, 1.0)
    rows = [_row(gap, margin, mark) for gap in gaps[:PAIRS]]
    title = f"nearest pairs, kept {1e3 * margin:g} mm apart" if gaps else "nothing is kept apart"
    return (
        '<div style="padding:0 12px 6px"><div style="margin-top:8px;font-size:12px;color:#8c8c8c">'
        f"{title}</div>{''.join(rows)}</div>"
    )


def spare(distance: float, margin: float) -> float:
    """What a pair has beyond its margin, as a part of what looks safe: 0 at the margin, at most 1."""
    return min(max((distance - margin) / max(3.0 * margin, 0.03), 0.0), 1.0)


def _row(gap: Gap, margin: float, mark: float) -> str:
    width = 100.0 * min(max(gap.distance / REACH, 0.0), 1.0)
    color = blend_color(spare(gap.distance, margin))
    name = escape(gap.pair)
    return (
        '<div style="margin:4px 0;font-size:13px;line-height:17px" '
        f'data-opspace-pair="{name}" data-opspace-mm="{1e3 * gap.distance:.2f}">'
        '<div style="display:flex;justify-content:space-between;gap:8px">'
        '<span style="overflow:hidden;text-overflow:ellipsis;white-space:nowrap" '
        f'title="{name}">{name}</span>'
        f'<span style="white-space:nowrap;font-variant-numeric:tabular-nums">'
        f"{1e3 * gap.distance:.0f} mm</span></div>"
        '<div style="position:relative;height:6px;border-radius:3px;background:rgba(140,140,140,0.22)">'
        f'<span style="position:absolute;left:0;top:0;bottom:0;border-radius:3px;width:{width:.1f}%;'
        f'background:{color}"></span><span style="position:absolute;top:-2px;bottom:-2px;width:2px;'
        f'left:{mark:.1f}%;background:#8c8c8c"></span></div></div>'
    )

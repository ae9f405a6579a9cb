"""How sure force tasks are of their contacts, as bars beside the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from opspace.view.frame import Frame, TouchFrame
from opspace.view.panels import ACTIVE, blend_color


def touches(frame: Frame, presses: Mapping[str, Mapping[str, Any]]) -> str:
    """Draw the confidence of every force task as a bar, with the force wanted and measured.

    Args:
        frame: The tick.
        presses: What the recording says about force tasks, by name.
    """
    if not frame.touches:
        return ""
    rows = [_row(touch, len(presses[touch.name]["force"])) for touch in frame.touches]
    return (
        '<div style="padding:0 12px 6px"><div style="display:flex;justify-content:space-between;'
        'margin-top:8px;font-size:12px;color:#8c8c8c"><span>touches</span>'
        f"<span>wanted, measured</span></div>{''.join(rows)}</div>"
    )


def _row(touch: TouchFrame, forces: int) -> str:
    there = not math.isnan(touch.confidence)
    c = touch.confidence if there else 0.0
    name = escape(touch.name)
    numbers = [np.linalg.norm(touch.wanted[:forces]) if there else np.nan]
    numbers.append(np.linalg.norm(touch.wrench))
    shown = ["–" if np.isnan(one) else f"{one:.1f} N" for one in numbers]
    return (
        '<div style="display:flex;align-items:center;gap:8px;margin:3px 0;font-size:13px;'
        f'line-height:18px;color:{"inherit" if there else "#8c8c8c"}" '
        f'data-opspace-touch="{name}" data-opspace-c="{c:.3f}">'
        '<span style="flex:0 0 30%;overflow:hidden;text-overflow:ellipsis;white-space:nowrap" '
        f'title="{name}">{name}</span>'
        '<span style="flex:1;height:10px;border-radius:3px;background:rgba(140,140,140,0.22)">'
        '<span style="display:block;height:10px;border-radius:3px;'
        f'background:{ACTIVE if c >= 0.999 else blend_color(c)};width:{100.0 * c:.1f}%"></span></span>'
        + "".join(
            '<span style="flex:0 0 56px;text-align:right;font-variant-numeric:tabular-nums">'
            f"{one}</span>"
            for one in shown
        )
        + "</div>"
    )

"""What can be said of a figure without looking at it."""

import itertools

import numpy as np


def texts(figure):
    """Every text that is drawn, with its box in pixels."""
    figure.draw_without_rendering()
    found = [text for legend in figure.legends for text in legend.get_texts()]
    for axes in figure.axes:
        if not axes.axison:
            continue
        found += [axes.xaxis.label, axes.yaxis.label, axes.title, axes._left_title, *axes.texts]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                if low <= tick.get_loc() <= high:
                    found += [tick.label1]
    shown = [text for text in found if text.get_visible() and text.get_text().strip()]
    return [(text.get_text(), text.get_window_extent()) for text in shown]


def overlaps(figure):
    """Pairs of texts that lie on each other."""
    return [
        (a, b)
        for (a, box_a), (b, box_b) in itertools.combinations(texts(figure), 2)
        if min(box_a.x1, box_b.x1) - max(box_a.x0, box_b.x0) > 1.0
        and min(box_a.y1, box_b.y1) - max(box_a.y0, box_b.y0) > 1.0
    ]


def outside(figure):
    """Texts that the edge of the figure cuts."""
    width, height = figure.canvas.get_width_height()
    return [
        text
        for text, box in texts(figure)
        if box.x0 < 0 or box.y0 < 0 or box.x1 > width or box.y1 > height
    ]


def unlabelled(figure):
    """Axes of which neither they nor those that share their row or column say what they show."""
    shown = [axes for axes in figure.axes if axes.axison]
    rows, columns = {}, {}
    for axes in shown:
        place = axes.get_subplotspec()
        rows.setdefault(place.rowspan.start, []).append(axes.get_ylabel())
        columns.setdefault(place.colspan.start, []).append(axes.get_xlabel())
    lines = [*rows.values(), *columns.values()]
    return [line for line in lines if not any("[" in label and "]" in label for label in line)]


def contrast(image):
    """Spread of the pixels; 0 is blank."""
    return float(np.asarray(image, dtype=float).std())

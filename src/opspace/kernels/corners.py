"""Corners of a blend as bit sets: which variables are on, with what weight."""

from __future__ import annotations

from opspace.kernels.compiled_scalars import spread
from opspace.law.scalars import CHAINED
from opspace.machine.jit import jit


@jit
def corners(work, on, weight):
    """List the corners of the exact group times the chain (`opspace.law.combined`).

    Reads value, group, low and width (variables,), at most 62 of them.

    Args:
        work: `opspace.plan.records.TICK`.
        on: Filled with the variables that are on in each corner, as bit sets.
        weight: Filled with the weights.

    Returns:
        Number of corners with weight > 0.
    """
    h = work.value
    always = 0
    exact = 1
    on[0], weight[0] = 0, 1.0
    links = 0
    for k in range(h.shape[0]):
        if h[k] >= 1.0:
            always |= 1 << k
        elif h[k] > 0.0:
            if work.group[k] >= CHAINED:
                links = insert(k, work.low, work.order, links)
            else:
                exact = _branch(k, h[k], on, weight, exact)
    total = _chain(work, links, always, exact, on, weight)
    for c in range(total):  # written beyond the exact corners, now moved to the front
        on[c], weight[c] = on[exact + c], weight[exact + c]
    return total


@jit
def _chain(work, links, always, exact, on, weight):
    """Go through the orders that the chain has as its members lean (`opspace.law.leaning_chain`)."""
    order, first, share = work.order, work.first, work.first_weight
    first[0] = always
    share[0] = 0.0
    for i in range(links):
        first[i + 1], share[i + 1] = first[i] | 1 << order[i], 0.0
    y, total = 0.0, 0
    while True:
        meet, where = _next_meeting(work, links)
        meet = max(meet, y)
        _go_on(work, links, y, meet)
        y = meet
        if where < 0:
            break
        total = _emit(first[where + 1], share[where + 1], exact, total, on, weight)
        order[where], order[where + 1] = order[where + 1], order[where]
        first[where + 1], share[where + 1] = first[where] | 1 << order[where], 0.0
    for i in range(links + 1):
        total = _emit(first[i], share[i], exact, total, on, weight)
    return total


@jit
def _next_meeting(work, links):
    """Where on the way from 0 to 1 the next neighbours meet, and which: 1 and none at the end."""
    order, low, width = work.order, work.low, work.width
    meet, where = 1.0, -1
    for i in range(links - 1):
        a, b = order[i], order[i + 1]
        closing = width[b] - width[a]
        if closing > 0.0 and low[a] - low[b] < closing * meet:
            meet, where = (low[a] - low[b]) / closing, i
    return meet, where


@jit
def _go_on(work, links, y, end):
    """Add the weights of the way from y to end to those of the first few."""
    order, low, width = work.order, work.low, work.width
    before, moment_before = spread(y)
    after, moment_after = spread(end)
    part, moment = after - before, moment_after - moment_before
    above, rising = 1.0, 0.0
    for i in range(links + 1):
        below, climbing = 0.0, 0.0
        if i < links:
            below, climbing = low[order[i]], width[order[i]]
        work.first_weight[i] += (above - below) * part + (rising - climbing) * moment
        above, rising = below, climbing


@jit
def _emit(members, share, exact, total, on, weight):
    """Write one set of the chain with every corner of the exact group."""
    if share > 0.0:
        for c in range(exact):
            on[exact + total] = on[c] | members
            weight[exact + total] = weight[c] * share
            total += 1
    return total


@jit
def insert(k, h, order, links):
    """Keep a chain sorted, the most active first, equal ones in the order of the variables."""
    i = links
    while i > 0 and h[order[i - 1]] < h[k]:
        order[i] = order[i - 1]
        i -= 1
    order[i] = k
    return links + 1


@jit
def _branch(k, h, on, weight, total):
    for c in range(total):
        on[total + c] = on[c] | (1 << k)
        weight[total + c] = weight[c] * h
        weight[c] *= 1.0 - h
    return 2 * total


@jit
def sort_corners(masks, weights, count):
    """Sort corners by falling mask and join those that are the same stack.

    Returns:
        Number of different stacks.
    """
    gap = 1
    while 3 * gap < count:
        gap = 3 * gap + 1
    while gap > 0:  # Shell's sort: in place, and short where few corners are the rule
        for i in range(gap, count):
            mask, weight = masks[i], weights[i]
            j = i
            while j >= gap and masks[j - gap] < mask:
                masks[j], weights[j] = masks[j - gap], weights[j - gap]
                j -= gap
            masks[j], weights[j] = mask, weight
        gap = (gap - 1) // 3
    kept = 0
    for i in range(1, count):
        if masks[i] == masks[kept]:
            weights[kept] += weights[i]
        else:
            kept += 1
            masks[kept], weights[kept] = masks[i], weights[i]
    return kept + 1 if count > 0 else 0

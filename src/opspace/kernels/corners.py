"""Corners of a blend as bit sets: which variables are on, with what weight."""

from __future__ import annotations

from opspace.machine.jit import jit


@jit
def corners(h, count, chained, on, weight, order):
    """List the corners of the exact group times the chain (`opspace.law.combined`).

    Args:
        h: (count,) activations.
        count: Number of variables, at most 62.
        chained: (count,) whether a variable that moves is in the chain.
        on: Filled with the variables that are on in each corner, as bit sets.
        weight: Filled with the weights.
        order: (count,) scratch.

    Returns:
        Number of corners with weight > 0.
    """
    always = 0
    total = 1
    on[0], weight[0] = 0, 1.0
    links = 0
    for k in range(count):
        if h[k] >= 1.0:
            always |= 1 << k
        elif h[k] > 0.0:
            if chained[k] != 0:
                links = insert(k, h, order, links)
            else:
                total = _branch(k, h[k], on, weight, total)
    # The chain: its i most active variables, with weight h_(i) − h_(i+1).
    exact = total
    total = 0
    first = exact  # written beyond the exact corners, then moved to the front
    members = always
    before = 1.0
    for i in range(links + 1):
        after = h[order[i]] if i < links else 0.0
        if before > after:
            for c in range(exact):
                on[first + total] = on[c] | members
                weight[first + total] = weight[c] * (before - after)
                total += 1
        if i < links:
            members |= 1 << order[i]
            before = after
    for c in range(total):
        on[c], weight[c] = on[first + c], weight[first + c]
    return total


@jit
def insert(k, h, order, links):
    """Keep the chain sorted, the most active first, equal ones in the order of the variables."""
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

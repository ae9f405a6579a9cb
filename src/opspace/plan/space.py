"""The memory that a walk down the levels works in, made once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from opspace.machine.record import Handle


class Space(NamedTuple):
    """Arrays of a walk over stacks with up to D levels, R rows in a level and n joints.

    The first axis of the arrays in the first group is the depth: what the levels above have decided.

    Attributes:
        Z: (D + 1, n, n) basis of the motions still free, vectors as rows; the identity while all are.
        u: (D + 1, n) whitened torque so far.
        free: (D + 1,) number of motions still free.
        V: (D + 1, n, n) directions of a level that branches, strongest first, then what it leaves.
        strength: (D + 1, n) what each direction adds to the torque.
        share: (D + 1, n + 1) weight of the alternative with that many directions.
        path: (D + 1,) weight of the branch that led here.
        cursor: (D + 1, 6) corners of the node (first, end), next corner, group (first, end),
            next alternative.
        alternatives: (D + 1,) number of alternatives of the group.
        top: (D + 1,) strongest weight that a level has been solved with.
        chosen: (D + 1,) task sets present at a level when that was.
        width: (D + 1,) motions free above a level when that was.
        off: (D + 1,) whether a direction of a level was faded when that was.
        faded: (1,) whether a direction of the level solved last is faded.
        B: (R, n) rows of a level in the basis of the free motions.
        C: (n, R) their columns, when there are more rows than columns.
        column: (n,) free motions that the rows move, then the others.
        residual: (R,) what the levels above leave to be done.
        rows: (R,) the rows of a level that are present.
        G: (n, n) scratch.
        R: (n, n) triangular factor.
        Y: (n, n) right singular vectors.
        x: (n,) scratch.
        y: (R,) scratch.
        scale: (n,) scratch.
        sigma: (n,) singular values.
        kept: (rows, n) B of each level when ``top`` was found, from row ``first_kept`` of it on.
        first_kept: (D + 1,) where that begins for each level.
        motors: (1,) whether torque limits are kept.
        inertia: Handle of the inertia's factor.
        start: (n,) torque before the first level, inside the limits, N·m.
        limit: (n,) largest torque of each joint, N·m.
        torque: (D + 1, n) torque so far, N·m.
        part: (n,) scratch.
        got: (D + 1, 2) sums of weight times scale, and of weight, of each level.
    """

    Z: np.ndarray
    u: np.ndarray
    free: np.ndarray
    V: np.ndarray
    strength: np.ndarray
    share: np.ndarray
    path: np.ndarray
    cursor: np.ndarray
    alternatives: np.ndarray
    top: np.ndarray
    chosen: np.ndarray
    width: np.ndarray
    off: np.ndarray
    faded: np.ndarray
    B: np.ndarray
    C: np.ndarray
    column: np.ndarray
    residual: np.ndarray
    rows: np.ndarray
    G: np.ndarray
    R: np.ndarray
    Y: np.ndarray
    x: np.ndarray
    y: np.ndarray
    scale: np.ndarray
    sigma: np.ndarray
    kept: np.ndarray
    first_kept: np.ndarray
    motors: np.ndarray
    inertia: Handle
    start: np.ndarray
    limit: np.ndarray
    torque: np.ndarray
    part: np.ndarray
    got: np.ndarray


def make_space(n: int, depth: int, rows: int, inertia: Handle) -> Space:
    """Make the memory for ``n`` joints, ``depth`` levels and ``rows`` rows in a level."""
    D, R, most = depth + 1, max(rows, 1), max(rows, n, 1)
    integers = np.int64
    return Space(
        Z=np.zeros((D, n, n)),
        u=np.zeros((D, n)),
        free=np.zeros(D, integers),
        V=np.zeros((D, n, n)),
        strength=np.zeros((D, n)),
        share=np.zeros((D, n + 1)),
        path=np.zeros(D),
        cursor=np.zeros((D, 6), integers),
        alternatives=np.zeros(D, integers),
        top=np.zeros(D),
        chosen=np.zeros(D, integers),
        width=np.zeros(D, integers),
        off=np.zeros(D, integers),
        faded=np.zeros(1, integers),
        B=np.zeros((most, n)),
        C=np.zeros((n, most)),
        column=np.zeros(n, integers),
        residual=np.zeros(most),
        rows=np.zeros(R, integers),
        G=np.zeros((n, n)),
        R=np.zeros((n, n)),
        Y=np.zeros((n, n)),
        x=np.zeros(most),
        y=np.zeros(most),
        scale=np.zeros(most),
        sigma=np.zeros(n),
        kept=np.zeros((R, n)),
        first_kept=np.zeros(D, integers),
        motors=np.zeros(1, integers),
        inertia=inertia,
        start=np.zeros(n),
        limit=np.full(n, np.inf),
        torque=np.zeros((D, n)),
        part=np.zeros(n),
        got=np.zeros((D, 2)),
    )


def space_handle(s: Space) -> Handle:
    """Make the handle with which compiled functions reach a `Space`."""
    return Handle("Space", s._asdict())

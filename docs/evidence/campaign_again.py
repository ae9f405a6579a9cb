"""Repeat the runs of a campaign in which a body came too near, and say what it was: docs/safety.md.

``python docs/evidence/campaign_again.py results/sweep/random`` (some minutes) repeats those that came
nearer than the margin unsaid with the masses that the controller knows and without friction, and
measures in those with ``COLLISION_LOST`` how near a body came in the end.
"""

import sys
from pathlib import Path

import numpy as np
from campaign import moving, read

from opspace.loop import simulate
from opspace.scenario.build import build
from opspace.scenario.load import scenario_from
from opspace.sweep.limit_measures import LimitWatch

UNKNOWN = ("mass_error", "dry_friction")
"""What the plant has and the controller does not know."""


class Depth:
    """How much nearer than the margin a pair came that had been outside of it, m; said or not."""

    def __init__(self, built):
        self._guard = built.controller.collisions
        self._within = None
        self.most = 0.0

    def observe(self, q, v, command):
        """See one tick."""
        del q, v
        margin = self._guard.margin
        beyond = {pair: margin - d.distance for pair, d in command.distances.items()}
        beyond = {pair: depth for pair, depth in beyond.items() if depth > 0.0}
        self._within = beyond.keys() & (beyond.keys() if self._within is None else self._within)
        self.most = max([self.most, *(beyond[pair] for pair in beyond.keys() - self._within)])


def again(content, watch):
    """Run a scenario once more with an observer of the run."""
    scenario = scenario_from(content)
    built = build(scenario)
    watching = watch(built)
    simulate(
        built.plant,
        built.controller,
        scenario.duration,
        [watching, built.triggers],
        built.stop,
    )
    return watching


def known(content):
    """Return a scenario whose plant has what the controller knows of it."""
    plant = {key: value for key, value in content["plant"].items() if key not in UNKNOWN}
    return {**content, "plant": plant}


def main(directory):
    """Repeat, and print."""
    _, rows = read(directory)
    unsaid = [row for row in rows if (row["numbers"].get("distance_excess") or 0.0) > 0.0]
    left = [again(known(row["scenario"]), LimitWatch).numbers["distance_excess"] for row in unsaid]
    print(
        f"{len(unsaid)} nearer unsaid; with known masses and no friction {np.count_nonzero(left)}"
    )
    for what, moves in (("still", False), ("moving", True)):
        lost = [row for row in rows if "COLLISION_LOST" in row["seconds"] and moving(row) is moves]
        depths = [again(row["scenario"], Depth).most for row in lost]
        touching = sum(
            depth > row["scenario"]["collisions"]["margin"]
            for depth, row in zip(depths, lost, strict=True)
        )
        print(
            f"{what}: {len(lost)} lost, nearer than the margin by {np.median(depths):.2g} m in the "
            f"median, {max(depths):.2g} m at most; touching: {touching}"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))

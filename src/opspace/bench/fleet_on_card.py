"""What a robot of the fleet that is timed takes of a graphics card, which need not be there."""

from __future__ import annotations

from collections.abc import Sequence

from opspace.bench.fleet_steps import fleet_stack
from opspace.bench.scenes import SCENES
from opspace.fleet import Fleet
from opspace.fleet.card_code import card_code

CARD_HEADS = (
    *("robot", "card", "numbers", "registers", "local memory [B]", "spilled, read again [B]"),
    *("instructions", "compiled in [s]"),
)


def fleet_on_card(
    arch: str, scene: str = "panda", dtypes: Sequence[str] = ("float32", "float64")
) -> list[tuple[str, ...]]:
    """Compile a fleet for a kind of card.

    Args:
        arch: The kind of card, as ``"sm_90"``.
        scene: Whose robot.
        dtypes: Types of numbers.

    Returns:
        Rows for `CARD_HEADS`, each for one robot, which is one thread.

    Raises:
        InputError: Warp does not compile for that card.
        MissingExtraError: Warp or the robot is not installed.
    """
    robot, rows = SCENES[scene].robot(), []
    reference = SCENES[scene].states(robot)[0][0]
    for dtype in dtypes:
        fleet = Fleet(robot, fleet_stack(robot, reference), 1, device="cpu", dtype=dtype)
        code = card_code(fleet, arch)
        spills = "not known" if code.spills is None else "{}, {}".format(*code.spills)
        needs = (code.needs.registers, code.needs.local, spills, code.needs.instructions)
        told = (scene, arch, dtype, *map(str, needs), f"{code.seconds:.0f}")
        rows.append(told)
    return rows

"""What a robot of the fleet that is timed takes of a graphics card, which need not be there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from opspace.bench.fleet_steps import fleet_stack
from opspace.bench.scenes import SCENES
from opspace.fleet import Fleet
from opspace.fleet.card_code import card_code
from opspace.stack import Stack
from opspace.tasks import JointLimits

CARD_HEADS = (
    *("robot", "card", "numbers", "registers", "local memory [B]", "workspace [B]"),
    *("spilled, read again [B]", "instructions", "compiled in [s]"),
)


LARGE = "humanoid"
"""The scene whose robot is too large for the memory of a thread."""


def fleet_on_card(
    arch: str,
    scenes: Sequence[str] = ("panda", LARGE),
    dtypes: Sequence[str] = ("float32", "float64"),
) -> list[tuple[str, ...]]:
    """Compile fleets for a kind of card.

    Args:
        arch: The kind of card, as ``"sm_90"``.
        scenes: Whose robots; a large one has the tasks of its scene, arms have a pose and a posture.
        dtypes: Types of numbers.

    Returns:
        Rows for `CARD_HEADS`, each for one robot, which is one thread.

    Raises:
        InputError: Warp does not compile for that card.
        MissingExtraError: Warp or a robot is not installed.
    """
    rows = []
    for name, dtype in product(scenes, dtypes):
        scene = SCENES[name]
        robot = scene.robot()
        if name == LARGE:
            stack = Stack([list(level) for level in scene.levels()], limits=JointLimits())
        else:
            stack = fleet_stack(robot, scene.states(robot)[0][0])
        code = card_code(Fleet(robot, stack, 1, device="cpu", dtype=dtype), arch)
        spills = "not known" if code.spills is None else "{}, {}".format(*code.spills)
        memory = (code.needs.registers, code.needs.local, code.workspace)
        told = (name, arch, dtype, *map(str, memory), spills, str(code.needs.instructions))
        rows.append((*told, f"{code.seconds:.0f}"))
    return rows

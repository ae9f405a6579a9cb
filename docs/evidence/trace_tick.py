"""Follow one ordinary tick of the readable form by name: functions, files, moves between files.

A PUMA 560 in motion holds orientation, position and posture of its tool under joint limits while a
joint task is on its way in. The profiler reports every call and every return of a Python function of
the package. A move is a call or a return whose file is another one than that of the line before: to
call a function of another file and to come back from it are two moves. Functions of other packages,
and what they call back, are passed over; comprehensions that Python runs as functions count as part
of the function around them.

Run it as ``python docs/evidence/trace_tick.py``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FrameType

import numpy as np

import opspace as osc
from opspace.controller import ReferenceController

HOME = Path(osc.__file__).parent
TICKS, PERIOD = 100, 0.001


@dataclass
class Trace:
    """What one tick went through.

    Attributes:
        calls: Every call in order: depth, file within the package, name of the function.
        moves: How often the file changed, by a call or by a return.
    """

    calls: list[tuple[int, str, str]] = field(default_factory=list)
    moves: int = 0

    @property
    def functions(self) -> list[tuple[str, str]]:
        """The functions, (file, name), in the order in which they were first called."""
        return list(dict.fromkeys((file, name) for _, file, name in self.calls))

    @property
    def files(self) -> list[str]:
        """The files in the order in which they were first entered."""
        return list(dict.fromkeys(file for _, file, _ in self.calls))

    def stages(self, driver: str) -> Iterator[tuple[str, str, list[str]]]:
        """Follow what one function calls.

        Args:
            driver: Name of the function whose calls are the stages.

        Yields:
            Name and file of each stage, and the functions inside it in the order of their calls.
        """
        at = next(i for i, call in enumerate(self.calls) if call[2] == driver)
        depth = self.calls[at][0]
        stage: tuple[str, str, list[str]] | None = None
        for level, file, name in self.calls[at + 1 :]:
            if level <= depth:
                break
            if level == depth + 1:
                if stage is not None:
                    yield stage
                stage = (name.rpartition(".")[2], file, [])
            elif stage is not None and name not in stage[2]:
                stage[2].append(name)
        if stage is not None:
            yield stage


def controller_in_motion() -> tuple[ReferenceController, Iterator[tuple[float, list, list]]]:
    """Build the controller and the states of its ticks."""
    robot = osc.load_robot("puma560")
    stack = osc.Stack(
        [
            osc.JointLimits(),
            osc.OrientationTask("tool"),
            osc.PositionTask("tool"),
            osc.PostureTask(),
        ]
    )
    controller = ReferenceController(robot, stack)
    joint = osc.JointTask("joint1", target=0.3, name="coming")
    stack.insert(joint, level=0.5, duration=0.4)
    q0 = np.array([0.1, -0.6, 0.9, 0.2, 0.8, -0.3])
    v = np.array([0.2, -0.1, 0.3, 0.1, -0.2, 0.15])
    states = ((k * PERIOD, q0 + v * k * PERIOD, v) for k in range(TICKS + 1))
    return controller, states


def traced() -> Trace:
    """Trace the last of some ticks."""
    controller, states = controller_in_motion()
    found = Trace()
    names: dict[CodeType, tuple[str, str] | None] = {}

    def place(code: CodeType) -> tuple[str, str] | None:
        if code not in names:
            path = Path(code.co_filename)
            inside = HOME in path.parents and not code.co_name.startswith("<")
            names[code] = (path.relative_to(HOME).as_posix(), code.co_name) if inside else None
        return names[code]

    way: list[str] = []

    def go(file: str) -> None:
        found.moves += bool(way) and way[-1] != file
        way[:] = [file]

    inside: list[str] = []

    def watch(frame: FrameType, event: str, _: object) -> None:
        if event not in ("call", "return") or (here := place(frame.f_code)) is None:
            return
        if event == "call":
            found.calls.append((len(inside), *here))
            inside.append(here[0])
            go(here[0])
        elif inside:
            inside.pop()
            if inside:
                go(inside[-1])

    for t, q, v in states:
        if t == TICKS * PERIOD:
            sys.setprofile(watch)
        try:
            controller.step(t, q, v)
        finally:
            sys.setprofile(None)
    return found


def main() -> None:
    """Print the trace."""
    trace = traced()
    print(f"functions {len(trace.functions)}, files {len(trace.files)}, moves {trace.moves}")
    if "-v" in sys.argv:
        for depth, file, name in trace.calls:
            print(f"{'  ' * depth}{file}: {name}")


if __name__ == "__main__":
    main()

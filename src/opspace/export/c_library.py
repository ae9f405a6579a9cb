"""A controller as a C library: its numbers as a source, the kernels as an object, and a header."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from opspace.command import Status
from opspace.controller import Controller, falling
from opspace.controller.exported import Exported, exported
from opspace.controller.reference import ReferenceController
from opspace.controller.watchdog import JUMP, MISSED
from opspace.errors import InputError
from opspace.export.own_kernels import frozen
from opspace.kernels import columns, led_columns, stance_columns
from opspace.law import PROFILES, press_columns
from opspace.law.scalars import LARGEST_STEP, MAY_GIVE_UP, MOST_UNREST, NO_GROUP, TANH_EDGE
from opspace.machine.freeze import MEMORY, Frozen
from opspace.machine.processor import host
from opspace.plan.entries import KERNELS
from opspace.plan.pack_task import Packed
from opspace.plan.records import TICK
from opspace.record.whole_file import whole_file
from opspace.stack import contact_course
from opspace.tasks import ForceTask

SOURCES = Path(__file__).parent / "c"
COLUMNS = {
    "KIND": ("KIND_SIZE", "REMEMBERS", "KIND", "FORCE", "PRESS"),
    "NUMBERS": (
        *("NUMBERS_SIZE", "GOAL_ROTATION", "GOAL_POSITION", "GOAL_VELOCITY"),
        "GOAL_ACCELERATION",
    ),
    "VARIABLE": ("VARIABLE_SIZE",),
    "OPTION": ("DAMPING",),
    "ANSWER": ("SOLVE",),
}
"""What the C source must know of `opspace.kernels.columns`, by the array that has it."""
PRESS = (
    *("WHEN", "BEGUN", "GIVEN_AT", "FROZEN", "CONFIDENCE", "FLOOR", "GIVEN", "WANTED"),
    *("FORCES", "OFF", "ON", "KI", "KP", "PRESS_SIZE"),
)
"""What it must know of `opspace.law.press_columns`."""
INNER = (
    "space.first_kept",
    *(f"stance.{name}" for name in ("count", "rows", "place", "edges", "numbers", "motion")),
    *(f"led.{name}" for name in ("asked_goal", "joint_asked", "more", "joint_more", "asked", "on")),
    *(f"integrals.{name}" for name in ("ki", "integral", "joint_integral", "since")),
    *(f"stance.{name}" for name in ("force", "most", "cone", "metric", "reference", "hindrance")),
)
"""Arrays of records in the record of a tick, or beside it, that the C source writes."""
CMAKE = """\
cmake_minimum_required(VERSION 3.13)
project(opspace_{name} LANGUAGES C)

add_library(opspace_{name} STATIC {name}.c {sources} opspace_kernels.o)
add_library(opspace::{name} ALIAS opspace_{name})
set_source_files_properties(opspace_kernels.o PROPERTIES EXTERNAL_OBJECT TRUE)
set_target_properties(opspace_{name} PROPERTIES C_STANDARD 99 POSITION_INDEPENDENT_CODE ON)
target_include_directories(opspace_{name} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})
target_link_libraries(opspace_{name} PUBLIC m)
"""
NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
TARGETS = {
    columns.POSITION: (3, 0, 0),
    columns.ORIENTATION: (0, 9, 0),
    columns.POSE: (3, 9, 0),
}
"""Numbers of a target: position, rotation, joints."""


def export_c(
    controller: ReferenceController,
    directory: Path | str,
    name: str = "controller",
    *,
    absent: Sequence[str] = (),
    levels: Sequence[float] = (),
    moves: int = 2,
    profile: str = "quintic",
    own_kernels: bool = False,
    overwrite: bool = False,
) -> Path:
    """Write a controller as files that a C or C++ program is linked with.

    The program needs no Python, and its torque is that of `Controller.step` to the last bit. It
    begins as a controller that has not ticked, with the tasks, targets and gains of this moment.

    Args:
        controller: A `Controller`.
        directory: Where the files go; it is made.
        name: Name of the model in C, and of its files.
        absent: Names of tasks and contacts of the stack that are not there at first and come later.
        levels: Numbers of levels to which tasks will move, beside those of the stack.
        moves: How many moves and swaps can be on their way at once; each has its memory and its part
            of a tick.
        profile: Profile of all transitions, see `opspace.Profile`.
        own_kernels: Compile kernels for this controller alone, which takes as long as compiling all
            of them. They know its sizes and its robot, which makes them faster; the torque differs
            from that of `Controller.step` in its last bits, and a program has one of it at a time.
        overwrite: Replace files that are already there.

    Returns:
        The directory.

    Raises:
        InputError: The controller does something at its ticks that only Python can; the name is no
            name in C; a file is there already or cannot be written.
        UnknownNameError: The stack has no task or contact of a name, or there is no such profile.
    """
    if not isinstance(controller, Controller):
        raise InputError(f"only a Controller can be exported, not {type(controller).__name__}")
    if not NAME.fullmatch(name) or name.startswith("opspace"):
        raise InputError(f"{name!r} is no name for a model in C: letters, digits and _")
    found = exported(controller, absent, profile, levels, moves)
    own = frozen(found) if own_kernels else None
    files = {
        "opspace_codes.h": _codes().encode(),
        "opspace_layout.h": _layout().encode(),
        f"{name}.h": _header(name, found).encode(),
        f"{name}.c": _source(name, found, PROFILES.index(profile), own).encode(),
        "opspace_kernels.o": KERNELS.object() if own is None else KERNELS.object_for(own),
        "CMakeLists.txt": CMAKE.format(name=name, sources=" ".join(_c_sources())).encode(),
        **{path.name: path.read_bytes() for path in sorted(SOURCES.iterdir())},
    }
    directory = Path(directory)
    for file, content in files.items():
        with whole_file(directory / file, overwrite=overwrite) as unfinished:
            unfinished.write_bytes(content)
    return directory


def _c_sources() -> list[str]:
    """List the sources of the library."""
    return sorted(path.name for path in SOURCES.glob("*.c"))


def _codes() -> str:
    """What a step answers, and what can be read after it."""
    codes = {f"OPSPACE_{one.name}": int(one) for one in (Status(0), *Status)}
    refused = {"NOT_FINITE": -1, "NO_TASK": -2, "REFUSED": -3, "NO_WRENCH": -4, "BUSY": -5}
    codes |= {f"OPSPACE_{word}": code for word, code in refused.items()}
    enum = "".join(f"    {word} = {code},\n" for word, code in codes.items())
    read = "".join(
        f" * {field.name} ({', '.join(map(str, field.shape))}): {field.meaning}"
        f"{f' [{field.unit}]' if field.unit else ''}\n"
        for field in TICK.fields
        if field.lives == "reported" and field.dtype is np.float64
    )
    return (
        f"{_written()}#ifndef OPSPACE_CODES_H\n#define OPSPACE_CODES_H\n\n"
        f"enum {{\n{enum}}};\n\n/* Names for opspace_read:\n{read} */\n\n#endif\n"
    )


def _layout() -> str:
    """What only the C source of the library uses."""
    known = vars(columns)
    lines = [
        f"#define {word if word.endswith('_SIZE') else f'{array}_{word}'} {known[word]}\n"
        for array, words in COLUMNS.items()
        for word in words
    ]
    lines += [
        f"#define {word if word.endswith('_SIZE') else f'PRESS_{word}'} {vars(press_columns)[word]}\n"
        for word in PRESS
    ]
    numbers = {
        "TARGET_STEP": LARGEST_STEP,
        "TIME_JUMP_PERIODS": JUMP,
        "TIME_LATE_PERIODS": MISSED,
        "HALF_TURN": np.pi,
        "TANH_EDGE": TANH_EDGE,
        "MOST_UNREST": MOST_UNREST,
        "FALL_SLACKENING": falling.SLACKENING,
        "FALL_SLOWER": falling.SLOWER,
        "FALL_LESS": falling.LESS,
        "FALL_MAY_GIVE_UP": MAY_GIVE_UP,
        "CONTACT_MOTION_PART": contact_course.MOTION_PART,
        "CONTACT_STOP": contact_course.STOP,
        "CONTACT_CALMER": contact_course.CALMER,
        "CONTACT_CALMEST": contact_course.CALMEST,
        "CONTACT_RECOVERY": contact_course.RECOVERY,
    }
    whole = {
        **{f"PROFILE_{one.upper().replace('-', '_')}": k for k, one in enumerate(PROFILES)},
        "GROUP_NONE": NO_GROUP,
        "FROM_FOLLOWED": led_columns.FROM_FOLLOWED,
        "FROM_FOUND": led_columns.FROM_FOUND,
        "GOAL_TURN": led_columns.GOAL_TURN,
        "GOAL_PLACE": led_columns.GOAL_PLACE,
        "GOAL_SIZE": led_columns.GOAL_SIZE,
        "CONTACT_PLACE_SIZE": stance_columns.PLACE_SIZE,
        "CONTACT_NUMBERS_SIZE": stance_columns.NUMBERS_SIZE,
        "CONTACT_CONE_SIZE": stance_columns.MOST_EDGES * stance_columns.SOLE_ROWS,
    }
    lines += [f"#define {word} {x}\n" for word, x in whole.items()]
    lines += [f"#define {word} {float(x)!r}\n" for word, x in numbers.items()]
    lines.append(f'#define OPSPACE_MODEL_FORM "{_form()}"\n')
    return f"{_written()}{''.join(lines)}"


def _form() -> str:
    """Return what changes with the structure of a model in C."""
    return hashlib.sha256((SOURCES / "opspace.h").read_bytes()).hexdigest()[:16]


def _header(name: str, found: Exported) -> str:
    """Declare the model, its sizes and the numbers of its tasks."""
    guard = f"{name.upper()}_H"
    sizes = {"N": found.plan.n, "NQ": found.robot.nq, "TASKS": len(found.plan.packed)}
    numbers = {f"{name.upper()}_{word}": x for word, x in sizes.items()}
    for i, packed in enumerate(found.plan.packed):
        word = re.sub(r"\W", "_", packed.task.name, flags=re.ASCII)
        if numbers.setdefault(f"{name.upper()}_TASK_{word}", i) != i:
            raise InputError(f"in C the name of task {packed.task.name!r} is another task's, too")
    for i, contact in enumerate(found.contacts):
        word = re.sub(r"\W", "_", contact.name, flags=re.ASCII)
        if numbers.setdefault(f"{name.upper()}_CONTACT_{word}", i) != i:
            raise InputError(f"in C the name of contact {contact.name!r} is another one's, too")
    enum = "".join(f"    {word} = {x},\n" for word, x in numbers.items())
    return (
        f'{_written()}#ifndef {guard}\n#define {guard}\n\n#include "opspace.h"\n\n'
        f"enum {{\n{enum}}};\n\n"
        f'#ifdef __cplusplus\nextern "C" {{\n#endif\n\nextern const opspace_model {name};\n\n'
        "#ifdef __cplusplus\n}\n#endif\n\n#endif\n"
    )


def _source(name: str, found: Exported, profile: int, own: Frozen | None) -> str:
    """Write the numbers of the model."""
    words, runs = found.image.words, list(_runs(found.image.words))
    content = [format(x, "#x") for first, count in runs for x in words[first : first + count]]
    tasks = [_task(packed, at) for packed, at in zip(found.plan.packed, found.at, strict=True)]
    outer = {field.name: int(field.dtype is np.int64) for field in TICK.fields}
    fields = [
        f'{{"{inner}", {found.image.first[inner]}, {_size(found, inner)}, {own}}}'
        for inner, own in {**outer, **dict.fromkeys(INNER, 1)}.items()
        if inner in found.image.first
    ]
    touched = [_contact(found, i) for i in range(len(found.contacts))]
    arrays = {
        "const char *const joint": [_text(joint) for joint in found.robot.joint_names],
        "const opspace_task task": tasks or ["{0}"],
        "const double level": [repr(level) for level in found.levels] or ["0"],
        "const int quaternion": list(map(str, found.robot.description.quaternions)) or ["0"],
        **{f"const double contact_{i}": x for i, (_, x) in enumerate(touched)},
        "const opspace_contact contact": [words for words, _ in touched] or ["{0}"],
        **_fall(found),
        "const opspace_field field": fields,
        "const opspace_run run": [f"{{{first}, {count}}}" for first, count in runs],
        "const uint64_t content": content,
        "const int64_t address": [str(i) for i in found.image.addresses],
    }
    data = "".join(
        f"static {declared}[] = {{\n{_wrapped(items)}}};\n" for declared, items in arrays.items()
    )
    memory = f"extern uint64_t {MEMORY}[];\n\n" if own else ""
    members = [
        _text(f"{KERNELS.stamp}-{f'{own.stamp}-' if own else ''}{_form()}"),
        *map(str, (found.plan.n, found.robot.nq, len(tasks))),
        *("joint", "task", str(found.moves), str(profile), str(len(found.levels)), "level"),
        *(str(found.base), str(len(found.robot.description.quaternions)), "quaternion"),
        *(str(len(found.contacts)), "contact", "fall" if found.fall else "0"),
        *(str(len(fields)), "field"),
        *(repr(found.period), str(int(found.robot_adds))),
        *map(str, (words.size, found.image.handle)),
        *(str(found.image.beside.get("integrals", -1)), str(len(runs))),
        *("run", "content", str(found.image.addresses.size), "address"),
        MEMORY if own else "0",
    ]
    return (
        f'{_written()}#include "{name}.h"\n\n{memory}{data}\n'
        f"const opspace_model {name} = {{\n{_wrapped(members)}}};\n"
    )


def _fall(found: Exported) -> dict[str, list[str]]:
    """Write the rule by which the robot is given up, where there is one."""
    if found.fall is None:
        return {}
    after, cosine, *upright = map(_number, found.fall.numbers)
    return {"const opspace_fall fall": [f"{{{after}, {cosine}, {{{', '.join(upright)}}}}}"]}


def _contact(found: Exported, i: int) -> tuple[str, list[str]]:
    """Write a contact, and the numbers that it leads to."""
    assert found.plan.contacts is not None
    stance, contact = found.plan.contacts.record, found.contacts[i]
    body, joint, rows, first = stance.place[i].tolist()
    own = slice(first, first + rows)
    numbers = [stance.numbers[i], stance.cone[i].ravel(), stance.metric[own], stance.reference[own]]
    words = [_text(contact.name), int(found.there[i]), rows, body, joint, stance.edges[i].item()]
    words += [_number(stance.most[i].item()), f"contact_{i}"]
    content = [_number(x) for x in np.concatenate(numbers).tolist()]
    return f"{{{', '.join(map(str, words))}}}", content


def _number(x: float) -> str:
    """Write a double so that it comes back to the last bit; what has no end is larger than all."""
    return repr(x) if np.isfinite(x) else "1e999"


def _task(packed: Packed, level: int) -> str:
    kind = packed._tick.kind[packed.index]
    position, rotation, joints = _target(packed, kind)
    rows = packed.rows
    task = packed.task
    led = int(getattr(task, "max_acceleration", None) is not None)
    graded = int(isinstance(task, ForceTask) and not task.thresholds_are_given)
    return (
        f"{{{_text(task.name)}, {rows.start}, {rows.stop - rows.start}, "
        f"{position}, {rotation}, {joints}, {level}, {led}, {graded}}}"
    )


def _target(packed: Packed, kind: np.ndarray) -> tuple[int, int, int]:
    """Numbers of a target: position, rotation, joints."""
    if kind[columns.KIND] == columns.JOINTS:
        return 0, 0, packed.task.rows
    if kind[columns.KIND] == columns.FORCE:
        return 0, 0, 0
    return TARGETS[int(kind[columns.QUANTITY])]


def _size(found: Exported, name: str) -> int:
    record: Any = found.plan.tick
    first, _, rest = name.partition(".")
    if first in found.image.beside:
        assert found.plan.integrals is not None
        record, name = found.plan.integrals.record, rest
    for part in name.split("."):
        record = getattr(record, part)
    return record.size


def _runs(words: np.ndarray) -> Iterator[tuple[int, int]]:
    """Find the pieces that are not zero; most of the memory of a tick is, before the first one."""
    there = np.flatnonzero(words)
    if there.size:
        breaks = np.flatnonzero(np.diff(there) > 1) + 1
        for part in np.split(there, breaks):
            yield int(part[0]), part.size


def _wrapped(items: Sequence[str]) -> str:
    """Lay items out in lines that an editor can show."""
    lines, line = [], "   "
    for item in items:
        if len(line) + len(item) > 98:
            lines.append(line)
            line = "   "
        line += f" {item},"
    return "".join(f"{one}\n" for one in [*lines, line])


def _text(word: str) -> str:
    """Write a name as C's compiler reads it, in UTF-8."""
    plain = "".join(
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in word.encode()
    )
    return f'"{plain}"'


def _written() -> str:
    return f"/* Written by opspace {metadata.version('opspace')} for {host().cpu}. */\n"

"""What a scenario can say about a task, made from the signature of the task's constructor."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    NamedTuple,
    Union,
    get_type_hints,
)

from pydantic import AfterValidator, Discriminator, Field, Tag, create_model, model_validator

from opspace.scenario.fields import Checked, Entry, Number, problem, shown, whole
from opspace.scenario.surface_entries import ActivationEntry
from opspace.scenario.targets import (
    JointTarget,
    OrientationTarget,
    Point,
    PointTarget,
    PoseTarget,
    PostureTarget,
    tag_of,
)
from opspace.tasks import TASK_KINDS
from opspace.tasks.kinds import TaskKind

if TYPE_CHECKING:
    from typing_extensions import Self

Gain = float | tuple[float, ...]
Stiffness = Annotated[Gain, Number("1/s²", at_least=0.0, size="rows")]
Damping = Annotated[Gain, Number("1/s", at_least=0.0, size="rows")]
BlockStiffness = Annotated[float, Number("1/s²", at_least=0.0)]
LinearSpeed = Annotated[float, Number("m/s", above=0.0)]
AngularSpeed = Annotated[float, Number("rad/s", above=0.0)]
JointSpeed = Annotated[float, Number("rad/s or m/s", above=0.0)]
LinearAcceleration = Annotated[float, Number("m/s²", above=0.0)]
AngularAcceleration = Annotated[float, Number("rad/s²", above=0.0)]
JointAcceleration = Annotated[float, Number("rad/s² or m/s²", above=0.0)]
PoseAccelerations = Annotated[
    tuple[float, ...], Number("linear m/s², angular rad/s²", above=0.0, size=2)
]
PoseSpeeds = Annotated[tuple[float, ...], Number("linear m/s, angular rad/s", above=0.0, size=2)]

GIVING_WAY = ("position", "impedance")
"""Tasks whose target may give way to what is pressed."""
_GIVE_WAY = "name of the force task along whose force the target follows the tool in contact"
_TARGET = "value or reference to follow; null holds the value at the start"


class PlacedEntry(Entry):
    """What every task has, whatever it asks for."""

    level: Annotated[int, Checked(whole)] = Field(description="priority, 0 is the highest")
    present: bool = Field(
        default=True,
        description="whether it is in the stack at the start; one that an event inserts first is not",
    )
    activation: ActivationEntry | None = Field(
        default=None, description="what its presence is multiplied with; null is nothing"
    )
    if TYPE_CHECKING:  # every kind has its own
        type: str


class TaskEntry(PlacedEntry):
    """What every task has that is led to a target or presses."""

    if TYPE_CHECKING:  # every kind has its own
        target: Any


class GainsEntry(TaskEntry):
    """What tasks have that follow a target."""

    kp: Stiffness = Field(default=100.0, description="stiffness [1/s²], a number or one per row")
    kv: Damping | None = Field(
        default=None, description="damping [1/s]; null is critical, 2 sqrt(kp)"
    )

    def rows(self) -> int | None:
        """Number of task rows, None where only the robot knows it."""
        match TASK_KINDS[self.type].controls:
            case "pose":
                return 6
            case "joint":
                return 1
            case "joints":
                joints = getattr(self, "joints", None)
                return None if joints is None else len(joints)
            case _:
                return len(getattr(self, "axes", "xyz"))

    @model_validator(mode="after")
    def _check_rows(self) -> Self:
        rows = self.rows()
        for key, gain in (("kp", self.kp), ("kv", self.kv)):
            if rows is not None and isinstance(gain, tuple) and len(gain) != rows:
                raise problem(f"must be a number or a list of {rows} numbers, not {len(gain)}", key)
        return self


def _check_axes(axes: str) -> str:
    if not axes or set(axes) - set("xyz") or len(set(axes)) < len(axes):
        raise problem(f"must be some of the letters xyz, each once, not {shown(axes)}")
    return axes


class _Argument(NamedTuple):
    """An argument of a constructor as a key: what it takes, and what it means."""

    takes: Any
    means: str


def _nullable(takes: Any) -> Any:
    return takes | None


_ARGUMENTS: Mapping[str, _Argument] = {
    "axes": _Argument(
        Annotated[str, AfterValidator(_check_axes)], "axes to control, some of the letters xyz"
    ),
    "frame": _Argument(_nullable(str), "name of the frame; null is the robot's tool"),
    "reference_frame": _Argument(str, "name of the frame it is seen from"),
    "joint": _Argument(str, "name of the joint"),
    "joints": _Argument(
        Annotated[list[str] | None, Field(min_length=1)],
        "names of the joints; null is every actuated joint",
    ),
    "kp_linear": _Argument(
        _nullable(BlockStiffness), "stiffness of the linear rows in place of kp [1/s²]"
    ),
    "kp_angular": _Argument(
        _nullable(BlockStiffness), "stiffness of the angular rows in place of kp [1/s²]"
    ),
    "axes_frame": _Argument(Literal["world", "tool"], "whose axes: world or tool"),
    "offset": _Argument(_nullable(Point), "point to control, in the frame's axes [m]"),
}
"""Arguments that mean the same in every task; others are read by their type."""

_SPEED = "speed that the error may ask for"
_TRACKED: Mapping[str, Mapping[str, _Argument]] = {
    controls: {
        "target": _Argument(_nullable(target), _TARGET),
        "max_speed": _Argument(_nullable(speed), f"{words}; null is no limit"),
        "max_acceleration": _Argument(
            _nullable(acceleration), "acceleration of the way to a new target; null is no way"
        ),
    }
    for controls, target, speed, acceleration, words in (
        ("position", PointTarget, LinearSpeed, LinearAcceleration, f"{_SPEED} [m/s]"),
        ("orientation", OrientationTarget, AngularSpeed, AngularAcceleration, f"{_SPEED} [rad/s]"),
        ("pose", PoseTarget, PoseSpeeds, PoseAccelerations, f"{_SPEED} [m/s, rad/s]"),
        ("joint", JointTarget, JointSpeed, JointAcceleration, f"{_SPEED} [rad/s or m/s]"),
        ("joints", PostureTarget, JointSpeed, JointAcceleration, f"norm of the {_SPEED} [rad/s]"),
    )
} | {
    "momentum": {
        "kv": _Argument(Annotated[float, Number("1/s", at_least=0.0)], "rate of decay [1/s]")
    }
}
_CONTROLLED: Mapping[str, Mapping[str, _Argument]] = {
    **_TRACKED,
    "force": {
        "force": _Argument(
            Annotated[Gain, Number("N", size="rows")],
            "force along the axes [N], a number or one each",
        ),
        "moment": _Argument(
            Annotated[Gain, Number("N·m", size="rows")],
            "moment about the moment axes [N·m], a number or one each",
        ),
        "moment_axes": _Argument(
            Annotated[str, AfterValidator(lambda axes: _check_axes(axes) if axes else axes)],
            "axes with a moment, some of the letters xyz",
        ),
        "kv": _Argument(Damping, "damping [1/s], a number or one per row"),
        "contact": _Argument(
            _nullable(Annotated[tuple[float, ...], Number("N", above=0.0, size=2)]),
            "forces off and on between which the confidence rises [N]; null goes by the force",
        ),
    },
}


def _check_blocks(value: float | tuple[float, ...]) -> float | tuple[float, ...]:
    if isinstance(value, tuple) and len(value) not in (3, 6):
        raise problem(f"must be a number or a list of 3 or 6 numbers, not {len(value)}")
    return value


_BLOCKS = AfterValidator(_check_blocks)
_IMPEDANCE: Mapping[str, _Argument] = {
    "stiffness": _Argument(
        Annotated[float | tuple[float, ...], Number("N/m", at_least=0.0, size="rows"), _BLOCKS],
        "stiffness [N/m], a number or one per axis; with six numbers, the last three in N·m/rad, "
        "the orientation at the start is held as well",
    ),
    "force": _Argument(
        _nullable(Annotated[tuple[float, ...], Number("N", size="any"), _BLOCKS]),
        "force beside the spring's [N], with six numbers of stiffness [N, N·m]; null is none",
    ),
}
_PLAIN: Mapping[Any, Any] = {float: Annotated[float, Number("1")], bool: bool, str: str}


def make_entry(name: str, kind: TaskKind) -> type[PlacedEntry]:
    """Make the entry of a kind of task.

    Args:
        name: What a scenario calls it.
        kind: The task.

    Returns:
        The entry; its keys and defaults are those of the constructor, and ``type``, ``level`` and
        ``present``.
    """
    known = {**_ARGUMENTS, **_CONTROLLED[kind.controls]}
    if name == "impedance":
        known |= _IMPEDANCE
    base = GainsEntry
    if kind.controls == "momentum":
        base = PlacedEntry
    elif kind.sprung:
        base = TaskEntry
    always = ("self", "name", *base.model_fields)
    fields: dict[str, Any] = {"type": (Literal[name], Field(description=name))}
    if name in GIVING_WAY:
        fields["give_way"] = str | None, Field(default=None, description=_GIVE_WAY)
    for key, argument in inspect.signature(kind.task).parameters.items():
        if key in always:
            continue
        takes, means = known.get(key) or _by_type(kind, key)
        default = argument.default
        if default is argument.empty:  # only what may be null may be left out
            default = None if key == "frame" else ...
        fields[key] = (takes, Field(default=default, description=means))
    camel = name.title().replace("_", "")
    return create_model(f"{camel}Entry", __base__=base, __module__=__name__, **fields)


def _by_type(kind: TaskKind, key: str) -> _Argument:
    """Read an argument by its annotation, and what it means in the docstring of its task."""
    hint = get_type_hints(kind.task.__init__)[key]
    choices = getattr(hint, "__args__", (hint,))
    takes: Any = next((_PLAIN[one] for one in choices if one in _PLAIN), None)
    if takes is None:
        takes = Annotated[tuple[float, ...], Number("1", size="any")]
    found = re.search(rf"^ *{key}: (.+?)\.?$", kind.task.__doc__ or "", re.MULTILINE)
    means = found[1] if found else key
    return _Argument(_nullable(takes) if type(None) in choices else takes, means)


ENTRIES: Mapping[str, type[PlacedEntry]] = MappingProxyType(
    {name: make_entry(name, kind) for name, kind in TASK_KINDS.items()}
)
"""The entry of every kind of task, by what a scenario calls it."""

if TYPE_CHECKING:
    AnyTask = PlacedEntry
else:
    AnyTask = Annotated[
        Union[tuple(Annotated[entry, Tag(f"<{name}>")] for name, entry in ENTRIES.items())],  # noqa: UP007
        Discriminator(tag_of),
    ]

"""Shapes of links and the pairs that are kept apart, in a file to look at, mend and read again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from opspace.errors import ModelError
from opspace.robots.shapes import LinkCapsule, Triple
from opspace.robots.touching import Pairs

SUFFIXES = (".yaml", ".yml")
FORMAT = "opspace-shapes-1"
_KEYS = {"format", "robot", "margin", "shapes", "pairs", "left_out"}
_DIGITS = 6


class ShapeFile(NamedTuple):
    """What a file of shapes says.

    Attributes:
        shapes: Capsules of links.
        pairs: Pairs of links that are kept apart, and why others are not.
    """

    shapes: tuple[LinkCapsule, ...]
    pairs: Pairs


def write_shapes(
    path: Path | str, robot: str, margin: float, shapes: Sequence[LinkCapsule], pairs: Pairs
) -> Path:
    """Write shapes and pairs.

    Radii are rounded up, so that what was enclosed still is.

    Args:
        path: The file, ending in .yaml.
        robot: Name of the robot, for who reads it.
        margin: Distance for which the pairs were chosen, m.
        shapes: Capsules of links.
        pairs: Pairs of links, and why others are left out.

    Raises:
        ModelError: Another ending, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ModelError(f"{path}: a file of shapes ends in {' or '.join(SUFFIXES)}")
    text = [
        "# Capsules in the axes of their frames, m, and the pairs of links that are kept apart.",
        f"format: {FORMAT}",
        f"robot: {_line(robot)}",
        f"margin: {margin:g}",
        "shapes:",
        *(f"  - {_line(_plain(shape))}" for shape in shapes),
        "pairs:" if pairs.kept else "pairs: []",
        *(f"  - {_line(list(pair))}" for pair in pairs.kept),
        "left_out:" if pairs.left_out else "left_out: []",
        *(f"  - {_line([one, two, why])}" for (one, two), why in pairs.left_out.items()),
    ]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(text) + "\n", encoding="utf-8")
    except OSError as error:
        raise ModelError(f"{path}: cannot be written: {error.strerror}") from None
    return path


def read_shapes(path: Path | str) -> ShapeFile:
    """Read what `write_shapes` wrote, or somebody after it.

    Raises:
        ModelError: It cannot be read, or an entry is not what it should be; the entry is named.
    """
    try:
        content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ModelError(f"{path}: these shapes cannot be read: {error}") from None
    if not isinstance(content, Mapping) or content.get("format") != FORMAT:
        raise ModelError(f"{path}: a file of shapes says 'format: {FORMAT}'")
    if unknown := sorted(set(content) - _KEYS):
        raise ModelError(f"{path}: unknown {unknown[0]!r} (valid: {', '.join(sorted(_KEYS))})")
    shapes = tuple(
        _capsule(path, i, entry) for i, entry in enumerate(_list(path, content, "shapes"))
    )
    if not shapes:
        raise ModelError(f"{path}: there is no shape")
    kept = [_names(path, "pairs", entry, 2) for entry in _list(path, content, "pairs")]
    rest = [_names(path, "left_out", entry, 3) for entry in _list(path, content, "left_out")]
    known = {shape.frame for shape in shapes}
    for name in (name for pair in kept for name in pair):
        if name not in known:
            raise ModelError(f"{path}: a pair has {name!r}, which has no shape")
    left_out = {(one, two): why for one, two, why in rest}
    return ShapeFile(shapes, Pairs(tuple((one, two) for one, two in kept), left_out))


def _plain(shape: LinkCapsule) -> dict[str, Any]:
    scale = 10.0**_DIGITS
    ends = {name: [round(x, _DIGITS) for x in getattr(shape, name)] for name in ("start", "end")}
    # Each end moves by at most half a digit along each of three axes.
    radius = math.ceil((shape.radius + 0.5 * math.sqrt(3.0) / scale) * scale) / scale
    return {"frame": shape.frame, **ends, "radius": radius}


def _line(value: Any) -> str:
    """Write a value of YAML on one line."""
    text = yaml.safe_dump(value, default_flow_style=True, width=math.inf, sort_keys=False)
    return text.split("\n...")[0].strip()


def _list(path: Path | str, content: Mapping[str, Any], key: str) -> list[Any]:
    found = content.get(key) or []
    if not isinstance(found, list):
        raise ModelError(f"{path}: {key} must be a list, not {found!r}")
    return found


def _names(path: Path | str, key: str, entry: Any, size: int) -> list[str]:
    if not isinstance(entry, list) or len(entry) != size:
        raise ModelError(f"{path}: {key} has {entry!r}, not {size} texts")
    return [str(name) for name in entry]


def _capsule(path: Path | str, i: int, entry: Any) -> LinkCapsule:
    where = f"{path}: shape {i + 1}"
    if not isinstance(entry, Mapping) or set(entry) != {"frame", "start", "end", "radius"}:
        raise ModelError(f"{where} must have frame, start, end and radius, not {entry!r}")
    start, end = (_triple(f"{where}: {key}", entry[key]) for key in ("start", "end"))
    radius = _number(f"{where}: radius", entry["radius"])
    if radius <= 0.0:
        raise ModelError(f"{where}: radius must be above 0, not {radius:g}")
    return LinkCapsule(str(entry["frame"]), start, end, radius)


def _triple(what: str, value: Any) -> Triple:
    if not isinstance(value, list) or len(value) != 3:
        raise ModelError(f"{what} must be three numbers, not {value!r}")
    x, y, z = (_number(what, part) for part in value)
    return x, y, z


def _number(what: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ModelError(f"{what} must be a finite number, not {value!r}")
    return float(value)

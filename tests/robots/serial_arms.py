"""Arms as chains of joints whose axes are given, stretched upwards where every joint is at zero."""

from __future__ import annotations

from pathlib import Path

AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
BODY = (
    '<inertial><origin xyz="0 0 .1"/><mass value="{mass}"/><inertia ixx="{i}" iyy="{i}" izz="{i}" '
    'ixy="0" ixz="0" iyz="0"/></inertial>'
)


def part(name: str, mass: float = 1.0) -> str:
    """Write a link whose mass lies on the line of the arm."""
    return f'<link name="{name}">{BODY.format(mass=mass, i=0.01 * mass)}</link>'


def hinge(
    name: str, parent: str, child: str, axis: str = "y", *, ends: float = 2.5, more: str = ""
) -> str:
    """Write a joint 0.2 m above the one before."""
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 .2"/><axis xyz="{AXES[axis]}"/><limit lower="-{ends}" upper="{ends}" '
        f'effort="80" velocity="3"/>{more}</joint>'
    )


def fixed(parent: str, child: str, xyz: str = "0 0 .05", link: str = "") -> str:
    """Fix a link to another."""
    body = link or f'<link name="{child}"/>'
    return (
        f'{body}<joint name="to_{child}" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{xyz}"/></joint>'
    )


def serial_arm(path: Path, axes: str, *parts: str) -> Path:
    """Write an arm with a joint j1, j2, ... and a link l1, l2, ... for every axis, and what is on it."""
    text = [part("l0", 3.0)]
    for k, axis in enumerate(axes, start=1):
        text += [part(f"l{k}", 2.0 / k), hinge(f"j{k}", f"l{k - 1}", f"l{k}", axis)]
    path.write_text(f'<robot name="arm">{"".join(text)}{"".join(parts)}</robot>')
    return path

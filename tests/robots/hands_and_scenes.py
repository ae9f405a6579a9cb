"""Model files in the style of real ones: hands, loops, tables with things on them, two arms."""

from __future__ import annotations

from pathlib import Path

GRIPPER = """
<body name="left" pos=".3 .03 0"><joint name="left_driver" axis="0 0 1" range="0 45"/>
  <geom type="box" size=".05 .01 .01" mass=".2" pos=".03 0 .01"/>
  <body name="left_pad" pos=".1 0 0"><joint name="left_tip" axis="0 0 1" range="-45 45"/>
    <geom type="box" size=".05 .01 .01" mass=".1"/></body></body>
<body name="right" pos=".3 -.03 0"><joint name="right_driver" axis="0 0 -1" range="0 45"/>
  <geom type="box" size=".05 .01 .01" mass=".2" pos=".03 0 .01"/></body>
"""
MOTORS = '<motor joint="j1" ctrlrange="-90 90"/><motor joint="j2" ctrlrange="-50 50"/>'


def arm_on_a_table(
    path: Path,
    *,
    hand: str = "",
    motors: str = MOTORS,
    more: str = "",
    around: str = "",
    keys: str = "",
) -> Path:
    """Write an arm of two joints, turned in a frame, with something at its end and around it."""
    path.write_text(f"""
<mujoco><compiler angle="degree"/><default><geom contype="0" conaffinity="0"/></default>
<worldbody><body name="table"><geom type="box" size="1 1 .02" pos="0 0 -.5"/></body>
<frame pos="0 0 .5" euler="0 0 20">
<body name="upper" euler="10 0 0"><joint name="j1" axis="0 1 0" range="-120 120"/>
  <geom type="capsule" fromto="0 0 0 .4 0 0" size=".04" mass="3"/>
  <body name="fore" pos=".4 0 0"><joint name="j2" axis="0 1 0" range="-120 120"/>
    <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="2"/>
    <site name="wrist" pos=".3 0 0"/>{hand}</body></body></frame>{around}</worldbody>
{more}<actuator>{motors}</actuator>{keys}</mujoco>""")
    return path


def link(name: str, mass: float = 1.0) -> str:
    """Write a link whose mass lies off its axis."""
    return (
        f'<link name="{name}"><inertial><origin xyz=".1 .02 .01"/><mass value="{mass}"/>'
        '<inertia ixx=".01" iyy=".02" izz=".015" ixy=".001" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    axis: str = "0 1 0",
    mimic: str = "",
) -> str:
    """Write a joint with a turned origin and a range of two to each side."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz=".3 0 .05" rpy=".1 -.2 .3"/><axis xyz="{axis}"/>'
        f'<limit lower="-2" upper="2" effort="60" velocity="3"/>{mimic}</joint>'
    )


def arm_with_fingers(path: Path, first: str = "", second: str = "", third: str = "") -> Path:
    """Write a URDF arm of two joints whose hand carries a finger of two joints and one of one."""
    path.write_text(
        '<robot name="r">'
        + "".join(map(link, ("base", "a", "b", "hand")))
        + "".join(link(name, 0.2) for name in ("f", "g", "h"))
        + joint("j1", "base", "a")
        + joint("j2", "a", "b", axis="1 0 1")
        + joint("flange", "b", "hand", kind="fixed")
        + joint("f1", "hand", "f", kind="prismatic", mimic=first)
        + joint("f2", "hand", "g", axis="0 0 1", mimic=second)
        + joint("f3", "f", "h", axis="1 0 0", mimic=third)
        + "</robot>"
    )
    return path

"""Robots and states that the tests of this directory share."""

from __future__ import annotations

import numpy as np
import pytest

from opspace.robots import Robot, available_robots

INSTALLED = [robot.name for robot in available_robots() if robot.installed]
NAMES = [
    pytest.param(
        robot.name,
        marks=pytest.mark.skipif(not robot.installed, reason=f"{robot.package} is not installed"),
    )
    for robot in available_robots()
]
BACKENDS = ("pinocchio", "mujoco")

# Every kind of URDF joint, an oblique axis that is not of unit length, a link without inertia, a
# joint and a link of one name, and branches whose order in the file is not alphabetical.
URDF = """
<robot name="oddity">
  <link name="trunk"><inertial><origin xyz="0.02 -0.01 0.05" rpy="0.3 -0.2 0.5"/><mass value="4"/>
    <inertia ixx="0.05" ixy="0.002" ixz="-0.001" iyy="0.06" iyz="0.003" izz="0.04"/></inertial>
  </link>
  <link name="wheel"><inertial><origin xyz="0 0.03 0.1"/><mass value="1.2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.012" iyz="0" izz="0.007"/></inertial></link>
  <link name="slider"><inertial><origin xyz="0.1 0 0" rpy="0 0 1"/><mass value="0.7"/>
    <inertia ixx="0.004" ixy="0.0005" ixz="0" iyy="0.005" iyz="0" izz="0.006"/></inertial></link>
  <link name="tip"/>
  <link name="lump"><inertial><mass value="0.3"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <link name="fin"><inertial><mass value="0.5"/>
    <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.002"/></inertial></link>
  <joint name="zeta" type="continuous"><origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/>
    <parent link="trunk"/><child link="wheel"/><axis xyz="0 2 1"/>
    <limit effort="12" velocity="3"/></joint>
  <joint name="slider" type="prismatic"><origin xyz="0 0 0.4" rpy="0 1 0"/>
    <parent link="wheel"/><child link="slider"/><axis xyz="0 0 1"/>
    <limit lower="-0.2" upper="0.4" effort="0" velocity="0"/></joint>
  <joint name="mount" type="fixed"><origin xyz="0.05 0 0.02" rpy="0 0 0.7"/>
    <parent link="slider"/><child link="tip"/></joint>
  <joint name="ballast" type="fixed"><origin xyz="0 0.1 0"/>
    <parent link="tip"/><child link="lump"/></joint>
  <joint name="alpha" type="revolute"><origin xyz="-0.1 0 0"/>
    <parent link="trunk"/><child link="fin"/>
    <limit lower="-1" upper="0.5" effort="5" velocity="7"/></joint>
</robot>
"""

# A free root, two joints on one body, a ball joint, joint references, anchors off the body's
# origin, armature, defaults, euler angles, inertia from shapes, sites, a keyframe, odd gravity.
MJCF = """
<mujoco model="medley">
  <compiler angle="degree" eulerseq="zyx"/>
  <option gravity="0.5 -0.3 -9"/>
  <default><joint armature="0.03"/><geom density="700" contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="plinth" pos="1 2 0"><geom type="box" size="0.1 0.2 0.1"/></body>
    <body name="hull" pos="0 0 1" euler="10 20 30">
      <freejoint name="float"/>
      <geom type="box" size="0.2 0.1 0.15" pos="0.02 0.01 0"/>
      <body name="arm" pos="0.2 0 0.1" euler="30 -20 10">
        <joint name="turn" axis="0 1 0.5" pos="0.01 0.02 0" ref="20" range="-60 90"/>
        <joint name="push" type="slide" axis="1 0 0" ref="0.05" range="-0.1 0.3"
               actuatorfrcrange="-40 30"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.04"/>
        <body pos="0.3 0 0">
          <joint name="ball" type="ball" pos="-0.02 0 0.01"/>
          <geom type="ellipsoid" size="0.1 0.05 0.07" pos="0.1 0 0"/>
          <body name="hand" pos="0.2 0.01 0" quat="0.9 0.1 -0.2 0.3">
            <joint name="wrist" axis="1 0 0"/>
            <inertial pos="0.01 0 0.02" mass="0.4"
                      fullinertia="0.002 0.003 0.004 0.0002 0 -0.0001"/>
            <site name="grip" pos="0.1 0.02 0" euler="45 0 30"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="turn" gear="5" ctrlrange="-3 4"/><motor joint="wrist"/>
    <motor joint="ball" gear="1"/></actuator>
  <keyframe><key name="home" qpos="0 0 1 1 0 0 0 0.4 0.1 1 0 0 0 0.3"/></keyframe>
</mujoco>
"""


def random_state(robot: Robot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a configuration away from the reference and a velocity."""
    q = robot.integrate(robot.q_reference, rng.uniform(-1.5, 1.5, robot.nv), 1.0)
    return q, rng.standard_normal(robot.nv)

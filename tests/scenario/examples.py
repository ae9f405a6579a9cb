"""A scenario that uses everything, and random ones."""

from hypothesis import strategies as st

EVERYTHING = """\
description: every kind of entry
robot: puma560
backend: mujoco
floating_base: false
joints: ["joint?"]
locked: {}
tool: camera
reference: {joint2: 0.4}
frames:
  grip: {placement: [0, 0, 0.1, 1, 0, 0, 0]}
  camera: {parent: grip, placement: [0.05, 0, 0]}
payload: {mass: 0.4, centre: [0, 0, 0.02], inertia: [1e-3, 1e-3, 1e-3], frame: grip}
duration: 1e1
dt: 2e-3
seed: 5
start: [0, 0.5, -3, 0, 0.7, 0]
method: switch
blending: chain
torque_limits: priority
bias: task
tasks:
  reach:
    type: position
    level: 1
    frame: tool
    kp: [100, 200]
    kv: 20
    axes: xz
    axes_frame: tool
    max_speed: 0.5
    offset: [0, 0, 0.1]
    target: [0.4, 0.1, 0.9]
  circle:
    type: position
    level: 0
    target: {type: circle, radius: 0.1, period: 2, normal: [0, 1, 0], ramp: 1}
  upright:
    type: orientation
    level: 0
    target: [1, 0, 0, 0]
  turn:
    type: orientation
    level: 2
    target:
      type: minimum_jerk
      goal: [0, 1, 0, 0]
      duration: 2
      start_time: 0.5
  wave:
    type: pose
    level: 0
    kp_linear: 400
    kp_angular: 100
    max_speed: [0.5, 1]
    target:
      position: {type: out_and_back, offset: [0, 0.1, 0], out_duration: 1, back_duration: 2}
      orientation: {type: hold}
  place:
    type: pose
    level: 0
    target: [0, 0, 1, 1, 0, 0, 0]
  rest:
    type: posture
    level: 3
    joints: [joint1, joint2]
    target:
      type: via_points
      times: [1, 2]
      points: [reference, [0.1, 0.2]]
  wrist:
    type: joint
    level: 3
    joint: joint6
    target:
      type: jerk_limited
      offset: 0.5
      max_velocity: 1
      max_acceleration: 5
      max_jerk: 50
  balance: {type: com, level: 1, axes: xy}
  apart: {type: relative_position, level: 1, reference_frame: link2}
  parallel: {type: relative_orientation, level: 1, reference_frame: link2, target: [1, 0, 0, 0]}
  docked: {type: relative_pose, level: 1, reference_frame: link2, frame: tool}
  press:
    type: force
    level: 0
    axes: z
    force: 12
    moment_axes: xy
    contact: [1, 4]
    activation: {contact: press, near: {point: [0.4, 0, 0.5], off: 0.2, on: 0.1}}
  spring: {type: impedance, level: 2, stiffness: [300, 300, 50], force: [0, 0, -2], give_way: press}
joint_limits:
  mode: buffer
  buffer: 0.2
  brake_acceleration: 20
  profile: tanh
  joints:
    joint1: [-0.75, 0.75]
collisions:
  margin: 0.02
  brake: 3.0
  pairs: none
  obstacles:
    ball: {shape: ball, radius: 0.1, position: [3.0, 0.0, 0.0], velocity: [0.0, 0.01, 0.0]}
    wall: {shape: half-space, normal: [0.0, 0.0, 1.0], position: [0.0, 0.0, -2.0]}
singularity:
  scale: absolute
  lower: 0.01
  upper: 0.02
  profile: cubic
plant:
  friction: true
  wrench_noise: 0.1
  surfaces:
    - {point: [0, 0, -3], normal: [0, 0, 1], stiffness: 1e4, size: 0.2, bevel: 0.01, give: 0.002}
  torque_limits: false
stop:
  max_joint_speed: 20
  max_torque: 500
events:
  - {at: 0.1, insert: rest, level: 7.5, duration: 0.2, profile: cubic}
  - {at: 0.2, move: rest, level: -1}
  - {at: 0.2, swap: [rest, reach]}
  - {at: 0.3, remove: wrist}
"""

STANDING = """\
robot: g1
duration: 1
torque_limits: priority
contacts:
  left: {type: sole, frame: left_ankle_roll_link, half: [0.08, 0.02], offset: [0.03, 0, -0.035]}
  right: {type: sole, frame: right_ankle_roll_link, half: [0.08, 0.02], offset: [0.03, 0, -0.035]}
  palm:
    type: point
    frame: right_rubber_hand
    normal: [-2, 0, 0]
    friction: 0.4
    force: 20
    max_force: 50
    present: false
ground:
  friction: 0.7
  time_constant: 0.02
  walls: [{point: [0.3, 0, 0], normal: [-1, 0, 0]}]
  boards: [{contact: right, height: -0.01, at: 0.5}]
falling: {after: 0.1, tilt: 0.5}
tasks:
  com:
    type: com
    level: 0
    target:
      type: stops
      moves:
        - {at: 0.1, duration: 0.2, offset: [0, 0.02, 0]}
        - {at: 0.4, duration: 0.2, goal: [0.03, 0, 0.67]}
  still: {type: angular_momentum, level: 1, kv: 5}
  posture: {type: posture, level: 2, kp: 25}
events:
  - {at: 0.1, when: {contact: left, force_above: 20, lasting: 0.01}, insert: palm}
  - {at: 0.1, when: {contact: right, force_below: 5}, remove: right, wait: false}
  - {at: 0.2, remove: left, duration: 0.2}
plant:
  pushes: [{at: 0.1, duration: 0.1, force: [10, 0, 0], frame: pelvis}]
"""
"""What only robots with a floating base can be told."""

numbers = st.floats(-1e3, 1e3)
times = st.floats(1e-3, 1e3)
gains = st.floats(0.0, 1e6)
names = st.text(st.characters(codec="utf-8", exclude_categories=["C"]), min_size=1).filter(
    lambda name: name == name.strip() and "/" not in name
)


def vectors(size):
    return st.lists(numbers, min_size=size, max_size=size)


def references(value, offset):
    aims = st.one_of(
        value.map(lambda v: {"goal": v}) if value is not None else st.nothing(),
        offset.map(lambda v: {"offset": v}),
    )
    return st.one_of(
        st.just({"type": "hold"}),
        st.builds(
            lambda aim, duration, start: {
                "type": "minimum_jerk",
                **aim,
                "duration": duration,
                "start_time": start,
            },
            aims,
            times,
            times,
        ),
        st.builds(
            lambda far, out, back: {
                "type": "out_and_back",
                "offset": far,
                "out_duration": out,
                "back_duration": back,
            },
            offset,
            times,
            times,
        ),
    )


def tasks():
    common = {"level": st.integers(0, 9), "kp": gains}
    tuned = {"kv": st.none() | gains}
    point = vectors(3) | references(vectors(3), vectors(3))
    posture = names | vectors(6) | references(names | vectors(6), vectors(6))
    return st.one_of(
        st.fixed_dictionaries(
            {"type": st.sampled_from(["position", "com"]), **common},
            optional={**tuned, "target": point, "axes": st.sampled_from(["x", "zy", "xyz"])},
        ),
        st.fixed_dictionaries(
            {"type": st.just("posture"), **common}, optional={**tuned, "target": posture}
        ),
        st.fixed_dictionaries(
            {"type": st.just("joint"), **common, "joint": names},
            optional={**tuned, "target": numbers | references(numbers, numbers)},
        ),
    )


def scenarios():
    return st.fixed_dictionaries(
        {
            "robot": names,
            "duration": st.floats(0.1, 3600.0),
            "tasks": st.dictionaries(names, tasks(), min_size=1, max_size=3),
        },
        optional={
            "description": names,
            "dt": st.floats(1e-6, 0.1),
            "seed": st.integers(0, 2**53),
            "start": names | vectors(6),
            "singularity": st.none() | st.just({}),
            "joint_limits": st.none()
            | st.fixed_dictionaries(
                {"joints": st.dictionaries(names, st.just([-1.0, 1.0]), max_size=2)}
            ),
        },
    )

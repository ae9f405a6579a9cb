"""Things to look at: a skeleton for robots without meshes, a floor, a sky and a light."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

LINK_RGBA = (0.88, 0.89, 0.91, 1.0)
JOINT_RGBA = (0.20, 0.36, 0.58, 1.0)
RADIUS = 0.045
"""Of the largest ball that stands for a joint, m."""

COLLISION_GROUP = 3
"""MuJoCo's convention: shapes of this group and above are for contacts only."""


def add_skeleton(spec: mujoco.MjSpec) -> None:
    """Draw a capsule from each joint to the next and a ball at each joint.

    The shapes have no mass and touch nothing.

    Args:
        spec: Specification to draw in.
    """
    moving = [body for body in spec.bodies if body.joints]
    offsets = [float(np.linalg.norm(body.pos)) for body in moving]
    spacing = float(np.mean(offsets)) if offsets else 0.0
    # Joints may all lie in one point.
    radius = min(RADIUS, 0.3 * spacing) if spacing > 0.0 else RADIUS
    for body in spec.bodies:
        parent = body.parent
        if parent is None or parent.name == spec.worldbody.name:
            continue
        length = float(np.linalg.norm(body.pos))
        if length > 0.5 * radius:
            _draw(
                parent,
                mujoco.mjtGeom.mjGEOM_CAPSULE,
                size=[min(0.75 * radius, 0.25 * length), 0.0, 0.0],
                fromto=np.concatenate([np.zeros(3), body.pos]),
                rgba=LINK_RGBA,
            )
    for body in moving:
        _draw(body, mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0.0, 0.0], rgba=JOINT_RGBA)


def draw_what_is_unseen(spec: mujoco.MjSpec) -> None:
    """Draw the skeleton of a robot that nothing shows: without meshes, or with shapes for contact only.

    Args:
        spec: Specification to draw in.
    """
    clear = {material.name for material in spec.materials if material.rgba[3] == 0.0}
    for body in spec.bodies[1:]:
        for geom in body.geoms:
            unseen = geom.material in clear if geom.material else geom.rgba[3] == 0.0
            if geom.group < COLLISION_GROUP and not unseen:
                return
    add_skeleton(spec)


def add_scenery(spec: mujoco.MjSpec) -> None:
    """Add a floor, a sky and a light where the file has none.

    Args:
        spec: Specification to draw in.
    """
    if not any(t.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX for t in spec.textures):
        _add_sky(spec)
    if not any(g.type == mujoco.mjtGeom.mjGEOM_PLANE for g in spec.worldbody.geoms):
        _add_floor(spec)
    if not list(spec.lights):
        _add_light(spec)
    screen = spec.visual.global_
    screen.offwidth, screen.offheight = max(screen.offwidth, 1920), max(screen.offheight, 1080)


def _add_light(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[1.5, -1.5, 4.0],
        dir=[-0.35, 0.45, -1.0],
        diffuse=[0.5, 0.5, 0.5],
    )
    spec.visual.headlight.ambient = [0.38, 0.38, 0.38]
    spec.visual.headlight.diffuse = [0.3, 0.3, 0.3]
    # A shadow map that ends on the floor speckles it; this one reaches past what is in view.
    spec.visual.map.shadowclip = 4.0
    spec.visual.quality.shadowsize = 8192


def _draw(body: mujoco.MjsBody, shape: mujoco.mjtGeom, **form: object) -> None:
    body.add_geom(type=shape, mass=0.0, contype=0, conaffinity=0, **form)


def _add_sky(spec: mujoco.MjSpec) -> None:
    spec.add_texture(
        name="opspace_sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.62, 0.74, 0.88],
        rgb2=[0.97, 0.98, 1.0],
        width=256,
        height=256,
    )


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.add_texture(
        name="opspace_floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.80, 0.82, 0.84],
        rgb2=[0.70, 0.73, 0.76],
        width=256,
        height=256,
    )
    material = spec.add_material(name="opspace_floor", texrepeat=[2, 2], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "opspace_floor"
    _draw(
        spec.worldbody,
        mujoco.mjtGeom.mjGEOM_PLANE,
        name="opspace_floor",
        size=[0.0, 0.0, 0.05],
        material="opspace_floor",
    )

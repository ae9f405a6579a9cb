"""Do without meshes and pictures that are only looked at and are not there."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mujoco

from opspace.errors import ModelError
from opspace.robots.description import ModelOrigin


def drop_missing(spec: mujoco.MjSpec, origin: ModelOrigin) -> tuple[str, ...]:
    """Take out shapes whose mesh file is missing, and paint plain what has no picture.

    Args:
        spec: The specification; it is changed.
        origin: Where it comes from.

    Returns:
        What is missing, a sentence each.

    Raises:
        ModelError: The inertia of a body comes from a mesh that is missing.
    """
    missing = {mesh.name or Path(mesh.file).stem: mesh for mesh in spec.meshes if _lost(spec, mesh)}
    for geom in list(spec.geoms):
        if geom.meshname in missing:
            if _gives_inertia(spec, geom):
                raise ModelError(
                    f"{origin}: mesh file {missing[geom.meshname].file!r} is missing, and the "
                    f"inertia of body {geom.parent.name!r} comes from it"
                )
            spec.delete(geom)
    files = [mesh.file for mesh in missing.values()]
    for mesh in missing.values():
        spec.delete(mesh)
    files += list(_paint(spec))
    return (f"files are missing and not drawn: {', '.join(files)}",) if files else ()


def _gives_inertia(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> bool:
    """Whether MuJoCo would take the inertia of a body from this shape."""
    told = spec.compiler.inertiafromgeom
    never, always = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE, 1
    low, high = spec.compiler.inertiagrouprange
    counts = low <= geom.group <= high and geom.mass != 0.0
    carried = geom.parent.name != spec.worldbody.name
    own = geom.parent.explicitinertial and int(told) != always
    return bool(carried and counts and told != never and not own)


def _lost(spec: mujoco.MjSpec, mesh: mujoco.MjsMesh) -> bool:
    return bool(mesh.file) and not _is_there(spec, mesh.file, spec.meshdir)


def _is_there(spec: mujoco.MjSpec, file: str, folder: str) -> bool:
    name = Path(file).name if spec.strippath else file
    if {file, name, Path(file).name} & set(spec.assets):
        return True
    return (Path(spec.modelfiledir) / folder / name).is_file()


def _paint(spec: mujoco.MjSpec) -> Iterator[str]:
    """Put a plain colour in the place of pictures that are missing."""
    for texture in spec.textures:
        if texture.file and not _is_there(spec, texture.file, spec.texturedir):
            yield texture.file
            texture.file = ""
            texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
            texture.rgb1 = texture.rgb2 = [0.7, 0.7, 0.7]
            texture.width = texture.height = 8

"""Levels and repairs of meshes of trimesh, with their textures.

>>> import seamwise.trimesh, trimesh
>>> scan = trimesh.load("scan.glb", force="mesh")                       # doctest: +SKIP
>>> quarter, = seamwise.trimesh.simplify(scan, [0.25])                  # doctest: +SKIP
>>> seamwise.trimesh.repair(quarter).export("quarter.glb")              # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import InvalidError
from ._repair import repair as repair_image
from ._simplify import Level
from ._simplify import simplify as simplify_arrays

if TYPE_CHECKING:
    import trimesh

__all__ = ["arrays", "repair", "simplify"]


def arrays(mesh: trimesh.Trimesh) -> dict[str, Any]:
    """The arrays of a mesh as arguments of ``seamwise.simplify``: positions, triangles, and UVs, normals
    and vertex colors where it has some of its own."""
    own: dict[str, Any] = {"positions": mesh.vertices, "triangles": mesh.faces}
    kind = getattr(mesh.visual, "kind", None)
    if kind == "texture" and mesh.visual.uv is not None:
        own["uvs"] = mesh.visual.uv
    elif kind == "vertex":
        own["colors"] = mesh.visual.vertex_colors / np.float32(255)
    # Others are computed when they are asked for, and would be taken for the artist's.
    if "vertex_normals" in mesh._cache:
        own["normals"] = mesh.vertex_normals
    return own


def simplify(
    mesh: trimesh.Trimesh, targets: Sequence[float | int], **options: Any
) -> list[trimesh.Trimesh]:
    """Levels of detail of a mesh, with its material; ``options`` are those of ``seamwise.simplify``."""
    levels = simplify_arrays(targets=targets, **arrays(mesh), **options)
    return [_mesh(level, mesh) for level in levels]


def repair(mesh: trimesh.Trimesh, **options: Any) -> trimesh.Trimesh:
    """The mesh with every texel of its base color texture filled that no triangle covers.

    ``options`` are those of ``seamwise.repair``. Raises InvalidError for a mesh without UVs or texture.
    """
    from PIL import Image

    image = _texture(mesh)
    if image is None or getattr(mesh.visual, "uv", None) is None:
        raise InvalidError("the mesh has no texture with UVs")
    # trimesh counts v from the bottom, as OpenGL does.
    uvs = np.asarray(mesh.visual.uv) * [1, -1] + [0, 1]
    texels = np.asarray(image if image.mode in ("L", "LA", "RGB", "RGBA") else image.convert("RGBA"))
    done = repair_image(texels, uvs, mesh.faces, **options)
    repaired = mesh.copy()
    material = repaired.visual.material
    name = "baseColorTexture" if hasattr(material, "baseColorTexture") else "image"
    setattr(material, name, Image.fromarray(done.image))
    return repaired


def _texture(mesh: trimesh.Trimesh) -> Any:
    material = getattr(mesh.visual, "material", None)
    return getattr(material, "baseColorTexture", None) or getattr(material, "image", None)


def _mesh(level: Level, source: trimesh.Trimesh) -> trimesh.Trimesh:
    import trimesh
    from trimesh.visual import ColorVisuals, TextureVisuals

    mesh = trimesh.Trimesh(
        level.positions, level.triangles, vertex_normals=level.normals, process=False
    )
    if level.uvs:
        mesh.visual = TextureVisuals(uv=level.uvs[0], material=source.visual.material)
    elif level.colors is not None:
        colors = np.clip(np.round(level.colors * 255), 0, 255).astype(np.uint8)
        mesh.visual = ColorVisuals(mesh, vertex_colors=colors)
    mesh.metadata.update(source.metadata)
    return mesh

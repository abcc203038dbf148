"""Repairs of images in memory, and of files."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _seamwise
from ._arrays import floats, indices
from ._errors import InvalidError, OptionsError


@dataclass(frozen=True, eq=False)
class Repaired:
    """An image of which every texel may be read."""

    image: npt.NDArray[Any]
    """The texels, of the shape and type that came."""
    valid: npt.NDArray[np.bool_]
    """Shape (height, width): the texels that are to the bit what they were."""
    filled: int
    """Texels that were filled."""
    remaining: int
    """Texels that could not be filled, since no texel is valid."""
    padding: int
    """Texels outside of charts that were kept, since they agree with them."""


def repair(
    image: npt.ArrayLike,
    uvs: npt.ArrayLike | None = None,
    triangles: npt.ArrayLike | None = None,
    *,
    mask: npt.ArrayLike | None = None,
    role: Literal["color", "normal", "data"] = "color",
    wrap: Literal["repeat", "mirror", "clamp"] = "repeat",
    keep_padding: int = 0,
) -> Repaired:
    """Fills every texel of an atlas that no chart covers with a smooth continuation of the charts.

    image: (height, width) or (height, width, channels), the top row first: uint8 or uint16 of 1 to 4
    channels, float32 of 3 or 4. Integer colors are sRGB, floats linear light.
    uvs: float32 (n, 2), 0 at the left and at the **top**, as in glTF; OpenGL's and trimesh's are 1 − v.
    triangles: uint32 (m, 3), indices of UVs.
    mask: bool (height, width), True where texels are valid. With UVs a texel must pass both; with
    neither, the image's background is found by its color or its alpha.
    role: how texels are averaged: colors in linear light, normals as vectors, data as they are.
    wrap: how the image is read beyond its edges.
    keep_padding: rings of texels around charts that stay where they agree with them.

    Raises OptionsError if nothing tells which texels are valid, InvalidError for arrays that do not fit.
    """
    texels = np.asarray(image)
    if texels.dtype not in (np.uint8, np.uint16, np.float32):
        raise InvalidError(f"an image is of uint8, uint16 or float32, not {texels.dtype}")
    if texels.ndim not in (2, 3) or not texels.size:
        raise InvalidError(f"an image is of shape (height, width[, channels]), not {texels.shape}")
    charts = {
        "uvs": None if uvs is None else floats(uvs, "uvs"),
        "triangles": None if triangles is None else indices(triangles, "triangles"),
        "mask": None if mask is None else _mask(mask),
    }
    keywords = {"role": role, "wrap": wrap, "keep_padding": keep_padding}
    layers = np.ascontiguousarray(texels if texels.ndim == 3 else texels[..., None])
    done = _seamwise.repair(layers, charts, keywords)
    done["image"] = done["image"].reshape(texels.shape)
    return Repaired(**done)


def repair_file(
    source: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    mesh: str | os.PathLike[str] | None = None,
    mask: str | os.PathLike[str] | None = None,
    background: str = "auto",
    role: Literal["color", "normal", "data"] | None = None,
    keep_padding: int = 0,
) -> dict[str, Any]:
    """Repairs a file as ``seamwise repair`` does: an asset with all its images, or a picture.

    The meaning of ``mesh``, ``mask`` and ``background`` is that of the command's options; an asset needs
    none of them. The result is the command's report.
    """
    source, output = os.fspath(source), os.fspath(output)
    files = [None if own is None else os.fspath(own) for own in (mesh, mask)]
    keywords = {"role": role, "wrap": None, "keep_padding": keep_padding}
    return json.loads(_seamwise.repair_file(source, output, *files, background, keywords))


def _mask(mask: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    array = np.asarray(mask)
    if array.dtype != np.bool_ or array.ndim != 2:
        raise OptionsError(f"a mask is of bool and of shape (height, width), not {array.dtype} {array.shape}")
    return np.ascontiguousarray(array)

"""Levels of detail of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _seamwise
from ._arrays import column, floats, indices


@dataclass(frozen=True, eq=False)
class Level:
    """A level of detail, its vertices in the layout of the source.

    ``sources`` has for each vertex the one of the source that it stands for, for attributes of your own.
    """

    positions: npt.NDArray[np.float32]
    """Shape (n, 3), in the units of the source."""
    triangles: npt.NDArray[np.uint32]
    """Shape (m, 3): indices of vertices."""
    sources: npt.NDArray[np.uint32]
    """Shape (n,): indices of vertices of the source."""
    target: int
    """Triangles asked for."""
    error: float
    """Root of the largest area-weighted cost of any collapse, in the units of the positions."""
    stopped: str | None = None
    """Why the target was not reached, if it was not."""
    uvs: list[npt.NDArray[np.float32]] = field(default_factory=list)
    """One array of shape (n, 2) per set."""
    normals: npt.NDArray[np.float32] | None = None
    """Shape (n, 3), of unit length."""
    colors: npt.NDArray[np.float32] | None = None
    """Shape (n, 3) or (n, 4), linear, 0 to 1."""
    groups: npt.NDArray[np.uint32] | None = None
    """Shape (m,): the group of each triangle."""


def simplify(
    positions: npt.ArrayLike,
    triangles: npt.ArrayLike,
    targets: Sequence[float | int],
    *,
    uvs: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    groups: npt.ArrayLike | None = None,
    locked: npt.ArrayLike | None = None,
    importance: npt.ArrayLike | None = None,
    cost: Literal["quadric", "edge-length"] = "quadric",
    placement: Literal["best", "ends", "middle"] = "best",
    max_error: float | None = None,
    max_rotation: float | None = None,
    join_distance: float | None = None,
    keep_volume: bool = False,
    reach_target: bool = False,
    polish: bool = True,
    weights: dict[str, float] | None = None,
) -> list[Level]:
    """Simplifies a mesh to levels of detail, one for each target and in their order.

    Vertices at one position are one point of the surface, whatever their attributes: seams survive.
    No level is farther from its source than 2.5 % of the diagonal of its bounding box, unless
    ``reach_target`` says so: a level that stops before says why in ``stopped``.

    positions: float32 (n, 3).
    triangles: uint32 (m, 3), indices of vertices.
    targets: a float is a share of the triangles, above 0 and up to 1; an int is a count.
    uvs: float32 (n, 2), or a list of such, one per set.
    normals: float32 (n, 3), of unit length.
    colors: float32 (n, 3) or (n, 4), linear, 0 to 1.
    groups: uint32 (m,), the material or primitive of each triangle: their boundaries are kept.
    locked: bool (n,), vertices that keep their positions and attributes to the bit.
    importance: float32 (n,), 1 by default: costs around a vertex are multiplied by it.
    cost, placement: baselines to compare with, beside the defaults; "ends" keeps vertices of the source.
    max_error, join_distance: in the units of the positions.
    max_rotation: degrees that a collapse may rotate a triangle by, 75 by default.
    weights: of a unit of error in "uv", "normal", "color", and of the planes of "border" and "seam".

    Raises InvalidError for arrays that do not fit, OptionsError for an argument that makes no sense.
    """
    sets = _sets(uvs)
    arrays: dict[str, Any] = {
        "positions": floats(positions, "positions"),
        "triangles": indices(triangles, "triangles"),
        "uvs": [floats(own, "uvs") for own in sets],
        "normals": None if normals is None else floats(normals, "normals"),
        "colors": None if colors is None else floats(colors, "colors"),
        "groups": None if groups is None else column(groups, np.uint32, "groups"),
        "locked": None if locked is None else column(locked, np.bool_, "locked"),
        "importance": None if importance is None else column(importance, np.float32, "importance"),
    }
    keywords = {
        "cost": cost,
        "placement": placement,
        "max_error": max_error,
        "max_rotation": max_rotation,
        "join_distance": join_distance,
        "keep_volume": keep_volume,
        "reach_target": reach_target,
        "polish": polish,
        "weights": weights or {},
    }
    sizes = [int(size) if isinstance(size, (int, np.integer)) else float(size) for size in targets]
    return [Level(**own) for own in _seamwise.simplify(arrays, sizes, keywords)]


def _sets(uvs: npt.ArrayLike | Sequence[npt.ArrayLike] | None) -> Sequence[npt.ArrayLike]:
    if uvs is None:
        return []
    if isinstance(uvs, (list, tuple)) and uvs and np.ndim(uvs[0]) == 2:
        return uvs
    return [uvs]

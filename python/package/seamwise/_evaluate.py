"""Figures of levels from any tool, and of what is in a file."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from . import _seamwise
from ._bake import Source, _looks, _resolve


def evaluate(
    reference: Source,
    candidates: Source | Iterable[Source],
    *,
    views: int | None = None,
    resolution: int | None = None,
    samples: int | None = None,
    pixel_tolerance: float | None = None,
    allow_missing: bool = False,
) -> list[dict[str, Any]]:
    """Compares levels of detail, from any tool, with the asset that they stand for: with its atlases filled
    where it bleeds and that shows, as ``seamwise evaluate`` does by default.

    One dictionary per candidate, in their order, with the names of ``seamwise evaluate --json``: for
    instance ``rms_luminance`` over the views (linear light, 0 to 1), ``distance_rms`` and ``distance_max``
    (shares of the diagonal of the reference's bounding box), ``color_rms``, ``normal_degrees_rms``,
    ``volume_ratio``.

    views: cameras, 1 to 24 (24). resolution: pixels along each side of a view (512). samples: places on
    each surface (200,000).

    Raises FileError, InvalidError or UnsupportedError with ``path`` and ``place``.
    """
    if isinstance(candidates, (str, bytes, bytearray, memoryview)) or hasattr(candidates, "__fspath__"):
        candidates = [candidates]
    sources = [_resolve(own)[0] for own in candidates]
    looks = _looks(views, resolution, samples, pixel_tolerance)
    return json.loads(_seamwise.evaluate(_resolve(reference)[0], sources, looks, allow_missing))


def inspect(source: Source) -> dict[str, Any]:
    """What is in an asset: meshes, materials, textures and the texels of its atlases that bleed.

    Raises FileError, InvalidError or UnsupportedError with ``path`` and ``place``.
    """
    return json.loads(_seamwise.inspect(_resolve(source)[0]))

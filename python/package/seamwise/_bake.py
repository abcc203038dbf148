"""Bakes of files and of bytes."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Union

from . import _seamwise
from ._errors import FileError
from ._progress import Progress, resolve

Source = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview]
"""A file, or the bytes of a self-contained .glb or .gltf."""


@dataclass(frozen=True)
class Baked:
    """The result of a bake."""

    report: dict[str, Any]
    """What was made and measured, as in ``<stem>.json``."""
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    """Bytes by name, the finest level first; none if they were written to a folder."""
    skipped: bool = False
    """Whether all of it was there already."""


def bake(
    source: Source,
    folder: str | os.PathLike[str] | None = None,
    *,
    name: str | None = None,
    ratios: Sequence[float] | None = None,
    triangles: Sequence[int] | None = None,
    textures: Literal["auto", "repair", "transfer", "keep"] | None = None,
    texture_format: Literal["keep", "png", "jpeg", "webp", "webp-lossy", "ktx2"] | None = None,
    texture_quality: int | None = None,
    png: Literal["fast", "smallest"] | None = None,
    budget_per: Literal["scene", "mesh"] | None = None,
    layout: Literal["none", "msft_lod", "names", "needle"] | None = None,
    format: Literal["glb", "gltf"] | None = None,
    polish: bool = True,
    evaluate: bool = True,
    report: bool = False,
    compress: bool = False,
    progressive: bool = False,
    geomorph: Literal["none", "attributes", "target"] | None = None,
    reach_target: bool = False,
    keep_volume: bool = False,
    max_error: float | None = None,
    join_distance: float | None = None,
    allow_missing: bool = False,
    allow_outside: bool = False,
    strict: bool = False,
    time_limit: float | None = None,
    memory_limit: str | int | None = None,
    resume: bool = False,
    views: int | None = None,
    resolution: int | None = None,
    samples: int | None = None,
    pixel_tolerance: float | None = None,
    progress: Progress = None,
) -> Baked:
    """Bakes the levels of one asset, as ``seamwise bake`` does with options of the same names.

    With a ``folder`` all files are written there or none, and ``Baked.files`` is empty; without one nothing
    is written. ``name`` is the stem of the files' names, that of the source by default.

    textures: "auto" unless levels lead to the next (``geomorph``), which share the source's: "repair".
    texture_format: the files of textures; all but "ktx2", which all textures become, need textures="auto" or "transfer".
    resume: leave a bake alone whose outputs are in ``folder`` already, those of this source, these options
    and this version: the result is its report then, and ``skipped`` is true.
    memory_limit: bytes, or a size like "8GB", that decoding one image or all geometry may take.
    progress: a function of (stage, done, total); an exception in it ends the bake, as Ctrl-C does,
    between two stages and with nothing written. True shows bars of tqdm if that is installed.

    Raises FileError, InvalidError or UnsupportedError with ``path`` and ``place`` if the source can't be
    read; OptionsError for an argument that makes no sense; TimeLimitError after ``time_limit`` seconds.
    """
    source, stem = _resolve(source)
    keywords = {
        "ratios": None if ratios is None else [float(ratio) for ratio in ratios],
        "triangles": None if triangles is None else [int(count) for count in triangles],
        "textures": textures,
        "texture_format": texture_format,
        "texture_quality": texture_quality,
        "png": png,
        "budget_per": budget_per,
        "layout": layout,
        "format": format,
        "polish": polish,
        "evaluate": evaluate,
        "report": report,
        "compress": compress,
        "progressive": progressive,
        "geomorph": geomorph,
        "reach_target": reach_target,
        "keep_volume": keep_volume,
        "max_error": max_error,
        "join_distance": join_distance,
        "allow_missing": allow_missing,
        "allow_outside": allow_outside,
        "strict": strict,
        "time_limit": time_limit,
        "memory_limit": None if memory_limit is None else str(memory_limit),
        "resume": resume,
    }
    looks = _looks(views, resolution, samples, pixel_tolerance)
    name = name or stem
    folder = None if folder is None else os.fspath(folder)
    told, files = _seamwise.bake(source, name, folder, keywords, looks, resolve(progress))
    if told is None:
        return Baked(json.loads((Path(folder) / f"{name}.json").read_bytes()), skipped=True)
    return Baked(json.loads(told), files)


def manifest(path: str | os.PathLike[str], shard: str | None = None) -> list[Path]:
    """The inputs of a list, as ``seamwise bake --manifest`` reads it: one in each line, empty lines and those
    that begin with ``#`` left out.

    shard: one of several parts, like "2/8", for one of several processes: every input is in exactly one.

    Raises FileError if the list can't be read, OptionsError for a part that makes no sense.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{os.fspath(path)}: {error}", os.fspath(path)) from error
    return [Path(own) for own in _seamwise.manifest(text, shard)]


def _resolve(source: Source) -> tuple[bytes | str, str]:
    """The source as the compiled half takes it, and the stem of its name."""
    if isinstance(source, (bytes, bytearray, memoryview)):
        return bytes(source), "asset"
    path = os.fspath(source)
    return path, Path(path).stem


def _looks(
    views: int | None,
    resolution: int | None,
    samples: int | None,
    pixel_tolerance: float | None,
) -> dict[str, Any]:
    return {
        "views": views,
        "resolution": resolution,
        "samples": samples,
        "pixel_tolerance": pixel_tolerance,
    }

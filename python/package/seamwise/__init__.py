"""Levels of detail for textured glTF that still look like the original, and atlases that do not bleed.

Arrays are those of numpy: positions float32 of shape (n, 3), triangles uint32 of shape (m, 3). Others are
converted, at the price of a copy. Work is done on all cores, without the interpreter's lock, and gives the
same bytes at any number of threads.

>>> import numpy, seamwise
>>> x, y = numpy.meshgrid(numpy.linspace(0, 1, 33), numpy.linspace(0, 1, 33))
>>> hill = numpy.stack([x, y, 0.1 * numpy.sin(3 * x)], axis=-1).reshape(-1, 3)
>>> corner = (numpy.arange(32)[:, None] * 33 + numpy.arange(32)).reshape(-1, 1)
>>> triangles = numpy.concatenate([corner + [0, 1, 34], corner + [0, 34, 33]])
>>> level, = seamwise.simplify(hill, triangles, [0.1])
>>> len(level.triangles) <= 205
True
"""

from ._bake import Baked, bake, manifest
from ._errors import (
    CanceledError,
    Error,
    FileError,
    InternalError,
    InvalidError,
    OptionsError,
    TimeLimitError,
    UnsupportedError,
)
from ._evaluate import evaluate, inspect
from ._repair import Repaired, repair, repair_file
from ._simplify import Level, simplify

__all__ = [
    "Baked",
    "CanceledError",
    "Error",
    "FileError",
    "InternalError",
    "InvalidError",
    "Level",
    "OptionsError",
    "Repaired",
    "TimeLimitError",
    "UnsupportedError",
    "bake",
    "evaluate",
    "inspect",
    "manifest",
    "repair",
    "repair_file",
    "simplify",
]

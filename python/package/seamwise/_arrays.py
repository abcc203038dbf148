"""Arrays as the compiled half takes them: contiguous and of the right type."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InvalidError


def floats(values: npt.ArrayLike, name: str) -> npt.NDArray[np.float32]:
    """Rows of 32-bit floats; the array itself if it is such."""
    return _table(np.asarray(values), np.float32, name)


def indices(values: npt.ArrayLike, name: str) -> npt.NDArray[np.uint32]:
    """Rows of 32-bit indices; the array itself if it is such. Values that do not fit are an error."""
    array = np.asarray(values)
    _check_range(array, name)
    return _table(array, np.uint32, name)


def column(values: npt.ArrayLike, dtype: Any, name: str) -> npt.NDArray[Any]:
    """An array of one axis."""
    array = np.asarray(values)
    if dtype is np.uint32:
        _check_range(array, name)
    if array.ndim != 1:
        raise InvalidError(f"{name} are of shape (n,), not {array.shape}")
    return np.ascontiguousarray(array, dtype=dtype)


def _check_range(array: npt.NDArray[Any], name: str) -> None:
    if array.dtype.kind not in "iu":
        raise InvalidError(f"{name} are integers, not {array.dtype}")
    if array.dtype != np.uint32 and array.size and (array.min() < 0 or array.max() > 0xFFFFFFFF):
        raise InvalidError(f"{name} lie in 0 to {0xFFFFFFFF}")


def _table(array: npt.NDArray[Any], dtype: Any, name: str) -> npt.NDArray[Any]:
    if array.ndim != 2:
        raise InvalidError(f"{name} are of shape (n, columns), not {array.shape}")
    return np.ascontiguousarray(array, dtype=dtype)

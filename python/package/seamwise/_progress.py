"""Progress as a function, or as a bar of tqdm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Union

Progress = Union[Callable[[str, int, int], Any], bool, None]
"""A function of (stage, done, total); True for bars of tqdm if that is installed; None for silence."""


def resolve(progress: Progress) -> Callable[[str, int, int], Any] | None:
    """The function to call, if there is one."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return _bars()
    return progress


def _bars() -> Callable[[str, int, int], Any] | None:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    shown: dict[str, Any] = {}

    def show(stage: str, done: int, total: int) -> None:
        bar = shown.get(stage)
        if bar is None:
            bar = shown[stage] = tqdm(total=total, desc=stage, leave=False)
        bar.update(done - bar.n)
        if done >= total:
            shown.pop(stage).close()

    return show

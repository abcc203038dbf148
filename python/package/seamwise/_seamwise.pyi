"""The compiled half: what the package checks and documents, and nothing that a user calls."""

from os import PathLike
from typing import Any, Callable

def simplify(
    arrays: dict[str, Any], targets: list[int | float], keywords: dict[str, Any]
) -> list[dict[str, Any]]: ...
def bake(
    source: str | bytes,
    name: str,
    folder: str | None,
    keywords: dict[str, Any],
    looks: dict[str, Any],
    progress: Callable[[str, int, int], Any] | None,
) -> tuple[str | None, dict[str, bytes]]: ...
def manifest(text: str, shard: str | None) -> list[PathLike[str]]: ...
def evaluate(
    reference: str | bytes,
    candidates: list[str | bytes],
    looks: dict[str, Any],
    allow_missing: bool,
) -> str: ...
def inspect(source: str | bytes) -> str: ...
def repair(
    texels: Any, charts: dict[str, Any], keywords: dict[str, Any]
) -> dict[str, Any]: ...
def repair_file(
    input: str,
    output: str,
    mesh: str | PathLike[str] | None,
    mask: str | PathLike[str] | None,
    background: str,
    keywords: dict[str, Any],
) -> str: ...

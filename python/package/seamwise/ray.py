"""Many assets on many machines, by Ray Data.

On one machine and on a cluster alike::

    import ray, seamwise.ray

    ray.init()  # or ray.init("auto") on a cluster
    table = seamwise.ray.bake(paths, "out", reports="out/reports", cpus=2, textures="transfer")
    print(table[table.error.notna()][["path", "error"]])

Paths and folders are read and written by the workers: on a cluster they lie on a disk that all of them
share. What was baked before is left alone, so a run that was cut goes on when it is started again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._bake import bake as bake_one
from ._errors import Error, OptionsError

if TYPE_CHECKING:
    import pandas
    import pyarrow

__all__ = ["bake"]


def bake(
    paths: Iterable[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    *,
    reports: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    cpus: int = 1,
    memory: int | None = None,
    resume: bool = True,
    **options: Any,
) -> pandas.DataFrame:
    """Bakes each asset into ``folder``, one at a time in each worker; ``options`` are those of
    ``seamwise.bake``.

    The result has a row for each path, in their order: ``path``, ``name`` (the stem of its files),
    ``status`` ("baked", "skipped" or "failed"), ``error`` and ``place`` of one that failed, ``triangles``
    of the source, ``seconds`` and the whole ``report`` as JSON. One that fails stops no other, and a
    worker that dies is started again with the asset that it was at.

    reports: a folder for the same table in Parquet, written in the end.
    workers: how many at a time; as many as there are cores for by default.
    cpus: cores for each worker. memory: bytes that Ray is to keep free for each.

    Raises OptionsError if two assets would have the same files.
    """
    import pandas
    import ray

    items = [{"at": at, **item} for at, item in enumerate(_named(paths))]
    if not items:
        return pandas.DataFrame(columns=[name for name in _COLUMNS if name != "at"])
    place = os.path.abspath(os.fspath(folder))
    slots = workers or max(1, int(ray.cluster_resources().get("CPU", 1)) // cpus)
    resources: dict[str, Any] = {"num_cpus": cpus}
    if memory is not None:
        resources["memory"] = memory
    rows = ray.data.from_items(items, override_num_blocks=len(items)).map_batches(
        _Baker,
        batch_size=1,
        batch_format="pyarrow",
        fn_constructor_kwargs={
            "folder": place,
            "options": {**options, "resume": resume},
            "threads": cpus,
        },
        compute=ray.data.ActorPoolStrategy(min_size=min(slots, len(items)), max_size=slots),
        **resources,
    )
    if reports is not None:
        rows = rows.materialize()
        rows.write_parquet(os.path.abspath(os.fspath(reports)))
    table = rows.to_pandas()
    return table.sort_values("at", ignore_index=True).drop(columns="at")


# Names of columns, and their types in Arrow.
_COLUMNS = {
    "at": "int64",
    "path": "string",
    "name": "string",
    "status": "string",
    "error": "string",
    "place": "string",
    "triangles": "int64",
    "seconds": "float64",
    "report": "string",
}


class _Baker:
    """A worker: an asset in, a row out."""

    def __init__(self, folder: str, options: dict[str, Any], threads: int) -> None:
        # Read by the compiled half when it works for the first time.
        os.environ["RAYON_NUM_THREADS"] = str(threads)
        self.folder = folder
        self.options = options

    def __call__(self, items: pyarrow.Table) -> pyarrow.Table:
        import pyarrow

        # Typed, as a column of a part of the rows may have no value at all.
        schema = pyarrow.schema([(name, getattr(pyarrow, kind)()) for name, kind in _COLUMNS.items()])
        return pyarrow.Table.from_pylist([self.bake(item) for item in items.to_pylist()], schema)

    def bake(self, item: dict[str, Any]) -> dict[str, Any]:
        row = {**item, "status": "failed"}
        try:
            baked = bake_one(item["path"], self.folder, name=item["name"], **self.options)
        except Error as error:
            return {**row, "error": str(error), "place": error.place}
        return {
            **row,
            "status": "skipped" if baked.skipped else "baked",
            "triangles": baked.report["input"]["triangles"],
            "seconds": sum(baked.report["seconds"].values()),
            "report": json.dumps(baked.report),
        }


def _named(paths: Iterable[str | os.PathLike[str]]) -> list[dict[str, str]]:
    """Each path with the stem of its files: its own, or its whole name where another has that stem."""
    taken: dict[str, str] = {}
    named = []
    for path in map(os.path.abspath, map(os.fspath, paths)):
        free = [name for name in (Path(path).stem, Path(path).name) if name not in taken]
        if not free or path in taken.values():
            other = path if path in taken.values() else taken[Path(path).name]
            raise OptionsError(f"{other} and {path} would both write the same files: bake them into two folders")
        taken[free[0]] = path
        named.append({"path": path, "name": free[0]})
    return named

"""Records on a cluster: sums of them, and errors of a model on them, by Apache Spark's `mapInArrow`.

    from jointwatch import Study, spark

    study = Study.open("study.toml")
    files = session.createDataFrame([(path,) for path in paths], "path string").repartition(64)
    sums = spark.accumulate(files, study, path="path")
    model = sums.identify("polynomial", study=study)

A task sums whole records, so a task that is retried or run twice gives the same bytes, and Spark takes one result of each task. The
sums are those of one process, to the byte.
"""

from __future__ import annotations

import ctypes
import json
import sys
from collections.abc import Iterable, Iterator
from importlib import import_module
from typing import Any, Callable, Optional

import numpy as np

from . import _native
from ._errors import Error, UsageError
from ._model import Model
from ._study import Study
from ._sums import Sums, merge_bytes, plan_of

SUMMED = "name string, part binary, problem string"
SCORED = (
    "record string, axis string, rows bigint, nmse_percent double, relative_error double, rms_error double, "
    "peak_error double, outside_range double, problem string"
)
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Of glibc's malloc.h."""
Batches = Iterator[Any]
"""Record batches of Arrow."""


def accumulate(
    frame: Any,
    study: Study,
    *,
    path: Optional[str] = None,
    record: Optional[str] = None,
    order: Optional[str] = None,
    on_bad: str = "raise",
) -> Sums:
    """Sums the records of a Spark DataFrame with the channels that a study describes.

    With `path`, that column holds paths of log files, one a row, which the tasks read: nothing is shuffled. With `record`, the frame
    holds the rows themselves; that column says which record a row belongs to, and `order` (the study's time column when left out)
    their order. `on_bad="skip"` leaves out records that cannot be read, with a warning for each.
    """
    plan = plan_of(study)
    text = plan.to_json()

    def of_file(name: str) -> dict[str, Any]:
        return {"part": _native.Plan.parse(text).sum_file(name)}

    def of_log(log: Any) -> dict[str, Any]:
        return {"part": _native.Plan.parse(text).sum_log(log)}

    given, logs = _prepared(frame, plan, path, record, order)
    # One part a task comes back: 17 kB for one axis, 0.7 MB for two.
    work = _worker(logs, of_file if path else of_log, _checked(on_bad), merged=True)
    parts = []
    for row in given.mapInArrow(work, SUMMED).collect():
        if row.problem:
            _warn(row.problem)
        else:
            parts.append((row.name, bytes(row.part)))
    if not parts:
        raise UsageError("the frame holds no record that could be summed.")
    return merge_bytes(parts)


def score(
    frame: Any,
    model: Model,
    study: Study,
    *,
    path: Optional[str] = None,
    record: Optional[str] = None,
    order: Optional[str] = None,
    on_bad: str = "raise",
) -> Any:
    """A DataFrame with the errors of a model per record and axis; the arguments are those of `accumulate`.

    With `on_bad="skip"` a record that cannot be read is a row of its own, whose `problem` says why.
    """
    plan = plan_of(study)
    text, judged = plan.to_json(), json.dumps(model.to_dict())

    def figures(of: Callable[[_native.Plan, _native.Model], str]) -> list[dict[str, Any]]:
        answer = of(_native.Plan.parse(text), _native.Model.parse("the model", judged))
        return [
            {"record": found["file"], "axis": axis, "rows": found["rows"], **values}
            for found in json.loads(answer)
            for axis, values in found["axes"].items()
        ]

    def of_file(name: str) -> list[dict[str, Any]]:
        return figures(lambda plan, model: plan.score_file(model, name))

    def of_log(log: Any) -> list[dict[str, Any]]:
        return figures(lambda plan, model: plan.score_log(model, log))

    given, logs = _prepared(frame, plan, path, record, order)
    return given.mapInArrow(_worker(logs, of_file if path else of_log, _checked(on_bad), merged=False), SCORED)


def _checked(on_bad: str) -> bool:
    if on_bad not in ("raise", "skip"):
        raise UsageError(f'on_bad = {on_bad!r} is not known; give "raise" or "skip".')
    return on_bad == "skip"


def _warn(problem: str) -> None:
    import warnings

    warnings.warn(f"left out: {problem}", stacklevel=3)


def _prepared(
    frame: Any, plan: _native.Plan, path: Optional[str], record: Optional[str], order: Optional[str]
) -> tuple[Any, Callable[[Batches], Iterator[tuple[str, Any]]]]:
    """The frame as the tasks get it, and what turns its batches into named records."""
    if (path is None) == (record is None):
        raise UsageError("give path, the column of log files, or record, the column that says which record a row is of.")
    if path is not None:
        _there(frame, [path])
        return frame.select(path), _files
    columns, time = plan.columns()
    order = order or time
    if order is None:
        raise UsageError("the study has no time column; give order, the column by which a record's rows are sorted.")
    assert record is not None
    there = [column for column in columns if column in frame.columns]
    _there(frame, [record, order])
    needed = [record, *dict.fromkeys([order, *there])]
    given = frame.select(*needed).repartition(record).sortWithinPartitions(record, order)
    return given, lambda batches: _logs(batches, record, there)


def _there(frame: Any, columns: list[str]) -> None:
    for column in columns:
        if column not in frame.columns:
            raise UsageError(f"the frame has no column {column!r}; it has {', '.join(frame.columns)}.")


def _files(batches: Batches) -> Iterator[tuple[str, Any]]:
    for batch in batches:
        for name in batch.column(0).to_pylist():
            # Spark's own listings begin with the scheme.
            plain = name[5:].replace("//", "", 1) if name.startswith("file:") else name
            yield name, plain


def _logs(batches: Batches, record: str, columns: list[str]) -> Iterator[tuple[str, Any]]:
    """Records whose rows stand together, with their columns as arrays."""
    name: Optional[str] = None
    pieces: list[Any] = []
    for batch in batches:
        names = np.asarray(batch.column(0).to_pylist(), dtype=object)
        edges = np.flatnonzero(names[1:] != names[:-1]) + 1
        for start, end in zip([0, *edges], [*edges, len(names)]):
            if end == start:
                continue
            if name is not None and names[start] != name:
                yield name, (name, _columns(pieces, columns))
                pieces = []
            name = str(names[start])
            pieces.append(batch.slice(start, end - start))
    if name is not None:
        yield name, (name, _columns(pieces, columns))


def _columns(pieces: list[Any], columns: list[str]) -> list[tuple[str, Any]]:
    def array(column: str) -> Any:
        parts = [piece.column(piece.schema.get_field_index(column)) for piece in pieces]
        return np.concatenate([part.to_numpy(zero_copy_only=False).astype(np.float64, copy=False) for part in parts])

    return [(column, np.ascontiguousarray(array(column))) for column in columns]


def _worker(
    records: Callable[[Batches], Iterator[tuple[str, Any]]],
    of: Callable[[Any], Any],
    skip: bool,
    *,
    merged: bool,
) -> Callable[[Batches], Batches]:
    """What a task does with its batches; with `merged`, its parts become one."""

    def results(batches: Batches) -> Iterator[dict[str, Any]]:
        whole: list[tuple[str, bytes]] = []
        for name, record in records(batches):
            try:
                found = of(record)
            except Error as problem:
                if not skip:
                    raise
                yield {"name": name, "record": name, "problem": str(problem)}
                continue
            if not merged:
                yield from found
                continue
            whole.append((name, found["part"]))
            if len(whole) == 64:
                whole = [(name, bytes(merge_bytes(whole)))]
        if whole:
            yield {"name": whole[-1][0], "part": bytes(merge_bytes(whole))}

    def work(batches: Batches) -> Batches:
        _keep_memory()
        pa: Any = import_module("pyarrow")
        fields = _fields(SUMMED if merged else SCORED)
        for row in results(batches):
            yield pa.RecordBatch.from_pylist([{key: row.get(key) for key, _ in fields}], schema=pa.schema(fields))

    return work


def _keep_memory() -> None:
    """Has a worker keep the memory of a record for the next one.

    glibc gives it back otherwise, and the kernel clears its pages anew: a fifth of a task's processor time.
    """
    # musl has no such call.
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, 1 << 30)
        mallopt(M_MMAP_THRESHOLD, 1 << 30)


def _fields(schema: str) -> list[tuple[str, Any]]:
    pa: Any = import_module("pyarrow")
    kinds = {"string": pa.string(), "binary": pa.binary(), "bigint": pa.int64(), "double": pa.float64()}
    pairs: Iterable[list[str]] = (field.split() for field in schema.split(", "))
    return [(name, kinds[kind]) for name, kind in pairs]

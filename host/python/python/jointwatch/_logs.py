"""What a study is made of in memory: records, and a description in the form of study.toml."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional, Union

from ._columns import as_column
from ._errors import DataError, UsageError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Log = tuple[str, list[tuple[str, npt.NDArray[np.float64]]]]

SERIES = ("displacement", "velocity", "body_position", "acceleration", "force")
"""What may be logged of an axis."""

PerAxis = Union[Any, Mapping[str, Any]]
"""One value for all axes, or one per axis by its name."""


@dataclass
class Record:
    """Arrays of one run; each may be a mapping with one array per axis."""

    t: Any = None
    force: PerAxis = None
    displacement: PerAxis = None
    velocity: PerAxis = None
    body_position: PerAxis = None
    acceleration: PerAxis = None
    inputs: Mapping[str, Any] = field(default_factory=dict)
    role: str = "train"
    name: Optional[str] = None


@dataclass
class Part:
    """A record of the description: rows of a log, and what they are used for."""

    log: str
    role: str
    rows: Optional[tuple[int, int]] = None


def per_axis(value: PerAxis, axes: Sequence[str], what: str) -> dict[str, Any]:
    """The value of every axis that has one."""
    if not isinstance(value, Mapping):
        return {} if value is None else {axis: value for axis in axes}
    for axis in value:
        if axis not in axes:
            raise UsageError(f"{what}: there is no axis {axis!r}; the displacement names {', '.join(axes)}.")
    return {axis: v for axis, v in value.items() if v is not None}


def axes_of(displacement: PerAxis, kind: PerAxis, axis: Optional[str]) -> list[str]:
    """The names of the axes: those that the displacement names, or one alone."""
    if isinstance(displacement, Mapping):
        return [str(name) for name in displacement]
    if axis is not None:
        return [axis]
    return ["phi" if kind == "rotation" else "x"]


def is_zero(force: Any) -> bool:
    """Whether a force is the number 0: nothing is applied."""
    return isinstance(force, (int, float)) and not isinstance(force, bool) and force == 0


def log_of(record: Record, axes: Sequence[str], name: str) -> Log:
    """The columns of a record by the names that the description gives them."""
    columns = []
    if record.t is not None:
        columns.append(("t", as_column(record.t, name, "t")))
    for series in SERIES:
        for axis, values in per_axis(getattr(record, series), axes, series).items():
            if series == "force" and is_zero(values):
                continue
            column = column_name(series, axis, axes)
            columns.append((column, as_column(values, name, column)))
    for given, values in record.inputs.items():
        columns.append((given, as_column(values, name, given)))
    return name, columns


def column_name(series: str, axis: str, axes: Sequence[str]) -> str:
    """What the column of a series is called."""
    return series if len(axes) == 1 else f"{series} of {axis}"


def units_of(units: Optional[Mapping[str, Any]], known: Iterable[str]) -> Mapping[str, Any]:
    """The units, each of something that there is."""
    known = list(known)
    for name in units or {}:
        if name not in known:
            raise UsageError(f"units: there is no {name!r}; known are {', '.join(known)}.")
    return units or {}


def split(logs: Sequence[Log], roles: Sequence[str], validate: float) -> list[Part]:
    """The records; of each that trains, the last part of this share validates."""
    if not 0.0 <= validate < 1.0:
        raise UsageError(f"validate = {validate}: give the share of the last rows that validates, from 0 to below 1.")
    parts = []
    for (name, columns), role in zip(logs, roles):
        rows = min((len(values) for _, values in columns), default=0)
        cut = rows - round(validate * rows)
        if validate == 0.0 or role != "train" or len({len(values) for _, values in columns}) > 1:
            parts.append(Part(name, role))
        else:
            parts += [Part(name, "train", (0, cut)), Part(name, "validate", (cut, rows))]
    return parts


def checked_roles(names: Sequence[str], roles: Sequence[str]) -> None:
    """Refuses roles that are none, and names that are there twice."""
    for name, role in zip(names, roles):
        if role not in ("train", "validate"):
            raise UsageError(
                f"{name}: role = {role!r} is not known; give 'train' (learnt from; its errors are the verification) or 'validate'."
            )
        if list(names).count(name) > 1:
            raise UsageError(f"two records are called {name!r}; give each a name of its own.")


def described(
    axes: Sequence[Mapping[str, Any]],
    parts: Sequence[Part],
    inputs: Sequence[Mapping[str, Any]],
    top: Mapping[str, Any],
    terms: Iterable[str],
) -> str:
    """The description in the form of study.toml."""
    if not parts:
        raise DataError("there is no record; give at least one with force and displacement.")
    whole = dict(top)
    whole["axis"] = list(axes)
    whole["record"] = [
        {"file": p.log, "role": p.role, "rows": None if p.rows is None else list(p.rows)} for p in parts
    ]
    whole["input"] = list(inputs)
    lines = [f"{key} = {toml(value)}" for key, value in whole.items() if value is not None]
    return "\n".join([*lines, f"base = {{ terms = {toml(list(terms))} }}", ""])


def toml(value: Any) -> str:
    """A value as TOML writes it."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        pairs = [f"{json.dumps(key)} = {toml(v)}" for key, v in value.items() if v is not None]
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    raise UsageError(f"{value!r} cannot be part of a study's description; give numbers, texts, lists or mappings of these.")

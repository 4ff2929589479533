"""Studies: read from a folder, or made of arrays or frames."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Optional, Union

from . import _html, _native
from ._columns import as_frame, column_of, names_of
from ._errors import UsageError
from ._logs import (
    SERIES,
    Part,
    PerAxis,
    Record,
    axes_of,
    checked_roles,
    column_name,
    described,
    is_zero,
    log_of,
    per_axis,
    split,
    units_of,
)
from ._model import Model
from ._progress import Progress, shown

OF_AXIS = ("inertia", "restoring_force", "ground_stiffness", "ground_damping", "encoder_step")
"""What a description says of an axis beside its channels."""


class Study:
    """A rig and its records, read and checked."""

    def __init__(self, native: _native.Study, description: str) -> None:
        self._native = native
        self.description = description
        """The description in the form of study.toml; empty for a study that was opened."""

    @classmethod
    def open(cls, path: Union[str, PathLike[str]]) -> Study:
        """Reads a study.toml, or the one in a folder, with all its logs."""
        return cls(_native.Study.open(path), "")

    @classmethod
    def from_arrays(
        cls,
        *records: Record,
        t: Any = None,
        force: PerAxis = None,
        displacement: PerAxis = None,
        velocity: PerAxis = None,
        body_position: PerAxis = None,
        acceleration: PerAxis = None,
        inputs: Optional[Mapping[str, Any]] = None,
        units: Optional[Mapping[str, PerAxis]] = None,
        kind: PerAxis = "translation",
        inertia: PerAxis = None,
        restoring_force: PerAxis = None,
        ground_stiffness: PerAxis = None,
        ground_damping: PerAxis = None,
        encoder_step: PerAxis = None,
        axis: Optional[str] = None,
        sample_rate_hz: Optional[float] = None,
        resample_hz: Optional[float] = None,
        band_hz: Optional[float] = None,
        terms: Iterable[str] = (),
        validate: float = 0.0,
        name: str = "arrays",
    ) -> Study:
        """A study of arrays: of one run, or of several `Record`s.

        Whatever belongs to an axis is one value, or a mapping with one per axis: `force={"x": f, "phi": torque}`. `units` says the
        unit of `t`, `force`, `displacement`, …, as in study.toml; SI where it says nothing. `validate` is the share of the last rows
        of every record that are validated on. The other arguments are the keys of study.toml (docs/reference/study.md).
        """
        if records and any(v is not None for v in (t, force, displacement, velocity, body_position, acceleration)):
            raise UsageError("give arrays or records, not both.")
        if not records:
            single = Record(t, force, displacement, velocity, body_position, acceleration, inputs or {}, name="record")
            records = (single,)
        first = records[0]
        for given, key in ((first.displacement, "displacement"), (first.force, "force")):
            if given is None:
                raise UsageError(f"{key} is missing; give its array{' or 0' if key == 'force' else ''}.")
        axes = axes_of(first.displacement, kind, axis)
        names = [record.name or f"record {number + 1}" for number, record in enumerate(records)]
        checked_roles(names, [record.role for record in records])
        logs = [log_of(record, axes, record_name) for record, record_name in zip(records, names)]
        units = units_of(units, ["t", *SERIES, *first.inputs])

        def channel(series: str, of: str) -> Any:
            given = per_axis(getattr(first, series), axes, series).get(of)
            if given is None or (series == "force" and is_zero(given)):
                return given
            unit = per_axis(units.get(series), axes, f"units of {series}").get(of)
            return {"column": column_name(series, of, axes), "unit": unit}

        time = None if first.t is None else {"column": "t", "unit": units.get("t"), "resample_hz": resample_hz}
        top = {"name": name, "time": time, "sample_rate_hz": sample_rate_hz, "band_hz": band_hz}
        said = dict(zip(OF_AXIS, (inertia, restoring_force, ground_stiffness, ground_damping, encoder_step)))
        description = described(
            _axes(axes, channel, kind, said),
            split(logs, [record.role for record in records], validate),
            [{"name": given, "column": given, "unit": units.get(given)} for given in first.inputs],
            top,
            terms,
        )
        return cls(_native.Study.of_memory(name, description, logs), description)

    @classmethod
    def from_dataframe(
        cls,
        frames: Any,
        *,
        t: Any = None,
        force: PerAxis,
        displacement: PerAxis,
        velocity: PerAxis = None,
        body_position: PerAxis = None,
        acceleration: PerAxis = None,
        inputs: Optional[Mapping[str, str]] = None,
        units: Optional[Mapping[str, str]] = None,
        kind: PerAxis = "translation",
        inertia: PerAxis = None,
        restoring_force: PerAxis = None,
        ground_stiffness: PerAxis = None,
        ground_damping: PerAxis = None,
        encoder_step: PerAxis = None,
        axis: Optional[str] = None,
        sample_rate_hz: Optional[float] = None,
        band_hz: Optional[float] = None,
        terms: Iterable[str] = (),
        validate: Union[float, Collection[str]] = 0.0,
        name: str = "dataframe",
    ) -> Study:
        """A study of frames of pandas, polars or pyarrow, or of anything that offers the Arrow PyCapsule interface.

        `frames` is one frame, or a mapping from names to frames. Channels are the names of columns, or tables as in study.toml:
        `displacement=["far", "near"]`, `force={"column": "load", "unit": "lbf"}`. `units` says the units of columns. `validate` is the
        share of the last rows that validates, or the names of the frames that do.
        """
        if not isinstance(frames, Mapping) or _is_columns(frames):
            frames = {"record": frames}
        frames = {str(key): as_frame(frame, str(key)) for key, frame in frames.items()}
        given = dict(zip(SERIES, (displacement, velocity, body_position, acceleration, force)))
        axes = _axes_of_channels(displacement, kind, axis)
        channels = {key: _per_axis_of_channels(value, axes, key) for key, value in given.items()}
        inputs = inputs or {}
        columns = _columns([t, *inputs.values(), *(c for per in channels.values() for c in per.values())])
        units = units_of(units, columns)
        logs = []
        for key, frame in frames.items():
            there = names_of(frame) or []
            logs.append((key, [(c, column_of(frame, key, c)) for c in columns if c in there]))
        shared = isinstance(validate, (int, float))
        roles = ["train" if shared or key not in _names(validate, frames) else "validate" for key in frames]
        parts = (
            split(logs, roles, float(validate))  # type: ignore[arg-type]
            if shared
            else [Part(key, role) for key, role in zip(frames, roles)]
        )
        said = dict(zip(OF_AXIS, (inertia, restoring_force, ground_stiffness, ground_damping, encoder_step)))
        description = described(
            _axes(axes, lambda series, of: _with_units(channels[series].get(of), units), kind, said),
            parts,
            [{"name": k, "column": column, "unit": units.get(column)} for k, column in inputs.items()],
            {"name": name, "time": _with_units(t, units), "sample_rate_hz": sample_rate_hz, "band_hz": band_hz},
            terms,
        )
        return cls(_native.Study.of_memory(name, description, logs), description)

    def identify(
        self,
        kind: str,
        terms: Optional[Iterable[str]] = None,
        *,
        fit: Optional[str] = None,
        neurons: Union[int, str, None] = None,
        restarts: Optional[int] = None,
        seed: Optional[int] = None,
        input: Optional[str] = None,
        progress: Progress = None,
    ) -> Model:
        """Learns a model: `"physical"`, `"polynomial"` or `"network"`.

        `terms` are those of a physical model; left out, those of the study. `fit` is a polynomial's: `"ridge"`, `"least-squares"` or
        `"select"`. `neurons` (a number or `"auto"`), `restarts` and `seed` are a network's. `input` names the input that either takes as the
        third state of one axis, or is `"none"`; left out, it is the study's only one.
        """
        of_kind = {"terms": "physical", "fit": "polynomial", "neurons": "network", "restarts": "network", "seed": "network"}
        given = {"terms": terms, "fit": fit, "neurons": neurons, "restarts": restarts, "seed": seed}
        for option, value in given.items():
            if value is not None and kind in of_kind.values() and of_kind[option] != kind:
                raise UsageError(
                    f"{option} is an option of {of_kind[option]!r} and says nothing about {kind!r}; leave it out."
                )
        if input is not None and kind == "physical":
            raise UsageError("input is for polynomials and networks; the terms of a physical model say what they follow.")
        auto = neurons == "auto"
        if not auto and isinstance(neurons, str):
            raise UsageError(f"neurons = {neurons!r}: give a number or 'auto'.")
        options = {
            "kind": kind,
            "terms": None if terms is None else _list(terms),
            "fit": fit,
            "neurons": None if auto else neurons,
            "auto": auto,
            "restarts": restarts,
            "seed": seed,
            "input": input,
        }
        with shown(progress) as told:
            return Model(self._native.identify(options, told))

    def to_dict(self) -> dict[str, Any]:
        """Name, axes, records, notes, and the mistakes that it seems to hold (`checks`)."""
        said: dict[str, Any] = json.loads(self._native.to_json())
        return said

    def __repr__(self) -> str:
        said = self.to_dict()
        axes = ", ".join(a["name"] for a in said["axes"])
        rows = sum(r["rows"] for r in said["records"])
        return f"<Study {said['name']!r}: axes {axes}; {len(said['records'])} records, {rows} rows at {said['sample_rate_hz']:g} Hz>"

    def _repr_html_(self) -> str:
        return _html.of_study(self.to_dict())


def _list(terms: Iterable[str]) -> list[str]:
    return [terms] if isinstance(terms, str) else list(terms)


def _axes(axes: Sequence[str], channel: Any, kind: PerAxis, said: Mapping[str, PerAxis]) -> list[dict[str, Any]]:
    """The [[axis]] tables."""
    tables = []
    for axis in axes:
        table: dict[str, Any] = {"name": axis, "kind": per_axis(kind, axes, "kind").get(axis, "translation")}
        table.update({series: channel(series, axis) for series in SERIES})
        table.update({key: per_axis(value, axes, key).get(axis) for key, value in said.items()})
        tables.append(table)
    return tables


def _is_channel(value: Any) -> bool:
    return isinstance(value, Mapping) and "column" in value


def _axes_of_channels(displacement: PerAxis, kind: PerAxis, axis: Optional[str]) -> list[str]:
    return axes_of(None if _is_channel(displacement) else displacement, kind, axis)


def _per_axis_of_channels(value: PerAxis, axes: Sequence[str], what: str) -> dict[str, Any]:
    return {axis: value for axis in axes} if _is_channel(value) else per_axis(value, axes, what)


def _columns(channels: Iterable[Any]) -> list[str]:
    """The names of the columns of channels, each once."""
    names: list[str] = []
    for channel in channels:
        for each in channel if isinstance(channel, (list, tuple)) else [channel]:
            name = each.get("column") if isinstance(each, Mapping) else each
            if isinstance(name, str) and name not in names:
                names.append(name)
    return names


def _with_units(channel: Any, units: Mapping[str, str]) -> Any:
    """A channel with the unit of its column."""
    if isinstance(channel, (list, tuple)):
        return [_with_units(each, units) for each in channel]
    table = {"column": channel} if isinstance(channel, str) else channel
    if isinstance(table, Mapping) and table.get("column") in units:
        return {"unit": units[table["column"]], **table}
    return channel


def _is_columns(frames: Mapping[str, Any]) -> bool:
    """Whether a mapping is one frame itself: names of columns to arrays."""
    return not any(names_of(f) is not None or hasattr(f, "__arrow_c_stream__") for f in frames.values())


def _names(validate: Any, frames: Mapping[str, Any]) -> list[str]:
    names = _list(validate)
    for name in names:
        if name not in frames:
            raise UsageError(f"validate: there is no frame {name!r}; there are {', '.join(frames)}.")
    return names
